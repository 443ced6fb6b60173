"""MuJoCo: point masses on slides, joined by tendons or by the edges of a one-dimensional flex.

"discrete" solves a linear system by conjugate gradients, of which MuJoCo allows 100 iterations to a
tolerance of 1e-8; both are settings here. All springs of a flex are alike.
"""

from typing import Any

import numpy as np

from plumbob.reference import MassSpring, State
from plumbob.reference.arguments import FloatArray

from ..peer import EXPLICIT, LINEARISED, Peer, Run
from ..protocol import Mover

PEER = Peer(
    "MuJoCo",
    __name__,
    "mujoco",
    "Apache-2.0",
    "semi-implicit Euler, Runge-Kutta, or one linear solve",
    "particles and springs with dampers",
    (
        Run(EXPLICIT, title="MuJoCo Euler"),
        Run(EXPLICIT, {"integrator": "implicitfast"}, title="MuJoCo implicitfast"),
        Run(EXPLICIT, {"integrator": "RK4"}, title="MuJoCo RK4"),
        Run(EXPLICIT, {"flex": True}, title="MuJoCo flex, Euler"),
        # MuJoCo's own 100 iterations are too few for stiff cloths (docs/peers/newton.md).
        Run(LINEARISED, {"integrator": "discrete", "iterations": 1000}, title="MuJoCo discrete"),
    ),
    engine="MuJoCo",
)

# A model is built from these; stiffness and damping are set anew every time.
_BUILT_FROM = ("masses", "springs", "rest_lengths", "tension_only", "pinned", "gravity")
_engines: dict[tuple[bool, int], tuple[MassSpring, Any]] = {}


def prepare(
    system: MassSpring,
    frame: float,
    integrator: str = "Euler",
    substeps: int = 1,
    iterations: int = 100,
    tolerance: float = 1e-8,
    flex: bool = False,
) -> Mover:
    """Return MuJoCo, stepping so many times a frame."""
    import mujoco

    engine = _engine(system, flex)
    model, option = engine.model, engine.model.opt
    if flex:
        model.flex_edgestiffness[:] = system.stiffnesses[0]
        model.flex_edgedamping[:] = system.dampings[0]
    else:
        engine.set_integrator(integrator)
        model.tendon_stiffness[:], model.tendon_damping[:] = system.stiffnesses, system.dampings
        option.iterations, option.tolerance = iterations, tolerance
    option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_ENERGY)  # energies are not read here
    option.timestep = frame / substeps
    # MuJoCo would write warnings to a file; the positions show whether a motion blew up.
    mujoco.set_mju_user_warning(lambda warning: None)
    return _Steps(engine, substeps)


def _engine(system: MassSpring, flex: bool) -> Any:
    """Return the engine of an equal system but for stiffness and damping, or a new engine.

    An engine is cached for each number of particles: its construction takes cubic time.
    """
    key = flex, system.particle_count
    if key in _engines:
        cached, engine = _engines[key]
        if all(
            np.array_equal(getattr(cached, part), getattr(system, part)) for part in _BUILT_FROM
        ):
            return engine
    from plumbob.crosscheck.engines import MujocoFlex, MujocoMassSpring

    engine = MujocoFlex(system) if flex else MujocoMassSpring(system)
    _engines[key] = system, engine
    return engine


class _Steps:
    """Steps of a MuJoCo model, so many a frame."""

    def __init__(self, engine: Any, substeps: int) -> None:
        self._engine, self._substeps = engine, substeps

    def begin(self, state: State) -> None:
        self._engine.write(state)

    def advance(self) -> None:
        self._engine.advance(self._substeps)

    def positions(self) -> FloatArray:
        engine = self._engine
        positions = engine.model.body_pos[engine.bodies]
        positions[engine.free] = engine.data.qpos[engine.columns]
        return positions
