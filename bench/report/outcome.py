"""Print the result of a report or a bench in a few lines: ranks, leaders, missing solvers."""

from collections.abc import Iterable, Sequence

from ..tables.aligned import filled
from ..tables.entered import remarks_of_entrants
from ..tables.results import Results, counted
from ..tables.table import is_blank, words
from ..text import visible
from .headlines import ClaimCount, Overview, overview
from .page.page_tables import gist
from .report import BenchReport
from .sections import tables
from .standings import Headline

# The headlines that are printed first, and the number that is printed.
_FIRST, HEADLINES = ("Most accurate", "Fastest to"), 3
# Lines on a report without those on the user's solvers; tables that a bench summarises.
LINES, TABLES = 10, 4


def outcome(report: BenchReport, width: int) -> list[str]:
    """Return a summary of a report: the user's solvers, then at most ten lines of 80 letters."""
    answers = report.answers
    sentences = [_verdict(answers.verdict), *map(_sentence, printed(answers.headlines))]
    sentences += _scale_and_absent(answers, width)
    page = f"{report.page}: the page, {len(report.tables)} tables (plumbob report --list)"
    lines, last = _lines(sentences, width), _lines([page], width)
    missing = [text for text in report.missing if not text.startswith("Absent peers")]
    lines += _missing(missing, width, LINES - len(lines) - len(last))
    return [*_lines(map(_sentence, answers.standings), width), *lines, *last]


def ending(results: Results, suites: Sequence[str], width: int) -> list[str]:
    """Return a summary of a bench of some suites."""
    answers = overview(results)
    sentences = [*map(_sentence, answers.standings)]
    sentences += [_verdict(answers.verdict)] if "check" in suites else []
    sentences += map(_sentence, printed(answers.headlines))
    sentences += remarks_of_entrants(results, suites)
    if not sentences:
        full = [table for table in tables(results, suites) if not is_blank(table)]
        gists = {table.title: gist(table.summary) for table in full[:TABLES]}
        sentences = [f"{title}: {text}" if text else title for title, text in gists.items()]
    return _lines([*sentences, *_scale_and_absent(answers, width)], width)


def _lines(sentences: Iterable[str], width: int) -> list[str]:
    return [line for sentence in sentences for line in filled(visible(sentence), width)]


def _scale_and_absent(answers: Overview, width: int) -> list[str]:
    """Return a line on the scale and as many absent peers as fit, if there are any."""
    scale = f"{answers.scale}. " if answers.scale else ""
    if not answers.absent:
        return [scale] if scale else []
    for count in range(len(answers.absent), -1, -1):
        more = len(answers.absent) - count
        names = answers.absent[:count] + ([f"{more} more" if count else f"{more}"] if more else [])
        line = f"{scale}Absent: {', '.join(names)}; `make peers` adds."
        if len(line) <= width:
            break
    return [line]


def _missing(sentences: Sequence[str], width: int, space: int) -> list[str]:
    """Return the sentences on missing parts that fit into a number of lines; count the rest."""
    for count in range(len(sentences), -1, -1):
        lines = _lines([f"Missing: {sentence}" for sentence in sentences[:count]], width)
        if more := len(sentences) - count:
            remarks = counted(more, "more remark" if count else "remark")
            lines.append(f"Missing: {remarks} at the end of the page.")
        if len(lines) <= max(1, space):
            break
    return lines


def _verdict(verdict: ClaimCount | None) -> str:
    if verdict is None:
        return "Right? Not checked yet: run `plumbob bench check`."
    if verdict.holding < verdict.total:
        return f"WRONG: {verdict.total - verdict.holding} of {verdict.total} claims are missed."
    margin = f"the largest difference uses {words(100.0 * verdict.used)} % of its tolerance"
    return f"Right: {verdict.holding} of {verdict.total} claims hold, {margin}."


def printed(headlines: Sequence[Headline]) -> list[Headline]:
    """Return the printed headlines: first the most accurate in kinematics, the fastest cloths."""
    return sorted(headlines, key=lambda h: not h.question.startswith(_FIRST))[:HEADLINES]


def _sentence(headline: Headline) -> str:
    question = headline.question
    if not headline.chapter:
        return f"{question}: {headline.answer}; {headline.detail.rstrip('.')}."
    question = f"{headline.chapter.capitalize()}, {question[:1].lower()}{question[1:]}"
    return f"{question}: {headline.answer}, {headline.detail}."
