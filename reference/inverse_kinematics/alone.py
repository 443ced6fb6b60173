"""One solve from arrays that need no conversion, with little between the caller and the kernel.

It is what `solve_targets` does for anything, for the one case in which looking at the arguments
would take longer than solving: one start and one target, float64 arrays of the right shape.
Whatever else comes, or is amiss, is left to `solve_targets`.
"""

import math
from typing import Any

import numpy as np

from ..arguments import FLOAT64, FloatArray, RecordArray, frozen
from ..articulation import Articulation
from ..model import effector_of
from ..outcome import Outcome
from ..quaternion import IDENTITY
from ..skeleton import Skeleton
from .batch import FIGURES
from .mechanism import TARGET
from .problem import IKSolution, Target
from .reduce import prepare

OUTCOMES = {outcome.value: outcome for outcome in Outcome}
NAMES = (int, str, type(None))
NO_HISTORY = frozen(np.empty(0))
UNWANTED = np.empty((1, 1))  # where the kernels may write a history that nobody reads


def solve_alone(
    model: Any, start: Any, target: Any, effector: Any, settings: Any
) -> IKSolution | None:
    """Return the solution, or None where the arguments are not that plain, or not fit."""
    if settings.record:
        return None
    if type(target) is np.ndarray and type(model) is Skeleton:
        return solve_chain(model, start, target, effector, settings)
    position, turn, weight = target, None, 1.0
    if type(target) is list and len(target) == 1:
        target = target[0]
    if type(target) is Target:
        if effector is not None:
            return None
        position, turn, effector, weight = target
    if type(weight) is not float or not 0.0 < weight < math.inf:  # alone, it counts for nothing
        return None
    if type(model) is Skeleton and turn is None:
        return solve_chain(model, start, position, effector, settings)
    if not (type(effector) in NAMES and is_plain(position, (3,))):
        return None
    if type(model) is Articulation and (turn is None or is_plain(turn, (4,))):
        goal = new_goal(position, turn)
        return solve_mechanism(model, start, goal, effector, turn is not None, settings)
    return None


def is_plain(values: Any, shape: tuple[int, ...]) -> bool:
    """Return whether values are a float64 array of a shape."""
    return type(values) is np.ndarray and values.dtype == FLOAT64 and values.shape == shape


def new_goal(position: Any, turn: Any) -> RecordArray:
    """Return what the kernels want to know of one target, a record TARGET, (1, 1)."""
    goal = np.empty((1, 1), TARGET)
    goal["position"] = position
    goal["rotation"] = IDENTITY if turn is None else turn
    goal["weight"] = 1.0
    return goal


def solve_mechanism(
    model: Articulation,
    start: FloatArray,
    goal: RecordArray,
    effector: int | str | None,
    oriented: bool,
    settings: Any,
) -> IKSolution | None:
    """Solve on an articulation; None if a number is not fit."""
    if not is_plain(start, (model.coordinate_count,)):
        return None
    count, asked = model.joint_count, (effector, oriented, settings.restarts, settings.seed)
    prepared = model.mechanisms.get(asked)
    if prepared is None:
        joint = effector_of(model, effector)
        prepared = prepare(model, (joint,), (oriented,), settings.restarts, settings.seed)
        model.mechanisms[asked] = prepared
    q, local = np.empty((1, model.coordinate_count)), np.empty((1, count, 4))
    positions, figures = np.empty((1, count, 3)), np.empty((1, len(FIGURES)))
    fine = settings.solver.mechanism(
        *prepared.flat, writable(start)[None], goal, settings.tolerance,
        settings.tolerance_rotation, settings.max_iterations, settings.far_iterations,
        prepared.restarts, prepared.tips, False, q, local, positions, figures, UNWANTED,
    )  # fmt: skip
    return finished(local, positions, figures, NO_HISTORY, q) if fine else None


def solve_chain(
    model: Skeleton, start: Any, position: Any, effector: Any, settings: Any
) -> IKSolution | None:
    """Solve on a skeleton; None if there is more to it, or a number is not fit."""
    count = model.joint_count
    if not (is_plain(start, (count, 4)) and is_plain(position, (3,))):
        return None
    if settings.restarts or type(effector) not in NAMES:
        return None
    joint = count - 1 if effector is None else model.index(effector, "effector")
    local, positions = np.empty((1, count, 4)), np.empty((1, count, 3))
    figures = np.empty((1, len(FIGURES)))
    fine = settings.solver.chain(
        *model.arrays, model.path_array(joint), writable(start)[None],
        writable(position)[None], settings.tolerance, settings.max_iterations,
        settings.far_iterations, 1, False, local, positions, figures, UNWANTED,
    )  # fmt: skip
    return finished(local, positions, figures, NO_HISTORY, local) if fine else None


def writable(values: FloatArray) -> FloatArray:
    """Return the values row after row in an array that may be written to, as kernels expect."""
    return values if values.flags.carray else values.copy()


def finished(
    local: FloatArray,
    positions: FloatArray,
    figures: FloatArray,
    history: FloatArray,
    coordinates: FloatArray,
) -> IKSolution:
    """Return the solution of one target from the kernels' rows of one."""
    shown = local[0]
    for rows in (shown, positions) if coordinates is local else (shown, positions, coordinates):
        rows.setflags(False)  # type: ignore[call-arg]  # by its name it takes twice as long
    residual, angle, iterations, outcome, merit, excess = figures.tolist()[0]
    return IKSolution(
        shown, positions[0], residual, int(iterations), OUTCOMES[int(outcome)], history, angle,
        shown if coordinates is local else coordinates[0], merit, excess,
    )  # fmt: skip
