"""Robots of joints with limits: as the reference's articulations and as URDF."""

import tomllib
from collections.abc import Iterable, Mapping
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
from plumbob.reference.judging import PoseJudgement
from plumbob.reference.rotation import roll_pitch_yaw
from plumbob.reference.skeleton import Pose
from plumbob.text.sentence import Sentence, sentence

from ..case import Case

Inputs = Mapping[str, Any]
ITERATIONS = 200
PRECISION = ("tolerance", "tolerance_rotation", "max_iterations")
TOLERANCES = {"double": 1e-5, "single": 1e-3}
# Robots of so many joints have a freedom to spare.
REDUNDANT = 7
# Angles of the robot of seven hinges, bent so that no singular value of its Jacobian is small.
BENT = np.array([0.3, -0.6, 0.2, 1.2, -0.3, 0.9, 0.4])
# Differences of poses leave so much of a Jacobian's entry unknown, relative to the robot's size:
# forward ones 1e-8 of a second derivative with the best step, with most steps ten times that.
DIFFERENCES = 1e-7
# Larger coordinates are clipped to this: the reference takes none beyond 1e75.
FARTHEST = 1e74
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
_TEXT = Path(__file__).with_name("robots.toml").read_text(encoding="utf-8")


def ancestors(inputs: Inputs) -> FloatArray:
    """Return 1 for the joints that move the tool, 0 for the others, (joint,)."""
    moves, j = np.zeros(len(inputs["parents"])), inputs["effector"]
    while j >= 0:
        moves[j], j = 1.0, inputs["parents"][j]
    return moves


def mechanism(inputs: Inputs) -> Articulation:
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


def tool_pose(inputs: Inputs, q: FloatArray) -> Pose:
    """Return the tool's position [m], (..., 3), and rotation, (..., 4), at coordinates q."""
    return tool_at(mechanism(inputs), q)


def tool_at(robot: Articulation, q: FloatArray) -> Pose:
    """Return the same of a `mechanism`."""
    pose = forward_kinematics(robot, q)
    return Pose(pose.positions[..., -1, :], pose.rotations[..., -1, :])


def twists_between(start: Pose, end: Pose) -> FloatArray:
    """Return displacements [m] and rotation vectors [rad] from poses to others, (..., 6)."""
    turns = rotation.multiply(end.rotations, rotation.conjugate(start.rotations))
    shifts = end.positions - start.positions
    return np.concatenate([shifts, rotation.logarithm(turns)], axis=-1)


def target_of(inputs: Inputs) -> Target:
    """Return the target of a request's tool."""
    return Target(inputs["target_position"], inputs["target_rotation"], -1)


def judgement_of(inputs: Inputs, q: FloatArray) -> PoseJudgement:
    """Return how far the tool is from its target at coordinates q, and these from their limits."""
    q = np.clip(q, -FARTHEST, FARTHEST)
    tolerances = {name: inputs[name] for name in ("tolerance", "tolerance_rotation")}
    return judge_pose(mechanism(inputs), q, target_of(inputs), **tolerances)


def size_of(robot: Inputs) -> float:
    """Return the sum of a robot's lengths, slides at their longest [m]."""
    lower, upper = robot["lower"], robot["upper"]
    slides = np.max([upper - lower, np.abs(lower), np.abs(upper)], axis=0)
    reach = sum(np.linalg.norm(x) for x in (*robot["origins"], robot["tool_position"]))
    return float(reach + robot["slides"] @ slides)


def urdf(inputs: Inputs) -> str:
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


def _urdf_joint(inputs: Inputs, j: int) -> str:
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


def solved(
    robot: Inputs, start: FloatArray, tool: Pose, solver: str = "levenberg_marquardt"
) -> tuple[FloatArray, bool]:
    """Return the coordinates of a solver of the reference, and whether they reach the target."""
    solution = solve_ik(
        mechanism(robot), start, Target(*tool, -1), solver, restarts=0,
        tolerance=1e-9, tolerance_rotation=1e-9, max_iterations=ITERATIONS,
    )  # fmt: skip
    return solution.coordinates, bool(solution.outcome == Outcome.CONVERGED)


def robot_case(
    name: str, task: str, family: str, robot: Inputs, options: Mapping[str, Any],
    facts: Mapping[str, Any], about: Sentence | None = None,
) -> Case:  # fmt: skip
    """Return a request about a robot, whose URDF has the limits of the options."""
    inputs = {**robot, **options}
    inputs["urdf"] = urdf(inputs)
    words = sentence("A robot of {joints} joints.", joints=len(robot["axes"]))
    return Case(name, task, inputs, family, about or words, facts=facts)


def any_pose(name: str, task: str, family: str, robot: Inputs, options: Inputs) -> Case:
    """Return a request about a robot at coordinates q among the options."""
    facts = {"size": max(size_of(robot), 1.0)}
    return robot_case(name, task, family, robot, options, facts)


def robots(rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    """Return the robots of `robots.toml` by name, two with random frames among them."""
    return {
        name: _robot(_random_frames(rng) if entry.get("random") else entry)
        for name, entry in tomllib.loads(_TEXT).items()
    }


def _random_frames(rng: np.random.Generator) -> dict[str, Any]:
    """Return an entry with random frames and axes."""
    axes = rng.standard_normal((7, 3))
    return {
        "axes": axes / np.linalg.norm(axes, axis=1, keepdims=True),
        "origins": 0.3 * rng.standard_normal((7, 3)),
        "orientations": rotation.random(rng, 7),
        "tool_position": [0.1, -0.1, 0.2],
        "tool_rotation": rotation.random(rng),
    }


def _robot(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return the robot of an entry: what the entry lacks is the usual."""
    count = len(entry["axes"])
    slides = np.array(entry.get("slides", np.zeros(count, dtype=bool)))
    usual = {
        "parents": np.arange(count) - 1,
        "origins": np.zeros((count, 3)),
        "orientations": rotation.identity(count),
        "axes": np.zeros((count, 3)),
        "slides": slides,
        "lower": np.where(slides, -0.2, -2.2),
        "upper": np.where(slides, 0.3, 2.4),
        "tool_position": np.array([0.0, 0.0, 0.1]),
        "tool_rotation": IDENTITY,
    }
    robot = {name: np.array(entry.get(name, v), dtype=v.dtype) for name, v in usual.items()}
    return {**robot, "effector": entry.get("effector", count - 1)}
