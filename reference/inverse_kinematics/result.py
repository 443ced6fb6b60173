"""The arrays that the kernels of inverse kinematics fill, and the figures in them."""

from typing import NamedTuple

from ..arguments import FloatArray
from ..outcome import Outcome

# Columns of Result.figures: the largest distance [m] and angle [rad] from effector to target, the
# number of iterations, and the value of the outcome. Then the merit [m], and the distance above the
# least that geometry allows [m].
RESIDUAL, RESIDUAL_ROTATION, ITERATIONS, OUTCOME, MERIT, EXCESS = FIGURES = range(6)
FIGURE_COUNT = len(FIGURES)


class Result(NamedTuple):
    """The arrays that kernels fill, a row a target."""

    local: FloatArray  # local rotations, (target, joint, 4)
    positions: FloatArray  # global positions [m], (target, joint, 3)
    figures: FloatArray  # (target, 6), see FIGURES
    # of an articulation, (target, coordinate); of a skeleton empty
    coordinates: FloatArray
    # distances before and after each iteration [m], as many as fit, (target, iteration + 1)
    history: FloatArray


def result_size(joints: int, coordinates: int, history: int) -> int:
    """Return how many numbers the results of a target are."""
    return 7 * joints + FIGURE_COUNT + coordinates + history


def result_on(memory, n, joints, coordinates):
    """Return the results of n targets in a row of numbers; what is left over is the history."""
    a = 4 * n * joints
    b = a + 3 * n * joints
    c = b + FIGURE_COUNT * n
    d = c + coordinates * n
    columns = (len(memory) - d) // max(n, 1)
    return Result(
        memory[:a].reshape(n, joints, 4), memory[a:b].reshape(n, joints, 3),
        memory[b:c].reshape(n, FIGURE_COUNT), memory[c:d].reshape(n, coordinates),
        memory[d:].reshape(n, columns),
    )  # fmt: skip


def fill_figures(figures, distance, angle, iterations, merit, lower_bound):
    """Fill all figures but the outcome; no pose is nearer to the target than a bound [m]."""
    figures[RESIDUAL], figures[RESIDUAL_ROTATION] = distance, angle
    figures[ITERATIONS], figures[MERIT] = iterations, merit
    figures[EXCESS] = max(0.0, distance - lower_bound)


def outcome_of(reached, unreachable, stalled):
    """Return how a solve ended; `unreachable` is whether geometry proves the target to be so."""
    if reached:
        return Outcome.CONVERGED
    if unreachable:
        return Outcome.UNREACHABLE if stalled else Outcome.UNREACHABLE_UNSETTLED
    return Outcome.STALLED if stalled else Outcome.ITERATION_LIMIT
