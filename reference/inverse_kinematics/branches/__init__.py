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
from ...arguments import FloatArray, is_plain, shown
from ...articulation import LIMIT_TOLERANCE, Articulation
from ...model import Model, checked_model, effector_of
from ..bounded_step import FULL_CIRCLE
from ..mechanism import TARGET
from ..problem import (
    CheckedTarget,
    Target,
    check_numbers,
    checked_settings,
    checked_targets,
)
from ..solve import solve_checked, target_rows
from .arms import SEARCH, Arm, Arms, arms_of
from .closed_forms import CANDIDATES, HINGES, LARGEST_COUNT
from .settle import FIGURES, TOLERANCE, closed_form_kernel, settle_kernel
from .subproblems import CERTAIN, EVERY_ANGLE

# Random starts of a search.
RESTARTS = 256
# A start of the search is given up at this distance from the target, over the reach, and angle.
SEARCH_TOLERANCE = 1e-6


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


class _ArmSolutions(NamedTuple):
    """The solutions of an arm: see IKSolutions."""

    rows: FloatArray  # the arm's coordinates, then FIGURES
    method: str
    complete: bool
    continuum: bool
    starts: int = 0  # of a search, those that come to a solution
    single: int = 0  # and those that alone come to theirs


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

    All solutions are polished by Newton's method, reach the target within 1e-9, of the reach and in
    radians, and differ by more than 1e-6. A robot of seven joints has a continuum of solutions: a
    joint is locked at values of a grid, and the others are solved for.

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
    model = checked_model(robot, "robot")
    if not isinstance(model, Articulation):
        raise ValueError("robot: expected hinges and slides, got a Skeleton")
    pose = _checked_pose(model, target, effector)
    arms = arms_of(model, pose.joint, grid)
    count = arguments.count("restarts", restarts, minimum=1)
    seed = arguments.integer("seed", seed, minimum=0)
    if len(arms.members) == 1 and arms.members[0].is_plain:
        solutions = _plain(arms, pose)
        if len(solutions.coordinates) or solutions.complete:
            return solutions
    return _merged(arms, [_solutions_of(arm, pose, count, seed) for arm in arms.members])


def _checked_pose(model: Articulation, target: Any, effector: int | str | None) -> CheckedTarget:
    """Return the target, its numbers not yet checked."""
    if type(target) is Target and (effector is None or target.effector is None):
        x, R = target.position, target.rotation
        if is_plain(x, (3,)) and is_plain(R, (4,)):
            joint = effector_of(model, target.effector if effector is None else effector)
            return CheckedTarget(joint, x, R, 1.0)  # type: ignore[arg-type]
    if not isinstance(target, Target) or target.rotation is None:
        raise ValueError(f"target: expected a Target with a rotation, got {shown(target)}")
    (checked,) = checked_targets(model, target, effector)
    arguments.check_shape("target", checked.position, 3)
    arguments.check_shape("rotation", checked.rotation, 4)  # type: ignore[arg-type]
    return checked


def _plain(arms: Arms, pose: CheckedTarget) -> IKSolutions:
    """Return the solutions of an arm with a closed form, whose joints are all the robot has."""
    (arm,) = arms.members
    rows, is_certain, continuum = _closed_form(arm, pose)
    return IKSolutions(
        rows[:, :HINGES], rows[:, HINGES], rows[:, HINGES + 1], arm.method,
        arm.is_exact and is_certain, continuum, 0.0, {}, arms.turn_limits,
    )  # fmt: skip


def _closed_form(arm: Arm, pose: CheckedTarget) -> tuple[FloatArray, bool, bool]:
    """Return rows of solutions, whether their number is certain, and whether some are continua."""
    rows = np.empty((CANDIDATES, HINGES + FIGURES))
    count, status, doubts = closed_form_kernel(*arm.flat, pose.position, pose.rotation, rows)
    rows.flags.writeable = False
    if count < 0:
        check_numbers([pose])
        raise ValueError("rotation: expected a quaternion within 1e-6 of unit length")
    return rows[:count], status == CERTAIN and not doubts, status == EVERY_ANGLE


def _solutions_of(arm: Arm, pose: CheckedTarget, restarts: int, seed: int) -> _ArmSolutions:
    """Return the solutions of an arm, by its closed form if there is one."""
    if arm.method == SEARCH:
        return _by_search(arm, pose, restarts, seed, SEARCH_TOLERANCE)
    rows, is_certain, continuum = _closed_form(arm, pose)
    if len(rows) or is_certain:
        return _ArmSolutions(rows, arm.method, arm.is_exact and is_certain, continuum)
    # Newton's method fails near this singular pose: the search has to come down to TOLERANCE
    searched = _by_search(arm, pose, restarts, seed, TOLERANCE)
    return searched._replace(continuum=searched.continuum or continuum)


def _by_search(
    arm: Arm, pose: CheckedTarget, restarts: int, seed: int, tolerance: float
) -> _ArmSolutions:
    """Return the solutions from random starts that reach a pose within a tolerance."""
    (pose,) = check_numbers([pose])
    starts = arm.articulation.random(np.random.default_rng(seed), restarts)
    tolerances = tolerance * arm.mechanism.reach, tolerance
    settings = checked_settings("levenberg_marquardt", *tolerances, None, 0, 0, False, 1)
    ends = solve_checked(arm.articulation, starts, [pose], settings)
    is_near = (ends.residual <= tolerances[0]) & (ends.residual_rotation <= tolerances[1])
    candidates = np.ascontiguousarray(ends.coordinates[is_near][:, arm.mechanism.columns])
    rows = np.empty((len(candidates), len(arm.columns) + FIGURES))
    count, _ = settle_kernel(
        tuple(arm.mechanism), candidates, target_rows([pose], ()).view(TARGET)[None], rows
    )
    rows = rows[:count]
    hits = rows[:, -1]
    single = int((hits == 1.0).sum())
    return _ArmSolutions(rows, SEARCH, False, count > LARGEST_COUNT, int(hits.sum()), single)


def _merged(arms: Arms, solved: list[_ArmSolutions]) -> IKSolutions:
    """Return the solutions of all arms."""
    coordinates = np.repeat(
        [arm.rest for arm in arms.members], [len(s.rows) for s in solved], axis=0
    )
    rows = solved[0].rows if len(solved) == 1 else np.concatenate([s.rows for s in solved])
    coordinates[:, arms.members[0].columns] = rows[:, :-FIGURES]
    distance, angle, _ = rows[:, -FIGURES:].T.copy()
    for values in (coordinates, distance, angle):
        values.flags.writeable = False
    methods = dict.fromkeys(s.method for s in solved)
    starts, unseen = sum(s.starts for s in solved), float(SEARCH in methods)
    if starts:
        unseen = sum(s.single for s in solved) / starts
    return IKSolutions(
        coordinates, distance, angle, ", ".join(methods), all(s.complete for s in solved),
        any(s.continuum for s in solved), unseen, arms.grid,
        arms.turn_limits,
    )  # fmt: skip
