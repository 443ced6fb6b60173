"""Figures and pictures, drawn only when what they show has changed.

A figure is data first: a `Sketch` knows what it shows and how it is drawn. The digest of that
stands in the files that were drawn, and files with the same digest serve again.
"""

import hashlib
import inspect
import re
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..harness.record import check_regular

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .chart import Chart

# Drawings that are kept for as long as the process lives.
_KEPT = 64
_DIGEST = "plumbob figure"
# What no drawing of ours has: a file from elsewhere brings no script and no address into the page.
_FOREIGN = re.compile(r"<(script|foreignObject)|\son\w+=|href=\"(?!#|data:image/png)")


class Drawing(NamedTuple):
    """A figure or picture: the stem of its file, what it shows, as SVG and as PDF."""

    name: str
    title: str
    shows: str
    svg: str
    pdf: bytes = b""


@dataclass(frozen=True, eq=False)
class Sketch:
    """A figure before it is drawn.

    Attributes:
        name: the stem of its files.
        title: what it is called.
        shows: what can be read off.
        data: all that the drawing depends on: arrays, words, numbers, and tuples of such.
        draw: makes a figure of matplotlib's from the data; imports matplotlib only then.
    """

    name: str
    title: str
    shows: str
    data: Any
    draw: Callable[[Any], "Figure"]

    def digest(self) -> str:
        """Return what is another for other data, and for other code that draws."""
        found = hashlib.blake2b(digest_size=12)
        for source in (inspect.getsourcefile(self.draw), *_SOURCES):
            found.update(Path(str(source)).read_bytes())
        _update(found, (self.name, self.title, self.data))
        return found.hexdigest()


_SOURCES = [
    Path(__file__).with_name(f"{name}.py")
    for name in ("sketch", "style", "drawing", "chart", "scene_drawing", "view")
]
_drawn: OrderedDict[str, tuple[str, bytes]] = OrderedDict()


def drawn(sketch: Sketch, folder: Path | None = None) -> Drawing:
    """Return a sketch drawn, taken from a folder's files if they show the same."""
    digest = sketch.digest()
    files = _drawn.get(digest) or _on_file(sketch.name, folder, digest) or _files(sketch, digest)
    _drawn[digest] = files
    _drawn.move_to_end(digest)
    if len(_drawn) > _KEPT:
        _drawn.popitem(last=False)
    return Drawing(sketch.name, sketch.title, sketch.shows, *files)


def _on_file(name: str, folder: Path | None, digest: str) -> tuple[str, bytes] | None:
    """Return what was drawn before, if it shows the same."""
    if folder is None:
        return None
    svg, pdf = (folder / f"{name}.{suffix}" for suffix in ("svg", "pdf"))
    try:
        check_regular(svg)
        check_regular(pdf)
        found = svg.read_text(encoding="utf-8"), pdf.read_bytes()
    except (OSError, ValueError):
        return None
    mark = f"{_DIGEST} {digest}"
    is_ours = mark in found[0][-200:] and mark.encode() in found[1]
    return found if is_ours and not _FOREIGN.search(found[0]) else None


def _files(sketch: Sketch, digest: str) -> tuple[str, bytes]:
    from .drawing import pdf_of, styled, svg_of

    mark = f"{_DIGEST} {digest}"
    with styled():
        figure = sketch.draw(sketch.data)
        return svg_of(figure, sketch.title, mark), pdf_of(figure, sketch.title, mark)


def _update(found: Any, value: Any) -> None:
    """Take a value into a digest: arrays by their bytes, what holds others by its parts."""
    if isinstance(value, np.ndarray):
        found.update(f"{value.dtype}{value.shape}".encode() + value.tobytes())
    elif isinstance(value, tuple | list | frozenset):
        found.update(f"({len(value)}".encode())
        for part in sorted(value) if isinstance(value, frozenset) else value:
            _update(found, part)
    elif isinstance(value, Mapping):
        _update(found, list(value.items()))
    elif is_dataclass(value):
        _update(found, [getattr(value, field.name) for field in fields(value)])
    else:
        found.update(f"{type(value).__name__}:{value!r};".encode())


def chart_sketch(chart: "Chart") -> Sketch:
    """Return a chart before it is drawn."""
    return Sketch(chart.name, chart.title, chart.caption, chart, _draw_chart)


def _draw_chart(chart: "Chart") -> "Figure":
    from .drawing import draw_chart

    return draw_chart(chart)
