"""Compare answers exactly: the same sources give the same bits, except times and memory.

The catalogue of arrays is here: which hold times, which are better when smaller or larger.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from plumbob.reference.arguments import distinct_texts

from ..measure.metrics import chance_of_pairs
from ..tables.table import words
from .rows import ChangeVerdict, Pair, RowChange, RowKey

# Arrays of measured times [s], by suite; the default is for all other suites.
_DEFAULT_TIMES = frozenset({"seconds", "setup", "control", "overhead"})
_TIMES: Mapping[str, frozenset[str]] = {
    "scale": frozenset({"seconds", "reading", "computing", "proof"})
}
# Bytes of memory, which depend on the state of the system.
_MEMORY = frozenset({("scale", "proof_memory"), ("scale", "memory")})
# Arrays of which smaller values are better.
_ERRORS = frozenset({
    "residual", "error", "position", "rotation", "beyond", "excess", "drift", "difference",
    "positions", "rotations", "jacobians", "above",
})  # fmt: skip
# Arrays of which larger values are better.
_MERITS = frozenset({"solved", "holds", "covered", "same"})
# Which targets were solved; records with this array have times by target too.
SOLVED = "solved"
# Statistics of a row, and the arrays whose minimum is the smallest error.
SHARE, ERROR = "share solved", "smallest error"
_SMALLEST = {"error", "true"}
# The setting of a time limit per solve, which makes answers differ from run to run.
_TIME_LIMIT = "seconds"
SAME_BITS = "the same to the bit"


def is_time(suite: str, name: str) -> bool:
    """Return whether an array holds measured times."""
    return name in _TIMES.get(suite, _DEFAULT_TIMES)


def worse_sign(suite: str, name: str) -> int:
    """Return 1 if larger is worse, -1 if larger is better, 0 if neither is known."""
    if name in _ERRORS or (suite, name) == ("newton", "distance"):  # elsewhere an input
        return 1
    return -1 if name in _MERITS else 0


def compare_answers(key: RowKey, pair: Pair) -> RowChange:
    """Return the change of a row's answers: of the first worse array, else the first that differs.

    Arrays are compared to the bit, over the targets reached in both runs within the time limit.
    """
    if pair.old.size != pair.new.size:
        old, new = distinct_texts(pair.old.size, pair.new.size)
        why = f"measured on {old} and on {new}: not compared"
        return RowChange(key, "", ChangeVerdict.UNDECIDED, why=why)
    changes = [RowChange(key, "", ChangeVerdict.SAME, why=SAME_BITS)]
    for name in pair.old.numbers():
        if name not in pair.new.numbers():
            why = "no longer measured"
            changes.append(RowChange(key, name, ChangeVerdict.CHANGED, 1.0, why))
        elif not is_time(key[0], name) and (key[0], name) not in _MEMORY:
            changes.append(_compare_array(key, name, pair))
    order = (ChangeVerdict.LESS_RIGHT, ChangeVerdict.CHANGED, ChangeVerdict.MORE_RIGHT)
    by_verdict = {change.verdict: change for change in reversed(changes)}
    return next((by_verdict[v] for v in order if v in by_verdict), changes[0])


def compare_statistics(key: RowKey, pair: Pair) -> Iterator[RowChange]:
    """Yield the change of the share solved, in shares, and of the smallest error, by a factor - 1.

    Only changes are yielded, of rows of which both runs have as much.
    """
    if pair.old.size != pair.new.size:
        return
    if all(SOLVED in record.measured for record in pair):
        solved = _common_targets(pair.old.measured[SOLVED], pair.new.measured[SOLVED])
        old, new = (float(np.mean(part)) for part in solved)
        why = f"from {100 * old:.1f} % to {100 * new:.1f} %"
        yield from _statistic(key, SHARE, new - old, f"{'fell' if new < old else 'rose'} {why}")
    for name in _SMALLEST & pair.old.numbers().keys() & pair.new.numbers().keys():
        errors = (np.asarray(record.numbers()[name], dtype=float) for record in pair)
        old, new = (float(np.min(a[np.isfinite(a)], initial=np.inf)) for a in errors)
        if min(old, new) > 0:
            why = f"{'grew' if new > old else 'shrank'} from {words(old)} to {words(new)}"
            yield from _statistic(key, ERROR, 1 - new / old if new > old else old / new - 1, why)


def _statistic(key: RowKey, name: str, gain: float, why: str) -> Iterator[RowChange]:
    if gain:
        verdict = ChangeVerdict.MORE_RIGHT if gain > 0 else ChangeVerdict.LESS_RIGHT
        yield RowChange(key, name, verdict, abs(gain), f"{name} {why}")


def chance_by_time_limit(pair: Pair) -> float | None:
    """Return the probability of as many differing targets by chance; None without a time limit.

    McNemar's exact test (1947) on the targets solved in only one of the two runs.
    """
    has_targets = SOLVED in pair.old.measured and SOLVED in pair.new.measured
    if _TIME_LIMIT not in pair.old.settings or not has_targets:
        return None
    return chance_of_pairs(*_common_targets(pair.old.measured[SOLVED], pair.new.measured[SOLVED]))


def compare_limited_answers(key: RowKey, pair: Pair, chance: float, error_rate: float) -> RowChange:
    """Return the change of the targets solved within a time limit, by its adjusted probability."""
    old, new = _common_targets(pair.old.measured[SOLVED], pair.new.measured[SOLVED])
    before, after = int(np.sum(old)), int(np.sum(new))
    why = f"solved {before:,} of {len(old):,}, now {after:,}, within a time limit"
    if chance > error_rate:
        verdict = ChangeVerdict.SAME if before == after else ChangeVerdict.UNDECIDED
    else:
        verdict = ChangeVerdict.LESS_RIGHT if after < before else ChangeVerdict.MORE_RIGHT
    return RowChange(key, SOLVED, verdict, abs(after - before) / max(len(old), 1), why)


def _common_targets(old: np.ndarray, new: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the parts of two arrays for the same targets."""
    if old.ndim == new.ndim == 1:
        count = min(len(old), len(new))
        return old[:count], new[:count]
    return old, new


def _compare_array(key: RowKey, name: str, pair: Pair) -> RowChange:
    """Return the change of an array of answers."""
    old, new = _common_targets(pair.old.numbers()[name], pair.new.numbers()[name])
    if old.shape != new.shape:
        why = f"shape {old.shape}, now {new.shape}"
        return RowChange(key, name, ChangeVerdict.CHANGED, 1.0, why)
    differs = ~((old == new) | ((old != old) & (new != new)))
    if not differs.any():
        return RowChange(key, name, ChangeVerdict.SAME, why=SAME_BITS)
    before, after = (np.asarray(array[differs], dtype=float) for array in (old, new))
    sign = worse_sign(key[0], name)
    worse = int(np.sum(np.isnan(after) | (sign * (after - before) > 0)))
    first = before[0].item(), after[0].item()
    texts = [*map(words, first)]
    why = ", now ".join(texts if texts[0] != texts[1] else map(repr, first))
    if old.size > 1:
        worse_text = f", {worse:,} worse" if sign else ""
        why += f" ({len(before):,} of {old.size:,} differ{worse_text})"
    verdict = ChangeVerdict.CHANGED
    if sign:
        is_worse = 2 * worse >= len(before)
        verdict = ChangeVerdict.LESS_RIGHT if is_worse else ChangeVerdict.MORE_RIGHT
    with np.errstate(invalid="ignore"):
        relative = np.abs(after - before) / np.maximum(np.abs(after), np.abs(before))
    largest = float(np.where(np.isfinite(relative), relative, 1.0).max())
    return RowChange(key, name, verdict, largest, why)
