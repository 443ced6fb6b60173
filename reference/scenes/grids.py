"""Ropes, cloths, nets and lattices: particles on regular grids.

Scenes share these arguments: the spacing of neighbours [m]; the mass of each particle [kg];
stiffness [N/m] and damping [N s/m] of each spring; gravity downwards [m/s²]; tension_only, whether
springs go slack. A scene raises a ValueError if a count is too small, a length or mass not
positive, or an index out of range. The same goes for a number that is negative or not finite.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import FloatArray, IndexArray, boolean, count, number, sequence
from ..mass_spring import MassSpring, State, lengths

# Offsets in rows and columns from a particle of the cloth to its neighbours by springs.
NEIGHBOURS = [(1, 0), (0, 1)]
NEXT_BUT_ONE = [(2, 0), (0, 2)]
DIAGONALS = [(1, 1), (1, -1)]

# The edges of the six tetrahedra around a diagonal of a cube. All cubes have the same, so
# neighbouring cubes share the diagonals of their faces (Freudenthal 1942).
TETRAHEDRA = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1), (1, 1, 1)]


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
    """Return the lab's cloth: a square `grid_cloth`, the two corners at x = 0 pinned.

    `size` particles, 2 or more, along each side [m]. The lab's own cloth has a damping of 0.2.
    """
    size = count("size", size, minimum=2)
    count("size", size * size, minimum=1)
    return grid_cloth(
        size,
        size,
        spacing=number("side", side, above=0) / (size - 1),
        height=height,
        mass=mass,
        stiffness=stiffness,
        damping=damping,
        gravity=gravity,
    )


def grid_cloth(
    rows: int = 11,
    columns: int = 11,
    *,
    spacing: float = 0.2,
    height: float = 1.5,
    mass: float = 1.0,
    stiffness: float = 100.0,
    shear_stiffness: float | None = None,
    bending_stiffness: float | None = None,
    damping: float = 0.0,
    tension_only: bool = False,
    pinned: ArrayLike | None = None,
    gravity: float = 9.81,
) -> tuple[MassSpring, State]:
    """Return a rectangular cloth at rest in a horizontal plane.

    Particle number columns i + j lies at x = spacing i, y = height and
    z = spacing (j - (columns - 1) / 2). Springs join neighbours, then particles two apart
    (bending), then the diagonals of each square (shear).

    Args:
        rows: particles along x, 1 or more.
        columns: particles along z, 1 or more.
        spacing: between neighbours [m].
        height: [m].
        mass: of each particle [kg].
        stiffness: of the springs between neighbours [N/m].
        shear_stiffness: of the diagonals; 0 leaves the diagonals out, None means the stiffness.
        bending_stiffness: of the springs between particles two apart; as for shear.
        damping: of each spring [N s/m].
        tension_only: whether the springs go slack.
        pinned: particles; by default the two corners at x = 0.
        gravity: downwards [m/s²].
    """
    rows, columns = _shape(rows, columns)
    stiffness = number("stiffness", stiffness, minimum=0)
    bending = stiffness if bending_stiffness is None else bending_stiffness
    shear = stiffness if shear_stiffness is None else shear_stiffness
    parts = [
        (NEIGHBOURS, stiffness),
        (NEXT_BUT_ONE, number("bending_stiffness", bending, minimum=0)),
        (DIAGONALS, number("shear_stiffness", shear, minimum=0)),
    ]
    springs_of = [
        (steps, stiffness) for steps, stiffness in parts if stiffness > 0 or steps is NEIGHBOURS
    ]
    springs = [_springs((rows, columns), steps) for steps, _ in springs_of]
    spacing, positions = number("spacing", spacing, above=0), np.empty((rows, columns, 3))
    positions[..., 0] = spacing * np.arange(rows)[:, None]
    positions[..., 1] = number("height", height)
    positions[..., 2] = spacing * (np.arange(columns) - (columns - 1) / 2)
    return at_rest(
        positions.reshape(-1, 3),
        np.concatenate(springs),
        masses=np.full(rows * columns, number("mass", mass, above=0)),
        stiffnesses=np.repeat(
            [stiffness for _, stiffness in springs_of], [len(ends) for ends in springs]
        ),
        damping=damping,
        pinned=[0, columns - 1] if pinned is None else pinned,
        gravity=gravity,
        tension_only=boolean("tension_only", tension_only),
    )


def grid_triangles(rows: int, columns: int) -> IndexArray:
    """Return the triangles of a `grid_cloth`, two per square, facing up, (triangle, 3)."""
    rows, columns = _shape(rows, columns)
    corner = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def net(
    rows: int = 11,
    columns: int = 11,
    *,
    spacing: float = 0.2,
    height: float = 1.5,
    mass: float = 0.05,
    stiffness: float = 1000.0,
    damping: float = 0.0,
    gravity: float = 9.81,
) -> tuple[MassSpring, State]:
    """Return a net of ropes: a `grid_cloth` without shear and bending, its corners pinned."""
    rows, columns = _shape(rows, columns)
    particles = rows * columns
    return grid_cloth(
        rows,
        columns,
        spacing=spacing,
        height=height,
        mass=mass,
        stiffness=stiffness,
        shear_stiffness=0.0,
        bending_stiffness=0.0,
        damping=damping,
        tension_only=True,
        pinned=[0, columns - 1, particles - columns, particles - 1],
        gravity=gravity,
    )


def lattice(
    counts: Sequence[int] = (9, 3, 3),
    *,
    spacing: float = 0.1,
    mass: float = 0.05,
    stiffness: float = 1000.0,
    damping: float = 0.0,
    gravity: float = 9.81,
) -> tuple[MassSpring, State]:
    """Return a block of tetrahedra with springs along their edges, clamped at its face x = 0.

    There are `counts` particles along x, y and z, 1 or more each. The grid is cubic and starts at
    the origin, numbered with z fastest and x slowest; each cube consists of six tetrahedra around
    its diagonal.
    """
    along = sequence("counts", counts, 3, "an axis")
    nx, ny, nz = (count("counts", number_of, minimum=1) for number_of in along)
    count("counts", nx * ny * nz, minimum=1)
    cells = np.indices((nx, ny, nz)).reshape(3, -1).T.astype(np.float64)
    return at_rest(
        number("spacing", spacing, above=0) * cells,
        _springs((nx, ny, nz), TETRAHEDRA),
        masses=np.full(nx * ny * nz, number("mass", mass, above=0)),
        stiffnesses=number("stiffness", stiffness, minimum=0),
        damping=damping,
        pinned=np.arange(ny * nz),
        gravity=gravity,
    )


def hanging_rope(
    *,
    particles: int = 11,
    length: float = 1.0,
    mass: float = 0.1,
    stiffness: float = 1000.0,
    damping: float = 0.0,
    gravity: float = 9.81,
    tension_only: bool = False,
) -> tuple[MassSpring, State]:
    """Return an unstretched rope of a length [m], hanging vertically from a pin at the origin.

    The rope has 2 or more particles, number 0 pinned. In equilibrium spring i, counted from the
    top, carries the particles below: its stretch is (particles - 1 - i) mass gravity / stiffness.
    """
    particles = count("particles", particles, minimum=2)
    positions = np.zeros((particles, 3))
    positions[:, 1] = -np.linspace(0, number("length", length, above=0), particles)
    return at_rest(
        positions,
        _springs((particles, 1), [(1, 0)]),
        masses=np.full(particles, number("mass", mass, above=0)),
        stiffnesses=number("stiffness", stiffness, minimum=0),
        damping=damping,
        pinned=[0],
        gravity=gravity,
        tension_only=boolean("tension_only", tension_only),
    )


def at_rest(
    positions: FloatArray,
    springs: IndexArray,
    *,
    masses: FloatArray,
    stiffnesses: ArrayLike,
    damping: float,
    pinned: ArrayLike,
    gravity: float,
    tension_only: ArrayLike = False,
) -> tuple[MassSpring, State]:
    """Return a system whose rest lengths equal the lengths of its springs exactly."""
    system = MassSpring(
        masses=masses,
        springs=springs,
        rest_lengths=0.0,
        stiffnesses=stiffnesses,
        dampings=number("damping", damping, minimum=0),
        pinned=pinned,
        gravity=(0.0, -number("gravity", gravity), 0.0),
        tension_only=tension_only,
    )
    state = State(positions, np.zeros_like(positions))
    return system.replaced(rest_lengths=lengths(system, positions)), state


def _shape(rows: int, columns: int) -> tuple[int, int]:
    """Return the checked numbers of rows and columns, and their product."""
    rows, columns = count("rows", rows, minimum=1), count("columns", columns, minimum=1)
    count("rows, columns", rows * columns, minimum=1)
    return rows, columns


def _springs(counts: tuple[int, ...], steps: Sequence[tuple[int, ...]]) -> IndexArray:
    """Return springs from each particle of a grid to the particles at each offset, (spring, 2)."""
    grid, springs = np.arange(np.prod(counts)).reshape(counts), []
    for step in steps:
        starts = tuple(slice(max(-s, 0), n - max(s, 0)) for s, n in zip(step, counts, strict=True))
        ends = tuple(slice(max(s, 0), n - max(-s, 0)) for s, n in zip(step, counts, strict=True))
        springs.append(np.stack([grid[starts].ravel(), grid[ends].ravel()], axis=1))
    return np.concatenate(springs)
