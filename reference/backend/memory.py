"""Arrays in a single block of memory: a call of a kernel takes as long for each array it is given.

A kernel views the parts where they are, and the interpreter views them alike.
"""

from itertools import pairwise

import numpy as np

from ..arguments import FloatArray


def packed(*arrays: np.ndarray) -> FloatArray:
    """Return the arrays one after the other, behind a table of where each begins and ends.

    Each is copied in C order and filled up to whole numbers of 8 bytes.
    """
    ends = [2 * len(arrays)]
    rows = []
    for values in arrays:
        content = np.ascontiguousarray(values).tobytes()
        rows.append(np.frombuffer(content + bytes(-len(content) % 8)))
        ends.append(ends[-1] + len(rows[-1]))
    table = np.array([*pairwise(ends)], dtype=np.int64).reshape(-1)
    return np.concatenate([table.view(np.float64), *rows])


def part(memory, i, kind):
    """Return the i-th array of a block as a row of a kind of entries, in place."""
    table = memory[2 * i : 2 * i + 2].view(np.int64)
    return memory[table[0] : table[1]].view(kind)
