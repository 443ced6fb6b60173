"""Rankings of solvers, read from finished tables: one for each group of compared rows and column.

Sentences on who is first read these rankings, and so have the numbers, solvers and ties of a table.
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ..measure.metrics import Share
from ..peers import catalogue
from ..tables.results import grouped
from ..tables.table import Cell, Column, Table, best_cells, number_of, words

# Titles of the columns whose words divide the cases of a table: robots for tuning and held out.
KINDS = ("group", "kind of work")
_UNITS_OF_TIME = ("s", "ms", "µs", "ns")


class Place(NamedTuple):
    """A solver in a ranking, by its best row."""

    solver: str  # as records call it
    number: float  # the cell, a share as a part of 1; NaN without a result
    row: int  # its row in the table

    @property
    def engine(self) -> str:
        """The engine of the solver, or the solver itself if its engine is unknown."""
        return catalogue.find(self.solver).engine or self.solver


class TableRanking(NamedTuple):
    """The solvers of a group of compared rows, by a column of a table."""

    table: Table
    column: Column
    case: str  # what is compared: a robot, a cloth or some work
    kind: tuple[str, ...]  # the other words that the rows have in common
    places: tuple[Place, ...]  # the best first; solvers without a result last
    first: frozenset[str]  # the solvers that tie with the first, the first included

    @property
    def results(self) -> list[Place]:
        """The solvers with a result."""
        return [place for place in self.places if not math.isnan(place.number)]

    @property
    def leader(self) -> Place | None:
        """The first solver, None if another engine's solver ties with it."""
        if len({place.engine for place in self.places if place.solver in self.first}) != 1:
            return None
        return self.places[0]

    @property
    def own(self) -> Place | None:
        """The best of Plumbob's solvers, None if none takes part."""
        return next((place for place in self.places if catalogue.is_ours(place.solver)), None)

    @property
    def is_lost(self) -> bool:
        """Whether Plumbob takes part, and solvers of others alone are first."""
        return bool(self.own and self.first) and not any(map(catalogue.is_ours, self.first))

    @property
    def is_of_shares(self) -> bool:
        """Whether shares are compared."""
        j = self.table.columns.index(self.column)
        return any(isinstance(self.table.rows[place.row][j], Share) for place in self.places)

    def factor(self, place: Place) -> float:
        """Return by what factor the first is better than another, or by how many points of a share.

        The result is NaN without a finite factor.
        """
        best, number = self.places[0].number, place.number
        if self.is_of_shares:
            return 100.0 * (best - number)
        low, high = sorted((best, number))
        return high / low if low > 0.0 and math.isfinite(high) else math.nan


def measures_time(column: Column) -> bool:
    """Return whether the cells of a column are times."""
    return column.unit.partition("/")[0] in _UNITS_OF_TIME or column.title.startswith("time")


def rankings(table: Table) -> Iterator[TableRanking]:
    """Yield the rankings of a finished table, visible column by column; none without sources."""
    ranked = [i for i, source in enumerate(table.sources)
              if source.solvers and i not in table.unranked]  # fmt: skip
    groups = grouped(ranked, lambda i: table.rows[i][: table.compared])
    best = best_cells(table)
    for j, column in enumerate(table.columns):
        for rows in groups.values() if column.best and not column.folded else ():
            places = _places(table, j, rows)
            results = [place for place in places if not math.isnan(place.number)]
            first = [place for place in results if (place.row, j) in best] or results
            case, kind = _words_of(table, rows[0])
            yield TableRanking(
                table, column, case, kind, places, frozenset(p.solver for p in first)
            )


def _places(table: Table, j: int, rows: Sequence[int]) -> tuple[Place, ...]:
    """Return each solver once, by its best cell in column j."""
    sign = -1.0 if table.columns[j].best == "greatest" else 1.0
    places = [Place(table.sources[i].solvers[0], number_of(table.rows[i][j]), i) for i in rows]
    places.sort(key=lambda place: math.inf if math.isnan(place.number) else sign * place.number)
    return tuple(group[0] for group in grouped(places, lambda place: place.solver).values())


def _words_of(table: Table, i: int) -> tuple[str, tuple[str, ...]]:
    """Return the case of a row, and the other words that its group has in common."""
    cells: tuple[Cell, ...] = table.rows[i][: table.compared]
    groups = (table.rows[i][j] for j, column in enumerate(table.columns) if column.title in KINDS)
    case, *kind = map(words, (*(cells or ("",)), *groups))
    return case, tuple(filter(None, kind))
