"""Named scenes: each function returns a model and its state at the start."""

from collections.abc import Sequence

import numpy as np

from . import rotation
from .arguments import FloatArray, IndexArray, integer, number
from .mass_spring import MassSpring, State
from .skeleton import Skeleton

# Steps along rows and columns from a particle of the cloth to those that springs join it to.
NEIGHBOURS = [(1, 0), (0, 1)]
NEXT_BUT_ONE = [(2, 0), (0, 2)]
DIAGONALS = [(1, 1), (1, -1)]


def lab_arm() -> tuple[Skeleton, FloatArray]:
    """Return the lab's arm, hanging straight down, and its rest pose of identity rotations (5, 4).

    Five joints at heights 1.7, 0.9, 0.5, 0.3 and -0.9: links of 0.8, 0.4, 0.2 and 1.2 m.
    """
    heights = np.array([1.7, 0.9, 0.5, 0.3, -0.9])
    offsets = np.zeros((5, 3))
    offsets[:, 1] = np.diff(heights, prepend=0.0)
    names = ["shoulder", "elbow", "wrist", "palm", "tip"]
    return Skeleton(np.arange(-1, 4), offsets, names), rotation.identity(5)


def ball_chain(*, links: int = 10, link_length: float = 0.1) -> tuple[Skeleton, FloatArray]:
    """Return a straight chain of equal links along x from the origin, and its rest pose.

    Args:
        links: how many, with a ball joint at the foot of each and the effector at the end.
        link_length: of each [m].

    Raises:
        ValueError: if links is not a positive integer or link_length not a positive number.
    """
    links = integer("links", links, least=1)
    offsets = np.zeros((links + 1, 3))
    offsets[1:, 0] = number("link_length", link_length, above=0.0)
    return Skeleton(np.arange(-1, links), offsets), rotation.identity(links + 1)


def lab_cloth(
    *,
    size: int = 11,
    side: float = 2.0,
    height: float = 1.5,
    mass: float = 1.0,
    stiffness: float = 100.0,
    damping: float = 0.0,
    gravity: float = 0.3,
) -> tuple[MassSpring, State]:
    """Return the lab's cloth at rest in a level square, the two corners at x = 0 pinned.

    Of size x size particles, number size i + j lies at x = side i / (size - 1), y = height and
    z = side (j / (size - 1) - 1/2). Springs join neighbours, next but one neighbours and the
    diagonals of each square; their rest lengths are their lengths at the start. The lab's own cloth
    has a damping of 0.2.

    Args:
        size: particles along each side, 2 or more.
        side: [m].
        height: [m].
        mass: of each particle [kg].
        stiffness: of each spring [N/m].
        damping: of each spring [N s/m].
        gravity: downwards [m/s²].

    Raises:
        ValueError: if the size is less than 2, the side not positive, or a number is negative or
            not finite.
    """
    integer("size", size, least=2)
    spacing = number("side", side, above=0) / (size - 1)
    i, j = np.divmod(np.arange(size * size), size)
    level = np.full(i.shape, number("height", height))
    positions = np.stack([spacing * i, level, spacing * j - side / 2], axis=1)
    springs = _grid_springs(size, size, [*NEIGHBOURS, *NEXT_BUT_ONE, *DIAGONALS])
    return _at_rest(positions, springs, mass, stiffness, damping, (0, size - 1), gravity)


def hanging_rope(
    *,
    particles: int = 11,
    length: float = 1.0,
    mass: float = 0.1,
    stiffness: float = 1000.0,
    damping: float = 0.0,
    gravity: float = 9.81,
) -> tuple[MassSpring, State]:
    """Return a rope that hangs straight down from a pin at the origin, not yet stretched.

    In equilibrium each spring carries what hangs below it: spring i, counted from the top, is
    longer than at rest by (particles - 1 - i) mass gravity / stiffness.

    Args:
        particles: 2 or more, the pinned one, number 0, included.
        length: at rest [m].
        mass: of each particle [kg].
        stiffness: of each spring [N/m].
        damping: of each spring [N s/m].
        gravity: downwards [m/s²].

    Raises:
        ValueError: if there are fewer than 2 particles, the length is not positive, or a number is
            negative or not finite.
    """
    integer("particles", particles, least=2)
    number("length", length, above=0)
    positions = np.zeros((particles, 3))
    positions[:, 1] = -np.linspace(0, length, particles)
    springs = _grid_springs(particles, 1, [(1, 0)])
    return _at_rest(positions, springs, mass, stiffness, damping, (0,), gravity)


def _grid_springs(rows: int, columns: int, steps: Sequence[tuple[int, int]]) -> IndexArray:
    """Return springs from each particle of a grid to the one each step leads to, (spring, 2)."""
    i, j = np.divmod(np.arange(rows * columns), columns)
    springs = []
    for down, right in steps:
        inside = (i + down < rows) & (j + right >= 0) & (j + right < columns)
        ends = np.flatnonzero(inside)
        springs.append(np.stack([ends, ends + columns * down + right], axis=1))
    return np.concatenate(springs)


def _at_rest(
    positions: FloatArray,
    springs: IndexArray,
    mass: float,
    stiffness: float,
    damping: float,
    pinned: Sequence[int],
    gravity: float,
) -> tuple[MassSpring, State]:
    """Return equal particles and springs at rest where they are."""
    system = MassSpring(
        masses=np.full(len(positions), number("mass", mass, above=0)),
        springs=springs,
        rest_lengths=np.linalg.norm(np.subtract(*positions[springs.T]), axis=1),
        stiffnesses=number("stiffness", stiffness, least=0),
        dampings=number("damping", damping, least=0),
        pinned=pinned,
        gravity=(0.0, -number("gravity", gravity), 0.0),
    )
    return system, State(positions, np.zeros_like(positions))
