"""Replace each <include> of an MJCF file by the content of the included file."""

from pathlib import Path

from .. import xml
from ..xml import Element


def include_files(root: Element, path: Path, top: str | Path | None) -> None:
    """Replace all includes by the content of the files, each of which may be included once.

    `top` is the folder that must contain all files after symbolic links are resolved; that of the
    main file at `path` if None. A file that is included twice, does not exist or is outside of that
    folder is a ValueError, as is a folder that does not contain the main file.
    """
    main = path.resolve()
    folder = main.parent if top is None else _checked_top(main, top)
    files = {main}
    waiting = [(root, main)]
    while waiting:
        element, file = waiting.pop()
        children = [(child, file) for child in reversed(element.children)]
        element.children.clear()
        while children:
            child, file = children.pop()
            if child.tag == "include":
                included = _included(child, file, main.parent, folder)
                if included in files:
                    raise child.error("expected every file to be included once, got it again")
                files.add(included)
                children += [(part, included) for part in reversed(xml.read(included).children)]
            else:
                element.children.append(child)
                waiting.append((child, file))


def refuse_includes(root: Element) -> None:
    """Raise a ValueError if any file is included."""
    for element in root.walk():
        if element.tag == "include":
            raise element.error("expected a text without includes; they need a file to be read")


def _checked_top(main: Path, top: str | Path) -> Path:
    folder = _resolved(Path(top)) if isinstance(top, str | Path) else None
    if folder is None or not (folder.is_dir() and main.is_relative_to(folder)):
        raise ValueError(f"root: expected a folder that holds {main.name!r:.80}, got {top!r:.80}")
    return folder


def _included(include: Element, file: Path, main_folder: Path, top: Path) -> Path:
    """Return the included file, relative to the main file or else to the including file."""
    name = include.word("file")
    paths = [path for base in (main_folder, file.parent) if (path := _resolved(base / name))]
    inside = [path for path in paths if path.is_relative_to(top)]
    for path in inside:
        if path.is_file():
            return path
    is_outside = paths and not inside
    fault = "outside; root= names a wider folder" if is_outside else "not there"
    raise include.error(f"expected a file in {top.name!r:.60}, got {name!r:.80}, which is {fault}")


def _resolved(path: Path) -> Path | None:
    """Return a path with symbolic links resolved; None if it is not a valid path."""
    try:
        path.exists()  # raises for names that are too long and for cycles of links
        return path.resolve()
    except (OSError, RuntimeError):
        return None
