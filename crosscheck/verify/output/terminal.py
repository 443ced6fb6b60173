"""What `verify` prints: one screen with a line a task, what is wrong, and what to do next."""

import re
import sys
import unicodedata
from collections.abc import Sequence

from plumbob.bench.tables.aligned import aligned
from plumbob.bench.tables.columns import text
from plumbob.bench.tables.table import Column, Table, cells
from plumbob.bench.text import visible

from ..judgement import CaseJudgement, Report, TaskReport
from ..sentence import Sentence, sentence
from . import comparison, saved
from .words import (
    GOOD,
    VERDICTS,
    Presentation,
    Say,
    advice,
    complaints,
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


def lines(report: Report, context: Presentation, height: int = HEIGHT) -> list[str]:
    """Return what is printed, at most 80 columns wide and cut to about so many lines."""
    say = context.say
    bad = [task for task in report.tasks if task.verdict not in GOOD]
    shown = [*wrapped(say(introduction(report)), WIDTH), *_table(report.tasks, say)]
    for remark in remarks(report):
        shown += wrapped(say(remark), WIDTH)
    end = wrapped(say(advice(report.tasks)), WIDTH)
    reserved = [(task, list(_reservations(task))) for task in report.tasks if task.verdict in GOOD]
    reserved = [(task, words) for task, words in reserved if words]
    free = 0 if bad and height < ENDLESS else height - len(shown) - len(end) - 1
    for task, words in reserved:
        shown += _reserved(task, words, say, max(_COMPLAINT, free // len(reserved)))
    if bad and height < ENDLESS:
        others = [line for task in bad[1:] for line in _brief(task, say)]
        room = height - len(shown) - len(end) - len(others) - 2
        shown += ["", *_trouble(bad[0], context, room), *others]
    else:
        shown += [line for task in bad for line in ("", *_trouble(task, context, height))]
    if any(line.endswith(_CUT) for line in shown):
        end = [*wrapped(say(sentence("Cut at …: --html FILE or | cat shows all.")), WIDTH), *end]
    return [*shown, "", *end] if len(shown) + len(end) < height else [*shown, *end]


def _table(tasks: Sequence[TaskReport], say: Say) -> list[str]:
    """Return a line a task, below a heading."""
    columns = (
        text(say(sentence("task")), title),
        text(say(sentence("verdict")), lambda task: say(VERDICTS[task.verdict])),
        Column(say(sentence("digits")), read=lambda t: t.digits and f"{t.digits:.1f}"),
        Column(say(sentence("cases passed")), read=lambda t: f"{passed(t)}/{len(t.judgements)}"),
        text(say(sentence("beside the reference")), lambda t: (pace := speed(t)) and say(pace)),
    )
    made = aligned(Table("tasks", "", columns, cells(columns, tasks)), WIDTH)
    return ["".join(span.text for span in line).rstrip() for line in made.lines]


def _reservations(task: TaskReport) -> list[Sentence]:
    """Return what is said of answers that none is wrong of: another model, what it behaves like."""
    worst = max(task.judgements, key=lambda one: one.verdict, default=None)
    found = complaints(worst)[:1] if worst is not None else []
    return [*found, *explanations(task)]


def _reserved(task: TaskReport, words: Sequence[Sentence], say: Say, most: int) -> list[str]:
    told = f"{title(task)}: " + " ".join(dict.fromkeys(map(say, words)))
    return _cut(wrapped(told, WIDTH, "  "), most)


def _brief(task: TaskReport, say: Say) -> list[str]:
    """Return what is wrong with a task in two lines."""
    failure = task.smallest_failure
    words = [*explanations(task), *complaints(failure)] if failure else _reservations(task)
    return _cut(wrapped(f"{title(task)}: {' '.join(map(say, words))}", WIDTH), 2)


def _trouble(task: TaskReport, context: Presentation, room: int) -> list[str]:
    """Return what is wrong with a task, in so many lines if that can be."""
    say = context.say
    failure = task.smallest_failure
    words = explanations(task) if failure else _reservations(task)
    why = [line for told in words for line in wrapped(say(told), WIDTH, "  ")]
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
    told = sentence(
        "Smallest failing case, {name}: {what}", name=f'"{failure.case.name}"', what=what
    )
    return wrapped(say(told), WIDTH, "  ")


def _again(task: TaskReport, context: Presentation) -> list[str]:
    path = context.files.get((task.task, task.method))
    if path is None:
        return []
    command = saved.command(context.solver, path)
    return [
        f"  {context.say(sentence('It is saved; ask it again:'))}",
        f"    {context.say(command)}",
    ]


def _numbers(failure: CaseJudgement, say: Say, most: int) -> list[str]:
    """Return a heading and at most so many rows of numbers side by side."""
    rows = comparison.rows(failure, min(most, 3))
    if most < 1 or not rows:
        return []
    label = max(width(row.label) for row in rows)
    texts = [comparison.written(row) for row in rows]
    column = max(len(text) for pair in texts for text in pair)
    if label + 2 * column + 8 > WIDTH:  # below each other
        return _stacked(rows[: max(most // 2, 1)], label, say)
    heads = say(sentence("yours")), say(sentence("expected"))
    shown = [(" " * label, *heads), *((r.label, *t) for r, t in zip(rows, texts, strict=True))]
    return [
        f"    {_aligned(a, label)}  {_aligned(b, column, right=True)}"
        f"  {_aligned(c, column, right=True)}"
        for a, b, c in shown
    ]


def _stacked(rows: Sequence[comparison.Row], label: int, say: Say) -> list[str]:
    heads = say(sentence("yours")), say(sentence("expected"))
    size = max(map(width, heads))
    return [
        f"    {_aligned(name, label)}  {_aligned(head, size)}  {text}"
        for row in rows
        for name, head, text in zip((row.label, ""), heads, comparison.written(row), strict=True)
    ]


def width(text: str) -> int:
    """Return how many columns a text takes on a terminal."""
    return sum(
        0 if unicodedata.combining(letter) else 1 + (unicodedata.east_asian_width(letter) in "WF")
        for letter in text
    )


def _aligned(text: str, size: int, right: bool = False) -> str:
    space = " " * (size - width(text))
    return space + text if right else text + space


def wrapped(text: str, size: int, indent: str = "") -> list[str]:
    """Return a text in lines of at most so many columns, each indented."""
    shown, line = [], indent
    for piece in _pieces(text, size - len(indent)):
        if width(line + piece) <= size or not line.strip():
            line += piece
            continue
        moved = _PIECE.findall(line)[-1] if piece in _CLOSING or line[-1] in _OPENING else ""
        shown.append(line.removesuffix(moved).rstrip())
        line = indent + moved + piece.lstrip()
    return [*shown, line.rstrip()] if line.strip() else shown


def _pieces(text: str, size: int) -> list[str]:
    """Return words, spaces and single letters, those that fit no line cut."""
    return [
        match[i : i + size]
        for match in _PIECE.findall(visible(text))
        for i in range(0, len(match), size)
    ]


def _cut(shown: list[str], most: int) -> list[str]:
    """Return at most so many lines; an ellipsis says that there was more."""
    if len(shown) <= most:
        return shown
    last = shown[most - 1]
    while width(last) > WIDTH - 2:
        last = last[:-1]
    return [*shown[: most - 1], last + _CUT]


def show(report: Report, context: Presentation) -> None:
    """Print the screen, the verdicts in colour where the terminal has some."""
    from rich.console import Console
    from rich.text import Text

    console = Console(highlight=False, markup=False, emoji=False, soft_wrap=True)
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
