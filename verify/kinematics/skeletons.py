"""Families of cases, from `cases.toml`, and their skeletons in random poses.

No pose is at rest: with all rotations the identity most faults of forward kinematics do not show.
No two links are equally long: otherwise a wrong link's length would not show.
"""

import functools
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics, rotation, scenes
from plumbob.reference.arguments import FloatArray, IndexArray
from plumbob.text.sentence import Sentence

from ..case import Requirement
from ..greeting import Greeting

FILE = Path(__file__).with_name("cases.toml")
# Projects onto the plane z = 0.
IN_PLANE = np.array([1.0, 1.0, 0.0])


class PosedSkeleton(NamedTuple):
    """A skeleton and its local rotations."""

    parents: IndexArray
    offsets: FloatArray
    local_rotations: FloatArray


class CaseFamily(NamedTuple):
    """An entry of `cases.toml`."""

    name: str
    about: Sentence
    skeleton: list[Any]  # a key of SKELETONS, and its arguments
    target: list[Any]  # the kind of a target or a curve, and its arguments
    copies: int
    tolerance: float  # [m]
    sweeps: int
    requirement: Requirement
    planar: bool = False  # whether all is projected onto the plane z = 0

    def pose(self, rng: np.random.Generator) -> PosedSkeleton:
        """Return a random skeleton of the family in a random pose."""
        name, *arguments = self.skeleton
        skeleton = SKELETONS[name](rng, *arguments)
        return in_plane(skeleton) if self.planar else skeleton


Problem = TypeVar("Problem")
Draw = Callable[[CaseFamily, np.random.Generator], Problem]


def drawn(
    task: str, draw: Draw[Problem], seed: int, repeats: int, planar: bool = False
) -> tuple[tuple[str, CaseFamily, Problem], ...]:
    """Return the name of each case of a task, its family and its random problem."""
    return _drawn(task, draw, seed, repeats, planar)


@functools.lru_cache(maxsize=16)  # the tasks of a seed, whose methods are asked the same
def _drawn(task: str, draw: Draw[Any], seed: int, repeats: int, planar: bool) -> Any:
    cases = []
    for name, entry in tomllib.loads(FILE.read_text(encoding="utf-8"))[task].items():
        target = entry.get("target") or entry.get("curve", [])
        family = CaseFamily(
            name, Sentence(entry["about"], {}), entry["skeleton"], target, entry.get("copies", 1),
            entry.get("tolerance", 1e-4), entry.get("sweeps", 60),
            entry.get("requirement", "must"), planar,
        )  # fmt: skip
        names = [f"{name} {i + 1}" for i in range(family.copies * repeats)]
        cases += [(case, family, draw(family, generator(seed, case))) for case in names]
    return tuple(cases)


def generator(seed: int, name: str) -> np.random.Generator:
    """Return the random numbers of a case, independent of those of all other cases."""
    return np.random.default_rng([seed, *name.encode()])


def extent(offsets: FloatArray) -> float:
    """Return the largest coordinate that a joint can have [m]."""
    return float(np.abs(offsets[0]).max() + np.linalg.norm(offsets[1:], axis=-1).sum())


def chain(rng: np.random.Generator, joints: int, distance: float = 1.0) -> PosedSkeleton:
    """Return a chain in a random pose, its root about `distance` from the origin [m]."""
    offsets = _offsets(rng, joints, distance)
    return PosedSkeleton(np.arange(-1, joints - 1), offsets, rotation.random(rng, joints))


def tree(rng: np.random.Generator, joints: int) -> PosedSkeleton:
    """Return a tree in a random pose, its last joint on a branch."""
    parents = np.arange(-1, joints - 1)
    for j in range(2, joints):
        if rng.uniform() < 0.5 or j == joints - 1:
            parents[j] = rng.integers(max(0, j - 4), j - 1)
    return PosedSkeleton(parents, _offsets(rng, joints, 1.0), rotation.random(rng, joints))


def _offsets(rng: np.random.Generator, joints: int, distance: float) -> FloatArray:
    offsets = rotation.rotate(rotation.random(rng, joints), [1.0, 0.0, 0.0])
    offsets *= rng.uniform(0.3, 1.2, (joints, 1))
    offsets[0] = distance * rng.uniform(0.3, 1.0, 3) * rng.choice([-1.0, 1.0], 3)
    return offsets


def links(rng: np.random.Generator, *lengths: float) -> PosedSkeleton:
    """Return a chain of links of given lengths [m] in a random pose."""
    skeleton = chain(rng, len(lengths) + 1)
    offsets = skeleton.offsets[1:]
    offsets *= np.array(lengths)[:, None] / np.linalg.norm(offsets, axis=-1, keepdims=True)
    return skeleton


def arm(rng: np.random.Generator, angle: float = 1.2) -> PosedSkeleton:
    """Return the lab's arm with every joint rotated by up to an angle [rad]."""
    skeleton, local = scenes.lab_arm()
    if angle:
        local = rotation.exponential(rng.uniform(-angle, angle, (len(local), 3)) / np.sqrt(3.0))
    return PosedSkeleton(np.array(skeleton.parents), np.array(skeleton.offsets), np.array(local))


def straight(rng: np.random.Generator) -> PosedSkeleton:
    """Return a straight chain along x, its root at the origin."""
    offsets = np.array([[0.0, 0.0, 0.0], [0.8, 0.0, 0.0], [0.6, 0.0, 0.0], [0.5, 0.0, 0.0]])
    return PosedSkeleton(np.arange(-1, 3), offsets, rotation.identity(4))


def quarter_turns(rng: np.random.Generator, joints: int) -> PosedSkeleton:
    """Return a chain along the axes with rotations by a right angle about them."""
    offsets = np.zeros((joints, 3))
    offsets[np.arange(joints), rng.integers(0, 3, joints)] = rng.uniform(0.3, 1.5, joints)
    half = np.sqrt(0.5)
    local = np.zeros((joints, 4))
    local[:, 0] = half
    local[np.arange(joints), rng.integers(1, 4, joints)] = half * rng.choice([-1.0, 1.0], joints)
    return PosedSkeleton(np.arange(-1, joints - 1), offsets, local)


def half_turns(rng: np.random.Generator) -> PosedSkeleton:
    """Return a chain with rotations by pi."""
    skeleton = chain(rng, 4)
    local = rotation.random(rng, 4)
    local[:, 0] = 0.0
    return skeleton._replace(local_rotations=local / np.linalg.norm(local, axis=-1, keepdims=True))


def negative_w(rng: np.random.Generator) -> PosedSkeleton:
    """Return a chain whose quaternions have a negative w."""
    skeleton = chain(rng, 4)
    local = skeleton.local_rotations
    return skeleton._replace(local_rotations=local * np.where(local[:, :1] > 0.0, -1.0, 1.0))


def slight_rotations(rng: np.random.Generator) -> PosedSkeleton:
    """Return a chain with rotations of a milliradian."""
    skeleton = chain(rng, 5)
    v = 1e-3 * rng.uniform(-1.0, 1.0, (5, 3))
    return skeleton._replace(local_rotations=rotation.exponential(v))


def link_of_no_length(rng: np.random.Generator, joint: int = 2) -> PosedSkeleton:
    """Return a chain with an offset of zero."""
    skeleton = chain(rng, 4)
    skeleton.offsets[joint] = 0.0
    return skeleton


def staircase(rng: np.random.Generator) -> PosedSkeleton:
    """Return a chain along the axes whose positions no solver rounds."""
    offsets = np.array([
        [0.5, -0.25, 0.75], [0.75, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.625], [0.875, 0.0, 0.0],
    ])  # fmt: skip
    return PosedSkeleton(np.arange(-1, 4), offsets, rotation.identity(5))


def right_angle(rng: np.random.Generator) -> PosedSkeleton:
    """Return an elbow with links of 3 and 4."""
    offsets = np.array([[0.5, -0.2, 0.3], [0.0, 3.0, 0.0], [4.0, 0.0, 0.0]])
    v = 0.4 * rng.uniform(-1.0, 1.0, (3, 3))
    return PosedSkeleton(np.arange(-1, 2), offsets, rotation.exponential(v))


def partly_rotated(rng: np.random.Generator, joints: int, unrotated: int) -> PosedSkeleton:
    """Return a chain in a random pose with a joint that is not rotated."""
    skeleton = chain(rng, joints)
    skeleton.local_rotations[unrotated] = rotation.identity()
    return skeleton


def leaves_at_three_depths(rng: np.random.Generator) -> PosedSkeleton:
    """Return a tree in a random pose with leaves one, two and three links below the root."""
    return chain(rng, 6)._replace(parents=np.array([-1, 0, 0, 2, 3, 2]))


SKELETONS: dict[str, Callable[..., PosedSkeleton]] = {
    "chain": chain,
    "tree": tree,
    "three branches": lambda rng: tree(rng, 5)._replace(parents=np.array([-1, 0, 0, 0, 1])),
    "links": links,
    "arm": arm,
    "arm at rest": lambda rng: arm(rng, 0.0),
    "quarter turns": quarter_turns,
    "half turns": half_turns,
    "negative w": negative_w,
    "slight rotations": slight_rotations,
    "link of no length": link_of_no_length,
    "right angle": right_angle,
    "partly rotated": partly_rotated,
    "leaves at three depths": leaves_at_three_depths,
    "staircase": staircase,
    "straight": straight,
}


def in_plane(skeleton: PosedSkeleton) -> PosedSkeleton:
    """Return a skeleton turned into the plane z = 0, its links as long, its root projected."""
    offsets, local = onto_plane(skeleton.offsets), skeleton.local_rotations * [1.0, 0.0, 0.0, 1.0]
    offsets[0] = skeleton.offsets[0] * IN_PLANE
    norms = np.linalg.norm(local, axis=-1, keepdims=True)
    local = np.where(norms > 0.0, local / np.maximum(norms, 1e-300), rotation.identity())
    return skeleton._replace(offsets=offsets, local_rotations=local)


def onto_plane(vectors: FloatArray) -> FloatArray:
    """Return vectors turned into the plane z = 0, as long as before."""
    shadows = vectors * IN_PLANE
    lengths, widths = (np.linalg.norm(x, axis=-1, keepdims=True) for x in (vectors, shadows))
    return np.asarray(shadows * (lengths / np.maximum(widths, 1e-300)))


def without_rotations(skeleton: PosedSkeleton) -> PosedSkeleton:
    """Return a skeleton whose joints have the same positions without any rotation."""
    joints = Skeleton(skeleton.parents, skeleton.offsets)
    x = forward_kinematics(joints, skeleton.local_rotations).positions
    offsets = x.copy()
    offsets[1:] -= x[skeleton.parents[1:]]
    return skeleton._replace(offsets=offsets, local_rotations=rotation.identity(len(x)))


def suits(parents: IndexArray, greeting: Greeting, effector: int | None = None) -> bool:
    """Return whether a solver takes joints with these parents, and this effector."""
    joints = len(parents)
    is_chain = bool((parents == np.arange(-1, joints - 1)).all())
    is_last = effector in (None, joints - 1) or greeting.effector == "any"
    is_small = joints <= (greeting.max_joints or joints)
    return (is_chain or not greeting.chains_only) and is_small and is_last
