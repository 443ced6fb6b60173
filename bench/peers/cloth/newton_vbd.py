"""Newton, the engine: vertex block descent, which minimises the objective of implicit Euler.

Chen et al. 2024, "Vertex Block Descent". One after the other, each particle takes a Newton step of
its own, those of one colour at once; so neighbours must differ in colour.
"""

from functools import partial

from newton.solvers import SolverVBD

from plumbob.reference import MassSpring

from .newton_model import NewtonSteps
from .protocol import Mover


def prepare(
    system: MassSpring, frame: float, iterations: int = 10, substeps: int = 1, own: int = 0
) -> Mover:
    """Return the solver; with `own`, by the colours that Newton gives, not those of the springs."""
    return NewtonSteps(
        system, frame, substeps, partial(SolverVBD, iterations=iterations), own_colours=bool(own)
    )
