"""Plumbob's own explicit integrators, through their public interface."""

from functools import partial

from plumbob.reference import MassSpring, runge_kutta, symplectic_euler

from .protocol import Mover
from .step_solvers import Steps

INTEGRATORS = {"symplectic_euler": symplectic_euler, "runge_kutta": runge_kutta}


def prepare(
    system: MassSpring, frame: float, integrator: str = "symplectic_euler", substeps: int = 1
) -> Mover:
    """Return an explicit integrator that takes so many steps a frame."""
    return Steps(partial(INTEGRATORS[integrator], system, h=frame / substeps), substeps)
