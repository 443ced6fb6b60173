"""Figures as parts of a page: an SVG file's tree changed so that it can stand within HTML."""

import itertools
import re
import xml.etree.ElementTree as ElementTree

from markupsafe import Markup

from .sketch import Drawing
from .style import COLOURS

_SVG, _XLINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"
# What a drawing consists of; all else is left out, such as what describes the file.
_DRAWN = {"svg", "g", "defs", "path", "use", "clipPath", "rect", "text", "tspan", "image", "title"}
# What the page says itself: its own size of figures, and that it is SVG.
_OF_THE_FILE = {"width", "height", "version"}
_REFERENCE = re.compile(r'(?:url\(|href=")#([^")]*)')
_VARIABLES = {colour: f"var(--{name})" for name, colour in COLOURS.items()}


def inline(drawing: Drawing) -> Markup:
    """Return an SVG that can stand in a page: own ids, colours by name, no links, the page's fonts.

    Ids are made unique, since all drawings of a page share one name space; those that nothing
    refers to are left out.
    """
    root = ElementTree.fromstring(drawing.svg)
    _shorten(root)
    for title in root.findall(f"{_SVG}title"):
        root.remove(title)
    used = set(_REFERENCE.findall(drawing.svg))
    for element in root.iter():
        element.tag = element.tag.removeprefix(_SVG)
        if element.tag not in ("text", "tspan"):
            element.text = None
        element.tail = None
        if element.get("id") not in used:
            element.attrib.pop("id", None)
        element.attrib = _attributes(element.attrib, drawing.name)
    for name in _OF_THE_FILE:
        root.attrib.pop(name, None)
    root.attrib |= {"role": "img", "aria-label": drawing.title}
    return Markup(ElementTree.tostring(root, encoding="unicode"))


def _shorten(element: ElementTree.Element) -> None:
    """Remove what describes the file, what styles it as a whole, and what draws nothing."""
    for child in list(element):
        if child.tag.removeprefix(_SVG) in _DRAWN:
            _shorten(child)
        else:
            element.remove(child)


def _attributes(given: dict[str, str], name: str) -> dict[str, str]:
    """Return attributes whose ids, and references to ids, are within the drawing of this name."""
    kept = {}
    for key, value in given.items():
        key = key.removeprefix(_XLINK)
        if key.startswith("on") or (key == "href" and not value.startswith("#")):
            continue
        if key == "id":
            value = f"{name}-{value}"
        elif key == "href":
            value = value.replace("#", f"#{name}-", 1)
        elif key == "style":
            value = _style(value)
        elif key == "d":
            value = shorter_path(value)
        kept[key] = value.replace("url(#", f"url(#{name}-")
    return kept


def shorter_path(path: str) -> str:
    """Return a path to a hundredth of a point, without what lies within level or upright lines."""
    parts = [re.split(r"\s+", part.strip()) for part in re.findall(r"[A-Za-z][^A-Za-z]*", path)]
    kept: list[list[str]] = []
    for letter, *numbers in parts:
        part = [letter, *map(_rounded, numbers)]
        if len(kept) > 1 and letter == kept[-1][0] == "L" and _is_between(kept[-2:], part):
            kept.pop()
        kept.append(part)
    told = [" ".join(part) for part in kept]
    for i, (before, part) in enumerate(
        itertools.pairwise(kept), 1
    ):  # a line's letter is understood
        if part[0] == "L" and before[0] in "ML":
            told[i] = " ".join(part[1:])
    return " ".join(told)


def _is_between(before: list[list[str]], part: list[str]) -> bool:
    """Return whether the last point lies on a level or upright line to the next one."""
    (x, y), (at_x, at_y), (to_x, to_y) = ([float(n) for n in p[-2:]] for p in (*before, part))
    level = y == at_y == to_y and min(x, to_x) <= at_x <= max(x, to_x)
    upright = x == at_x == to_x and min(y, to_y) <= at_y <= max(y, to_y)
    return level or upright


def _rounded(number: str) -> str:
    return f"{float(number):.2f}".rstrip("0").rstrip(".")


def _style(text: str) -> str:
    """Return a style whose colours are the page's, and whose fonts are only sizes and weights."""
    declared = dict(part.strip().split(": ", 1) for part in text.split(";") if part.strip())
    declared.pop("font-family", None)
    if font := declared.pop("font", ""):  # a weight, where it is not the usual one, and the size
        words = font.split()
        i = next(i for i, word in enumerate(words) if word.endswith("px"))
        declared |= {"font-size": words[i], **({"font-weight": words[0]} if i else {})}
    return "; ".join(f"{key}: {_VARIABLES.get(value, value)}" for key, value in declared.items())
