"""The screen of `verify`: a line a task, the mistakes, and what to do next."""

import re
import sys
from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Any

from rich.cells import cell_len, set_cell_size
from rich.console import Console
from rich.table import Table
from rich.text import Text

from plumbob.text.printable import harmless, visible
from plumbob.text.sentence import Say, Sentence, sentence, without_repetition

from ..judgement import CaseJudgement, Report, TaskReport, Verdict, smallest_failures
from . import comparison
from .words import (
    GOOD,
    VERDICTS,
    Presentation,
    advice,
    causes,
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

# Nothing is cut on an endless screen, such as a pipe.
WIDTH, HEIGHT, ENDLESS = 80, 24, sys.maxsize
# The most lines of the sentences about a task, and about its smallest failing case, unless a third
# and an eighth of the screen are more. Beside mistakes, remarks get a twelfth of the screen.
_EXPLANATION, _COMPLAINT = 6, 3
_ELLIPSIS = " …"
# The pieces between which a line may break: words, and single letters of scripts without spaces.
_PIECE = re.compile(
    r"[\u3000-\u30ff\u3400-\u9fff\uff00-\uffef]|[^\s\u3000-\u30ff\u3400-\u9fff\uff00-\uffef]+|\s+"
)
# Marks that begin no line, and marks that end no line.
_CLOSING, _OPENING = "，。、；：！？）》」』”’", "（《「『"
_PLAIN: dict[str, Any] = {"highlight": False, "markup": False, "emoji": False}
_COLOURS = dict(zip(Verdict, ("green", "yellow", "yellow", "red", "red"), strict=True))
_WIDEST = 10_000
_PAPER = Console(**_PLAIN, width=_WIDEST, color_system=None, force_terminal=False)


def lines(report: Report, context: Presentation, height: int = HEIGHT) -> list[str]:
    """Return the screen, at most 80 columns wide and cut to about so many lines."""
    say = context.say
    bad = [task for task in report.tasks if task.verdict not in GOOD and not is_unwritten(task)]
    screen = [*wrapped(say(introduction(report))), *_table(report.tasks, say)]
    notes = paragraphs(remarks(report), say)
    screen += _shorten(notes, height // 12) if bad else notes
    end = wrapped(say(advice(report.tasks)))
    good = [task for task in report.tasks if task.verdict in GOOD and reservations(task)]
    free = 0 if bad and height < ENDLESS else height - len(screen) - len(end) - 1
    texts = set[str]()  # of the faults that are explained on the screen
    for task in good:
        text = _summary(task, say, "  ", texts if height == ENDLESS else None)  # else it may be cut
        screen += _shorten(text, max(_COMPLAINT, free // len(good)))
    if bad and height < ENDLESS:
        brief = [line for task in bad[1:] for line in _shorten(_summary(task, say), 2)]
        room = height - len(screen) - len(end) - len(brief) - 2
        screen += ["", *_details(bad[0], context, room), *brief]
    else:
        screen += _all_details(bad, context, height, texts)
    if any(line.endswith(_ELLIPSIS) for line in screen):
        hint = sentence("Cut at …: use --html FILE or | cat to see all of it.")
        end = [*wrapped(say(hint)), *end]
    whole = [*screen, "", *end] if len(screen) + len(end) < height else [*screen, *end]
    return list(map(harmless, whole))


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
    """Return rows in columns; the first column gets the space that the others leave."""
    grid = Table.grid(padding=(0, 2, 0, 0))
    for i, side in enumerate(sides):
        grid.add_column(justify="right" if side == "r" else "left", no_wrap=i > 0, overflow="fold")
    for row in rows:
        grid.add_row(*row)
    with _PAPER.capture() as capture:
        _PAPER.print(grid, width=size, crop=False)
    return [line.rstrip() for line in capture.get().splitlines()]


def _summary(
    task: TaskReport, say: Say, indent: str = "", texts: set[str] | None = None
) -> list[str]:
    """Return the name of a task and the sentences about its answers, each on a line of its own."""
    failure, texts = task.smallest_failure, set[str]() if texts is None else texts
    sentences = [*explanations(task), *failure.complaints] if failure else reservations(task)
    whole = {say(words): words for words in sentences}
    parts = {text for text in whole for other in whole if text != other and text in other}
    words = [without_repetition(words, texts) for text, words in whole.items() if text not in parts]
    new = list(dict.fromkeys(map(say, words)))
    first, *others = [f"{title(task)}: " + "".join(new[:1]), *new[1:]]
    return [*wrapped(first, indent), *(s for text in others for s in wrapped(text, f"{indent}  "))]


def _all_details(
    tasks: Sequence[TaskReport], context: Presentation, room: int, texts: set[str]
) -> list[str]:
    """Return the details of tasks, once for neighbours of which the same is said.

    Faults whose texts stand on the screen are named by their codes.
    """
    screen = list[str]()
    for _, group in groupby(tasks, key=lambda task: _details(task, context, room)[1:]):
        same = list(group)
        heading = ", ".join(map(title, same))
        screen += ["", *wrapped(f"{heading}:"), *_details(same[0], context, room, texts)[1:]]
    return screen


def _details(
    task: TaskReport, context: Presentation, room: int, texts: set[str] | None = None
) -> list[str]:
    """Return the mistakes of a task and its smallest failing case, in so many lines if possible."""
    say, texts = context.say, set[str]() if texts is None else texts
    failure, command = task.smallest_failure, context.command(task)
    heading, why_limit = f"{title(task)}:", max(_EXPLANATION, room // 3)
    if failure is None:
        return [heading, *_shorten(paragraphs(reservations(task), say, "  "), why_limit)]
    failures = smallest_failures(task.judgements, task.diagnosis.explained)
    # what is BROKEN has no numbers: then those of the WRONG case stand below its complaint, last
    failures.sort(key=lambda other: other.verdict, reverse=True)
    case = [
        line
        for other in failures
        for line in _shorten(_failing(task, other, len(failures), say), max(_COMPLAINT, room // 8))
    ]
    rerun = []
    if command:
        saved = sentence('The case "{name}" is saved. To run it again:', name=failure.case.name)
        rerun = [*wrapped(say(saved), "  "), f"    {say(command)}"]
    room -= 1 + len(case) + len(rerun)
    why = _why(task, say, texts, max(2, min(why_limit, room - 3)))
    rows = numbers(failures[-1], say, room - len(why) - 1)
    return [heading, *why, *case, *rows, *rerun]


def _why(task: TaskReport, say: Say, texts: set[str], limit: int) -> list[str]:
    """Return what answers show and the causes, in so many lines; both keep half if cut."""
    observed = paragraphs(task.diagnosis.observations, say, "  ")
    words = [without_repetition(words, texts) for words in causes(task)]
    why = paragraphs(words, say, "  ")
    share = limit - min(len(why), limit // 2)
    observed = _shorten(observed, share)
    return [*observed, *_shorten(why, limit - len(observed))]


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


def numbers(failure: CaseJudgement, say: Say, limit: int) -> list[str]:
    """Return a heading and rows of numbers side by side, in so many lines."""
    rows = comparison.rows(failure, min(limit, 3))
    if limit < 1 or not rows:
        return []
    headings = say(sentence("yours")), say(sentence("expected"))
    columns = [("", *headings), *((row.label, *comparison.texts(row)) for row in rows)]
    grid = _grid(columns, "lrr")
    if max(map(cell_len, grid)) + 4 > WIDTH:  # one side below the other
        stacked = [
            cells
            for row in rows[: max(limit // 2, 1)]
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


def _shorten(text: list[str], limit: int) -> list[str]:
    """Return at most so many lines; an ellipsis marks a cut."""
    if len(text) <= limit:
        return text
    last = text[limit - 1]
    return [*text[: limit - 1], set_cell_size(last, min(cell_len(last), WIDTH - 2)) + _ELLIPSIS]


def show(report: Report, context: Presentation) -> None:
    """Print the screen, the verdicts in colour if the terminal has colours."""
    console = Console(**_PLAIN, soft_wrap=True)
    height = max(HEIGHT, console.height) if console.is_terminal else ENDLESS
    for line in lines(report, context, height):
        text = Text(line)
        for verdict, words in VERDICTS.items():
            pattern = rf"(?<=  ){re.escape(context.say(words))}(?=  )"
            text.highlight_regex(pattern, f"bold {_COLOURS[verdict]}")
        console.print(text)
