"""All solutions of a pose: closed forms where the axes of an arm allow, else a search.

`arms.py` brings a robot down to arms of at most six joints; `closed_forms.py` solves them by the
angles of `subproblems.py`. `settle.py` checks the results by forward kinematics.
"""

import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ... import arguments
from ...arguments import FloatArray, frozen, is_plain, shown
from ...articulation import LIMIT_TOLERANCE, Articulation
from ...backend.threads import ArraysOfThread
from ...model import Model, checked_model, effector_of
from ..bounded_step import FULL_CIRCLE
from ..mechanism import TARGET
from ..problem import (
    CheckedTarget,
    Target,
    check_numbers,
    check_single,
    checked_settings,
    checked_targets,
)
from ..solve import solve_checked, target_rows
from .arms import SEARCH, Arm, Arms, arms_of
from .closed_forms import CANDIDATES, FIGURES, HINGES, LARGEST_COUNT, SOLUTIONS_AT, TARGET_AT
from .settle import TOLERANCE, closed_form_kernel, settle_kernel
from .subproblems import CERTAIN, DOUBTFUL, EVERY_ANGLE

# Random starts of a search.
RESTARTS = 256
# A start of the search is given up at this distance from the target, over the reach, and angle.
SEARCH_TOLERANCE = 1e-6
# The target in a block of an arm, a position and a rotation.
_POSE = 7
_POSITION, _ROTATION = slice(TARGET_AT, TARGET_AT + 3), slice(TARGET_AT + 3, TARGET_AT + _POSE)


class IKSolutions(NamedTuple):
    """All solutions of a pose found by a method, up to whole revolutions; arrays are read-only.

    Attributes:
        coordinates: (solution, coordinate). Each angle is the nearest to the middle of its limits,
            or without limits to zero; `with_turns` adds whole revolutions. Joints that do not move
            the effector are at neutral.
        residual: distances from effector to target [m], by forward kinematics, (solution,).
        residual_rotation: angles between effector and target [rad], (solution,).
        method: the name of the closed form, or "restarts".
        complete: whether the method proves that no other solutions exist within the limits, up to
            whole revolutions; with a grid, at its values. Never near a singular pose, where the
            number of solutions is in doubt: an empty list then proves nothing.
        continuum: whether the target is singular, within 1e-7 of the reach and in angle: solutions
            form a continuum, of which the list has single members, or none.
        unseen: the probability that a further restart would find an unlisted solution; 0 of closed
            forms. The estimate is the share of solutions found once (Good 1953).
        grid: the values at which joints were locked, by their names.
        turn_limits: lower and upper limits [rad] of angles moved by `with_turns`, else infinite,
            (2, coordinate).
    """

    coordinates: FloatArray
    residual: FloatArray
    residual_rotation: FloatArray
    method: str
    complete: bool
    continuum: bool
    unseen: float
    grid: dict[str, FloatArray]
    turn_limits: FloatArray

    def with_turns(self) -> Iterator[FloatArray]:
        """Yield each solution, (coordinate,), at all whole revolutions within the limits.

        Six hinges with limits of ±2 pi have 64 rows for a solution. Angles without two limits,
        locked joints and joints with followers do not turn.
        """
        is_limited = np.isfinite(self.turn_limits).all(axis=0)
        limits = self.turn_limits + LIMIT_TOLERANCE * np.array([[-1.0], [1.0]])
        for q in self.coordinates:
            ends = np.where(is_limited, limits - q, 0.0) / FULL_CIRCLE
            turns = [range(math.ceil(first), math.floor(last) + 1) for first, last in ends.T]
            for counts in itertools.product(*turns):
                yield np.clip(q + FULL_CIRCLE * np.array(counts), *self.turn_limits)


class _Solved(NamedTuple):
    """The solutions of an arm: see IKSolutions."""

    rows: FloatArray  # the arm's coordinates, then FIGURES
    method: str
    complete: bool
    continuum: bool


def all_solutions(
    robot: Model,
    target: Target,
    effector: int | str | None = None,
    *,
    grid: Mapping[int | str, ArrayLike] | None = None,
    restarts: int = RESTARTS,
    seed: int = 0,
) -> IKSolutions:
    """Return all joint coordinates within the limits which bring an effector to a pose.

    Six hinges have closed forms if the last or the first three axes meet (Pieper 1968). So have
    hinges whose second to fourth, or third to fifth, are parallel and whose two at the end meet
    (Elias & Wen 2022, by subproblems of Paden 1986 and Kahan 1983). Closed forms prove their lists
    complete where the axes meet or are parallel to rounding. Every other arm is searched by
    Levenberg-Marquardt from random starts.

    The list is up to whole revolutions, which `IKSolutions.with_turns` adds. An arm whose closed
    form comes to no solution near a singular pose is searched as well.

    All solutions reach the target within 1e-9, of the reach and in radians, and differ by more than
    1e-6; Newton's method polishes those further off than 1e-12. A robot of seven joints has a
    continuum of solutions: a joint is locked at values of a grid, and the others are solved for.

    Args:
        robot: an Articulation or a Robot; hinges and slides move the effector.
        target: the pose, with a rotation.
        effector: the joint to reach the pose, as for `solve_ik`.
        grid: joints to lock, each with a value or several, which are combined. By default, of seven
            joints the most redundant whose arm has a closed form, at 16 values between its limits.
        restarts: the number of starts of a search, at each value of the grid.
        seed: of the starts.

    Raises:
        ValueError: if an argument is not valid, the target has no rotation or is a batch, a joint
            is no hinge or slide, or more than six joints remain.
    """
    model, *search = _checked_robot(robot, restarts, seed)
    pose = _checked_pose(model, target, effector)
    return _all_solutions(arms_of(model, pose.joint, grid), pose, *search)


class PreparedSolutions(ArraysOfThread):
    """`all_solutions` of a robot, a pose a call; a closed form fills the same arrays every time.

    Each thread that shares the object has arrays of its own.
    """

    def __init__(self, arms: Arms, joint: int, restarts: int, seed: int):
        """Allocate the arrays of a thread; `prepare_all_solutions` checks the arguments."""
        self._problem = arms, joint, restarts, seed
        block, kernel = arms.members[0].block.copy(), closed_form_kernel.in_force
        lists: dict[Any, IKSolutions] = {}
        shape = (-1,)  # which no array has
        if arms.members[0].is_plain:
            shape, rows = (_POSE,), _solution_rows(block)
            lists = {
                (count, status): _listed(arms, rows, count, status)
                for count in range(CANDIDATES + 1)
                for status in (CERTAIN, DOUBTFUL, EVERY_ANGLE)
                if count or status == CERTAIN  # else there is a search
            }
        # one attribute, as a thread's attribute takes 0.05 µs
        self._work = shape, block[TARGET_AT:][:_POSE], kernel, block, lists

    def __call__(self, target: ArrayLike) -> IKSolutions:
        """Return all solutions of a pose; the next call overwrites those of a closed form.

        Args:
            target: the effector's position [m] and rotation, (7,).

        Raises:
            ValueError: as `all_solutions` does. Earlier solutions are then not defined.
        """
        shape, row, kernel, block, lists = self._work
        if is_plain(target, shape):
            row[...] = target
            solutions = lists.get(kernel(block))
            if solutions is not None:
                return solutions
        arms, joint, restarts, seed = self._problem
        values = arguments.floats("target", target, _POSE)
        pose = CheckedTarget(joint, values[:3], values[3:], 1.0)
        return _all_solutions(arms, pose, restarts, seed)


def prepare_all_solutions(
    robot: Model,
    effector: int | str | None = None,
    *,
    grid: Mapping[int | str, ArrayLike] | None = None,
    restarts: int = RESTARTS,
    seed: int = 0,
) -> PreparedSolutions:
    """Return `all_solutions` for many poses: `prepare_all_solutions(robot)(target)`.

    Arguments and errors are as for `all_solutions`. The kernel is of the backend now in force.
    """
    model, *search = _checked_robot(robot, restarts, seed)
    joint = effector_of(model, effector)
    return PreparedSolutions(arms_of(model, joint, grid), joint, *search)


def _checked_robot(robot: Model, restarts: int, seed: int) -> tuple[Articulation, int, int]:
    """Return the arguments that no pose needs."""
    model = checked_model(robot, "robot")
    if not isinstance(model, Articulation):
        raise ValueError("robot: expected hinges and slides, got a Skeleton")
    count = arguments.count("restarts", restarts, minimum=1)
    return model, count, arguments.integer("seed", seed, minimum=0)


def _checked_pose(model: Articulation, target: Any, effector: int | str | None) -> CheckedTarget:
    """Return the target, its numbers not yet checked."""
    if type(target) is Target and (effector is None or target.effector is None):
        x, R = target.position, target.rotation
        if is_plain(x, (3,)) and is_plain(R, (4,)):
            joint = effector_of(model, target.effector if effector is None else effector)
            return CheckedTarget(joint, x, R, 1.0)  # type: ignore[arg-type]
    if not isinstance(target, Target) or target.rotation is None:
        raise ValueError(f"target: expected a Target with a rotation, got {shown(target)}")
    return check_single(checked_targets(model, target, effector))[0]


def _all_solutions(arms: Arms, pose: CheckedTarget, restarts: int, seed: int) -> IKSolutions:
    """Return the solutions of all arms, as `all_solutions` does."""
    arm = arms.members[0]
    if arm.is_plain:
        rows, count, status = _closed_form(arm, pose)
        if count or status == CERTAIN:
            return _listed(arms, rows, count, status)
    return _merged(arms, [_arm_solutions(arm, pose, restarts, seed) for arm in arms.members])


def _listed(arms: Arms, rows: FloatArray, count: int, status: int) -> IKSolutions:
    """Return the first rows as solutions of an arm whose joints are all the robot has."""
    arm = arms.members[0]
    return IKSolutions(
        rows[:count, :HINGES], rows[:count, HINGES], rows[:count, HINGES + 1], arm.method,
        arm.is_exact and status == CERTAIN, status == EVERY_ANGLE, 0.0, {}, arms.turn_limits,
    )  # fmt: skip


def _solution_rows(block: FloatArray) -> FloatArray:
    """Return the rows of solutions in a block, (candidate, HINGES + FIGURES), read-only."""
    rows: Any = block[SOLUTIONS_AT:].reshape(CANDIDATES, HINGES + FIGURES)
    rows.setflags(False)  # by its name it takes twice as long
    return rows


def _closed_form(arm: Arm, pose: CheckedTarget) -> tuple[FloatArray, int, int]:
    """Return rows, how many of them are solutions, and the certainty of their number."""
    block = arm.block.copy()
    block[_POSITION], block[_ROTATION] = pose.position, pose.rotation
    count, status = closed_form_kernel(block)
    if count < 0:
        check_numbers([pose])
        raise ValueError("rotation: expected a quaternion within 1e-6 of unit length")
    return _solution_rows(block), count, status


def _arm_solutions(arm: Arm, pose: CheckedTarget, restarts: int, seed: int) -> _Solved:
    """Return the solutions of an arm, by its closed form if there is one."""
    if arm.method == SEARCH:
        return _by_search(arm, pose, restarts, seed, SEARCH_TOLERANCE)
    rows, count, status = _closed_form(arm, pose)
    is_certain, continuum = status == CERTAIN, status == EVERY_ANGLE
    if count or is_certain:
        return _Solved(rows[:count], arm.method, arm.is_exact and is_certain, continuum)
    # Newton's method fails near this singular pose: the search has to come down to TOLERANCE
    searched = _by_search(arm, pose, restarts, seed, TOLERANCE)
    return searched._replace(continuum=searched.continuum or continuum)


def _by_search(arm: Arm, pose: CheckedTarget, count: int, seed: int, tolerance: float) -> _Solved:
    """Return the solutions from random starts that reach a pose within a tolerance."""
    (pose,) = check_numbers([pose])
    starts = arm.articulation.random(np.random.default_rng(seed), count)
    tolerances = tolerance * arm.mechanism.reach, tolerance
    settings = checked_settings("levenberg_marquardt", *tolerances, 200, 0, 0, False, 1)
    ends = solve_checked(arm.articulation, starts, [pose], settings)
    is_near = (ends.residual <= tolerances[0]) & (ends.residual_rotation <= tolerances[1])
    candidates = np.ascontiguousarray(ends.coordinates[is_near][:, arm.mechanism.columns])
    rows = np.empty((len(candidates), len(arm.columns) + FIGURES))
    target = target_rows([pose], ()).view(TARGET)
    count, _ = settle_kernel(tuple(arm.mechanism), candidates, target, rows)
    return _Solved(rows[:count], SEARCH, False, count > LARGEST_COUNT)


def _merged(arms: Arms, solved: list[_Solved]) -> IKSolutions:
    """Return the solutions of all arms."""
    rests, rows = [arm.rest for arm in arms.members], np.concatenate([s.rows for s in solved])
    coordinates = np.repeat(rests, [len(s.rows) for s in solved], axis=0)
    coordinates[:, arms.members[0].columns] = rows[:, :-FIGURES]
    distance, angle, _ = rows[:, -FIGURES:].T.copy()
    methods = dict.fromkeys(s.method for s in solved)
    # how many starts of a search came to each solution
    starts = np.concatenate([s.rows[:, -1] * (s.method == SEARCH) for s in solved])
    single, total = float((starts == 1.0).sum()), float(starts.sum())
    unseen = single / total if total else float(SEARCH in methods)
    return IKSolutions(
        frozen(coordinates), frozen(distance), frozen(angle), ", ".join(methods),
        all(s.complete for s in solved), any(s.continuum for s in solved), unseen, arms.grid,
        arms.turn_limits,
    )  # fmt: skip
