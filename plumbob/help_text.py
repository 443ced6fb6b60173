"""Parts of the help that several commands share, and how it is fitted to the terminal."""

import re
import shutil
import textwrap
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

# Lines of help are no longer than this, however wide the terminal is, and no shorter than that.
WIDEST, NARROWEST = 80, 30

_Formatter: Any = typer.Context.formatter_class
_Context: Any = TyperCommand.context_class


def block(title: str, *lines: str) -> str:
    """Return lines for the end of a help text, kept as they are where they fit."""
    return "\n".join(["\b", f"{title}:", *(f"  {line}" for line in lines)])


class FittingFormatter(_Formatter):  # type: ignore[misc]
    """What sets the help: no line is wider than the terminal, if its words are not."""

    def __init__(self, **options: Any) -> None:
        self.most = max(NARROWEST, shutil.get_terminal_size().columns)
        super().__init__(**{**options, "width": min(self.most, WIDEST) - 2})

    def write_usage(self, prog: str, args: str = "", prefix: str | None = None) -> None:
        """Write the line of usage, every argument in one pair of brackets or in none."""
        args = re.sub(r"\[\[(.*?)\]\]", r"[\1]", re.sub(r"\{(.*?)(\.\.\.)?\}", r"\1", args))
        super().write_usage(prog, args, prefix)

    def write_dl(self, rows: Any, col_max: int = 30, col_spacing: int = 2) -> None:
        """Write options and what they do; in a narrow terminal below each other."""
        named = [(_without_type(name), text) for name, text in rows]
        super().write_dl(named, min(col_max, self.most // 3), col_spacing)

    def getvalue(self) -> str:
        """Return the help, lines that are too wide continued in the next."""
        lines = super().getvalue().splitlines()
        return "".join(f"{part}\n" for line in lines for part in fitted(line, self.most))


def _without_type(name: str) -> str:
    """Return an argument without a type of Python, or an option with a word in its place."""
    if not name.startswith("-"):
        return re.sub(r" <[^>]*>$", "", name)
    return re.sub(r"<([^>]*)>$", lambda found: "N" if "int" in found[1] else "NAME", name)


def fitted(line: str, width: int) -> list[str]:
    """Return a line, or several of no more letters: words behind a gap stay below each other."""
    if len(line) <= width:
        return [line]
    begin = len(line) - len(line.lstrip())
    gap = re.match(r" *\S.*?  +(?=\S)", line)
    hang = gap.end() if gap and gap.end() <= width // 2 else begin + 4
    options: dict[str, Any] = {"break_long_words": False, "break_on_hyphens": False}
    head = line[: gap.end()] if gap and gap.end() <= width // 2 else line[:begin]
    if gap and gap.end() > width // 2:
        line = re.sub(r"(?<=\S)  +", "  ", line)
    return textwrap.wrap(
        line[len(head) :], width, initial_indent=head, subsequent_indent=" " * hang, **options
    )


class FittingContext(_Context):  # type: ignore[misc]
    """A context whose help fits the terminal."""

    formatter_class = FittingFormatter


class Command(TyperCommand):
    """A command whose help fits the terminal."""

    context_class = FittingContext

    def get_short_help_str(self, limit: int = 0) -> str:
        """Return the first sentence of the help, whatever its length."""
        return super().get_short_help_str(1000)


class Group(TyperGroup):
    """A group of commands whose help fits the terminal."""

    context_class = FittingContext

    def get_short_help_str(self, limit: int = 0) -> str:
        """Return the first sentence of the help, whatever its length."""
        return super().get_short_help_str(1000)
