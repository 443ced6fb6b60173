"""Families of cases, and their skeletons and poses: the lab's arm, random chains and trees.

No pose is at rest: with all rotations the identity most faults of forward kinematics do not show.
No two links are equally long: otherwise a wrong link's length would not show.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import rotation, scenes
from plumbob.reference.arguments import FloatArray, IndexArray

from ..greeting import Greeting
from ..sentence import Sentence


class CaseFamily(NamedTuple):
    """Cases of a kind, drawn at random."""

    name: str
    about: Sentence
    draw: Callable[[np.random.Generator], Any]
    copies: int = 1
    tolerance: float = 1e-4
    sweeps: int = 60


class PosedSkeleton(NamedTuple):
    """A skeleton and its local rotations."""

    parents: IndexArray
    offsets: FloatArray
    local_rotations: FloatArray


DrawSkeleton = Callable[[np.random.Generator], PosedSkeleton]


def drawn(
    families: Sequence[CaseFamily], seed: int, repeats: int
) -> Iterator[tuple[str, CaseFamily, Any]]:
    """Yield the name of each case, its family and its random problem."""
    for family in families:
        for i in range(family.copies * repeats):
            name = f"{family.name} {i + 1}"
            yield name, family, family.draw(generator(seed, name))


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


def chains(joints: int, distance: float = 1.0) -> DrawSkeleton:
    """Return a function that draws chains."""
    return lambda rng: chain(rng, joints, distance)


def trees(joints: int) -> DrawSkeleton:
    """Return a function that draws trees."""
    return lambda rng: tree(rng, joints)


def arm() -> PosedSkeleton:
    """Return the lab's arm at rest: straight down."""
    skeleton, local = scenes.lab_arm()
    return PosedSkeleton(np.array(skeleton.parents), np.array(skeleton.offsets), np.array(local))


def moved_arm(rng: np.random.Generator) -> PosedSkeleton:
    """Return the lab's arm with every joint rotated by up to 1.2 rad."""
    skeleton = arm()
    v = rng.uniform(-1.2, 1.2, (len(skeleton.parents), 3)) / np.sqrt(3.0)
    return skeleton._replace(local_rotations=rotation.exponential(v))


def quarter_turns(rng: np.random.Generator, joints: int) -> PosedSkeleton:
    """Return a chain along the axes with rotations by a right angle about them."""
    offsets = np.zeros((joints, 3))
    offsets[np.arange(joints), rng.integers(0, 3, joints)] = rng.uniform(0.3, 1.5, joints)
    half = np.sqrt(0.5)
    local = np.zeros((joints, 4))
    local[:, 0] = half
    local[np.arange(joints), rng.integers(1, 4, joints)] = half * rng.choice([-1.0, 1.0], joints)
    return PosedSkeleton(np.arange(-1, joints - 1), offsets, local)


def suits(parents: IndexArray, greeting: Greeting) -> bool:
    """Return whether a solver takes joints with these parents."""
    joints = len(parents)
    is_chain = bool((parents == np.arange(-1, joints - 1)).all())
    return (is_chain or not greeting.chains_only) and joints <= (greeting.max_joints or joints)
