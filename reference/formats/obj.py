"""Wavefront OBJ: the vertices and faces of a file as a triangle mesh.

Vertices (`v`) and faces (`f`) count; texture coordinates, normals, lines, groups, materials and
free forms are read over.
"""

import itertools
import math
import os
import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .. import arguments
from ..arguments import FloatArray, IndexArray, frozen
from .source import read_text

# Statements of the format that say nothing about vertices and faces.
READ_OVER = {
    "vt", "vn", "vp", "p", "l", "cstype", "deg", "bmat", "step", "curv", "curv2", "surf",
    "parm", "trim", "hole", "scrv", "sp", "end", "con", "g", "s", "mg", "o", "bevel",
    "c_interp", "d_interp", "lod", "usemtl", "mtllib", "usemap", "maplib", "shadow_obj",
    "trace_obj", "ctech", "stech",
}  # fmt: skip

# v, v/vt, v//vn or v/vt/vn. More digits than these are no index of anything.
CORNER = re.compile(r"(-?[0-9]{1,15})(?:/(?:-?[0-9]{1,15})?(?:/(?:-?[0-9]{1,15})?)?)?")
NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")


class Mesh(NamedTuple):
    """A triangle mesh.

    Attributes:
        vertices: [m], shape (vertex, 3).
        triangles: indices of vertices, shape (triangle, 3).
    """

    vertices: FloatArray
    triangles: IndexArray


def read_obj(path: str | os.PathLike[str]) -> Mesh:
    """Return the mesh in an OBJ file of at most 256 MiB.

    Raises:
        ValueError: naming the file, if it cannot be read as text, or as `parse_obj` says.
    """
    return parse_obj(read_text(path), name=str(path))


def parse_obj(text: str, *, name: str = "text") -> Mesh:
    """Return the mesh that an OBJ text describes, with its vertices in their order.

    Polygons become fans of triangles about their first corner. What follows the third coordinate
    of a vertex, a weight or a colour, is read over. A backslash at the end of a line, before any
    comment, continues it. Faces may name vertices that come later, by positive indices;
    negative ones count back from the last vertex so far.

    Raises:
        ValueError: naming the text and the line, if a statement is none of the format, a
            coordinate is no finite number, a face has fewer than three corners, names a vertex
            twice or one that does not exist, or there is no face at all.
    """
    arguments.text("text", text)
    arguments.text("name", name)
    vertices: list[float] = []
    triangles: list[int] = []
    furthest = -1, 0  # the highest vertex that a face names, and the line that does
    for line, words in _statements(text):
        try:
            if words[0] == "v":
                vertices += _vertex(words[1:])
            elif words[0] == "f":
                corners = _face(words[1:], len(vertices) // 3)
                triangles += _fan(corners)
                furthest = max(furthest, (max(corners), line))
            elif words[0] not in READ_OVER:
                raise ValueError(f"expected a statement of the format, got {words[0]!r:.40}")
        except ValueError as error:
            raise ValueError(f"{name}, line {line}: {error}") from None
    return _mesh(name, vertices, triangles, *furthest)


def _statements(text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the words of each statement and the line that it starts on."""
    begun: list[str] = []
    start = 1
    for line, written in enumerate(text.split("\n"), 1):
        said = written.partition("#")[0].rstrip()
        continues = said.endswith("\\")
        start = start if begun else line
        begun += said.removesuffix("\\").split() if continues else said.split()
        if begun and not continues:
            yield start, begun
            begun = []
    if begun:
        yield start, begun


def _vertex(words: list[str]) -> list[float]:
    if len(words) < 3:
        raise ValueError(f"expected three coordinates, got {len(words)}")
    return [_coordinate(word) for word in words[:3]]


def _coordinate(word: str) -> float:
    value = float(word) if NUMBER.fullmatch(word) else math.nan
    if not math.isfinite(value):
        raise ValueError(f"expected a finite number, got {word!r:.40}")
    return value


def _face(words: list[str], vertex_count: int) -> list[int]:
    """Return the vertices of a face, counted from 0."""
    corners = [_corner(word, vertex_count) for word in words]
    if len(corners) < 3:
        raise ValueError(f"expected a face of three corners or more, got {len(corners)}")
    if len(set(corners)) < len(corners):
        raise ValueError("expected a face of different vertices, got one twice")
    return corners


def _corner(word: str, vertex_count: int) -> int:
    match = CORNER.fullmatch(word)
    if match is None:
        raise ValueError(f"expected v, v/vt, v//vn or v/vt/vn, got {word!r:.40}")
    index = int(match[1])
    if index > 0:
        return index - 1
    if index == 0 or index < -vertex_count:
        raise ValueError(f"expected 1 or more, or -{vertex_count} to -1, got {index}")
    return vertex_count + index


def _fan(corners: list[int]) -> list[int]:
    """Return the corners of the triangles of a polygon, three by three."""
    return [
        corner
        for one, other in itertools.pairwise(corners[1:])
        for corner in (corners[0], one, other)
    ]


def _mesh(name: str, vertices: list[float], triangles: list[int], furthest: int, line: int) -> Mesh:
    if not triangles:
        raise ValueError(f"{name}: expected faces, got none")
    if furthest >= len(vertices) // 3:
        got = f"{furthest + 1} of {len(vertices) // 3}"
        raise ValueError(f"{name}, line {line}: expected a vertex of the file, got {got}")
    return Mesh(
        frozen(np.array(vertices).reshape(-1, 3)),
        frozen(np.array(triangles, dtype=np.int64).reshape(-1, 3)),
    )
