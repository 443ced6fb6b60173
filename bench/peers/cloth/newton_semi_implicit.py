"""Newton, the engine: its semi-implicit solver, which is symplectic Euler."""

from newton.solvers import SolverSemiImplicit

from plumbob.reference import MassSpring

from .newton_model import NewtonSteps
from .protocol import Mover


def prepare(system: MassSpring, frame: float, substeps: int = 1) -> Mover:
    """Return the solver, stepping so many times a frame."""
    return NewtonSteps(system, frame, substeps, SolverSemiImplicit)
