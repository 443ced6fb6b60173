"""Requests to bring a robot's tool to a pose, many of which show a single rule of a program."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import count, islice
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import rotation, solve_ik
from plumbob.reference.arguments import FloatArray
from plumbob.reference.jacobians import jacobian
from plumbob.reference.skeleton import Pose

from ..case import Case
from ..greeting import Greeting
from .robot_models import (
    BENT,
    IDENTITY,
    ITERATIONS,
    PRECISION,
    REDUNDANT,
    TOLERANCES,
    Inputs,
    ancestors,
    mechanism,
    robot_case,
    robots,
    size_of,
    solved,
    target_of,
    tool_pose,
    twists_between,
)
from .skeletons import suits

TASK = "robot_inverse_kinematics"
# Starts at the answer, near it, anywhere; unreachable targets; a joint at its limit while the other
# joints can reach the target.
AT, CLOSE, ANYWHERE, BEYOND = "start at the target", "near start", "any start", "beyond reach"
AT_A_LIMIT = "at a limit"
# Starts off their targets by multiples of a tolerance; limits close to the start; a single
# iteration, without and with a joint at its limit.
TOLERANCE, TIGHT, STEP = "off by tolerances", "tight limits", "a single iteration"
LIMIT_STEP = "a single iteration at a limit"
# The same of an iteration and more, from the same start; no target need be reached.
FEW, MOST = "a few iterations", 5
# Single iterations of tools that are rotated by nearly half a turn about x, y and z.
HALF_TURNS = tuple(f"half a turn about {axis}" for axis in "xyz")
# Targets nearly half a turn away, or beyond half a turn: the other way round leads to limits.
FAR_ROTATION = "far rotation"
# Requests whose targets need not be reached.
UNREACHED = (BEYOND, STEP, TIGHT, FEW, LIMIT_STEP, *HALF_TURNS)
# From a start so near to an answer [rad, m] no other minimum than the target's is nearer.
NEAR = 0.1
# How far single iterations and motions to a limit begin from an answer [rad, m]; of slides a share.
DISTANCE, SLIDE = 0.3, 0.1
# The largest share of a joint in a movement that the others can make up for in few iterations.
SHARE, DRAWS = 0.5, 50
# Of so many configurations the least singular one is a target: near others solvers are slow.
FEW_DRAWS = 4
# A test passes all errors up to some multiple of the tolerance between two of these. Degrees are
# between the second and the third. No start is farther off [m, rad].
RATIOS, MAX_ERROR = (3.0, 20.0, 90.0, 500.0), 0.6
# The larger of two tolerances, of which square roots are other multiples than of the smaller.
LARGE_TOLERANCE = 1e-3
# Limits of single iterations [rad, m], which even steps of wrong kinematics do not reach.
UNLIMITED = 100.0
# How near tight limits are, and how far beyond the target's joints are [rad].
WIDTHS, AWAY, FEW_ITERATIONS, SOME_ITERATIONS = (0.03, 0.09), 1.0, 40, 100
# Squared dampings with all of which a joint moves to one side, by this share of the longest step.
STEP_DAMPINGS, CLEAR = (1e-6, 1e-3, 1e-1), 0.3
# Rotations by nearly half a turn [rad].
NEARLY_HALF = 2.9
# Tools at starts before half a turn and targets beyond are rotated so far from half a turn [rad].
BEFORE_HALF = 0.15
# The joints of robots with a feature of their kinematics near their targets alone.
ONE_FEATURE = 3
_SEED = 1955


class ToolRequest(NamedTuple):
    """A pose that a robot's tool is to have, or the poses of all frames of a motion."""

    family: str
    robot: Inputs
    start: FloatArray
    tool: Pose  # the target
    options: Mapping[str, Any] = {}  # inputs other than most requests'
    facts: Mapping[str, Any] = {}


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return robots of one joint to seven, each from starts at, near and far from the target."""
    rng = np.random.default_rng([_SEED, seed])
    tolerance = TOLERANCES[greeting.precision]
    cases = []
    for name, robot in robots(rng).items():
        for number in range(3 if thorough else 1):
            numbers: dict[str, Iterator[int]] = {}
            for request in _requests(name, robot, tolerance, rng):
                order = next(numbers.setdefault(request.family, count()))
                label = f"{name}, pose {number + 1}, {request.family}"
                label += ("", " again")[order] if order < 2 else f" {order + 1}"
                if suits(robot["parents"], greeting, robot["effector"]):
                    cases.append(_case(label, request, tolerance))
    return cases


def _case(name: str, request: ToolRequest, tolerance: float) -> Case:
    robot, family = request.robot, request.family
    options = {
        "start": request.start,
        "target_position": request.tool.positions,
        "target_rotation": request.tool.rotations,
        "tolerance": tolerance * max(size_of(robot), 1.0),
        "tolerance_rotation": tolerance,
        "max_iterations": ITERATIONS,
        **request.options,
    }
    is_reachable = np.array([family not in (BEYOND, TIGHT, FEW)])
    facts = {"size": size_of(robot), "reachable": is_reachable, **request.facts}
    return robot_case(name, TASK, family, robot, options, facts)


def _requests(
    name: str, robot: Inputs, tolerance: float, rng: np.random.Generator
) -> Iterator[ToolRequest]:
    """Yield the requests of a robot: requests of rare features come last."""
    lower, upper, joints = robot["lower"], robot["upper"], len(robot["lower"])
    generators = [rng, *np.random.default_rng(_SEED).spawn(FEW_DRAWS - 1)]
    answers = [
        lower + (upper - lower) * generator.uniform(0.2, 0.8, joints) for generator in generators
    ]
    answer = max(answers, key=lambda q: np.linalg.svd(jacobian(mechanism(robot), q, -1))[1].min())
    close = np.clip(answer + rng.uniform(-NEAR, NEAR, joints), lower, upper)
    anywhere = np.asarray(rng.uniform(lower, upper))
    tool = tool_pose(robot, answer)
    unreachable = tool._replace(positions=np.array([0.6, 0.0, 0.8]) * 1.5 * size_of(robot))
    yield ToolRequest(AT, robot, answer, tool)
    yield ToolRequest(CLOSE, robot, close, tool)
    if joints != ONE_FEATURE:
        yield ToolRequest(ANYWHERE, robot, anywhere, tool)
        yield ToolRequest(BEYOND, robot, anywhere, unreachable, {"max_iterations": FEW_ITERATIONS})
    if joints >= REDUNDANT - 1 or not ancestors(robot).all():
        steps = list(_single_steps(robot, rng))
        yield from steps
        if name == "seven hinges":
            for k in range(1, MOST + 1):
                options = {**steps[0].options, "max_iterations": k}
                yield steps[0]._replace(family=FEW, options=options)
        yield from limited_steps(robot, rng)
    if joints >= REDUNDANT:
        draws = (_draw_limited(robot, rng) for _ in range(DRAWS))
        yield from islice((draw for draw in draws if draw is not None), 2)
        yield from tight_limits(robot, rng)
    if name == "seven hinges":
        tolerances = tolerance * np.array([max(size_of(robot), 1.0), 1.0])
        yield from off_by_tolerances(robot, tolerances, rng)
        for family, turned in zip(HALF_TURNS, half_turns(robot, BENT), strict=True):
            for near in BENT + rng.uniform(-NEAR, NEAR, (3, joints)):
                tool = tool_pose(turned, near)
                yield ToolRequest(family, turned, BENT, tool, {"max_iterations": 1})
            yield ToolRequest(CLOSE, turned, BENT, tool)
    yield from _far_rotations(name, robot)


def _far_rotations(name: str, robot: Inputs) -> Iterator[ToolRequest]:
    """Yield targets nearly half a turn away, and tools that are rotated across half a turn."""
    if name == "one hinge":
        ends = 0.5 * NEARLY_HALF * np.array([[-1.0], [1.0]])
        yield from _of_both_signs(FAR_ROTATION, robot, *ends)
    if name == "seven hinges":
        short = {"lower": BENT - 5.0 * NEAR, "upper": BENT + 5.0 * NEAR}  # the long way is beyond
        for turned in half_turns({**robot, **short}, BENT, np.pi - BEFORE_HALF):
            turn = rotation.logarithm(tool_pose(turned, BENT).rotations)
            signs = np.sign(turn @ jacobian(mechanism(turned), BENT, -1)[3:])
            yield from _of_both_signs(FAR_ROTATION, turned, BENT, BENT + NEAR * signs)


def _of_both_signs(
    family: str, robot: Inputs, start: FloatArray, answer: FloatArray
) -> Iterator[ToolRequest]:
    """Yield requests for the tool's pose at an answer, its quaternion of either sign."""
    tool = tool_pose(robot, answer)
    for sign in (1.0, -1.0):
        target = tool._replace(rotations=sign * tool.rotations)
        yield ToolRequest(family, robot, start, target)


def _single_steps(robot: Inputs, rng: np.random.Generator) -> Iterator[ToolRequest]:
    unlimited = np.full(len(robot["lower"]), UNLIMITED)
    options = {"max_iterations": 1, "lower": -unlimited, "upper": unlimited}
    for _ in range(2):
        answer = _middle(robot, rng)
        start = _near(robot, answer, rng)
        yield ToolRequest(STEP, robot, start, tool_pose(robot, answer), options)


def _draw_limited(robot: Inputs, rng: np.random.Generator) -> ToolRequest | None:
    """Return limits on a joint's way to a target, if the other joints suffice.

    By Klein and Huang (1983), a joint's share in a step of least length is the diagonal entry of
    J^+ J.
    """
    start = _middle(robot, rng)
    target = tool_pose(robot, _near(robot, start, rng))
    changes = solved(robot, start, target)[0] - start
    J = jacobian(mechanism(robot), start, -1)
    is_spare = (np.diag(np.linalg.pinv(J) @ J) < SHARE) & ~robot["slides"]
    joint = int(np.argmax(np.abs(changes) * is_spare))
    if not is_spare[joint]:
        return None
    side = "upper" if changes[joint] > 0.0 else "lower"
    limited = _limited(robot, side, joint, start[joint] + 0.3 * changes[joint])
    solvers = ("levenberg_marquardt", "damped_least_squares")
    is_solvable = all(solved(limited, start, target, solver)[1] for solver in solvers)
    return ToolRequest(AT_A_LIMIT, limited, start, target) if is_solvable else None


def _limited(robot: Inputs, side: str, joint: int, limit: float) -> Inputs:
    """Return the robot with another limit of a joint."""
    is_joint = np.arange(len(robot[side])) == joint
    return {**robot, side: np.where(is_joint, limit, robot[side])}


def limited_steps(robot: Inputs, rng: np.random.Generator) -> Iterator[ToolRequest]:
    """Yield single iterations from a joint's limit, which its step leaves or would pass.

    The joint is neither the first nor the last, so that steps of other joints show.
    """
    for is_leaving in (True, False):
        for _ in range(DRAWS):
            start = _middle(robot, rng)
            target = tool_pose(robot, _near(robot, start, rng))
            steps = _steps(robot, start, target)
            is_clear = (np.sign(steps) == np.sign(steps[0])).all(axis=0)
            is_clear &= np.abs(steps).min(axis=0) > CLEAR
            if is_clear[1:-1].any():
                joint = 1 + int(np.argmax(is_clear[1:-1]))
                side = "lower" if (steps[0, joint] > 0.0) == is_leaving else "upper"
                limited, options = _limited(robot, side, joint, start[joint]), {"max_iterations": 1}
                facts = {"held": joint, "is_leaving": is_leaving}
                yield ToolRequest(LIMIT_STEP, limited, start, target, options, facts)
                break


def _steps(robot: Inputs, start: FloatArray, tool: Pose) -> FloatArray:
    """Return steps along the gradient and with several dampings, the longest joint's 1."""
    J, error = jacobian(mechanism(robot), start, -1), twists_between(tool_pose(robot, start), tool)
    steps = [J.T @ error]
    steps += [J.T @ np.linalg.solve(J @ J.T + d * np.eye(6), error) for d in STEP_DAMPINGS]
    return np.array([step / np.abs(step).max() for step in steps])


def tight_limits(robot: Inputs, rng: np.random.Generator) -> Iterator[ToolRequest]:
    """Yield targets far beyond limits that differ from joint to joint."""
    scale = np.where(robot["slides"], SLIDE, 1.0)
    for _ in range(3):
        start = _middle(robot, rng)
        below, above = rng.uniform(*WIDTHS, (2, len(start))) * scale
        limited = {**robot, "lower": start - below, "upper": start + above}
        tool = tool_pose(robot, start + AWAY * scale * rng.choice([-1.0, 1.0], len(start)))
        yield ToolRequest(TIGHT, limited, start, tool, {"max_iterations": FEW_ITERATIONS})


def off_by_tolerances(
    robot: Inputs, tolerances: FloatArray, rng: np.random.Generator
) -> Iterator[ToolRequest]:
    """Yield starts whose position or rotation is off by multiples of two sizes of tolerances."""
    pose = tool_pose(robot, BENT)
    for scale in (1.0, max(LARGE_TOLERANCE / tolerances[1], 10.0)):
        position, angle = (scale * tolerances).tolist()
        options = {"tolerance": position, "tolerance_rotation": angle}
        options["max_iterations"] = SOME_ITERATIONS
        for part, ratio in [(part, ratio) for part in range(2) for ratio in RATIOS]:
            vector = rng.standard_normal(3)
            vector *= ratio * scale * tolerances[part] / np.linalg.norm(vector)
            rotated = rotation.multiply(rotation.exponential(vector), pose.rotations)
            shifted = pose._replace(positions=pose.positions + vector)
            target = pose._replace(rotations=rotated) if part else shifted
            if np.linalg.norm(vector) <= MAX_ERROR:
                yield ToolRequest(TOLERANCE, robot, BENT, target, options)


def half_turns(robot: Inputs, start: FloatArray, angle: float = NEARLY_HALF) -> Iterator[Inputs]:
    """Yield the robot with tools that are rotated by nearly half a turn about x, y and z."""
    for axis in np.eye(3) + 0.1:
        turn = rotation.exponential(angle * axis / np.linalg.norm(axis))
        flange = tool_pose({**robot, "tool_rotation": IDENTITY}, start).rotations
        yield {**robot, "tool_rotation": rotation.multiply(rotation.conjugate(flange), turn)}


def _near(robot: Inputs, q: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return coordinates at some distance from others."""
    distances = np.where(robot["slides"], SLIDE * DISTANCE, DISTANCE)
    return np.asarray(q + distances * rng.uniform(-1.0, 1.0, len(q)))


def _middle(robot: Inputs, rng: np.random.Generator) -> FloatArray:
    """Return coordinates well within the limits."""
    lower, upper = robot["lower"], robot["upper"]
    return np.asarray(lower + (upper - lower) * rng.uniform(0.3, 0.7, len(lower)))


def timed_solve(inputs: Inputs) -> Callable[[], object]:
    """Return the call of the reference that answers a request, to be timed."""
    options = {name: inputs[name] for name in PRECISION}
    return partial(
        solve_ik, mechanism(inputs), inputs["start"], target_of(inputs), "levenberg_marquardt",
        restarts=0, **options,
    )  # fmt: skip
