"""Compare answers exactly: reruns of the same sources are the same to the bit, but for clocks.

What the arrays of a record are stands here: times by a clock, answers, or neither; what is better.
"""

from collections.abc import Mapping

import numpy as np

from plumbob.reference.arguments import distinct_texts

from ..harness.metrics import chance_of_pairs
from ..harness.record import Record
from ..tables.table import words
from .rows import Pair, Row, RowKey, Verdict

# Arrays that a clock filled [s], by suite; those of other suites are called as the first two.
_USUAL = frozenset({"seconds", "setup"})
_CLOCKED: Mapping[str, frozenset[str]] = {
    "cloth_scale": frozenset({"assembly", "factor", "refactor", "solve", "local", "step", "limit"}),
}
# What depends on the system's state: bytes of memory.
_INCIDENTAL = frozenset({("cloth_scale", "before"), ("cloth_scale", "memory")})
# Less of these is more right.
_ERRORS = frozenset({
    "residual", "error", "position", "rotation", "beyond", "excess", "drift", "difference",
    "positions", "rotations", "jacobians", "implicit", "true", "diverged", "above",
})  # fmt: skip
# Elsewhere these are the distance of a target, and so an input.
_DISTANCES = frozenset({("cloth", "distance"), ("newton", "distance")})
# More of these is more right.
_MERITS = frozenset({"solved", "held", "covered", "same"})
# Which targets were solved; who has it has times by target too.
SOLVED = "solved"
# A setting by which a clock ends a solve: its answers differ from run to run.
_TIME_LIMIT = "seconds"


def is_clocked(suite: str, name: str) -> bool:
    """Return whether an array holds times by a clock."""
    return name in _CLOCKED.get(suite, _USUAL)


def is_answer(suite: str, name: str) -> bool:
    """Return whether an array is the same to the bit whenever it is measured."""
    return not is_clocked(suite, name) and (suite, name) not in _INCIDENTAL


def worse_sign(suite: str, name: str) -> int:
    """Return 1 if more of it is worse, -1 if more of it is better, 0 if neither is known."""
    if name in _ERRORS or (suite, name) in _DISTANCES:
        return 1
    return -1 if name in _MERITS else 0


def is_cut_by_clock(record: Record) -> bool:
    """Return whether a time limit ends each of its solves."""
    return _TIME_LIMIT in record.settings


def ended_by_clock(record: Record) -> np.ndarray:
    """Return which motions of a record a budget of time ended early; empty if it holds none.

    A solver that fails leaves a remark, and where there is one none is excused.
    """
    arrays = record.arrays
    if not {"frames", "wanted"} <= arrays.keys() or np.size(arrays.get("remark_particles", ())):
        return np.zeros(0, dtype=bool)
    return np.asarray(arrays["frames"] < arrays["wanted"])


def differing(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return where two arrays of one shape hold other numbers; NaN is like NaN."""
    return np.asarray(~((a == b) | ((a != a) & (b != b))))


# Which verdict on an array is that of its row.
_GRAVITY = (Verdict.LESS_RIGHT, Verdict.CHANGED, Verdict.MORE_RIGHT, Verdict.SAME)


def compare_answers(key: RowKey, pair: Pair) -> Row:
    """Return what became of the answers of a row.

    Arrays are compared to the bit, over the targets that both runs came to where a budget of time
    ended one of them sooner. The first array that is worse decides, else the first that differs.
    """
    if pair.old.size != pair.new.size:
        old, new = distinct_texts(pair.old.size, pair.new.size)
        why = f"measured on {old} and on {new}: not compared"
        return Row(key, "", Verdict.UNDECIDED, why=why)
    answers = [name for name in pair.old.arrays if is_answer(key[0], name)]
    found = [_compared(key, name, pair) for name in answers if name in pair.new.arrays]
    lost = [name for name in pair.old.arrays if name not in pair.new.arrays]
    found += [Row(key, name, Verdict.CHANGED, 1.0, "no longer measured") for name in lost]
    same = Row(key, "", Verdict.SAME, why="the same to the bit")
    return min([same, *found], key=lambda row: _GRAVITY.index(row.verdict))


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


def _prefixes(old: np.ndarray, new: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what two runs have of the same targets."""
    if old.ndim == new.ndim == 1:
        count = min(len(old), len(new))
        return old[:count], new[:count]
    return old, new


def _without_ended(pair: Pair, old: np.ndarray, new: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return arrays of a value a motion without the motions that a clock ended in either run."""
    ended = [ended_by_clock(record)[: np.size(old)] for record in pair]
    if old.ndim == 1 and all(len(one) == len(old) == len(new) for one in ended):
        kept = ~np.any(ended, axis=0)
        return old[kept], new[kept]
    return old, new


def _compared(key: RowKey, name: str, pair: Pair) -> Row:
    old, new = _without_ended(pair, *_prefixes(pair.old.arrays[name], pair.new.arrays[name]))
    if old.shape != new.shape:
        return Row(key, name, Verdict.CHANGED, 1.0, f"shape {old.shape}, now {new.shape}")
    at = differing(old, new)
    if not at.any():
        return Row(key, name, Verdict.SAME, why="the same to the bit")
    before, after = (np.asarray(values[at], dtype=float) for values in (old, new))
    sign = worse_sign(key[0], name)
    worse = int(np.sum(np.isnan(after) | (sign * (after - before) > 0)))
    why = _change(before[0].item(), after[0].item())
    if old.size > 1:
        why += f" ({len(before)} of {old.size} differ" + (f", {worse} worse)" if sign else ")")
    verdict = _verdict(sign, worse, len(before))
    return Row(key, name, verdict, float(_relative(before, after).max()), why)


def _change(before: float, after: float) -> str:
    """Return two numbers in words, with all their digits where few are alike."""
    texts = words(before), words(after)
    return ", now ".join(texts if texts[0] != texts[1] else (repr(before), repr(after)))


def _verdict(sign: int, worse: int, count: int) -> Verdict:
    if not sign:
        return Verdict.CHANGED
    return Verdict.LESS_RIGHT if 2 * worse >= count else Verdict.MORE_RIGHT


def _relative(old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """Return differences as shares of the larger number; 1 beside what is no finite number."""
    with np.errstate(invalid="ignore"):
        share = np.abs(new - old) / np.maximum(np.abs(new), np.abs(old))
    return np.where(np.isfinite(share), share, 1.0)
