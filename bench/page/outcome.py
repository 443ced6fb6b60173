"""Print the result of a report or a bench in a few lines: ranks, leaders, missing solvers."""

import shlex
from collections.abc import Iterable, Sequence

from plumbob.text.printable import visible

from ..peers.packages import peers_command
from ..tables.aligned import filled
from ..tables.results import Results, counted, grouped
from ..tables.table import is_blank, words
from ..tables.user_solvers import solver_remarks
from .headlines import ClaimCount, Overview, overview
from .report import BenchReport
from .sections import tables
from .standings import Headline

# The most headlines, and wins of other solvers, to print.
HEADLINES, WINS = 3, 1
# Lines on a report, not counting the user's solvers; tables summarised by a bench.
LINES, TABLES = 14, 4
# The most lines on the scale and the absent peers.
ABSENT_LINES = 2


def outcome(report: BenchReport, width: int) -> list[str]:
    """Return a summary of a report: the user's solvers, then a few lines of 80 letters."""
    answers = report.answers
    sentences = [_verdict(answers.verdict), *leading(answers)]
    sentences += _scale_and_absent(answers, width)
    command = shlex.join(["plumbob", "report", str(report.page.parent), "--list"])
    page = f"Read on: {report.page}, the page; `{command}` names the tables."
    lines, last = _lines(sentences, width), _lines([page], width)
    missing = [text for text in report.missing if not text.startswith("Absent peers")]
    lines += _missing(missing, width, LINES - len(lines) - len(last))
    return [*_lines(map(_standing, answers.standings), width), *lines, *last]


def ending(results: Results, suites: Sequence[str], width: int) -> list[str]:
    """Return a summary of a bench of some suites."""
    answers = overview(results)
    sentences = [*map(_standing, answers.standings)]
    sentences += [_verdict(answers.verdict)] if "check" in suites else []
    sentences += leading(answers)
    sentences += solver_remarks(results, suites)
    if not sentences:
        full = [table for table in tables(results, suites) if not is_blank(table)]
        gists = {table.title: table.summary.sentence for table in full[:TABLES]}
        sentences = [f"{title}: {text}" if text else title for title, text in gists.items()]
    return _lines([*sentences, *_scale_and_absent(answers, width)], width)


def _lines(sentences: Iterable[str], width: int) -> list[str]:
    return [line for sentence in sentences for line in filled(visible(sentence), width)]


def _scale_and_absent(answers: Overview, width: int) -> list[str]:
    """Return a sentence on the scale and as many absent peers as fit, if there are any."""
    scale = f"{answers.scale}. " if answers.scale else ""
    if not answers.absent:
        return [scale] if scale else []
    for count in range(len(answers.absent), -1, -1):
        more = len(answers.absent) - count
        names = answers.absent[:count] + ([f"{more} more" if count else f"{more}"] if more else [])
        line = f"{scale}Absent: {', '.join(names)}; `{peers_command()}` adds."
        if len(_lines([line], width)) <= ABSENT_LINES:
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


def leading(answers: Overview) -> list[str]:
    """Return who is best in a few tasks, most solved first, and where others beat ours."""
    tasks = grouped(answers.headlines, _task)
    firsts = [headlines[0] for headlines in tasks.values()]
    headlines = sorted(firsts, key=lambda headline: not headline.question.startswith("Most"))
    best = [f"Best: {headline.sentence}" for headline in headlines[:HEADLINES]]
    wins = [f"Others win: {win.sentence}" for win in answers.wins[:WINS]]
    if more := len(answers.wins) - len(wins):
        wins[-1] += f" {counted(more, 'more win')} of others: see the page."
    return [*best, *wins]


def _task(headline: Headline) -> tuple[str, str]:
    """Return the task of a headline without its group of robots."""
    return headline.question.partition(",")[0], headline.question.rpartition(", ")[2]


def _standing(headline: Headline) -> str:
    return f"Yours: {headline.sentence}"
