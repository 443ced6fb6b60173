"""What a report comes to, in ten lines: right or not, who leads, what is missing, where it is."""

from collections.abc import Sequence

from ..text import visible
from .headlines import Headline, Verdict
from .report import Written
from .results import counted, listed
from .tables.aligned import filled
from .tables.table import words

# Chapter and question of the headlines that are printed, as far as there are any, then others.
_FIRST = (("kinematics", "Most accurate"), ("kinematics", "Fastest"), ("cloth", "Fastest"))
HEADLINES = 3
LINES = 10


def outcome(written: Written, width: int) -> list[str]:
    """Return what a report came to in lines for a terminal: ten of 80 letters, or fewer."""
    answers, page = written.answers, str(written.page)
    said = [_verdict(answers.verdict), *map(_headline, three(answers.headlines))]
    scale = f"{answers.scale}. " if answers.scale else ""
    if answers.absent:
        said.append(_named(f"{scale}Absent: ", answers.absent, "; `make peers` adds.", width))
    elif scale:
        said.append(scale)
    said.append(f"{page}: the page, {len(written.tables)} tables (plumbob report --list)")
    named = listed(answers.absent)
    missing = [one for one in written.missing if not named or named not in one]
    *lines, last = (filled(visible(sentence), width) for sentence in said)
    room = LINES - sum(map(len, (*lines, last)))
    return [line for part in (*lines, _missing(missing, width, room), last) for line in part]


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
    """Return those that are printed: who is accurate and fast at kinematics and cloths."""

    def rank(headline: Headline) -> int:
        wanted = (headline.chapter == c and headline.asked.startswith(a) for c, a in _FIRST)
        return next((i for i, is_it in enumerate(wanted) if is_it), len(_FIRST))

    return sorted(headlines, key=rank)[:HEADLINES]


def _headline(headline: Headline) -> str:
    asked = headline.asked[:1].lower() + headline.asked[1:]
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
