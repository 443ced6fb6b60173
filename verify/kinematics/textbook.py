"""CCD and FABRIK as textbooks have them, with the choices of honest programs.

The solvers keep the local rotations of the whole skeleton, not the reference's chain of global
rotations. All joints are placed anew after each rotation, like in a student's program. In CCD, d is
the world rotation of a joint, R its global and Q its local rotation, P its parent's global one.
"""

import math
from typing import Any, NamedTuple

from plumbob.reference.arguments import FloatArray, IndexArray
from plumbob.reference.backend.compiled import Kernel
from plumbob.reference.kinematics import forward_pose
from plumbob.reference.quaternion import (
    IDENTITY,
    add,
    between,
    conjugate,
    load_quaternion,
    load_vector,
    logarithm,
    magnitude,
    multiply,
    norm,
    normalised,
    rotate,
    rotation_about,
    scale,
    store_quaternion,
    store_vector,
    subtract,
)

UNCAPPED = 10.0  # an angle that no rotation has [rad]


class Method(NamedTuple):
    """The kernels of a solver: a sweep, and what makes rotations of positions."""

    sweep: Any
    finish: Any


class Choices(NamedTuple):
    """The choices of honest programs; the defaults are the textbook's."""

    root_first: bool = False  # CCD rotates the root first and the effector's parent last
    gain: float = 1.0  # by which CCD multiplies its angles
    cap: float = UNCAPPED  # the largest of these angles [rad]
    sweep_of_a_joint: bool = False  # CCD counts each rotation as a sweep
    more_sweeps: int = 0  # beyond the number allowed


class TextbookChain(NamedTuple):
    """A skeleton, and the joints from its root to the effector, both included."""

    parents: IndexArray
    offsets: FloatArray
    path: IndexArray


class TextbookPose(NamedTuple):
    """Local rotations, and the global positions and rotations of all joints."""

    local: FloatArray
    positions: FloatArray
    rotations: FloatArray


class Ending(NamedTuple):
    """When a solve ends: at a distance [m], or after so many sweeps."""

    tolerance: float
    sweeps: int


def place(chain: TextbookChain, pose: TextbookPose) -> None:
    """Fill positions and global rotations of all joints."""
    forward_pose(chain.parents, chain.offsets, pose.local, pose.positions, pose.rotations)


def solve(
    method: Method,
    chain: TextbookChain,
    target: Any,
    ending: Ending,
    choices: Choices,
    pose: TextbookPose,
) -> int:
    """Solve in place, `pose` from the start to the result, and return the number of sweeps."""
    place(chain, pose)
    i = 0
    while i < ending.sweeps + choices.more_sweeps:
        effector = load_vector(pose.positions, chain.path[-1])
        if norm(subtract(effector, target)) <= ending.tolerance:
            break
        method.sweep(chain, target, i, choices, pose)
        i += 1
    if i > 0:
        method.finish(chain, pose, pose.positions.copy())
    return i


def sweep_ccd(
    chain: TextbookChain, target: Any, i: int, choices: Choices, pose: TextbookPose
) -> None:
    """Rotate each joint from the effector's parent to the root; or only the i-th of these."""
    links = len(chain.path) - 1
    if choices.sweep_of_a_joint:
        rotate_joint(chain, links - 1 - i % links, target, choices, pose)
        return
    for link in range(links):
        k = link if choices.root_first else links - 1 - link
        rotate_joint(chain, k, target, choices, pose)


def rotate_joint(
    chain: TextbookChain, k: int, target: Any, choices: Choices, pose: TextbookPose
) -> None:
    """Rotate joint k of the path so that the effector comes nearest to the target."""
    j = chain.path[k]
    joint = load_vector(pose.positions, j)
    arm = subtract(load_vector(pose.positions, chain.path[-1]), joint)
    d = damped(between(arm, subtract(target, joint)), choices)
    apply_rotation(chain, j, d, pose)
    place(chain, pose)


def damped(d: Any, choices: Choices) -> Any:
    """Return a rotation with its angle multiplied by the gain, and no larger than the cap."""
    if choices.gain == 1.0 and choices.cap >= UNCAPPED:
        return d
    v = logarithm(d)
    angle = norm(v)
    if angle == 0.0:
        return d
    return rotation_about(scale(1.0 / angle, v), min(choices.gain * angle, choices.cap))


def apply_rotation(chain: TextbookChain, j: int, d: Any, pose: TextbookPose) -> None:
    """Give a joint the world rotation d: Q becomes P* d P Q, made unit."""
    p = chain.parents[j]
    P = load_quaternion(pose.rotations, p) if p >= 0 else IDENTITY
    Q = multiply(multiply(multiply(conjugate(P), d), P), load_quaternion(pose.local, j))
    length = magnitude(Q)
    store_quaternion(pose.local, j, normalised(Q) if 0.0 < length < math.inf else Q)


def leave(chain: TextbookChain, pose: TextbookPose, points: FloatArray) -> None:
    """Leave a pose of CCD as it is."""


def sweep_fabrik(
    chain: TextbookChain, target: Any, i: int, choices: Choices, pose: TextbookPose
) -> None:
    """Pull the joints to the target, then back to the root."""
    x, last = pose.positions, len(chain.path) - 1
    root = load_vector(x, chain.path[0])
    store_vector(x, chain.path[last], target)
    for k in range(last - 1, -1, -1):
        pull(chain, k, chain.path[k], chain.path[k + 1], x)
    store_vector(x, chain.path[0], root)
    for k in range(last):
        pull(chain, k, chain.path[k + 1], chain.path[k], x)


def pull(chain: TextbookChain, k: int, moved: int, fixed: int, x: FloatArray) -> None:
    """Move a joint of link k on the line to the other joint, to the link's length."""
    start = load_vector(x, fixed)
    direction = subtract(load_vector(x, moved), start)
    distance = norm(direction)
    if distance > 0.0:
        store_vector(x, moved, add(start, scale(link_length(chain, k) / distance, direction)))


def link_length(chain: TextbookChain, k: int) -> float:
    """Return the length of link k, from joint k of the path to the next."""
    return norm(load_vector(chain.offsets, chain.path[k + 1]))


def follow(chain: TextbookChain, pose: TextbookPose, points: FloatArray) -> None:
    """Rotate each joint of the path to its link's new direction; the path keeps its positions."""
    for k in range(len(chain.path) - 1):
        place(chain, pose)
        j, child = chain.path[k], chain.path[k + 1]
        link = rotate(load_quaternion(pose.rotations, j), load_vector(chain.offsets, child))
        end = subtract(load_vector(points, child), load_vector(points, j))
        apply_rotation(chain, j, between(link, end), pose)
    place(chain, pose)
    for j in chain.path:
        store_vector(pose.positions, j, load_vector(points, j))


SOLVERS = {
    "ccd": Kernel(solve, constants=(Method(sweep_ccd, leave),), label="CCD of the textbook"),
    "fabrik": Kernel(
        solve, constants=(Method(sweep_fabrik, follow),), label="FABRIK of the textbook"
    ),
}
