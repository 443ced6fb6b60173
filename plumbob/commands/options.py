"""What several commands share: their exit codes, options, and checks of what is asked for."""

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from ..entry_point import INTERRUPTED as INTERRUPTED

REPORT = Path("report")
SUCCESS, MISSED, MISUSED, UNREAD = 0, 1, 2, 141

Output = Annotated[
    Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of records and report.")
]
Fresh = Annotated[bool, typer.Option("--fresh", help="Forget what is on record; measure anew.")]


def writable(folder: Path) -> None:
    """Make the folder if need be.

    Raises:
        OSError: naming it, if nothing can be written there.
        ValueError: if it is something else than a folder.
    """
    import tempfile

    from plumbob.bench.harness.record import check_folder

    check_folder(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(error.errno, "cannot write here", str(folder)) from None


def known(kind: str, name: str, valid: Iterable[str]) -> str:
    """Return a name that is valid.

    Raises:
        ValueError: if it is not; the message offers the nearest.
    """
    names = list(valid)
    if name in names:
        return name
    from plumbob.reference.arguments import name_list

    near = difflib.get_close_matches(name, names, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"expected one of {name_list(names)}"
    raise ValueError(f"unknown {kind} {name!r}: {hint}")
