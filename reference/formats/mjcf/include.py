"""Files that an MJCF file includes: their content takes the place of the <include>."""

from pathlib import Path

from .. import xml
from ..xml import Element


def include_files(root: Element, path: Path) -> None:
    """Put the content of included files in its place, each file once.

    Raises:
        ValueError: if a file is included twice or is not in the folder of the main file.
    """
    main = path.resolve()
    seen = {main}
    waiting = [(root, main)]
    while waiting:
        element, file = waiting.pop()
        found = [(child, file) for child in reversed(element.children)]
        element.children.clear()
        while found:
            child, file = found.pop()
            if child.tag == "include":
                included = _included(child, file, main)
                if included in seen:
                    raise child.error("expected every file to be included once, got it again")
                seen.add(included)
                found += [(part, included) for part in reversed(xml.read(included).children)]
            else:
                element.children.append(child)
                waiting.append((child, file))


def refuse_includes(root: Element) -> None:
    """Raise a ValueError if any file is included."""
    waiting = [root]
    while waiting:
        element = waiting.pop()
        if element.tag == "include":
            raise element.error("expected a text without includes; they need a file to be read")
        waiting += element.children


def _included(include: Element, file: Path, main: Path) -> Path:
    """Return the file meant: beside the one that includes it, or else beside the main one."""
    name = include.word("file")
    for folder in (file.parent, main.parent):
        candidate = (folder / name).resolve()
        if candidate.is_relative_to(main.parent) and candidate.is_file():
            return candidate
    raise include.error(f"expected a file in the folder of {main.name!r:.80}, got {name!r:.80}")
