"""Which columns of a table fit a width, and how wide each then is: for terminals and for papers.

Columns are dropped before anything in a cell is: widths are those that the caller measures, in
letters or in points, and none is ever less than the least that a column asks for.
"""

from collections.abc import Sequence
from typing import NamedTuple

from .table import Table, naming


class Need(NamedTuple):
    """How wide a column is at least, with its words broken into lines, and at best.

    One whose cells are words comes first where there is room to spare: only its cells suffer.
    """

    least: float
    natural: float
    is_words: bool = False


def fits(needs: Sequence[Need], width: float, gap: float) -> bool:
    """Return whether columns can stand side by side, so far apart."""
    return sum(need.least for need in needs) + gap * (len(needs) - 1) <= width


def assigned(needs: Sequence[Need], width: float, gap: float) -> list[float]:
    """Return a width for each column: what is to spare goes to those that lack most.

    Raises:
        ValueError: if not even the least widths fit.
    """
    if not fits(needs, width, gap):
        raise ValueError(f"width: expected more than {width:g} for {len(needs)} columns")
    room = width - gap * (len(needs) - 1)
    first = [need if need.is_words else Need(need.least, need.least) for need in needs]
    widths = _shared(first, room)
    return _shared([Need(w, max(w, n.natural)) for w, n in zip(widths, needs, strict=True)], room)


def _shared(needs: Sequence[Need], room: float) -> list[float]:
    low, high = 0.0, max((need.natural for need in needs), default=0.0)
    for _ in range(50):  # halve the interval of the common width below which nothing is shortened
        middle = (low + high) / 2
        low, high = (middle, high) if sum(_within(needs, middle)) <= room else (low, middle)
    enough = sum(need.natural for need in needs) <= room
    return [need.natural for need in needs] if enough else _within(needs, low)


def _within(needs: Sequence[Need], most: float) -> list[float]:
    return [max(need.least, min(need.natural, most)) for need in needs]


def fitting(table: Table, needs: Sequence[Need], width: float, gap: float) -> list[int]:
    """Return the numbers of the columns that are shown in this width.

    Those that name a row always are, and one more; folded ones never are.
    """
    names = naming(table)
    shown = [i for i, column in enumerate(table.columns) if i < names or not column.folded]
    for i in _first_dropped(table, names):
        if fits([needs[i] for i in shown], width, gap) or len(shown) <= names + 1:
            break
        shown.remove(i)
    return shown


def _first_dropped(table: Table, names: int) -> list[int]:
    """Return columns in the order in which they are dropped: from the right, the best kept."""
    numbers = [i for i in range(names, len(table.columns)) if not table.columns[i].folded]
    return sorted(numbers, key=lambda i: (bool(table.columns[i].best), -i))


def parts(names: int, needs: Sequence[Need], width: float, gap: float) -> list[list[int]]:
    """Return columns in as few parts as fit, each begun by those that name a row, evenly filled."""
    count, low, high = len(_filled(names, needs, width, gap)), 0.0, width
    for _ in range(20):  # halve the interval of the least width that still takes no more parts
        middle = (low + high) / 2
        more = len(_filled(names, needs, middle, gap)) > count
        low, high = (middle, high) if more else (low, middle)
    return _filled(names, needs, high, gap)


def _filled(names: int, needs: Sequence[Need], width: float, gap: float) -> list[list[int]]:
    """Return parts of which each takes all that fit, and one column at least."""
    made: list[list[int]] = []
    for i in range(names, len(needs)):
        if made and fits([needs[j] for j in [*made[-1], i]], width, gap):
            made[-1].append(i)
        else:
            made.append([*range(names), i])
    return made or [list(range(names))]
