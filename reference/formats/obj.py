"""Wavefront OBJ: the vertices and faces of a file as a triangle mesh.

Texture coordinates, normals, lines, groups, materials and free-form surfaces are ignored.
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

# Statements of the format other than vertices and faces.
IGNORED = {
    "vt", "vn", "vp", "p", "l", "cstype", "deg", "bmat", "step", "curv", "curv2", "surf",
    "parm", "trim", "hole", "scrv", "sp", "end", "con", "g", "s", "mg", "o", "bevel",
    "c_interp", "d_interp", "lod", "usemtl", "mtllib", "usemap", "maplib", "shadow_obj",
    "trace_obj", "ctech", "stech",
}  # fmt: skip

# v, v/vt, v//vn or v/vt/vn, with a limit on the digits of an index.
CORNER = re.compile(r"(-?[0-9]{1,15})(?:/(?:-?[0-9]{1,15})?(?:/(?:-?[0-9]{1,15})?)?)?")
NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")


class Mesh(NamedTuple):
    """A triangle mesh."""

    vertices: FloatArray  # [m], shape (vertex, 3)
    triangles: IndexArray  # indices of vertices, shape (triangle, 3)


def read_obj(path: str | os.PathLike[str]) -> Mesh:
    """Return the mesh in an OBJ file of at most 256 MiB; errors are as for `parse_obj`."""
    return parse_obj(read_text(path), name=str(path))


def parse_obj(text: str, *, name: str = "text") -> Mesh:
    """Return the mesh described by an OBJ text, with its vertices in their order.

    Polygons become fans of triangles about their first corner. A weight or colour after the third
    coordinate of a vertex is ignored. A backslash at the end of a line, before any comment,
    continues the line. Positive indices may refer to later vertices; negative indices count back
    from the last vertex so far. Raise a ValueError if a statement is not of the format, a
    coordinate is not a finite number, or there are no faces. The same goes for a face with fewer
    than three corners, a repeated vertex or an unknown vertex. Errors name the text and the line.
    """
    arguments.text("text", text)
    arguments.text("name", name)
    vertices: list[float] = []
    triangles: list[int] = []
    highest = -1, 0  # the highest vertex index of a face, and its line
    for line, words in _statements(text):
        try:
            if words[0] == "v":
                if len(words) < 4:
                    raise ValueError(f"expected three coordinates, got {len(words) - 1}")
                vertices += map(_coordinate, words[1:4])
            elif words[0] == "f":
                corners = _face(words[1:], len(vertices) // 3)
                fan = itertools.pairwise(corners[1:])
                triangles += [corner for side in fan for corner in (corners[0], *side)]
                highest = max(highest, (max(corners), line))
            elif words[0] not in IGNORED:
                raise ValueError(f"expected a statement of the format, got {words[0]!r:.40}")
        except ValueError as error:
            raise ValueError(f"{name}, line {line}: {error}") from None
    return _mesh(name, vertices, triangles, *highest)


def _statements(text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the first line number and the words of each statement."""
    words: list[str] = []
    start = 1
    for number, line in enumerate(text.split("\n"), 1):
        code = line.partition("#")[0].rstrip()
        continues = code.endswith("\\")
        start = start if words else number
        words += code.removesuffix("\\").split() if continues else code.split()
        if words and not continues:
            yield start, words
            words = []
    if words:
        yield start, words


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


def _mesh(name: str, vertices: list[float], triangles: list[int], highest: int, line: int) -> Mesh:
    if not triangles:
        raise ValueError(f"{name}: expected faces, got none")
    if highest >= len(vertices) // 3:
        got = f"{highest + 1} of {len(vertices) // 3}"
        raise ValueError(f"{name}, line {line}: expected a vertex of the file, got {got}")
    return Mesh(
        frozen(np.array(vertices).reshape(-1, 3)),
        frozen(np.array(triangles, dtype=np.int64).reshape(-1, 3)),
    )
