"""Exit codes and options common to several commands, and checks of arguments."""

import difflib
import re
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import typer

from .entry_point import INTERRUPTED as INTERRUPTED

REPORT = Path("report")
# Exit codes; the last as shells report a program ended by SIGPIPE, 128 + 13.
SUCCESS, FAILED, MISUSED, UNREAD = 0, 1, 2, 141


def argument(metavar: str, text: str) -> Any:
    """Return an argument, by its metavariable and description."""
    return typer.Argument(metavar=metavar, help=text, parser=_PARSERS.get(metavar))


def option(metavar: str, text: str, *names: str, min: int | None = None) -> Any:
    """Return an option with a value, by its metavariable, description, names and least value."""
    parser = _PARSERS.get(metavar)
    return typer.Option(*names, metavar=metavar or None, help=text, min=min, parser=parser)


def flag(text: str, *names: str) -> Any:
    """Return an option without a value, by its description and names."""
    return typer.Option(*names, help=text)


def is_name(text: str) -> bool:
    """Return whether a text names a file: not blank, and without control characters."""
    return bool(text.strip()) and not re.search(r"[\x00-\x1f\x7f-\x9f]", text)


def _folder(text: str | Path) -> Path:
    """Return the path of a folder; a blank text would be the working folder."""
    if not is_name(str(text)):
        raise typer.BadParameter(f"expected a name without control characters, got {text!r}")
    return Path(text)


# How the values of options are read, by metavariable.
_PARSERS = {"DIR": _folder, "PATH": _folder, "[FOLDER]": _folder}
Texts = list[str] | None
File = Path | None
Text = str | None
Output = Annotated[Path, option("DIR", "Folder of the records and report.", "--output", "-o")]
UserSolvers = Annotated[
    Texts, option("SOLVER", "Your my_ik.py or module:object; repeatable.", "--with")
]
Fresh = Annotated[bool, flag("Delete the records and measure again.", "--fresh")]


def writable(folder: Path) -> None:
    """Make a folder if necessary.

    Raises:
        OSError: if the folder is not writable.
        ValueError: if it is not a folder.
    """
    from plumbob.process.paths import check_folder

    check_folder(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(error.errno, "cannot write here", str(folder)) from None


def write_text(path: Path, text: str) -> None:
    """Write a file, and make its folder if necessary."""
    from plumbob.process.paths import check_regular

    check_regular(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def valid_name(kind: str, name: str, valid: Iterable[str]) -> str:
    """Return a valid name.

    Raises:
        ValueError: if invalid; the message offers the nearest.
    """
    names = list(valid)
    if name in names:
        return name
    from plumbob.reference.arguments import name_list

    near = difflib.get_close_matches(name, names, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"expected one of {name_list(names)}"
    raise ValueError(f"unknown {kind} {name!r}: {hint}")
