"""Cloth from a triangle mesh: a spring along every edge, and a bending spring across it."""

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import FloatArray, IndexArray, array, boolean, indices, number
from ..mass_spring import MassSpring, State
from .grids import at_rest

LARGEST_EDGE_DEGREE = 16  # triangles; k of them need k (k - 1) / 2 bending springs


def cloth_from_mesh(
    vertices: ArrayLike,
    triangles: ArrayLike,
    *,
    density: float | None = None,
    mass: float | None = None,
    stiffness: float = 100.0,
    bending_stiffness: float = 0.0,
    damping: float = 0.0,
    tension_only: bool = False,
    pinned: ArrayLike = (),
    gravity: float = 9.81,
) -> tuple[MassSpring, State]:
    """Return the mesh as a cloth at rest: a particle at each vertex, a spring along each edge.

    A bending spring joins each pair of vertices opposite to a shared edge, unless an edge joins the
    pair already. The springs along edges may go slack. Pass the mass of each particle, or the
    density of the cloth [kg/m²]: the corners of a triangle then share its mass equally. The
    vertices are positions [m], (particle, 3), the triangles indices of vertices, (triangle, 3), in
    either orientation. Other arguments and errors are as for `grid_cloth`, without pins by default.

    Raises:
        ValueError: unless exactly one of density and mass is a number. Also if a triangle repeats a
            vertex or another triangle, more than 16 triangles meet at an edge, or a free vertex has
            no mass because its triangles have no area.
    """
    x = array("vertices", vertices, "particle", 3)
    corners = _triangles(triangles, len(x))
    bending = number("bending_stiffness", bending_stiffness, minimum=0)
    edges, across = mesh_springs(corners, len(x), bending > 0)
    stiffnesses = [number("stiffness", stiffness, minimum=0), bending]
    slack = boolean("tension_only", tension_only)
    return at_rest(
        x,
        np.concatenate([edges, across]),
        masses=_masses(x, corners, density, mass),
        stiffnesses=np.repeat(stiffnesses, [len(edges), len(across)]),
        damping=damping,
        pinned=pinned,
        gravity=gravity,
        tension_only=np.repeat([slack, False], [len(edges), len(across)]),
    )


def mesh_springs(
    triangles: IndexArray, vertex_count: int, bending: bool
) -> tuple[IndexArray, IndexArray]:
    """Return the edges of the triangles and the pairs across them, distinct, both (spring, 2)."""
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    keys = _keys(sides, vertex_count)
    edges = _distinct(keys)
    pairs = np.empty(0, dtype=np.int64)
    if bending:
        order = np.argsort(keys, kind="stable")
        facing = np.concatenate([triangles[:, 2], triangles[:, 0], triangles[:, 1]])[order]
        pairs = _distinct(_keys(_facing_pairs(keys[order], facing), vertex_count))
        pairs = np.setdiff1d(pairs, edges, assume_unique=True)
    return _ends(edges, vertex_count), _ends(pairs, vertex_count)


def _facing_pairs(keys: IndexArray, facing: IndexArray) -> IndexArray:
    """Return all pairs of vertices opposite to the same edge, (pair, 2); the keys are sorted."""
    pairs = [np.empty((0, 2), dtype=np.int64)]
    for offset in range(1, LARGEST_EDGE_DEGREE + 1):
        same = np.flatnonzero(keys[offset:] == keys[:-offset])
        if len(same) == 0:
            return np.concatenate(pairs)
        pairs.append(np.stack([facing[same], facing[same + offset]], axis=1))
    raise ValueError(f"triangles: expected at most {LARGEST_EDGE_DEGREE} at an edge, got more")


def _keys(ends: IndexArray, vertex_count: int) -> IndexArray:
    """Return a number for each pair, independent of the order in the pair."""
    return ends.min(axis=1) * vertex_count + ends.max(axis=1)


def _distinct(keys: IndexArray) -> IndexArray:
    """Return the distinct keys in ascending order, much faster than `np.unique`."""
    ordered = np.sort(keys)
    return ordered[np.diff(ordered, prepend=-1) > 0]


def _ends(keys: IndexArray, vertex_count: int) -> IndexArray:
    return np.stack(np.divmod(keys, vertex_count), axis=1)


def _triangles(triangles: ArrayLike, vertex_count: int) -> IndexArray:
    corners = indices("triangles", triangles, "triangle", 3, minimum=0, below=vertex_count)
    a, b, c = corners.T
    flat = np.flatnonzero((a == b) | (b == c) | (c == a))
    if len(flat):
        got = f"{corners[flat[0]].tolist()} at index {flat[0]}"
        raise ValueError(f"triangles: expected three different vertices, got {got}")
    rows = np.sort(corners, axis=1)
    order = np.lexsort(rows.T)
    repeated = np.flatnonzero((rows[order[1:]] == rows[order[:-1]]).all(axis=1))
    if len(repeated):
        i, j = order[repeated[0] : repeated[0] + 2]
        raise ValueError(f"triangles: expected each once, got the same at indices {i}, {j}")
    return corners


def _masses(
    x: FloatArray, triangles: IndexArray, density: float | None, mass: float | None
) -> FloatArray:
    if (density is None) == (mass is None):
        raise ValueError("density, mass: expected one of the two, got both or neither")
    if density is None:
        return np.full(len(x), number("mass", mass, above=0))
    a, b, c = x[triangles.T]
    share = number("density", density, above=0) / 6 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    masses = np.zeros(len(x))
    np.add.at(masses, triangles, share[:, None])
    return masses
