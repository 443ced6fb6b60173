"""A reader of untrusted XML files: elements and attributes with their line numbers.

Files are in UTF-8, in UTF-16 with a byte order mark, or in ISO-8859-n or Windows-125n as declared.
A document type declaration is refused: its entities may expand without bound or read other files.
"""

import math
import re
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast
from xml.parsers import expat

from .. import arguments
from ..arguments import LARGEST_COORDINATE
from .source import read_text, warn

# A round number, ten elements for each of the most joints of a robot.
MAX_ELEMENTS = 100_000
# The limit of TinyXML2, the parser of MuJoCo and ROS.
MAX_DEPTH = 500
# In an attribute to be read: a default value is copied to every joint.
MAX_CHARACTERS = 2000
MISPLACED_DECLARATION = re.compile(r"(\s+)<\?xml\s[^<>]{0,200}\?>")

Numbers = TypeVar("Numbers", bound=tuple[float, ...])


class Element(NamedTuple):
    """An element of a file; its methods raise a ValueError with the location of the element."""

    tag: str  # its name
    attributes: dict[str, str]  # their values, by name
    children: list["Element"]  # the elements in it, in the order of the file
    location: str  # the file and the line where it begins

    def walk(self) -> Iterator["Element"]:
        """Yield the element and all its descendants in the order of the file."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting += reversed(element.children)

    def children_named(self, tag: str) -> list["Element"]:
        """Return the children of this name."""
        return [child for child in self.children if child.tag == tag]

    def single(self, tag: str) -> "Element | None":
        """Return the only child of this name, None without such a child."""
        matches = self.children_named(tag)
        if len(matches) > 1:
            raise self.error(f"expected at most one <{tag}>, got {len(matches)}")
        return matches[0] if matches else None

    def word(self, name: str, default: str | None = None) -> str:
        """Return an attribute, or the default where the attribute is missing."""
        value = self._short(name) if name in self.attributes else default
        if not value:
            got = "none" if value is None else "an empty one"
            raise self.error(f"expected an attribute {name!r}, got {got}")
        return value

    def choice(self, name: str, valid: Collection[str], default: str | None = None) -> str:
        """Return an attribute from a list of valid words."""
        value = self.word(name, default)
        if value not in valid:
            raise self.error(f"expected one of {', '.join(valid)} for {name}, got {value!r:.80}")
        return value

    def numbers(self, name: str, default: Numbers) -> Numbers:
        """Return as many numbers of at most 1e75 as the default has, or the default itself."""
        values = self.limits(name, default)
        if not all(abs(value) <= LARGEST_COORDINATE for value in values):
            raise self._no_numbers(name, len(default), f"numbers of at most {LARGEST_COORDINATE:g}")
        return values

    def limits(self, name: str, default: Numbers) -> Numbers:
        """Return the same, infinite numbers allowed."""
        words = self._short(name).split()
        if not words:
            return default
        values = tuple(map(_number, words))
        if len(values) != len(default) or any(map(math.isnan, values)):
            raise self._no_numbers(name, len(default), "numbers")
        return cast(Numbers, values)

    def error(self, problem: str) -> ValueError:
        """Return an error with the location, the element and the problem."""
        name = f" name={self.attributes['name']!r:.60}" if "name" in self.attributes else ""
        return ValueError(f"{self.location}: <{self.tag:.60}{name}>: {problem}")

    def _short(self, name: str) -> str:
        value = self.attributes.get(name, "")
        if len(value) > MAX_CHARACTERS:
            raise self.error(f"expected at most {MAX_CHARACTERS:,} characters in {name!r}")
        if "${" in value or "$(" in value:
            raise self.error(f"expected a value, got the xacro {value!r:.80}: run xacro first")
        return value

    def _no_numbers(self, name: str, count: int, kind: str) -> ValueError:
        return self.error(f"expected {count} {kind} in {name!r}, got {self.attributes[name]!r:.80}")


def read(path: str | Path) -> Element:
    """Return the root element of a file; see `parse`."""
    return parse(read_text(path, is_xml=True), str(path))


def parse(text: str, origin: str) -> Element:
    """Return the root element of a text; errors name `origin`.

    White space before <?xml ...?> gets a warning. Raise a ValueError if the text is not
    well-formed, or has a document type, more than MAX_ELEMENTS elements, or more levels than
    MAX_DEPTH.
    """
    builder, text = _Builder(origin), arguments.text("text", text)
    if match := MISPLACED_DECLARATION.match(text):
        warn(f"{origin}, line 1: expected <?xml ...?> first, got white space before it")
        text = match[1] + text[match.end() :]
    try:
        builder.parser.Parse(text.encode(errors="replace"), True)
    except expat.ExpatError as error:
        problem = expat.ErrorString(error.code)
        raise ValueError(
            f"{origin}, line {error.lineno}: expected well-formed XML, got {problem}"
        ) from None
    return builder.top.children[0]


class _Builder:
    """A handler of the parser's events to build the tree of elements."""

    def __init__(self, origin: str) -> None:
        self.origin = origin
        self.count = 0
        self.top = Element("", {}, [], origin)
        self.open = [self.top]
        self.parser: Any = expat.ParserCreate("utf-8")
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.StartDoctypeDeclHandler = self.refuse_document_type

    def location(self) -> str:
        return f"{self.origin}, line {self.parser.CurrentLineNumber}"

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.count += 1
        if self.count > MAX_ELEMENTS:
            raise ValueError(f"{self.location()}: expected at most {MAX_ELEMENTS:,} elements")
        if len(self.open) > MAX_DEPTH:
            raise ValueError(
                f"{self.location()}: expected at most {MAX_DEPTH} elements in each other"
            )
        element = Element(tag, attributes, [], self.location())
        self.open[-1].children.append(element)
        self.open.append(element)

    def end(self, tag: str) -> None:
        self.open.pop()

    def refuse_document_type(self, name: str, *declaration: Any) -> None:
        raise ValueError(f"{self.location()}: expected no document type, got <!DOCTYPE {name:.60}>")


def _number(word: str) -> float:
    """Return the number in a word, possibly infinite, or NaN if the word is no number."""
    try:
        return math.nan if "_" in word else float(word)
    except ValueError:
        return math.nan
