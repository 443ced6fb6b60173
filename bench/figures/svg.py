"""Figures as parts of a page: an SVG file's tree changed so that it can stand within HTML."""

import re
import xml.etree.ElementTree as ElementTree
import zlib
from collections.abc import Iterator, Mapping, Sequence

from markupsafe import Markup

from .sketch import Drawing
from .style import COLOURS

_SVG, _XLINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"
# What a drawing consists of; all else is left out, such as what describes the file.
_DRAWN = {"svg", "g", "defs", "path", "use", "clipPath", "rect", "text", "tspan", "image", "title"}
# What the page says itself: its own size of figures, and that it is SVG.
_OF_THE_FILE = {"width", "height", "version"}
# What the parts of a group inherit from it.
_INHERITED = {"fill", "fill-opacity", "stroke", "stroke-opacity", "stroke-width", "font-size",
              "stroke-dasharray", "stroke-dashoffset", "stroke-linecap", "stroke-linejoin",
              "text-anchor"}  # fmt: skip
# A path of more parts than this is drawn to a tenth of a point.
_LONG = 20
# A space beside a letter or before a sign separates nothing.
_UNNEEDED = re.compile(r"(?<=[A-Za-z]) | (?=[A-Za-z-])")
_NUMBER, _IN_URL = re.compile(r"-?[0-9.]+(e-?[0-9]+)?"), re.compile(r"url\(#([^)]*)\)")
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
    used = dict.fromkeys(_REFERENCE.findall(drawing.svg))
    ids = {before: f"{_short(drawing.name)}-{number}" for number, before in enumerate(used)}
    for element in root.iter():
        element.tag = element.tag.removeprefix(_SVG)
        if element.tag not in ("text", "tspan"):
            element.text = None
        element.tail = None
        if element.get("id") not in ids:
            element.attrib.pop("id", None)
        element.attrib = _attributes(element.attrib, ids)
    _share_styles(root)
    for name in _OF_THE_FILE:
        root.attrib.pop(name, None)
    root.attrib |= {"role": "img", "aria-label": drawing.title}
    return Markup(ElementTree.tostring(root, encoding="unicode"))


def _short(name: str) -> str:
    """Return a name as few letters, which are others for another name."""
    return f"f{zlib.crc32(name.encode()):x}"[:6]


def _shorten(element: ElementTree.Element) -> None:
    """Remove what describes the file, what styles it as a whole, and what draws nothing."""
    for child in list(element):
        if child.tag.removeprefix(_SVG) in _DRAWN:
            _shorten(child)
        else:
            element.remove(child)


def _attributes(given: dict[str, str], ids: Mapping[str, str]) -> dict[str, str]:
    """Return attributes with ids of the page's, in as few digits as can be told apart."""
    kept = {}
    for key, value in given.items():
        key = key.removeprefix(_XLINK)
        if key.startswith("on") or (key == "href" and not value.startswith("#")):
            continue
        if key == "id":
            value = ids[value]
        elif key == "href":
            value = f"#{ids[value[1:]]}"
        elif key == "style":
            value = _style(value)
        elif key == "d":
            value = shorter_path(value)
        elif key in ("x", "y") and _NUMBER.fullmatch(value):
            value = _rounded(value, 1)
        elif key == "transform" and value.startswith("rotate(-0 "):
            continue
        kept[key] = _IN_URL.sub(lambda found: f"url(#{ids[found[1]]})", value)
    return kept


def _share_styles(element: ElementTree.Element) -> None:
    """Move what styles all parts of a group, or clips all its paths, to the group."""
    for child in element:
        _share_styles(child)
    if element.tag != "g" or len(element) < 2:
        return
    if _names(element[0].get("style", "")) <= _INHERITED:
        _share(element, "style")
    if {child.tag for child in element} == {"path"}:
        _share(element, "clip-path")


def _names(style: str) -> set[str]:
    return {part.partition(":")[0] for part in style.split(";")}


def _share(group: ElementTree.Element, key: str) -> None:
    """Move an attribute to a group, if it has none and that of all its parts is the same."""
    values = {child.get(key, "") for child in group}
    if key not in group.attrib and len(values) == 1 and values != {""}:
        group.set(key, values.pop())
        for child in group:
            del child.attrib[key]


def shorter_path(path: str) -> str:
    """Return a path to a hundredth of a point, a long one to a tenth, its lines as differences.

    What lies within level or upright lines is left out.
    """
    parts = [re.split(r"\s+", part.strip()) for part in re.findall(r"[A-Za-z][^A-Za-z]*", path)]
    digits = 1 if len(parts) > _LONG else 2
    kept: list[list[str]] = []
    for letter, *numbers in parts:
        part = [letter, *(_rounded(number, digits) for number in numbers)]
        if len(kept) > 1 and letter == kept[-1][0] == "L" and _is_between(kept[-2:], part):
            kept.pop()
        kept.append(part)
    return _UNNEEDED.sub("", " ".join(_told(kept, digits)))


def _told(parts: Sequence[Sequence[str]], digits: int) -> Iterator[str]:
    """Yield the parts of a path; lines as differences, whose letter is said once."""
    before, said, at = "", "", ["0", "0"]
    for letter, *numbers in parts:
        if letter == "L" and before in ("M", "L"):
            steps = (float(to) - float(start) for to, start in zip(numbers, at, strict=True))
            told = [_rounded(str(step), digits) for step in steps]
            how, told = _line(told)
            yield " ".join(told if how == said else [how, *told])
            said = how
        else:
            yield " ".join([letter, *numbers])
            said = letter
        before, at = letter, numbers[-2:]


def _line(step: list[str]) -> tuple[str, list[str]]:
    """Return a line's letter and numbers: of a level or upright one, how far it goes."""
    if step[1] == "0":
        return "h", step[:1]
    return ("v", step[1:]) if step[0] == "0" else ("l", step)


def _is_between(before: list[list[str]], part: list[str]) -> bool:
    """Return whether the last point lies on a level or upright line to the next one."""
    (x, y), (at_x, at_y), (to_x, to_y) = ([float(n) for n in p[-2:]] for p in (*before, part))
    level = y == at_y == to_y and min(x, to_x) <= at_x <= max(x, to_x)
    upright = x == at_x == to_x and min(y, to_y) <= at_y <= max(y, to_y)
    return level or upright


def _rounded(number: str, digits: int = 2) -> str:
    short = f"{float(number):.{digits}f}".rstrip("0").rstrip(".")
    return "0" if short == "-0" else re.sub(r"^(-?)0\.", r"\1.", short)


def _style(text: str) -> str:
    """Return a style whose colours are the page's, and whose fonts are only sizes and weights."""
    declared = dict(part.strip().split(": ", 1) for part in text.split(";") if part.strip())
    declared.pop("font-family", None)
    if font := declared.pop("font", ""):  # a weight, where it is not the usual one, and the size
        words = font.split()
        i = next(i for i, word in enumerate(words) if word.endswith("px"))
        declared |= {"font-size": words[i], **({"font-weight": words[0]} if i else {})}
    return ";".join(f"{key}:{_VARIABLES.get(value, value)}" for key, value in declared.items())
