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
    table = np.array([(*place, values.size) for place, values in places], dtype=np.int64)
    return np.concatenate([table.reshape(-1).view(np.float64), *rows])


def part(memory, i, kind):
    """Return the i-th array of a block as a row of a kind of entries, in place."""
    table = memory[3 * i : 3 * i + 3].view(np.int64)
    return memory[table[0] : table[1]].view(kind)[: table[2]]
