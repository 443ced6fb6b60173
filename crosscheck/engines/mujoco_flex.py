"""Springs as the edges of a one-dimensional flex in MuJoCo."""

import mujoco
import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import MassSpring

from .mujoco_mass_spring import MujocoMassSpring, particle_name, particles_spec

# Radius of the edges [m], required although collisions are disabled.
RADIUS = 1e-4


class MujocoFlex(MujocoMassSpring):
    """A mass-spring system in MuJoCo whose springs are the edges of a flex of dimension one.

    All edges of a flex have the same stiffness and damping, and none is tension-only. An edge
    between two pinned particles is rigid and stores no energy. The integrator "discrete" does not
    support such a flex.
    """

    def lengths(self) -> FloatArray:
        """Read the springs' lengths [m], shape (spring,)."""
        return self.data.flexedge_length[self._edges]

    def _build(self, system: MassSpring) -> mujoco.MjModel:
        """Return the model.

        MuJoCo computes the rest lengths of edges from the initial positions and does not accept
        zero: the bodies start at distinct positions, which are then reset to the origin while the
        rest lengths are overwritten. MuJoCo sorts the edges.

        Raises:
            ValueError: if the springs differ in stiffness or in damping, or there are none.
        """
        spec = particles_spec(system)
        for i in range(system.particle_count):
            spec.body(particle_name(i)).pos = (i, 0.0, 0.0)
        flex = spec.add_flex(name="springs", dim=1, radius=RADIUS, contype=0, conaffinity=0)
        flex.edgestiffness = _one("stiffnesses", system.stiffnesses)
        flex.edgedamping = _one("dampings", system.dampings)
        flex.vertbody = [particle_name(i) for i in range(system.particle_count)]
        flex.vert = np.zeros(3 * system.particle_count)
        flex.elem = system.springs.ravel()
        model = spec.compile()
        model.body_pos[:] = 0.0
        where = {frozenset(ends): edge for edge, ends in enumerate(model.flex_edge.tolist())}
        self._edges = np.array([where[frozenset(ends)] for ends in system.springs.tolist()])
        model.flexedge_length0[self._edges] = system.rest_lengths
        return model


def _one(name: str, values: FloatArray) -> float:
    if len(np.unique(values)) != 1:
        raise ValueError(f"{name}: expected the same for all springs, got {np.unique(values)}")
    return float(values[0])
