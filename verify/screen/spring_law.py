"""The pull of springs at each length, drawn in letters beside the linear law."""

import numpy as np

from plumbob.text.sentence import Sentence, sentence

from ..observe.spring_law import SpringLaw

# The size of the drawing on a terminal.
COLUMNS, ROWS = 48, 9
# The marks of a measured pull, of the linear law, and of both in the same place.
MEASURED, LINEAR, OVERLAP = "o", ".", "8"


def caption(law: SpringLaw) -> Sentence:
    """Return the caption of the drawing in letters."""
    return sentence(
        "Your springs (o) beside right ones (.), for l/r from {first:.2f} to {last:.2f}:",
        first=law.stretches[0], last=law.stretches[-1],
    )  # fmt: skip


def rows(law: SpringLaw) -> list[str]:
    """Return the rows of a drawing in letters, the strongest pull at the top."""
    grid = np.full((ROWS, COLUMNS), " ")
    x = np.linspace(law.stretches[0], law.stretches[-1], COLUMNS)
    columns = np.rint(np.interp(law.stretches, x, np.arange(COLUMNS))).astype(int)
    right = np.interp(x, law.stretches, law.linear)
    values = np.concatenate([law.measured, right])
    low, high = float(values.min()), float(values.max())

    linear, measured = (
        np.rint((ROWS - 1) * (high - values) / (high - low)).astype(int)
        for values in (right, law.measured)
    )
    grid[linear, np.arange(COLUMNS)] = LINEAR
    for row, column in zip(measured, columns, strict=True):
        grid[row, column] = MEASURED if grid[row, column] in (" ", MEASURED) else OVERLAP
    return ["|" + "".join(row).rstrip() for row in grid]
