"""Parts of the help common to several commands, fitted to the width of the terminal."""

import re
import shutil
import textwrap
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from plumbob.bench.experiments import SUITES

# The most letters of a line however wide the terminal is, and the fewest.
WIDEST, NARROWEST = 80, 30

_EPILOGS = tomllib.loads(Path(__file__).with_name("help.toml").read_text(encoding="utf-8"))
_EPILOGS["bench"]["Suites"] = list(SUITES.items())
_Formatter: Any = typer.Context.formatter_class
_Context: Any = TyperCommand.context_class


def epilog(command: str) -> str:
    """Return what stands below the options of a command, from `help.toml`."""
    return "\n\n".join(_block(title, rows) for title, rows in _EPILOGS[command].items())


def _block(title: str, rows: Sequence[str | Sequence[str]]) -> str:
    """Return lines below a title; pairs of command and description are aligned."""
    width = max((len(row[0]) for row in rows if not isinstance(row, str)), default=0)
    lines = (row if isinstance(row, str) else f"{row[0]:<{width}}  {row[1]}" for row in rows)
    return "\n".join(["\b", f"{title}:", *(f"  {line}" for line in lines)])


class FittingFormatter(_Formatter):  # type: ignore[misc]
    """A formatter of help in lines no wider than the terminal."""

    def __init__(self, **options: Any) -> None:
        self.columns = max(NARROWEST, shutil.get_terminal_size().columns)
        super().__init__(**{**options, "width": min(self.columns, WIDEST) - 2})

    def write_usage(self, prog: str, args: str = "", prefix: str | None = None) -> None:
        """Write the line of usage, each argument in at most a pair of brackets."""
        args = re.sub(r"\[\[(.*?)\]\]", r"[\1]", re.sub(r"\{(.*?)(\.\.\.)?\}", r"\1", args))
        super().write_usage(prog, args, prefix)

    def write_dl(self, rows: Any, col_max: int = 30, col_spacing: int = 2) -> None:
        """Write options and their descriptions; in a narrow terminal below each other."""
        rows = [(_without_type(name), text) for name, text in rows]
        super().write_dl(rows, min(col_max, self.columns // 3), col_spacing)

    def getvalue(self) -> str:
        """Return the help, each line that is too wide continued in the next."""
        lines = super().getvalue().splitlines()
        return "".join(f"{part}\n" for line in lines for part in fitted(line, self.columns))


def _without_type(name: str) -> str:
    """Return an argument without its Python type, or an option with a word in its place."""
    if not name.startswith("-"):
        return re.sub(r" <[^>]*>$", "", name)
    return re.sub(r"<([^>]*)>$", lambda match: "N" if "int" in match[1] else "NAME", name)


def fitted(line: str, width: int) -> list[str]:
    """Return a line in lines of at most this width, with text after a gap kept in its column."""
    if len(line) <= width:
        return [line]
    indent = len(line) - len(line.lstrip())
    gap = re.match(r" *\S.*?  +(?=\S)", line)
    if gap and gap.end() <= width // 2:
        head, hang = line[: gap.end()], gap.end()
    else:
        head, hang = line[:indent], indent + 4
        line = head + re.sub(r"  +", "  ", line[indent:])
    return textwrap.wrap(
        line[len(head) :],
        width,
        initial_indent=head,
        subsequent_indent=" " * hang,
        break_long_words=False,
        break_on_hyphens=False,
    )


class FittingContext(_Context):  # type: ignore[misc]
    """A context with help fitted to the terminal."""

    formatter_class = FittingFormatter


class _Fitting:
    """Help fitted to the terminal."""

    context_class: Any = FittingContext

    def get_short_help_str(self, limit: int = 0) -> str:
        """Return the first sentence of the help, whatever its length."""
        text: str = super().get_short_help_str(1000)  # type: ignore[misc]
        return text


class Command(_Fitting, TyperCommand):
    """A command with help fitted to the terminal."""


class FittingGroup(_Fitting, TyperGroup):
    """A group of commands with help fitted to the terminal."""
