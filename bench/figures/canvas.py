"""The common style of all figures, and their files.

Colours are from `style.COLOURS`, which the dark page replaces by its own.
"""

import contextlib
import io
import warnings
from collections.abc import Iterator

import matplotlib as mpl
from markupsafe import escape
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from ..tables.results import label
from .style import PARAMETERS

# Width of a figure [inch], at least 48 rem on the page, where letters stay above 7 points.
WIDTH = 9.0


@contextlib.contextmanager
def styled() -> Iterator[None]:
    """Draw in the common style, without warnings on letters missing from a font."""
    with mpl.rc_context(PARAMETERS), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        warnings.filterwarnings("ignore", "constrained_layout not applied")
        yield


def canvas(
    height: float, columns: int, rows: int = 1, *, sharex: bool = False, sharey: bool = False
) -> tuple[Figure, list[Axes]]:
    """Return a figure [inch high] and its axes, row by row; within `styled`."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey)
    return figure, list(axes.ravel())


def svg_of(figure: Figure, title: str, mark: str = "") -> str:
    """Return a figure as reproducible SVG, with a mark at its end."""
    file = io.StringIO()
    FigureCanvasSVG(figure).print_svg(
        file, metadata={"Date": None, "Creator": None, "Title": title}
    )
    text = file.getvalue()
    for i, name in enumerate(getattr(figure, "series_names", ())):
        group = f'<g class="series"><title>{escape(label(name))}</title>'
        text = text.replace(f'<g id="series-{i}">', group).replace(f'<g id="series-{i}"/>', "")
    return f"{text}<!-- {mark} -->\n" if mark else text


def pdf_of(figure: Figure, title: str, mark: str = "") -> bytes:
    """Return a figure as reproducible PDF with its fonts and text."""
    file = io.BytesIO()
    about = {"CreationDate": None, "Creator": None, "Producer": None, "Keywords": mark or None}
    figure.set_layout_engine("none")
    FigureCanvasPdf(figure).print_pdf(file, metadata={**about, "Title": title})
    return file.getvalue()
