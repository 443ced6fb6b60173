"""Figures as parts of a page: the text of an SVG file, shortened to stand within HTML."""

import re
import zlib

from markupsafe import Markup

from .sketch import Drawing
from .style import COLOURS

# Parts that describe or style the whole file: the page sets sizes and fonts.
_FILE_PARTS = re.compile(r"<metadata>.*?</metadata>|<style.*?</style>|<!--.*?-->", re.DOTALL)
_ATTRIBUTES = re.compile(
    r"(?<=<g) id=\"[^\"]*\"|font-family: [^;\"]*(?:; )?| xmlns(?::xlink)?=\"[^\"]*\""
    r"| (?:width|height)=\"[\d.]+pt\"| version=\"[^\"]*\"|xlink:(?=href)"
)
# Hundredths of a point are invisible.
_DECIMALS = re.compile(r"(?<![\w#])-?\d+\.\d\d+(?![\w])")
_FONT = re.compile(r"font: (?:(\d+) )?([\d.]+px) [^;\"]*")
# Between the letters and numbers of a path, and within a style.
_SPACES = re.compile(r"(?<=[MLCQz:;]) | (?=[MLCQz][ \d\"-])| (?=\")")
_IDS = re.compile(r'((?<= )id="|href="#|url\(#)')
_COLOURS = re.compile("|".join(COLOURS.values()))
_NAMES = {colour: name for name, colour in COLOURS.items()}


def inline(drawing: Drawing) -> Markup:
    """Return an SVG for a page: unique ids, colours by name, the page's fonts."""
    text = _FILE_PARTS.sub("", drawing.svg[drawing.svg.index("<svg") :])
    text = re.sub("<title>.*?</title>", "", text, count=1, flags=re.DOTALL)
    text = re.sub(r"(?<=>)\s+(?=<(?!tspan))", "", text)
    prefix = f"f{zlib.crc32(drawing.name.encode()):x}"[:6]
    text = re.sub("<[^>]+>", lambda tag: _shorter_tag(tag[0], prefix), text)
    label = Markup.escape(drawing.title)
    return Markup(text.strip().replace("<svg", f'<svg role="img" aria-label="{label}"', 1))


def _shorter_tag(tag: str, prefix: str) -> str:
    """Return a tag with few digits, its ids behind a prefix."""
    tag = _ATTRIBUTES.sub("", re.sub(r"\s+", " ", tag))
    tag = _DECIMALS.sub(lambda number: f"{float(number[0]):.1f}".removesuffix(".0"), tag)
    tag = _FONT.sub(r"font-size: \2; font-weight: \1", tag).replace("; font-weight: ;", ";")
    tag = _COLOURS.sub(lambda colour: f"var(--{_NAMES[colour[0]]})", tag)
    return _SPACES.sub("", _IDS.sub(rf"\g<1>{prefix}-", tag))
