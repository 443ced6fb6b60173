"""Families of cases, and their skeletons and poses: the lab's arm, random chains and trees.

Poses are moved ones: at rest, with all rotations the identity, most faults of forward kinematics
do not show. No two links are equally long, or a wrong link's length would not show.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import rotation, scenes
from plumbob.reference.arguments import FloatArray, IndexArray

from ..greeting import Greeting
from ..sentence import Sentence


class Family(NamedTuple):
    """Cases of a kind: what they try, how one is drawn, how many, and what is asked for."""

    name: str
    about: Sentence
    draw: Callable[[np.random.Generator], Any]
    copies: int = 1
    tolerance: float = 1e-4
    sweeps: int = 60


def drawn(families: Sequence[Family], seed: int, repeats: int) -> Iterator[tuple[str, Family, Any]]:
    """Yield the name of each case, its family and what is drawn for it."""
    for family in families:
        for i in range(family.copies * repeats):
            name = f"{family.name} {i + 1}"
            yield name, family, family.draw(generator(seed, name))


class Posed(NamedTuple):
    """A skeleton and its local rotations."""

    parents: IndexArray
    offsets: FloatArray
    local_rotations: FloatArray

    @property
    def size(self) -> float:
        """The largest coordinate that a joint can have [m]."""
        lengths = np.linalg.norm(self.offsets, axis=-1)
        return float(np.abs(self.offsets[0]).max() + lengths[1:].sum())


Make = Callable[[np.random.Generator], Posed]


def generator(seed: int, name: str) -> np.random.Generator:
    """Return the random numbers of a case, independent of those of all others."""
    return np.random.default_rng([seed, *name.encode()])


def chain(rng: np.random.Generator, joints: int, place: float = 1.0) -> Posed:
    """Return a chain with unequal links in a random pose, its root about `place` metres away."""
    offsets = _offsets(rng, joints, place)
    return Posed(np.arange(-1, joints - 1), offsets, rotation.random(rng, joints))


def tree(rng: np.random.Generator, joints: int) -> Posed:
    """Return a tree whose last joints have other parents than the joint before."""
    parents = np.arange(-1, joints - 1)
    for j in range(2, joints):
        if rng.uniform() < 0.5 or j == joints - 1:
            parents[j] = rng.integers(max(0, j - 4), j - 1)
    return Posed(parents, _offsets(rng, joints, 1.0), rotation.random(rng, joints))


def chains(joints: int, place: float = 1.0) -> Make:
    """Return how to draw chains of so many joints."""
    return lambda rng: chain(rng, joints, place)


def trees(joints: int) -> Make:
    """Return how to draw trees of so many joints."""
    return lambda rng: tree(rng, joints)


def arm() -> Posed:
    """Return the lab's arm at rest: straight down."""
    skeleton, local = scenes.lab_arm()
    return Posed(np.array(skeleton.parents), np.array(skeleton.offsets), np.array(local))


def moved_arm(rng: np.random.Generator, most: float = 1.2) -> Posed:
    """Return the lab's arm with every joint rotated by up to `most` [rad]."""
    posed = arm()
    v = rng.uniform(-most, most, (len(posed.parents), 3)) / np.sqrt(3.0)
    return posed._replace(local_rotations=rotation.exponential(v))


def quarter_turns(rng: np.random.Generator, joints: int) -> Posed:
    """Return a chain along the axes with rotations by a quarter about them."""
    offsets = np.zeros((joints, 3))
    offsets[np.arange(joints), rng.integers(0, 3, joints)] = rng.uniform(0.3, 1.5, joints)
    half = np.sqrt(0.5)
    local = np.zeros((joints, 4))
    local[:, 0] = half
    local[np.arange(joints), rng.integers(1, 4, joints)] = half * rng.choice([-1.0, 1.0], joints)
    return Posed(np.arange(-1, joints - 1), offsets, local)


def in_world(posed: Posed, Q: FloatArray, scale: float, shift: FloatArray) -> Posed:
    """Return the same pose in a rotated, scaled and shifted world."""
    offsets = scale * posed.offsets
    offsets[0] = scale * rotation.rotate(Q, posed.offsets[0]) + shift
    local = posed.local_rotations.copy()
    local[0] = rotation.multiply(Q, local[0])
    return Posed(posed.parents, offsets, local)


def suits(parents: IndexArray, greeting: Greeting) -> bool:
    """Return whether a solver takes joints with these parents."""
    joints = len(parents)
    is_chain = bool((parents == np.arange(-1, joints - 1)).all())
    return (is_chain or not greeting.chains_only) and joints <= (greeting.max_joints or joints)


def _offsets(rng: np.random.Generator, joints: int, place: float) -> FloatArray:
    offsets = rotation.rotate(rotation.random(rng, joints), [1.0, 0.0, 0.0])
    offsets *= rng.uniform(0.3, 1.2, (joints, 1))
    offsets[0] = place * rng.uniform(0.3, 1.0, 3) * rng.choice([-1.0, 1.0], 3)
    return offsets
