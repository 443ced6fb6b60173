"""Arrays in a single block of memory: a call of a kernel takes as long for each array it is given.

A kernel views the parts where they are, and the interpreter views them alike.
"""

from itertools import pairwise

import numpy as np

from ..arguments import FloatArray


def packed(*arrays: np.ndarray) -> FloatArray:
    """Return the arrays one after the other, behind a table of where each begins, ends, its length.

    Each is copied in C order and filled up to whole numbers of 8 bytes.
    """
    ends = [3 * len(arrays)]
    rows = []
    for values in arrays:
        content = np.ascontiguousarray(values).tobytes()
        rows.append(np.frombuffer(content + bytes(-len(content) % 8)))
        ends.append(ends[-1] + len(rows[-1]))
    places = zip(pairwise(ends), arrays, strict=True)
    table = [number for place, values in places for number in (*place, values.size)]
    return np.concatenate([np.array(table, dtype=np.float64), *rows])


def part(memory, i, kind):
    """Return the i-th array of a block as a row of a kind of entries, in place."""
    begin, end, length = int(memory[3 * i]), int(memory[3 * i + 1]), int(memory[3 * i + 2])
    return memory[begin:end].view(kind)[:length]
