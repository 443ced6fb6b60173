"""The kinematic part of an MJCF file, MuJoCo's own format.

Joint 0 of the articulation is the world. Bodies follow depth first in the order of the file, and
the coordinates equal those of MuJoCo's qpos. Every body becomes a joint with its name and pose. A
body with several joints becomes one joint for each, named "body/joint", except that the last one
has the name of the body; if its anchor is not the body's origin, a fixed joint with the name of the
body follows. A body without a name is called "body#3" by its index, a joint without one "hinge1" by
its type and its index in the body.

`home` is the configuration in the file, with each joint at its `ref`. A free joint moves in the
world's frame. MuJoCo limits the total angle of a ball; here its tilt and its twist about z are each
limited by that angle, which allows all that MuJoCo does, and more. Frames, nested defaults and
includes from one folder are supported. Elements that do not affect forward kinematics, such as
sites, keyframes and equality constraints, are ignored. Elements that generate bodies (replicate,
attach, composite, flexcomp) are refused, except for a replicate without bodies, which is ignored
with a warning.
"""

from pathlib import Path

from .. import xml
from ..robot import Robot
from ..xml import Element
from .bodies import robot

__all__ = ["parse", "read"]


def read(path: str | Path, *, root: str | Path | None = None) -> Robot:
    """Return the robot or character that a file describes.

    Args:
        path: of the file.
        root: the folder that must contain all included files after symbolic links are resolved;
            that of the file if None.

    Raises:
        ValueError: naming file, line and element, if it cannot be read, is not an MJCF file,
            includes one from outside the root, or has elements that generate bodies.
    """
    element = xml.read(path)
    _include_files(element, Path(path), root)
    return robot(element, str(path))


def parse(text: str) -> Robot:
    """Return the robot that a text describes, which can include no files; see `read`."""
    root = xml.parse(text, "MJCF")
    for element in root.walk():
        if element.tag == "include":
            raise element.error("expected a text without includes; they need a file to be read")
    return robot(root, "MJCF")


def _include_files(root: Element, path: Path, top: str | Path | None) -> None:
    """Replace all includes by the content of the files, each of which may be included once.

    `top` is the folder that must contain all files; that of the main file at `path` if None.
    """
    main = path.resolve()
    folder = main.parent
    if top is not None:
        top_folder = _resolved(Path(top)) if isinstance(top, str | Path) else None
        if top_folder is None or not (top_folder.is_dir() and main.is_relative_to(top_folder)):
            expected = f"expected a folder that holds {main.name!r:.80}"
            raise ValueError(f"root: {expected}, got {top!r:.80}")
        folder = top_folder
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
