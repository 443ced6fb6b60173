"""Where others win: every ranking of every table in which solvers of others alone are first."""

import math
from collections.abc import Iterator, Sequence

from ..ranking.rankings import TableRanking, measures_time, rankings
from ..tables.results import Results, counted, grouped, listed
from ..tables.table import Table
from .sections import SECTIONS
from .standings import Headline, full_name, span

# The most cases that a sentence names.
MAX_NAMED = 3
# What a table may compare, beside cases.
_NOUNS = ("robot", "cloth", "task", "problem", "curve")


def wins_of_others(results: Results) -> list[Headline]:
    """Return where another solver is first and none of ours ties with it, table by table."""
    tables = ((section.name, layout(results)) for section in SECTIONS for layout in section.layouts)
    return [headline for chapter, table in tables for headline in wins_in(table, chapter)]


def wins_in(table: Table, chapter: str = "") -> Iterator[Headline]:
    """Yield where others win in a table: a sentence for each winner, column and kind of case."""
    compared = [ranking for ranking in rankings(table) if ranking.own and _has_rival(ranking)]
    for group in grouped(compared, lambda ranking: (ranking.column, ranking.kind)).values():
        losses = [ranking for ranking in group if ranking.is_lost]
        for wins in grouped(
            losses, lambda r: (r.places[0].solver, r.own and r.own.solver)
        ).values():
            yield Headline(chapter, "Where others win", _sentence(wins, len(group)), table.name)


def _has_rival(ranking: TableRanking) -> bool:
    own = ranking.own
    return any(own and place.engine != own.engine for place in ranking.places)


def _sentence(wins: Sequence[TableRanking], total: int) -> str:
    """Return who wins over the best of ours in these cases, out of so many, and by how much."""
    win, cases_won = wins[0], [ranking.case for ranking in wins if ranking.case]
    assert win.own
    kind = f", {', '.join(win.kind)}," * bool(win.kind)
    noun = title if (title := win.table.columns[0].title) in _NOUNS else "case"
    cases = f" ({listed(cases_won)})" if 0 < len(cases_won) <= MAX_NAMED else ""
    names = f"{full_name(win.places[0].solver)} {_verb(win)} {full_name(win.own.solver)}"
    place = f"(“{win.column.title}” in “{win.table.title}”)"
    count = f"on {len(wins)} of {counted(total, noun)}"
    return f"{names}{kind} {count}{cases}{_size(wins)} {place}."


def _verb(win: TableRanking) -> str:
    if measures_time(win.column):
        return "is faster than"
    return "solves more than" if win.is_of_shares else "is better than"


def _size(wins: Sequence[TableRanking]) -> str:
    """Return by how much others win: ", by a factor of 1.6 to 1.8"."""
    factors = [ranking.factor(ranking.own) for ranking in wins if ranking.own]
    finite = [factor for factor in factors if not math.isnan(factor)]
    unit = "{} percentage points" if wins[0].is_of_shares else "a factor of {}"
    size = f", by {unit.format(span(finite))}" if finite else ""
    missing = len(factors) - len(finite)
    return size + f", without a factor on {missing}" * bool(missing)
