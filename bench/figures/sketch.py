"""Figures as data, drawn only when their data or the drawing code has changed.

A digest of both is written into the files of a figure; files with the same digest are kept.
"""

import hashlib
import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from plumbob.process.paths import check_regular

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# Drawings kept in memory.
_CACHE_SIZE = 64
_MARK = "plumbob figure"
# No drawing of ours contains these: a file from elsewhere brings no script into the page.
_FOREIGN = re.compile(r"<(script|foreignObject)|\son\w+=|href=\"(?!#|data:image/png)")


class Drawing(NamedTuple):
    """A figure: the stem of its files, its title and caption, and its content."""

    name: str
    title: str
    shows: str
    svg: str
    pdf: bytes = b""


@dataclass(frozen=True, eq=False)
class Sketch:
    """A figure before it is drawn."""

    name: str  # the stem of its files
    title: str  # heading
    shows: str  # a sentence on its contents
    data: Any  # of the figure: arrays, words, numbers, and tuples of such
    draw: Callable[[Any], "Figure"]  # returns the figure of the data; imports matplotlib only then

    def digest(self) -> str:
        """Return a cache key of the data and the drawing code."""
        digest = hashlib.blake2b(digest_size=12)
        for source in (inspect.getsourcefile(self.draw), *_SOURCES):
            digest.update(Path(str(source)).read_bytes())
        _update(digest, (self.name, self.title, self.data))
        return digest.hexdigest()


# The code and the style of all drawings.
_SOURCES = sorted(Path(__file__).parent.glob("*.*"))
_cache: dict[str, tuple[str, bytes]] = {}


def drawn(sketch: Sketch, folder: Path | None = None) -> Drawing:
    """Return a sketch drawn, or its files in a folder with the same digest."""
    digest = sketch.digest()
    files = _cache.get(digest) or _read(sketch.name, folder, digest) or _draw(sketch, digest)
    if len(_cache) == _CACHE_SIZE:
        _cache.pop(next(iter(_cache)))
    _cache[digest] = files
    return Drawing(sketch.name, sketch.title, sketch.shows, *files)


def _read(name: str, folder: Path | None, digest: str) -> tuple[str, bytes] | None:
    """Return SVG and PDF of the files in a folder, None for another digest."""
    if folder is None:
        return None
    try:
        for suffix in ("svg", "pdf"):
            check_regular(folder / f"{name}.{suffix}")
        svg = (folder / f"{name}.svg").read_text(encoding="utf-8")
        pdf = (folder / f"{name}.pdf").read_bytes()
    except (OSError, ValueError):
        return None
    mark = f"{_MARK} {digest}"
    is_same = mark in svg[-200:] and mark.encode() in pdf and not _FOREIGN.search(svg)
    return (svg, pdf) if is_same else None


def _draw(sketch: Sketch, digest: str) -> tuple[str, bytes]:
    """Return SVG and PDF of a sketch."""
    from .canvas import pdf_of, styled, svg_of

    mark = f"{_MARK} {digest}"
    with styled():
        figure = sketch.draw(sketch.data)
        return svg_of(figure, sketch.title, mark), pdf_of(figure, sketch.title, mark)


def _update(digest: Any, value: Any) -> None:
    """Add a value to a digest: arrays by their bytes, containers by their parts."""
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype}{value.shape}".encode() + value.tobytes())
    elif isinstance(value, tuple | list | frozenset):
        digest.update(f"({len(value)}".encode())
        for part in sorted(value) if isinstance(value, frozenset) else value:
            _update(digest, part)
    elif isinstance(value, Mapping):
        _update(digest, list(value.items()))
    elif is_dataclass(value):
        _update(digest, [getattr(value, field.name) for field in fields(value)])
    else:
        digest.update(f"{type(value).__name__}:{value!r};".encode())
