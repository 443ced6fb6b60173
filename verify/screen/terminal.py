"""The screen of `verify`: a line a task, the mistakes, and what to do next."""

import re
from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Any

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

from plumbob.text.printable import harmless, visible
from plumbob.text.sentence import Say, Sentence, sentence, without_repetition

from ..judgement import CaseJudgement, Report, TaskReport, Verdict, smallest_failures
from ..observe.spring_law import law_in
from . import comparison, spring_law
from .words import (
    GOOD,
    VERDICTS,
    Presentation,
    advice,
    digits,
    explanations,
    introduction,
    is_unwritten,
    passed,
    remarks,
    reservations,
    speed,
    title,
)

WIDTH = 80
# The pieces between which a line may break: words, and single letters of scripts without spaces.
_PIECE = re.compile(
    r"[\u3000-\u30ff\u3400-\u9fff\uff00-\uffef]|[^\s\u3000-\u30ff\u3400-\u9fff\uff00-\uffef]+|\s+"
)
# Marks never at the start of a line, and marks never at the end.
_CLOSING, _OPENING = "，。、；：！？）》」』”’", "（《「『"
_PLAIN: dict[str, Any] = {"highlight": False, "markup": False, "emoji": False}
_COLOURS = dict(zip(Verdict, ("green", "yellow", "yellow", "red", "red"), strict=True))
_WIDEST = 10_000
_PAPER = Console(**_PLAIN, width=_WIDEST, color_system=None, force_terminal=False)


def lines(report: Report, context: Presentation) -> list[str]:
    """Return the screen, at most 80 columns wide."""
    say = context.say
    bad = [task for task in report.tasks if task.verdict not in GOOD and not is_unwritten(task)]
    good = [task for task in report.tasks if task.verdict in GOOD and reservations(task)]
    screen = [*wrapped(say(introduction(report))), *_table(report.tasks, say)]
    screen += paragraphs(remarks(report), say)
    texts = set[str]()  # of the faults that are explained on the screen
    for task in good:
        screen += _summary(task, say, texts)
    screen += _all_details(bad, context, texts)
    return list(map(harmless, [*screen, "", *wrapped(say(advice(report.tasks)))]))


def _table(tasks: Sequence[TaskReport], say: Say) -> list[str]:
    """Return a line a task, below a heading."""
    headings = [sentence("task"), sentence("verdict"), sentence("digits"),
                sentence("cases passed"), sentence("vs. reference")]  # fmt: skip
    rows = [
        (title(task), say(VERDICTS[task.verdict]), digits(task), passed(task), speed(task, say))
        for task in tasks
    ]
    return _grid([tuple(map(say, headings)), *rows], "llrrl", WIDTH)


def _grid(rows: Sequence[Sequence[str]], sides: str, size: int = _WIDEST) -> list[str]:
    """Return rows in columns; the first column gets the remaining space."""
    grid = Table.grid(padding=(0, 2, 0, 0))
    for i, side in enumerate(sides):
        grid.add_column(justify="right" if side == "r" else "left", no_wrap=i > 0, overflow="fold")
    for row in rows:
        grid.add_row(*row)
    with _PAPER.capture() as capture:
        _PAPER.print(grid, width=size, crop=False)
    return [line.rstrip() for line in capture.get().splitlines()]


def _summary(task: TaskReport, say: Say, texts: set[str]) -> list[str]:
    """Return the name of a right task and its reservations, each on a line of its own."""
    whole = {say(words): words for words in reservations(task)}
    parts = {text for text in whole for other in whole if text != other and text in other}
    words = [without_repetition(words, texts) for text, words in whole.items() if text not in parts]
    first, *remaining_texts = dict.fromkeys(map(say, words))
    rows = wrapped(f"{title(task)}: {first}", "  ")
    return [*rows, *(row for text in remaining_texts for row in wrapped(text, "    "))]


def _all_details(tasks: Sequence[TaskReport], context: Presentation, texts: set[str]) -> list[str]:
    """Return the details of tasks, once for neighbours with equal details.

    Faults whose texts stand on the screen are named by their codes.
    """
    screen = list[str]()
    for _, group in groupby(tasks, key=lambda task: _details(task, context, set())):
        same = list(group)
        heading = ", ".join(map(title, same))
        screen += ["", *wrapped(f"{heading}:"), *_details(same[0], context, texts)]
    return screen


def _details(task: TaskReport, context: Presentation, texts: set[str]) -> list[str]:
    """Return what answers show, the mistakes of a task, and its smallest failing cases."""
    say, failure, command = context.say, task.smallest_failure, context.command(task)
    if failure is None:
        return paragraphs(reservations(task), say, "  ")
    failures = smallest_failures(task.judgements, task.diagnosis.explained)
    # BROKEN cases have no numbers: the numbers of the WRONG case stand below its complaint, last
    failures.sort(key=lambda other: other.verdict, reverse=True)
    words = [without_repetition(words, texts) for words in explanations(task)]
    rows = paragraphs(words, say, "  ")
    law = law_in(task.diagnosis.observations)
    if law:
        rows += paragraphs([spring_law.caption(law)], say, "  ")
        rows += [f"    {row}" for row in spring_law.rows(law)]
    for other in failures:
        rows += _failing(task, other, len(failures), say)
    rows += numbers(failures[-1], say)
    if command:
        saved = sentence('The case "{name}" is saved. To run it again:', name=failure.case.name)
        rows += [*wrapped(say(saved), "  "), f"    {say(command)}"]
    return rows


def _failing(task: TaskReport, failure: CaseJudgement, kinds: int, say: Say) -> list[str]:
    """Return the smallest failing case and its complaint, unless the first law includes both.

    If there are two kinds of failures, the number of cases of its kind is added.
    """
    complaint, law = " ".join(map(say, failure.complaints[:1])), task.diagnosis.first_broken
    name, verdict = f'"{failure.case.name}"', failure.verdict
    is_told = law is not None and say(law).endswith(complaint) and failure.case.name in say(law)
    if kinds > 1:
        count = sum(judgement.verdict == verdict for judgement in task.judgements)
        fields: dict[str, Any] = {"verdict": say(VERDICTS[verdict]), "count": count, "name": name}
        short = sentence("{verdict} cases: {count}; the smallest is {name}.", **fields)
        message = sentence(
            "{verdict} cases: {count}; the smallest, {name}: {what}", what=complaint, **fields
        )
        return wrapped(say(short if is_told else message), "  ")
    if is_told:
        return []
    return wrapped(
        say(sentence("Smallest failing case, {name}: {what}", name=name, what=complaint)), "  "
    )


def numbers(failure: CaseJudgement, say: Say) -> list[str]:
    """Return a heading and rows of numbers side by side."""
    rows = comparison.rows(failure)
    if not rows:
        return []
    headings = say(sentence("yours")), say(sentence("expected"))
    columns = [("", *headings), *((row.label, *comparison.texts(row)) for row in rows)]
    grid = _grid(columns, "lrr")
    if max(map(cell_len, grid)) + 4 > WIDTH:  # one side below the other
        stacked = [
            cells
            for row in rows
            for cells in zip((row.label, ""), headings, comparison.texts(row), strict=True)
        ]
        grid = _grid(stacked, "lll")
    return [f"    {line}" for line in grid]


def wrapped(text: str, indent: str = "", size: int = WIDTH) -> list[str]:
    """Return a text in indented lines of at most so many columns; Rich breaks at spaces only."""
    room = size - len(indent)
    pieces = [
        match[i : i + room]
        for match in _PIECE.findall(visible(text))
        for i in range(0, len(match), room)
    ]
    rows, line = [], indent
    for piece in pieces:
        if cell_len(line + piece) <= size or not line.strip():
            line += piece
            continue
        moved = _PIECE.findall(line)[-1] if piece in _CLOSING or line[-1] in _OPENING else ""
        rows.append(line.removesuffix(moved).rstrip())
        line = indent + moved + piece.lstrip()
    return [*rows, line.rstrip()] if line.strip() else rows


def paragraphs(sentences: Iterable[Sentence], say: Say, indent: str = "") -> list[str]:
    """Return each sentence in lines of its own."""
    return [line for words in sentences for line in wrapped(say(words), indent)]


def show(report: Report, context: Presentation) -> None:
    """Print the screen, the verdicts in colour if the terminal has colours."""
    console = Console(**_PLAIN, soft_wrap=True)
    for line in lines(report, context):
        text = Text(line)
        for verdict, words in VERDICTS.items():
            pattern = rf"(?<=  ){re.escape(context.say(words))}(?=  )"
            text.highlight_regex(pattern, f"bold {_COLOURS[verdict]}")
        console.print(text)
