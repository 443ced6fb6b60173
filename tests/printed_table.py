"""Read tables back from what a command prints, knowing nothing of how they were made."""

import itertools
import re

from rich.cells import cell_len

# What a table ends with: a blank line, or a sentence below it.
_END = re.compile(r"$|\d+ of \d+ (columns|claims)|MISSED: |plumbob report ")


def columns(lines):
    """Return the texts below each other in every column, one a line, "" where there is none.

    Columns stand apart where two letters in a row are blank in every line; no cell has such.
    """
    width = max(map(cell_len, lines))
    places = [_places(line, width) for line in lines]
    blank = [all(line[k] == " " for line in places) for k in range(width)] + [True, True]
    found, start = [], 0
    for k in range(width + 1):
        if blank[k] and blank[k + 1] and not all(blank[start:k]):
            found.append(["".join(line[start:k]).strip() for line in places])
            start = k
    return found


def _places(line, width):
    """Return a letter for each place on the terminal; the second of a wide letter is ""."""
    taken = [place for letter in line for place in (letter, *[""] * (cell_len(letter) - 1))]
    return taken + [" "] * (width - len(taken))


def rows(lines):
    """Return the cells of each line, the headings first."""
    return [list(cells) for cells in zip(*columns(lines), strict=True)]


def letters(*texts):
    """Return texts letter by letter, however they are broken into lines."""
    return re.sub(r"\s", "", "".join(texts))


def below(out, about, until=_END):
    """Return the lines of the table that follows some sentences."""
    lines, sentences = out.splitlines(), letters(*about)
    place = letters(out).index(sentences) + len(sentences)
    ends = itertools.accumulate((len(letters(line)) for line in lines), initial=0)
    start = next(i for i, end in enumerate(ends) if end >= place)
    end = (i for i, line in enumerate(lines[start:], start) if until.match(line))
    return lines[start : next(end, None)]
