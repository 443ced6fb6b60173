"""What a report or a bench comes to, in ten lines: the user's solvers, who leads, what lacks."""

from collections.abc import Sequence

from ..tables.aligned import filled
from ..tables.entered import remarks_of_entrants
from ..tables.results import Results, counted, listed
from ..tables.table import is_blank, words
from ..text import visible
from .headlines import Answers, Verdict, answers
from .page.shown_tables import gist
from .report import Written
from .sections import tables
from .standings import Headline

# What the headlines ask that are printed first, and how many are printed.
_FIRST, HEADLINES = ("Most accurate", "Fastest to"), 3
# Lines of a report, beside those on the user's solvers, and tables that a bench may sum up.
LINES, TABLES = 10, 4


def outcome(written: Written, width: int) -> list[str]:
    """Return what a report came to in lines for a terminal.

    They are ten of 80 letters, or fewer, after those on the user's solvers.
    """
    answers, page = written.answers, str(written.page)
    sentences = [_verdict(answers.verdict), *map(_headline, three(answers.headlines))]
    sentences += _field(answers, width)
    sentences.append(f"{page}: the page, {len(written.tables)} tables (plumbob report --list)")
    named = listed(answers.absent)
    missing = [one for one in written.missing if not named or named not in one]
    *lines, last = (filled(visible(sentence), width) for sentence in sentences)
    lines.append(_missing(missing, width, LINES - sum(map(len, (*lines, last)))))
    first = (filled(visible(_headline(standing)), width) for standing in answers.standings)
    return [line for part in (*first, *lines, last) for line in part]


def ending(results: Results, suites: Sequence[str], width: int) -> list[str]:
    """Return what a bench of some suites came to in lines for a terminal."""
    known = answers(results)
    first, leaders = known.standings, three(known.headlines)
    sentences = [*map(_headline, (*first, *leaders)), *remarks_of_entrants(results, suites)]
    if "check" in suites:
        sentences.insert(len(first), _verdict(known.verdict))
    if not sentences:
        full = [table for table in tables(results, suites) if not is_blank(table)]
        sentences = [f"{table.title}: {gist(table.summary)}" for table in full[:TABLES]]
    sentences += _field(known, width)
    return [line for sentence in sentences for line in filled(visible(sentence), width)]


def _field(answers: Answers, width: int) -> list[str]:
    """Return a sentence on the scale and on who is absent, if there is anything to say."""
    scale = f"{answers.scale}. " if answers.scale else ""
    if answers.absent:
        return [_named(f"{scale}Absent: ", answers.absent, "; `make peers` adds.", width)]
    return [scale] if scale else []


def _missing(sentences: Sequence[str], width: int, room: int) -> list[str]:
    """Return as many sentences on what is missing as there are lines for, and count the others."""
    wrapped = [filled(visible(f"Missing: {sentence}"), width) for sentence in sentences]
    for count in range(len(wrapped), -1, -1):
        lines = [line for part in wrapped[:count] for line in part]
        if more := len(wrapped) - count:
            remarks = counted(more, "more remark" if count else "remark")
            lines.append(f"Missing: {remarks} at the end of the page.")
        if len(lines) <= max(1, room):
            break
    return lines


def _verdict(verdict: Verdict | None) -> str:
    if verdict is None:
        return "Right? Not checked yet: `plumbob bench check` does it."
    used = words(100.0 * verdict.used)
    margin = f"the narrowest uses {used} % of its tolerance"
    if verdict.held < verdict.total:
        return f"WRONG: {verdict.total - verdict.held} of {verdict.total} claims are missed."
    return f"Right: {verdict.held} of {verdict.total} claims hold, {margin}."


def three(headlines: Sequence[Headline]) -> list[Headline]:
    """Return those that are printed: who is accurate at kinematics, and who is fast at cloths."""
    return sorted(headlines, key=lambda h: not h.asked.startswith(_FIRST))[:HEADLINES]


def _headline(headline: Headline) -> str:
    asked = headline.asked[:1].lower() + headline.asked[1:]
    if not headline.chapter:
        return f"{headline.asked}: {headline.answer}; {headline.detail.rstrip('.')}."
    return f"{headline.chapter}, {asked}: {headline.answer}, {headline.detail}."


def _named(begin: str, names: Sequence[str], end: str, width: int) -> str:
    """Return a line that names as many as fit its width, and counts the others."""
    for count in range(len(names), -1, -1):
        more = len(names) - count
        also = f"{more} more" if count else f"{more}"
        line = begin + ", ".join([*names[:count], *([also] if more else [])]) + end
        if len(line) <= width:
            break
    return line
