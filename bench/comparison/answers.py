"""Compare answers exactly: reruns of the same sources are the same to the bit."""

from collections.abc import Iterator

import numpy as np

from plumbob.reference.arguments import distinct_texts

from ..harness.metrics import chance_of_pairs
from ..tables.table import words
from .quantities import SOLVED, ended_by_clock, is_answer, is_cut_by_clock, same_bits, worse_sign
from .rows import Pair, Row, RowKey, Verdict


def compare_answers(key: RowKey, pair: Pair) -> Row:
    """Return what became of the answers of a row.

    Arrays are compared to the bit, over the targets that both runs came to where a budget of time
    ended one of them sooner. The first array that is worse decides, else the first that differs.
    """
    if pair.old.size != pair.new.size:
        old, new = distinct_texts(pair.old.size, pair.new.size)
        why = f"measured on {old} and on {new}: not compared"
        return Row(key, "", Verdict.UNDECIDED, why=why)
    found = [_compared(key, name, pair) for name in _common(key, pair)]
    different = [row for row in found if row.verdict != Verdict.SAME]
    lost = [name for name in pair.old.arrays if name not in pair.new.arrays]
    different += [Row(key, n, Verdict.CHANGED, 1.0, "no longer measured") for n in lost]
    order = [Verdict.LESS_RIGHT, Verdict.CHANGED, Verdict.MORE_RIGHT]
    different.sort(key=lambda row: order.index(row.verdict))
    return different[0] if different else Row(key, "", Verdict.SAME, why="the same to the bit")


def chance_by_clock(pair: Pair) -> float | None:
    """Return how likely the solved targets differ as much by chance; None if no clock cuts them.

    McNemar's exact test (1947) on targets that only one of the two runs solved.
    """
    if not (is_cut_by_clock(pair.old) and SOLVED in pair.old.arrays and SOLVED in pair.new.arrays):
        return None
    return chance_of_pairs(*_prefixes(pair.old.arrays[SOLVED], pair.new.arrays[SOLVED]))


def compare_cut_answers(key: RowKey, pair: Pair, chance: float, rate: float) -> Row:
    """Return what became of answers that depend on a clock, given a chance over all rows."""
    old, new = _prefixes(pair.old.arrays[SOLVED], pair.new.arrays[SOLVED])
    why = f"solved {np.sum(old)} of {len(old)}, now {np.sum(new)}, cut by a clock"
    change = abs(int(np.sum(new)) - int(np.sum(old))) / max(len(old), 1)
    if chance > rate:
        return Row(key, SOLVED, Verdict.UNDECIDED if change else Verdict.SAME, change, why)
    verdict = Verdict.LESS_RIGHT if np.sum(new) < np.sum(old) else Verdict.MORE_RIGHT
    return Row(key, SOLVED, verdict, change, why)


def _common(key: RowKey, pair: Pair) -> Iterator[str]:
    for name in pair.old.arrays:
        if name in pair.new.arrays and is_answer(key[0], name):
            yield name


def _prefixes(old: np.ndarray, new: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what two runs have of the same targets."""
    if old.ndim == new.ndim == 1:
        count = min(len(old), len(new))
        return old[:count], new[:count]
    return old, new


def _without_ended(pair: Pair, old: np.ndarray, new: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return arrays of a value a motion without the motions that a clock ended in either run."""
    ended = [ended_by_clock(record)[: len(old)] for record in pair if old.ndim == 1]
    if not all(len(one) == len(old) == len(new) for one in ended):
        return old, new
    kept = ~np.any(ended, axis=0) if ended else ...
    return old[kept], new[kept]


def _compared(key: RowKey, name: str, pair: Pair) -> Row:
    old, new = _without_ended(pair, *_prefixes(pair.old.arrays[name], pair.new.arrays[name]))
    if same_bits(old, new):
        return Row(key, name, Verdict.SAME)
    if old.shape != new.shape:
        return Row(key, name, Verdict.CHANGED, 1.0, f"shape {old.shape}, now {new.shape}")
    differs = ~((old == new) | ((old != old) & (new != new)))
    before, after = (np.asarray(values[differs], dtype=float) for values in (old, new))
    sign = worse_sign(key[0], name)
    worse = int(np.sum(_is_worse(before, after, sign)))
    first = before[0].item(), after[0].item()
    texts = list(map(words, first))
    why = ", now ".join(map(repr, first) if texts[0] == texts[1] else texts)
    if old.size > 1:
        why += f" ({len(before)} of {old.size} differ" + (f", {worse} worse)" if sign else ")")
    verdict = _verdict(sign, worse, len(before))
    return Row(key, name, verdict, float(_relative(before, after).max()), why)


def _verdict(sign: int, worse: int, count: int) -> Verdict:
    if not sign:
        return Verdict.CHANGED
    return Verdict.LESS_RIGHT if 2 * worse >= count else Verdict.MORE_RIGHT


def _is_worse(old: np.ndarray, new: np.ndarray, sign: int) -> np.ndarray:
    """Return where a number is worse; one that is none is worse than any."""
    return np.isnan(new) | (sign * (new - old) > 0)


def _relative(old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """Return differences as shares of the larger number; 1 beside what is no finite number."""
    with np.errstate(invalid="ignore"):
        share = np.abs(new - old) / np.maximum(np.abs(new), np.abs(old))
    return np.where(np.isfinite(share), share, 1.0)
