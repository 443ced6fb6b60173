"""Robots of joints with limits: as the reference's articulations and as URDF."""

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import reduce
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

from ..judgement import CaseJudgement, Verdict

Inputs = Mapping[str, Any]
ITERATIONS = 200
PRECISION = ("tolerance", "tolerance_rotation", "max_iterations")
TOLERANCES = {"double": 1e-5, "single": 1e-3}
# Robots of so many joints have a freedom to spare.
REDUNDANT = 7
# Angles of the robot of seven hinges, bent so that no singular value of its Jacobian is small.
BENT = np.array([0.3, -0.6, 0.2, 1.2, -0.3, 0.9, 0.4])
# Larger coordinates are clipped to this: the reference takes none beyond 1e75.
FARTHEST = 1e74
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
_TEXT = Path(__file__).with_name("robots.toml").read_text(encoding="utf-8")


# What some robots have and others lack.
FEATURES: Sequence[tuple[Sentence, Callable[[Inputs], Any]]] = (
    (sentence("slides"), lambda robot: robot["slides"].any()),
    (sentence("coordinates beyond pi"),
     lambda robot: (robot["lower"] > np.pi).any() or (robot["upper"] < -np.pi).any()),
    (sentence("negative numbers in axes"), lambda robot: (robot["axes"] < 0.0).any()),
    (sentence("axes along none of x, y and z"),
     lambda robot: (np.abs(robot["axes"]).max(axis=-1) < 1.0).any()),
    (sentence("rotated frames (orientations)"),
     lambda robot: (robot["orientations"] != IDENTITY).any()),
    (sentence("a rotated tool (tool_rotation)"),
     lambda robot: (robot["tool_rotation"] != IDENTITY).any()),
    (sentence("branches, or an effector that is not the last joint"),
     lambda robot: not ancestors(robot).all()),
    (sentence("fewer than six joints"), lambda robot: len(robot["axes"]) < REDUNDANT - 1),
    (sentence("more joints than the tool has freedoms"),
     lambda robot: len(robot["axes"]) >= REDUNDANT),
)  # fmt: skip
# A feature tells something if so many of the robots that have it get wrong answers.
MIN_WRONG, WRONG_SHARE = 2, 0.25


def feature_of(judgements: Sequence[CaseJudgement]) -> tuple[Sentence, ...]:
    """Return what all robots with wrong answers have, and no robot without, () if nothing."""
    is_wrong = np.array([judgement.verdict >= Verdict.WRONG for judgement in judgements])
    shares: dict[float, list[Sentence]] = {}
    for feature, has_feature in FEATURES if is_wrong.sum() >= MIN_WRONG else ():
        is_marked = np.array([bool(has_feature(judgement.case.inputs)) for judgement in judgements])
        if is_marked.any() and not is_marked.all() and not is_wrong[~is_marked].any():
            shares.setdefault(float(is_wrong[is_marked].mean()), []).append(feature)
    if max(shares, default=0.0) < WRONG_SHARE:
        return ()
    features = reduce(
        lambda one, other: sentence("{one} or {other}", one=one, other=other), shares[max(shares)]
    )
    words = sentence(
        "All wrong answers are for robots with {feature}; for those without all are right.",
        feature=features,
    )
    return (words,)


def ancestors(inputs: Inputs) -> FloatArray:
    """Return 1 for the joints that move the tool, 0 for the others, (joint,)."""
    moves, j = np.zeros(len(inputs["parents"])), inputs["effector"]
    while j >= 0:
        moves[j], j = 1.0, inputs["parents"][j]
    return moves


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


def size_of(robot: Mapping[str, Any]) -> float:
    """Return the sum of a robot's lengths, slides at their longest [m]."""
    lower, upper = robot["lower"], robot["upper"]
    slides = np.max([upper - lower, np.abs(lower), np.abs(upper)], axis=0)
    reach = sum(np.linalg.norm(x) for x in (*robot["origins"], robot["tool_position"]))
    return float(reach + robot["slides"] @ slides)


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


def solved(
    robot: Mapping[str, Any], start: FloatArray, tool: Pose, solver: str = "levenberg_marquardt"
) -> tuple[FloatArray, bool]:
    """Return the coordinates of a solver of the reference, and whether they reach the target."""
    solution = solve_ik(
        mechanism(robot), start, Target(*tool, -1), solver, restarts=0,
        tolerance=1e-9, tolerance_rotation=1e-9, max_iterations=ITERATIONS,
    )  # fmt: skip
    return solution.coordinates, bool(solution.outcome == Outcome.CONVERGED)


def robots(rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    """Return the robots of `robots.toml` by name, two with random frames among them."""
    table = tomllib.loads(_TEXT)
    last = table.pop("last")  # so that the random numbers of the other robots do not depend on them
    limits = {name: _limits(entry) for name, entry in last.items()}
    return {
        **{name: _robot(**entry) for name, entry in table.items()},
        **{f"seven hinges in rotated frames {i}": _random_frames(rng) for i in range(1, 3)},
        **{name: _robot(**entry) | limits[name] for name, entry in last.items()},
    }


def _limits(entry: dict[str, Any]) -> dict[str, FloatArray]:
    """Take the limits out of an entry of `robots.toml`, {} if it has the usual ones."""
    return {name: np.array(entry.pop(name)) for name in ("lower", "upper") if name in entry}


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
