"""What the kernels of inverse kinematics fill, a row a target."""

from typing import NamedTuple

from ..arguments import FloatArray
from ..outcome import Outcome

# Columns of Result.figures: the largest distance from effector to target [m], the largest angle
# between them [rad], the number of iterations, the value of the outcome, the merit [m], and the
# distance above what geometry proves to be the least [m].
RESIDUAL, RESIDUAL_ROTATION, ITERATIONS, OUTCOME, MERIT, EXCESS = FIGURES = range(6)


class Result(NamedTuple):
    """Poses and how good they are."""

    local: FloatArray  # local rotations, (target, joint, 4)
    positions: FloatArray  # global positions [m], (target, joint, 3)
    figures: FloatArray  # (target, 6), see above
    # distances before and after each iteration [m], (target, iteration); (1, 1) if they are not to
    # be recorded. Entries after the last iteration are not filled
    history: FloatArray
    # of an articulation, (target, coordinate); of a skeleton its local rotations
    coordinates: FloatArray


def fill_figures(figures, distance, angle, iterations, merit, least):
    """Fill all figures but the outcome, where no pose is nearer than `least` [m]."""
    figures[RESIDUAL], figures[RESIDUAL_ROTATION] = distance, angle
    figures[ITERATIONS], figures[MERIT] = iterations, merit
    figures[EXCESS] = max(0.0, distance - least)


def outcome_of(reached, unreachable, settled):
    """Return how a solve ended; `unreachable` is whether geometry proves the target to be so."""
    if reached:
        return Outcome.CONVERGED
    if unreachable:
        return Outcome.UNREACHABLE if settled else Outcome.UNREACHABLE_UNSETTLED
    return Outcome.STALLED if settled else Outcome.ITERATION_LIMIT
