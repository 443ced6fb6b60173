"""The solution nearest to the start, by the sum of squares or by the largest displacement."""

import contextlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments
from ..arguments import FloatArray, IndexArray
from ..articulation import HINGE, Articulation
from ..jacobians import difference
from ..outcome import Outcome
from ..skeleton import Skeleton
from .branches import all_solutions
from .problem import CheckedTarget, IKSolution, Settings, Target, check_numbers, check_single
from .reduce import prepare
from .solve import solve_checked

# The order of the norm of the displacement, of NumPy, by preference.
PREFERENCES = {"nearest": 2.0, "nearest_linf": np.inf}
REVOLUTION = 2.0 * np.pi  # [rad]


def nearest_solution(
    model: Skeleton | Articulation,
    start: ArrayLike,
    targets: list[CheckedTarget],
    settings: Settings,
    prefer: Any,
) -> IKSolution:
    """Return the solution whose displacement from the start has the least norm.

    Candidates are solutions from the start, from all random restarts, from the solve without a
    preference, and for a single pose of a suitable model from `all_solutions`. If nothing reaches
    the targets, the result is the solution without a preference. Each angle is the nearest to the
    start's within the limits.
    """
    order = PREFERENCES[arguments.choice("prefer", prefer, PREFERENCES)]
    if not isinstance(model, Articulation):
        raise ValueError("prefer: expected an Articulation or a Robot, got a Skeleton")
    check_single(targets)
    q = model.checked("q", arguments.floats("q", start, model.coordinate_count))
    single_start = settings.limited(restarts=0, phases=1)
    rng = np.random.default_rng(settings.seed)
    effectors, oriented = zip(*((t.joint, t.rotation is not None) for t in targets), strict=True)
    columns = prepare(model, effectors, oriented).mechanism.columns  # other joints stay as in q
    starts = np.tile(q, (1 + settings.limits.restarts, 1))
    starts[1:, columns] = model.random(rng, settings.limits.restarts)[:, columns]
    ends = solve_checked(model, starts, targets, single_start)
    solved = ends.coordinates[ends.outcome == Outcome.CONVERGED]
    plain = solve_checked(model, q, targets, settings)
    rows = [
        *_branches(model, targets, q, columns),
        *[plain.coordinates] * (plain.outcome == Outcome.CONVERGED),
    ]
    candidates = _unwound(model, np.vstack([solved, *rows]), q)
    if not len(candidates):
        return plain
    norms = np.linalg.norm(difference(model, candidates, q), order, axis=-1)
    unmoved = single_start.limited(max_iterations=0, far_iterations=0)
    solution = solve_checked(model, candidates[norms.argmin()], targets, unmoved)
    return solution._replace(iterations=int(np.sum(ends.iterations)) + plain.iterations)


def _branches(
    model: Articulation, targets: list[CheckedTarget], q: FloatArray, columns: IndexArray
) -> list[FloatArray]:
    """Return the rows of `all_solutions` of a single pose, other joints as in q; else nothing."""
    if len(targets) > 1 or targets[0].rotation is None:
        return []
    (target,) = check_numbers(targets)
    rows = []
    with contextlib.suppress(ValueError):  # joints of other kinds, or too many
        solutions = all_solutions(model, Target(target.position, target.rotation, target.joint))
        for coordinates in solutions.coordinates:
            rows.append(q.copy())
            rows[-1][columns] = coordinates[columns]
    return rows


def _unwound(model: Articulation, rows: FloatArray, q: FloatArray) -> FloatArray:
    """Return solutions with hinges moved by whole revolutions towards q, within the limits."""
    rows, joints = rows.copy(), model.joints
    for j in np.flatnonzero((joints["kind"] == HINGE) & ~joints["followed"]):
        if joints["leader"][j] == j:
            at, lower, upper = joints["coordinate"][j], joints["lower"][j], joints["upper"][j]
            turns = np.round((q[at] - rows[:, at]) / REVOLUTION)
            minimum = np.minimum(np.ceil((lower - rows[:, at]) / REVOLUTION), 0.0)
            maximum = np.maximum(np.floor((upper - rows[:, at]) / REVOLUTION), 0.0)
            rows[:, at] += REVOLUTION * np.clip(turns, minimum, maximum)
    return rows
