"""What `verify` prints: one screen with a line a task, what is wrong, and what to do next."""

import re
import sys
from collections.abc import Iterable, Sequence
from typing import Any

from rich.cells import cell_len, set_cell_size
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..judgement import CaseJudgement, Report, TaskReport
from ..sentence import Sentence, sentence, visible
from . import comparison
from .words import (
    GOOD,
    VERDICTS,
    Presentation,
    Say,
    advice,
    complaints,
    digits,
    explanations,
    introduction,
    passed,
    remarks,
    speed,
    title,
)

# Nothing is cut to an endless screen, which a pipe is.
WIDTH, HEIGHT, ENDLESS = 80, 24, sys.maxsize
# Lines that the sentences about one task, and about its smallest failing case, may take, or else a
# third and an eighth of the room.
_WHY, _COMPLAINT = 6, 3
_CUT = " …"
# What a line may be broken between: words, and letters of scripts that are written without spaces.
_PIECE = re.compile(
    r"[\u3000-\u30ff\u3400-\u9fff\uff00-\uffef]|[^\s\u3000-\u30ff\u3400-\u9fff\uff00-\uffef]+|\s+"
)
# Marks that no line begins with, and that none ends with.
_CLOSING, _OPENING = "，。、；：！？）》」』”’", "（《「『"
_PLAIN: dict[str, Any] = {"highlight": False, "markup": False, "emoji": False}
_WIDEST = 10_000
_PAPER = Console(**_PLAIN, width=_WIDEST, color_system=None, force_terminal=False)


def lines(report: Report, context: Presentation, height: int = HEIGHT) -> list[str]:
    """Return what is printed, at most 80 columns wide and cut to about so many lines."""
    say = context.say
    bad = [task for task in report.tasks if task.verdict not in GOOD]
    shown = [*wrapped(say(introduction(report))), *_table(report.tasks, say)]
    shown += paragraphs(remarks(report), say)
    end = wrapped(say(advice(report.tasks)))
    good = [task for task in report.tasks if task.verdict in GOOD and _reservations(task)]
    free = 0 if bad and height < ENDLESS else height - len(shown) - len(end) - 1
    for task in good:
        shown += _cut(_about(task, say, "  "), max(_COMPLAINT, free // len(good)))
    if bad and height < ENDLESS:
        others = [line for task in bad[1:] for line in _cut(_about(task, say), 2)]
        room = height - len(shown) - len(end) - len(others) - 2
        shown += ["", *_trouble(bad[0], context, room), *others]
    else:
        shown += [line for task in bad for line in ("", *_trouble(task, context, height))]
    if any(line.endswith(_CUT) for line in shown):
        end = [*wrapped(say(sentence("Cut at …: --html FILE or | cat shows all."))), *end]
    return [*shown, "", *end] if len(shown) + len(end) < height else [*shown, *end]


def _table(tasks: Sequence[TaskReport], say: Say) -> list[str]:
    """Return a line a task, below a heading."""
    heads = [sentence("task"), sentence("verdict"), sentence("digits"), sentence("cases passed"),
             sentence("beside the reference")]  # fmt: skip
    rows = [
        (title(task), say(VERDICTS[task.verdict]), digits(task), passed(task), speed(task, say))
        for task in tasks
    ]
    return _grid([tuple(map(say, heads)), *rows], "llrrl", WIDTH)


def _grid(rows: Sequence[Sequence[str]], sides: str, size: int = _WIDEST) -> list[str]:
    """Return rows in columns, the first one as narrow as the others leave it."""
    grid = Table.grid(padding=(0, 2, 0, 0))
    for i, side in enumerate(sides):
        grid.add_column(justify="right" if side == "r" else "left", no_wrap=i > 0, overflow="fold")
    for row in rows:
        grid.add_row(*row)
    with _PAPER.capture() as capture:
        _PAPER.print(grid, width=size, crop=False)
    return [line.rstrip() for line in capture.get().splitlines()]


def _reservations(task: TaskReport) -> list[Sentence]:
    """Return what is said of answers that none is wrong of: another model, what it behaves like."""
    worst = max(task.judgements, key=lambda one: one.verdict, default=None)
    return [*(complaints(worst)[:1] if worst is not None else ()), *explanations(task)]


def _about(task: TaskReport, say: Say, indent: str = "") -> list[str]:
    """Return the name of a task with all that is said of its answers."""
    failure = task.smallest_failure
    words = [*explanations(task), *complaints(failure)] if failure else _reservations(task)
    return wrapped(f"{title(task)}: " + " ".join(dict.fromkeys(map(say, words))), indent)


def _trouble(task: TaskReport, context: Presentation, room: int) -> list[str]:
    """Return what is wrong with a task, in so many lines if that can be."""
    say = context.say
    failure = task.smallest_failure
    words = explanations(task) if failure else _reservations(task)
    why = paragraphs(words, say, "  ")
    if failure is None:
        return [f"{title(task)}:", *_cut(why, max(_WHY, room // 3))]
    case = _cut(_failing(task, failure, say), max(_COMPLAINT, room // 8))
    again = _again(task, context)
    room -= 1 + len(case) + len(again)
    why = _cut(why, max(2, min(max(_WHY, room // 3), room - 3)))
    return [f"{title(task)}:", *why, *case, *_numbers(failure, say, room - len(why) - 1), *again]


def _failing(task: TaskReport, failure: CaseJudgement, say: Say) -> list[str]:
    """Return the smallest failing case and what is wrong with it, where no law has said so yet."""
    what, law = " ".join(map(say, complaints(failure)[:1])), task.diagnosis.first_broken
    if law is not None and say(law).endswith(what) and failure.case.name in say(law):
        return []
    name = f'"{failure.case.name}"'
    return wrapped(
        say(sentence("Smallest failing case, {name}: {what}", name=name, what=what)), "  "
    )


def _again(task: TaskReport, context: Presentation) -> list[str]:
    command = context.command(task)
    heading = context.say(sentence("It is saved; ask it again:"))
    return [f"  {heading}", f"    {context.say(command)}"] if command else []


def _numbers(failure: CaseJudgement, say: Say, most: int) -> list[str]:
    """Return a heading and at most so many rows of numbers side by side."""
    rows = comparison.rows(failure, min(most, 3))
    if most < 1 or not rows:
        return []
    heads = say(sentence("yours")), say(sentence("expected"))
    beside = [("", *heads), *((row.label, *comparison.written(row)) for row in rows)]
    found = _grid(beside, "lrr")
    if max(map(cell_len, found)) + 4 > WIDTH:  # below each other
        below = [
            cells
            for row in rows[: max(most // 2, 1)]
            for cells in zip((row.label, ""), heads, comparison.written(row), strict=True)
        ]
        found = _grid(below, "lll")
    return [f"    {line}" for line in found]


def wrapped(text: str, indent: str = "", size: int = WIDTH) -> list[str]:
    """Return a text in lines of at most so many columns, each indented.

    Rich breaks lines at spaces only, which Chinese has none of.
    """
    rows, line = [], indent
    for piece in _pieces(text, size - len(indent)):
        if cell_len(line + piece) <= size or not line.strip():
            line += piece
            continue
        moved = _PIECE.findall(line)[-1] if piece in _CLOSING or line[-1] in _OPENING else ""
        rows.append(line.removesuffix(moved).rstrip())
        line = indent + moved + piece.lstrip()
    return [*rows, line.rstrip()] if line.strip() else rows


def _pieces(text: str, size: int) -> list[str]:
    """Return words, spaces and single letters, those that fit no line cut."""
    return [
        match[i : i + size]
        for match in _PIECE.findall(visible(text))
        for i in range(0, len(match), size)
    ]


def paragraphs(sentences: Iterable[Sentence], say: Say, indent: str = "") -> list[str]:
    """Return each sentence in lines of its own."""
    return [line for one in sentences for line in wrapped(say(one), indent)]


def _cut(shown: list[str], most: int) -> list[str]:
    """Return at most so many lines; an ellipsis says that there was more."""
    if len(shown) <= most:
        return shown
    last = shown[most - 1]
    return [*shown[: most - 1], set_cell_size(last, min(cell_len(last), WIDTH - 2)) + _CUT]


def show(report: Report, context: Presentation) -> None:
    """Print the screen, the verdicts in colour where the terminal has some."""
    console = Console(**_PLAIN, soft_wrap=True)
    colours = {context.say(words): _COLOURS[verdict.name] for verdict, words in VERDICTS.items()}
    height = max(HEIGHT, console.height) if console.is_terminal else ENDLESS
    for line in lines(report, context, height):
        text = Text(line)
        for word, colour in colours.items():
            text.highlight_regex(rf"(?<=  ){re.escape(word)}(?=  )", colour)
        console.print(text)


_COLOURS = {
    "RIGHT": "bold green",
    "RIGHT_BUT": "bold yellow",
    "UNDECIDED": "bold yellow",
    "WRONG": "bold red",
    "BROKEN": "bold red",
}
