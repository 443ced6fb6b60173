"""How wide each column of a table is: what is to spare goes to those that lack least."""

from collections.abc import Sequence


def assigned(least: Sequence[float], natural: Sequence[float], room: float) -> list[float]:
    """Return a width for each column, from its least to its natural one, that fill a room.

    The columns that lack little get all of it, and the others share evenly what is left.
    """
    widths, spare = list(least), room - sum(least)
    lacks = [max(0.0, wide - narrow) for narrow, wide in zip(least, natural, strict=True)]
    for place, j in enumerate(sorted(range(len(widths)), key=lambda j: lacks[j])):
        share = max(0.0, min(lacks[j], spare / (len(widths) - place)))
        widths[j] += share
        spare -= share
    return widths
