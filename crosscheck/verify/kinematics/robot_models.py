"""Robots of joints with limits: their kinematics from the formulas, as URDF, and as cases."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray

from ..case import Case
from ..greeting import Greeting
from ..sentence import sentence

TASK = "robot_inverse_kinematics"
ITERATIONS = 200
TOLERANCES = {"double": 1e-5, "single": 1e-3}
# Where a start is so near to an answer, joint by joint, no minimum but the target's is nearer.
NEAR = 0.1
# Starts at the answer, near it, anywhere; targets that nothing reaches.
AT, CLOSE, ANYWHERE, BEYOND = "start at the target", "near start", "any start", "beyond reach"
_SEED = 1955


class Pose(NamedTuple):
    """Where a tool is: a position [m] and a unit quaternion, w first."""

    position: FloatArray
    rotation: FloatArray


class Reading(NamedTuple):
    """How a solver reads a request; what a faulty one does otherwise is False or another number.

    Attributes:
        scale: of hinges' coordinates, in radians.
        relative: whether coordinates count from the start.
        tool: whether there is a tool.
        orientations: whether frames are rotated in their parents.
        own_axes: whether axes are in the joint's own frame rather than in its parent's.
    """

    scale: float = 1.0
    relative: bool = False
    tool: bool = True
    orientations: bool = True
    own_axes: bool = True


RIGHT = Reading()


def tool_pose(inputs: Mapping[str, Any], q: FloatArray, reading: Reading = RIGHT) -> Pose:
    """Return where the tool is at coordinates q, each joint's frame placed in its parent's."""
    if reading.relative:
        q = inputs["start"] + q
    poses: list[Pose] = []
    for j in range(len(q)):
        parent = int(inputs["parents"][j])
        below = poses[parent] if parent >= 0 else Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
        poses.append(_moved(below, inputs, j, float(q[j]), reading))
    carrier = poses[int(inputs["effector"])]
    if not reading.tool:
        return carrier
    return _placed(carrier, inputs["tool_position"], inputs["tool_rotation"])


def _moved(below: Pose, inputs: Mapping[str, Any], j: int, q: float, reading: Reading) -> Pose:
    orientation = inputs["orientations"][j] if reading.orientations else np.array([1.0, 0, 0, 0])
    axis = inputs["axes"][j]
    if inputs["slides"][j]:
        motion, by = axis * q, np.array([1.0, 0.0, 0.0, 0.0])
    else:
        half = 0.5 * q * reading.scale
        motion, by = np.zeros(3), np.array([math.cos(half), *(math.sin(half) * axis)])
    if reading.own_axes:
        return _placed(_placed(below, inputs["origins"][j], orientation), motion, by)
    moved = _placed(_placed(below, inputs["origins"][j]), motion, by)
    return _placed(moved, np.zeros(3), orientation)


def _placed(below: Pose, position: FloatArray, by: FloatArray | None = None) -> Pose:
    x = below.position + rotation.rotate(below.rotation, position)
    return Pose(x, below.rotation if by is None else rotation.multiply(below.rotation, by))


def apart(pose: Pose, inputs: Mapping[str, Any]) -> tuple[float, float]:
    """Return a tool's distance [m] and angle [rad] from its target."""
    target = inputs["target_rotation"]
    distance = float(np.linalg.norm(pose.position - inputs["target_position"]))
    chord = min(np.linalg.norm(pose.rotation - target), np.linalg.norm(pose.rotation + target))
    return distance, 4.0 * math.asin(min(0.5 * float(chord), 1.0))


def urdf(inputs: Mapping[str, Any]) -> str:
    """Return a robot as URDF: links base, link_0 and so on, and the tool."""
    links = ["base", *(f"link_{j}" for j in range(len(inputs["parents"]))), "tool"]
    joints = [_urdf_joint(inputs, j) for j in range(len(inputs["parents"]))]
    placed = _urdf_origin(inputs["tool_position"], inputs["tool_rotation"])
    ends = f'<parent link="link_{inputs["effector"]}"/><child link="tool"/>'
    joints.append(f'<joint name="to_tool" type="fixed">{placed}{ends}</joint>')
    named = "".join(f'<link name="{link}"/>' for link in links)
    return f'<robot name="robot">{named}{"".join(joints)}</robot>'


def _urdf_joint(inputs: Mapping[str, Any], j: int) -> str:
    parent = int(inputs["parents"][j])
    kind = "prismatic" if inputs["slides"][j] else "revolute"
    lower, upper = (float(inputs[name][j]) for name in ("lower", "upper"))
    return (
        f'<joint name="joint_{j}" type="{kind}">'
        + _urdf_origin(inputs["origins"][j], inputs["orientations"][j])
        + f'<parent link="{f"link_{parent}" if parent >= 0 else "base"}"/>'
        + f'<child link="link_{j}"/><axis xyz="{_numbers(inputs["axes"][j])}"/>'
        + f'<limit lower="{lower!r}" upper="{upper!r}" effort="100" velocity="10"/></joint>'
    )


def _urdf_origin(position: FloatArray, quaternion: FloatArray) -> str:
    """Return an origin; roll, pitch and yaw rotate about x, then y, then z, all fixed axes."""
    R = rotation.to_matrix(quaternion)
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    angles = (math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0]))
    return f'<origin xyz="{_numbers(position)}" rpy="{_numbers(np.array(angles))}"/>'


def _numbers(values: FloatArray) -> str:
    return " ".join(repr(float(x)) for x in values)


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return robots of one joint to seven, each from starts at, near and far from the target."""
    rng = np.random.default_rng([_SEED, seed])
    found = []
    for name, robot in _robots(rng).items():
        joints = len(robot["parents"])
        if greeting.max_joints is not None and joints > greeting.max_joints:
            continue
        if greeting.chains_only and (robot["parents"] != np.arange(joints) - 1).any():
            continue
        for number in range(3 if thorough else 1):
            found += list(_of_robot(f"{name}, pose {number + 1}", robot, rng, greeting))
    return found


def _of_robot(
    name: str, robot: dict[str, Any], rng: np.random.Generator, greeting: Greeting
) -> Iterator[Case]:
    lower, upper = robot["lower"], robot["upper"]
    answer = lower + (upper - lower) * rng.uniform(0.2, 0.8, len(lower))
    close = np.clip(answer + rng.uniform(-NEAR, NEAR, len(lower)), lower, upper)
    anywhere = rng.uniform(lower, upper)
    reach = float(sum(np.linalg.norm(x) for x in (*robot["origins"], robot["tool_position"])))
    size = reach + float(np.abs(np.where(robot["slides"], upper - lower, 0.0)).sum())
    for family, start in ((AT, answer), (CLOSE, close), (ANYWHERE, anywhere)):
        yield _case(name, family, robot, start, tool_pose(robot, answer), size, greeting)
    far = Pose(np.array([0.6, 0.0, 0.8]) * 1.5 * size, tool_pose(robot, answer).rotation)
    yield _case(name, BEYOND, robot, anywhere, far, size, greeting)


def _case(
    name: str, family: str, robot: dict[str, Any], start: FloatArray, target: Pose, size: float,
    greeting: Greeting,
) -> Case:  # fmt: skip
    tolerance = TOLERANCES[greeting.precision]
    inputs = {
        **robot,
        "start": start,
        "target_position": target.position,
        "target_rotation": target.rotation,
        "tolerance": tolerance * max(size, 1.0),
        "tolerance_rotation": tolerance,
        "max_iterations": ITERATIONS,
        "urdf": urdf(robot),
    }
    about = sentence("A robot of {joints} joints.", joints=len(start))
    return Case(f"{name}, {family}", TASK, inputs, family, about, facts={"size": size})


def _robots(rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    z, y = [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]
    arm = [[0, 0, 0.3], [0, 0.1, 0], [0, 0, 0.4], [0, 0, 0.4], [0, 0.1, 0], [0, 0, 0.1]]
    taller = [[0, 0, height] for height in (0.34, 0.2, 0.2, 0.2, 0.2, 0.2, 0.1)]
    scara = [[0, 0, 0.4], [0.4, 0, 0], [0.3, 0, 0], [0, 0, -0.1]]
    slide = np.array([False, False, True, False])
    return {
        "one hinge": _robot([z], [[0, 0, 0.2]], tool=[0.5, 0, 0]),
        "two hinges": _robot([z, z], [[0, 0, 0.1], [0.6, 0, 0]], tool=[0.4, 0, 0]),
        "a slide": _robot([z, z, z, z], scara, slide),
        "a branch": _robot([z, y, y, y], [[0, 0, 0.2], [0, 0, 0.3], [0, 0.2, 0], [0.4, 0, 0]],
                           parents=[-1, 0, 0, 1], tool=[0.2, 0, 0.1]),
        "six hinges": _robot([z, y, y, y, z, y], arm, tool=[0, 0.05, 0.1]),
        "seven hinges": _robot([z, y, z, y, z, y, z], taller, tool=[0, 0, 0.1]),
        **{f"seven hinges in rotated frames {i}": _anyhow(rng) for i in range(1, 4)},
    }  # fmt: skip


def _anyhow(rng: np.random.Generator) -> dict[str, Any]:
    """Return a robot whose frames and axes point anywhere."""
    axes = rng.standard_normal((7, 3))
    return _robot(
        axes / np.linalg.norm(axes, axis=1, keepdims=True), 0.3 * rng.standard_normal((7, 3)),
        orientations=rotation.random(rng, 7), tool=[0.1, -0.1, 0.2],
        tool_rotation=rotation.random(rng),
    )  # fmt: skip


def _robot(
    axes: Any, origins: Any, slides: Any = None, *, parents: Any = None, orientations: Any = None,
    tool: Any = (0.0, 0.0, 0.1), tool_rotation: Any = (1.0, 0.0, 0.0, 0.0),
) -> dict[str, Any]:  # fmt: skip
    count = len(axes)
    slides = np.zeros(count, dtype=bool) if slides is None else slides
    still = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    return {
        "parents": np.array(np.arange(count) - 1 if parents is None else parents),
        "origins": np.array(origins, dtype=float),
        "orientations": still if orientations is None else orientations,
        "axes": np.array(axes, dtype=float),
        "slides": slides,
        "lower": np.where(slides, -0.2, -2.2),
        "upper": np.where(slides, 0.3, 2.4),
        "effector": count - 1,
        "tool_position": np.array(tool, dtype=float),
        "tool_rotation": np.array(tool_rotation, dtype=float),
    }
