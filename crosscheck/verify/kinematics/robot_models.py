"""Robots of joints with limits: as the reference's articulations, as URDF, and as cases."""

import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from plumbob.reference import (
    Articulation,
    Outcome,
    Skeleton,
    Target,
    forward_kinematics,
    judge_pose,
    rotation,
    solve_ik,
)
from plumbob.reference.arguments import FloatArray
from plumbob.reference.jacobians import jacobian
from plumbob.reference.judging import PoseJudgement
from plumbob.reference.skeleton import Pose

from ..case import Case
from ..greeting import Greeting
from ..sentence import sentence
from .robot_textbook import roll_pitch_yaw
from .skeletons import suits

TASK = "robot_inverse_kinematics"
ITERATIONS = 200
PRECISION = ("tolerance", "tolerance_rotation", "max_iterations")
TOLERANCES = {"double": 1e-5, "single": 1e-3}
# From a start so near to an answer [rad, m] no other minimum than the target's is nearer.
NEAR = 0.1
# Starts at the answer, near it, anywhere; targets that nothing reaches; a joint that comes to its
# limit while the others can reach the target; a single iteration.
AT, CLOSE, ANYWHERE, BEYOND = "start at the target", "near start", "any start", "beyond reach"
AT_A_LIMIT, STEP = "at a limit", "a single iteration"
# How far single iterations and motions to a limit begin from an answer [rad, m]: of slides a tenth.
DISTANCE = 0.3
# Robots of so many joints have a freedom to spare; draws of a motion to a limit.
REDUNDANT, DRAWS = 7, 50
# The largest share of a joint in a movement that the others can make up for in few iterations.
SHARE = 0.5
# Larger coordinates are clipped to this: the reference takes none beyond 1e75.
FARTHEST = 1e74
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
DAMPED = "damped_least_squares"
_SEED = 1955
_TEXT = Path(__file__).with_name("robots.toml").read_text(encoding="utf-8")


def mechanism(inputs: Mapping[str, Any]) -> Articulation:
    """Return the robot of a request: a fixed base, its joints in their order, the tool."""
    Z = [0.0, 0.0, 1.0]
    parents = [-1, *(inputs["parents"] + 1), inputs["effector"] + 1]
    offsets = [np.zeros(3), *inputs["origins"], inputs["tool_position"]]
    return Articulation(
        Skeleton(parents, offsets),
        ["fixed", *("slide" if slides else "hinge" for slides in inputs["slides"]), "fixed"],
        [Z, *inputs["axes"], Z],
        frames=[IDENTITY, *inputs["orientations"], inputs["tool_rotation"]],
        lower=[-np.inf, *inputs["lower"], -np.inf],
        upper=[np.inf, *inputs["upper"], np.inf],
    )


def tool_pose(inputs: Mapping[str, Any], q: FloatArray) -> Pose:
    """Return the tool's position [m], (..., 3), and rotation, (..., 4), at coordinates q."""
    return tool_at(mechanism(inputs), q)


def tool_at(robot: Articulation, q: FloatArray) -> Pose:
    """Return the same of a `mechanism`."""
    pose = forward_kinematics(robot, q)
    return Pose(pose.positions[..., -1, :], pose.rotations[..., -1, :])


def target_of(inputs: Mapping[str, Any]) -> Target:
    """Return the target of a request's tool."""
    return Target(inputs["target_position"], inputs["target_rotation"], -1)


def judgement_of(inputs: Mapping[str, Any], q: FloatArray) -> PoseJudgement:
    """Return how far the tool is from its target at coordinates q, and these from their limits."""
    q = np.clip(q, -FARTHEST, FARTHEST)
    tolerances = {name: inputs[name] for name in ("tolerance", "tolerance_rotation")}
    return judge_pose(mechanism(inputs), q, target_of(inputs), **tolerances)


def urdf(inputs: Mapping[str, Any]) -> str:
    """Return a robot as URDF: links base, link_0 and so on, and the tool."""
    count = len(inputs["parents"])
    links = [f'<link name="{link}"/>' for link in ("base", *map(_link, range(count)), "tool")]
    joints = [_urdf_joint(inputs, j) for j in range(count)]
    origin = _urdf_origin(inputs["tool_position"], inputs["tool_rotation"])
    ends = f'<parent link="{_link(inputs["effector"])}"/><child link="tool"/>'
    joints.append(f'<joint name="to_tool" type="fixed">{origin}{ends}</joint>')
    return f'<robot name="robot">{"".join(links + joints)}</robot>'


def _link(j: int) -> str:
    return f"link_{j}" if j >= 0 else "base"


def _urdf_joint(inputs: Mapping[str, Any], j: int) -> str:
    kind = "prismatic" if inputs["slides"][j] else "revolute"
    lower, upper = (float(inputs[name][j]) for name in ("lower", "upper"))
    return (
        f'<joint name="joint_{j}" type="{kind}">'
        + _urdf_origin(inputs["origins"][j], inputs["orientations"][j])
        + f'<parent link="{_link(int(inputs["parents"][j]))}"/><child link="{_link(j)}"/>'
        + f'<axis xyz="{_numbers(inputs["axes"][j])}"/>'
        + f'<limit lower="{lower!r}" upper="{upper!r}" effort="100" velocity="10"/></joint>'
    )


def _urdf_origin(position: FloatArray, quaternion: FloatArray) -> str:
    angles = roll_pitch_yaw(rotation.to_matrix(quaternion))
    return f'<origin xyz="{_numbers(position)}" rpy="{_numbers(angles)}"/>'


def _numbers(vector: Iterable[float]) -> str:
    return " ".join(repr(float(x)) for x in vector)


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return robots of one joint to seven, each from starts at, near and far from the target."""
    rng = np.random.default_rng([_SEED, seed])
    return [
        case
        for name, robot in robots(rng).items()
        if suits(robot["parents"], greeting, robot["effector"])
        for number in range(3 if thorough else 1)
        for case in _cases_of(f"{name}, pose {number + 1}", robot, rng, greeting)
    ]


def _cases_of(
    name: str, robot: dict[str, Any], rng: np.random.Generator, greeting: Greeting
) -> Iterator[Case]:
    lower, upper = robot["lower"], robot["upper"]
    answer = lower + (upper - lower) * rng.uniform(0.2, 0.8, len(lower))
    close = np.clip(answer + rng.uniform(-NEAR, NEAR, len(lower)), lower, upper)
    anywhere = rng.uniform(lower, upper)
    reach = float(sum(np.linalg.norm(x) for x in (*robot["origins"], robot["tool_position"])))
    size = reach + float(np.abs(np.where(robot["slides"], upper - lower, 0.0)).sum())
    tool = tool_pose(robot, answer)
    unreachable = tool._replace(positions=np.array([0.6, 0.0, 0.8]) * 1.5 * size)
    tolerance = TOLERANCES[greeting.precision]
    starts = ((AT, robot, answer, tool), (CLOSE, robot, close, tool),
              (ANYWHERE, robot, anywhere, tool), (BEYOND, robot, anywhere, unreachable),
              *_distant_starts(robot, rng))  # fmt: skip
    for number, (family, arm, start, target) in enumerate(starts):
        inputs = {
            **arm,
            "start": start,
            "target_position": target.positions,
            "target_rotation": target.rotations,
            "tolerance": tolerance * max(size, 1.0),
            "tolerance_rotation": tolerance,
            "max_iterations": 1 if family == STEP else ITERATIONS,
            "urdf": urdf(arm),
        }
        about = sentence("A robot of {joints} joints.", joints=len(start))
        facts = {"size": size, "reachable": np.array([family != BEYOND])}
        again = number > 0 and starts[number - 1][0] == family
        yield Case(f"{name}, {family}{' again' * again}", TASK, inputs, family, about, facts=facts)


def _distant_starts(
    robot: dict[str, Any], rng: np.random.Generator
) -> Iterator[tuple[str, dict[str, Any], FloatArray, Pose]]:
    """Yield a family, a robot, a start and a target of a single iteration, and of a limit."""
    lower, upper, count = robot["lower"], robot["upper"], len(robot["axes"])
    distances = np.where(robot["slides"], 0.1 * DISTANCE, DISTANCE)
    for _ in range(2 if count >= REDUNDANT - 1 else 0):
        answer = lower + (upper - lower) * rng.uniform(0.3, 0.7, count)
        start = answer + distances * rng.uniform(-1.0, 1.0, count)
        yield STEP, robot, start, tool_pose(robot, answer)
    if count >= REDUNDANT:
        draws = (_draw_limited(robot, distances, rng) for _ in range(DRAWS))
        yield from islice((draw for draw in draws if draw is not None), 2)


def _draw_limited(
    robot: dict[str, Any], distances: FloatArray, rng: np.random.Generator
) -> tuple[str, dict[str, Any], FloatArray, Pose] | None:
    """Return a start, and limits that one joint would leave on its way to a target.

    The other joints can do without it: by Klein and Huang (1983), a step of least length of all
    joints has a share of the joint that is the diagonal entry of J^+ J.
    """
    lower, upper = robot["lower"], robot["upper"]
    start = lower + (upper - lower) * rng.uniform(0.3, 0.7, len(lower))
    target = tool_pose(robot, start + distances * rng.uniform(-1.0, 1.0, len(lower)))
    changes = solved(robot, start, target)[0] - start
    J = jacobian(mechanism(robot), start, -1)
    is_spare = (np.diag(np.linalg.pinv(J) @ J) < SHARE) & ~robot["slides"]
    joint = int(np.argmax(np.abs(changes) * is_spare))
    side = "upper" if changes[joint] > 0.0 else "lower"
    limits = robot[side].copy()
    limits[joint] = start[joint] + 0.3 * changes[joint]
    limited = {**robot, side: limits}
    results = [solved(limited, start, target, s) for s in ("levenberg_marquardt", DAMPED)]
    is_solvable = is_spare[joint] and all(is_reached for _, is_reached in results)
    return (AT_A_LIMIT, limited, start, target) if is_solvable else None


def solved(
    robot: Mapping[str, Any], start: FloatArray, tool: Pose, solver: str = "levenberg_marquardt"
) -> tuple[FloatArray, bool]:
    """Return the coordinates of a solver of the reference, and whether they reach the target."""
    solution = solve_ik(
        mechanism(robot), start, Target(*tool, -1), solver, restarts=0,
        tolerance=1e-9, tolerance_rotation=1e-9, max_iterations=ITERATIONS,
    )  # fmt: skip
    return solution.coordinates, bool(solution.outcome == Outcome.CONVERGED)


def timed_solve(inputs: Mapping[str, Any]) -> Callable[[], object]:
    """Return the call of the reference that answers a request, to be timed."""
    options = {name: inputs[name] for name in PRECISION}
    return partial(
        solve_ik, mechanism(inputs), inputs["start"], target_of(inputs), "levenberg_marquardt",
        restarts=0, **options,
    )  # fmt: skip


def robots(rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    """Return the robots of `robots.toml`, and three with random frames and axes, by name."""
    tabulated = {name: _robot(**entry) for name, entry in tomllib.loads(_TEXT).items()}
    return tabulated | {
        f"seven hinges in rotated frames {i}": _random_frames(rng) for i in range(1, 4)
    }


def _random_frames(rng: np.random.Generator) -> dict[str, Any]:
    """Return a robot with random frames and axes."""
    axes = rng.standard_normal((7, 3))
    return _robot(
        axes / np.linalg.norm(axes, axis=1, keepdims=True), 0.3 * rng.standard_normal((7, 3)),
        orientations=rotation.random(rng, 7), tool=[0.1, -0.1, 0.2],
        tool_rotation=rotation.random(rng),
    )  # fmt: skip


def _robot(
    axes: Any, origins: Any, slides: Any = None, *, parents: Any = None, orientations: Any = None,
    effector: int | None = None, tool: Any = (0.0, 0.0, 0.1),
    tool_rotation: Any = (1.0, 0.0, 0.0, 0.0),
) -> dict[str, Any]:  # fmt: skip
    count = len(axes)
    slides = np.zeros(count, dtype=bool) if slides is None else np.array(slides)
    return {
        "parents": np.array(np.arange(count) - 1 if parents is None else parents),
        "origins": np.array(origins, dtype=float),
        "orientations": np.array(
            rotation.identity(count) if orientations is None else orientations
        ),
        "axes": np.array(axes, dtype=float),
        "slides": slides,
        "lower": np.where(slides, -0.2, -2.2),
        "upper": np.where(slides, 0.3, 2.4),
        "effector": count - 1 if effector is None else effector,
        "tool_position": np.array(tool, dtype=float),
        "tool_rotation": np.array(tool_rotation, dtype=float),
    }
