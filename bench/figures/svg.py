"""Figures as parts of a page: the text of an SVG file, shortened to stand within HTML."""

import re
import zlib
from collections import Counter, defaultdict
from itertools import count

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
# Points of a polyline on a horizontal or vertical line, all but the first and the last.
_STRAIGHT = re.compile(
    r"([ML]-?[\d.]+ (-?[\d.]+))(?:L-?[\d.]+ \2)+(?=L-?[\d.]+ \2(?![\d.]))"
    r"|([ML](-?[\d.]+) -?[\d.]+)(?:L\4 -?[\d.]+)+(?=L\4 )"
)
_POINT = re.compile(r"([MLCQ])([^MLCQz]*)|z")
_IDS = re.compile(r'((?<= )id="|href="#|url\(#)([^")]+)')
_COLOURS = re.compile("|".join(COLOURS.values()))
_NAMES = {colour: name for name, colour in COLOURS.items()}


def inline(drawing: Drawing) -> Markup:
    """Return an SVG for a page: unique ids, colours by name, the page's fonts."""
    text = _FILE_PARTS.sub("", drawing.svg[drawing.svg.index("<svg") :])
    text = re.sub("<title>.*?</title>", "", text, count=1, flags=re.DOTALL)
    text = re.sub(r"(?<=>)\s+(?=<(?!tspan))", "", text)
    prefix = f"f{zlib.crc32(drawing.name.encode()):x}"[:6]
    text = re.sub("<[^>]+>", lambda tag: _shorter_tag(tag[0]), text)
    numbers: dict[str, int] = defaultdict(count().__next__)
    text = _IDS.sub(lambda match: f"{match[1]}{prefix}-{numbers[match[2]]}", text)
    text = _with_classes(text, prefix)
    label = Markup.escape(drawing.title)
    return Markup(text.strip().replace("<svg", f'<svg role="img" aria-label="{label}"', 1))


def _shorter_tag(tag: str) -> str:
    """Return a tag with few digits, its colours by name."""
    tag = _ATTRIBUTES.sub("", re.sub(r"\s+", " ", tag))
    tag = _DECIMALS.sub(lambda number: f"{float(number[0]):.1f}".removesuffix(".0"), tag)
    tag = _FONT.sub(r"font-size: \2; font-weight: \1", tag).replace("; font-weight: ;", ";")
    tag = _COLOURS.sub(lambda colour: f"var(--{_NAMES[colour[0]]})", tag)
    return re.sub(r'(?<= d=")[^"]*', lambda path: _shorter_path(path[0]), _SPACES.sub("", tag))


def _with_classes(text: str, prefix: str) -> str:
    """Return an SVG with repeated styles as classes, declared behind its first tag."""
    text = re.sub(r' clip-path="([^"]*)" style="', r' style="clip-path:\1;', text)
    counts = Counter(re.findall(r' style="([^"]*)"', text))
    repeated = [style for style, count in counts.items() if count > 1]
    classes = {style: f"{prefix}-{number}" for number, style in enumerate(repeated)}
    declared = "".join(f".{name}{{{style}}}" for style, name in classes.items())

    def classed(tag: re.Match[str]) -> str:
        style = re.search(r' style="([^"]*)"', tag[0])
        if not style or style[1] not in classes or " class=" in tag[0]:
            return tag[0]
        return tag[0].replace(style[0], f' class="{classes[style[1]]}"')

    text = re.sub("<[^>]+>", classed, text)
    return text.replace(">", f"><style>{declared}</style>", 1) if declared else text


def _shorter_path(path: str) -> str:
    """Return a path without needless points, each line relative to the point before."""
    path = _STRAIGHT.sub(lambda run: run[1] or run[3], path)
    commands, last = [], [0.0, 0.0]
    for command in _POINT.finditer(path):
        letter, numbers = command[1], [float(number) for number in (command[2] or "").split()]
        steps = [f"{a - b:.1f}".removesuffix(".0") for a, b in zip(numbers, last, strict=False)]
        commands.append("l" + " ".join(steps) if letter == "L" else command[0])
        last = numbers[-2:]
    return "".join(commands).replace(" -", "-").replace("-0.0", "0")
