"""The strip of all claims against their tolerances."""

import math
from typing import NamedTuple

from ..tables.table import number_of, words
from .page_tables import PageTable

# Decades of the strip of claims, and the width of a dot [%].
DECADES, DOT = 8, 1.3


class ClaimDot(NamedTuple):
    """A claim on the strip: its difference over its tolerance, its place [%], and its level."""

    name: str
    used: float
    place: float
    level: int
    address: str


def claim_dots(check: PageTable) -> list[ClaimDot]:
    """Return the claims of the cross-check by their differences on a log scale.

    Dots that would touch lie above each other.
    """
    titles = [column.title for column in check.table.columns]
    difference, tolerance = (titles.index(name) for name in ("largest difference", "tolerance"))
    claims = [
        (number_of(row[difference]) / number_of(row[tolerance]), words(row[0]), page_row.address)
        for row, page_row in zip(check.table.rows, check.rows, strict=True)
        if row[difference] is not None
    ]
    dots: list[ClaimDot] = []
    ends: list[float] = []  # of the last dot of each level
    for used, name, address in sorted(claims):
        place = 100 * (1 + math.log10(min(max(used, 10.0**-DECADES), 2.0)) / DECADES)
        level = next((i for i, end in enumerate(ends) if end <= place), len(ends))
        ends[level : level + 1] = [place + DOT]
        dots.append(ClaimDot(name, used, place, level, address))
    return dots
