"""Newton, the engine: extended position based dynamics (Macklin, Müller, Chentanez 2016).

It corrects all springs at once and adds what each wants of a particle, without averaging.
"""

from functools import partial

from newton.solvers import SolverXPBD

from plumbob.reference import MassSpring

from .newton_model import NewtonSteps
from .protocol import Mover


def prepare(system: MassSpring, frame: float, iterations: int = 10, substeps: int = 1) -> Mover:
    """Return the solver, with so many iterations a step."""
    return NewtonSteps(system, frame, substeps, partial(SolverXPBD, iterations=iterations))
