"""MuJoCo: point masses on slides, springs as the edges of a one-dimensional flex, by `Euler`."""

from plumbob.crosscheck.engines import MujocoFlex
from plumbob.reference import MassSpring

from .mujoco_models import kept
from .mujoco_tendons import MujocoSteps
from .protocol import Mover


def prepare(system: MassSpring, frame: float, substeps: int = 1) -> Mover:
    """Return MuJoCo, stepping so many times a frame; all springs are alike in a flex."""
    engine = kept(MujocoFlex, system)
    engine.model.flex_edgestiffness[:] = system.stiffnesses[0]
    engine.model.flex_edgedamping[:] = system.dampings[0]
    return MujocoSteps(engine, frame, substeps)
