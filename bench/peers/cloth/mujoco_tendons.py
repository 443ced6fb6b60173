"""MuJoCo: point masses on slides, joined by tendons, by one of MuJoCo's integrators.

"discrete" solves a linear system by conjugate gradients, of which MuJoCo allows 100 iterations to a
tolerance of 1e-8; more, and a smaller one, are a matter of settings here.
"""

import mujoco

from plumbob.crosscheck.engines import MujocoMassSpring
from plumbob.reference import MassSpring, State
from plumbob.reference.arguments import FloatArray

from .mujoco_models import kept
from .protocol import Mover


def prepare(
    system: MassSpring,
    frame: float,
    integrator: str = "Euler",
    substeps: int = 1,
    iterations: int = 100,
    tolerance: float = 1e-8,
) -> Mover:
    """Return MuJoCo, stepping so many times a frame."""
    engine = kept(MujocoMassSpring, system)
    engine.set_integrator(integrator)
    engine.model.tendon_stiffness[:] = system.stiffnesses
    engine.model.tendon_damping[:] = system.dampings
    engine.model.opt.iterations, engine.model.opt.tolerance = iterations, tolerance
    return MujocoSteps(engine, frame, substeps)


class MujocoSteps:
    """Steps of a MuJoCo model, so many a frame."""

    def __init__(self, engine: MujocoMassSpring, frame: float, substeps: int) -> None:
        """Leave out the energies, which nobody asks for here, and MuJoCo's log of warnings."""
        engine.model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_ENERGY)
        engine.model.opt.timestep = frame / substeps
        mujoco.set_mju_user_warning(_ignore)
        self._engine, self._substeps = engine, substeps

    def begin(self, state: State) -> None:
        """Put the particles into a state."""
        self._engine.write(state)

    def advance(self) -> None:
        """Take the steps of one frame."""
        self._engine.advance(self._substeps)

    def positions(self) -> FloatArray:
        """Return where the particles are [m], (particle, 3)."""
        engine = self._engine
        positions = engine.model.body_pos[engine.bodies]
        positions[engine.free] = engine.data.qpos[engine.columns]
        return positions


def _ignore(warning: str) -> None:
    """MuJoCo would write it to a file; that a motion blew up is seen from the positions."""
