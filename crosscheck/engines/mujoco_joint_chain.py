"""Chains of particles on a line in MuJoCo, as nested slide joints or hinges with springs."""

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from plumbob.reference.arguments import FloatArray, choice
from plumbob.reference.mass_spring import MassSpring, State

from .mujoco_mass_spring import add_point_mass

JOINTS = {"slide": mujoco.mjtJoint.mjJNT_SLIDE, "hinge": mujoco.mjtJoint.mjJNT_HINGE}
ALONG_X = np.array([1.0, 0.0, 0.0])


class MujocoJointChain:
    """A chain of particles on the x axis, each joined to the one before it; the first is pinned.

    Each particle is a child body of the previous one, connected by a joint with a spring and a
    damper. The coordinate of the joint is the length of the spring, and the mass matrix couples all
    joints. With hinges about a common axis, masses become moments of inertia [kg m²], coordinates
    angles [rad] and forces torques in the same equations.

    The forces of springs are linear in the coordinates as long as the ends of no spring swap; then
    "discrete" equals implicit Euler.

    Attributes:
        model: the mujoco.MjModel.
        data: its mujoco.MjData.
    """

    def __init__(self, system: MassSpring, *, h: float, joint: str) -> None:
        """Build the model for the integrator "discrete".

        Args:
            system: particle 0 pinned, spring i from particle i to i + 1, gravity along x.
            h: time step [s].
            joint: one of `JOINTS`.

        Raises:
            ValueError: if there is no such joint.
        """
        self._weights = system.masses[1:] * system.gravity[0]
        self.model = _nested(system, JOINTS[choice("joint", joint, JOINTS)])
        self.model.opt.timestep = h
        self.data = mujoco.MjData(self.model)

    def step(
        self, state: State, external_forces: ArrayLike, *, steps: int = 1
    ) -> tuple[FloatArray, FloatArray]:
        """Return positions and velocities along x after some steps, each of shape (particle,).

        Only the x components of the state are used. Gravity is applied as a force because MuJoCo's
        gravity exerts no torque on these hinges.
        """
        start = state.positions[0, 0]
        forces = np.asarray(external_forces)[1:, 0] + self._weights
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = np.diff(state.positions[:, 0])
        self.data.qvel[:] = np.diff(state.velocities[:, 0], prepend=0.0)[1:]
        self.data.qfrc_applied[:] = np.cumsum(forces[::-1])[::-1]
        mujoco.mj_step(self.model, self.data, steps)
        x, v = np.cumsum(self.data.qpos), np.cumsum(self.data.qvel)
        return np.append(start, start + x), np.append(0.0, v)


def _nested(system: MassSpring, kind: mujoco.mjtJoint) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.option.gravity = np.zeros(3)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    spec.option.tolerance = 1e-15
    spec.option.iterations = 5000
    body = spec.worldbody
    for i, mass in enumerate(system.masses[1:], 1):
        body = add_point_mass(body, f"particle{i}", np.zeros(3), mass)
        body.inertia = np.full(3, mass)
        body.add_joint(type=kind, axis=ALONG_X)
    model = spec.compile()
    model.jnt_stiffness[:] = system.stiffnesses
    model.dof_damping[:] = system.dampings
    model.qpos_spring[:] = system.rest_lengths
    return model
