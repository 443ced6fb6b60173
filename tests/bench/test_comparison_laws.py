"""The decisions of a comparison, each at its edge: shares, halves, margins, drift, the latest."""

import math
from dataclasses import replace

import numpy as np
import pytest

from plumbob.bench.comparison import times
from plumbob.bench.comparison.compare import Limits, compare, stops_at
from plumbob.bench.comparison.intervals import ERROR_RATE, Ratio
from plumbob.bench.comparison.rows import Verdict, by_row
from plumbob.bench.comparison.times import judged

KEY = ("timing", "p", "mine", "{}")


def changed(record, **arrays):
    """The record with other arrays."""
    return replace(record, arrays={**record.arrays, **{k: np.array(v) for k, v in arrays.items()}})


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_change_is_a_share_of_the_larger_number_and_a_gate_stops_from_there_on(make, factor):
    old = make.drawn("ccd", False, 1.0)
    new = changed(old, largest_angle=factor * old.arrays["largest_angle"])
    rows = compare([old], [new]).rows
    (row,) = (row for row in rows if row.quantity == "largest_angle")
    assert (row.verdict, row.change) == (Verdict.CHANGED, 0.5)
    assert stops_at(rows, Limits(accuracy=0.5)) == [row]
    assert stops_at(rows, Limits(accuracy=0.51)) == []


@pytest.mark.parametrize(
    ("position", "verdict"),
    [
        ([1e-8, 0.4, 0.1, 1e-7], Verdict.LESS_RIGHT),  # as many are worse as better
        ([1e-8, 0.4, 0.09, 1e-7], Verdict.MORE_RIGHT),  # one of three is worse
        ([1e-8, 0.6, 0.09, 1e-7], Verdict.LESS_RIGHT),
    ],
)
def test_answers_are_less_right_where_half_of_those_that_differ_are_worse(make, position, verdict):
    old = changed(make.raced("lm", "one start"), position=[1e-9, 0.5, 0.1, 1e-7])
    row = compare([old], [changed(old, position=position)]).rows[0]
    assert (row.verdict, row.quantity) == (verdict, "position")


@pytest.mark.parametrize(
    ("low", "high", "chance", "verdict"),
    [
        (0.92, 1.09, 1.0, Verdict.SAME),
        (0.90, 1.09, 1.0, Verdict.UNDECIDED),  # it may be 1.1 times as fast
        (0.92, 1.11, 1.0, Verdict.UNDECIDED),
        (1.01, 1.05, ERROR_RATE, Verdict.SLOWER),
        (1.01, 1.05, 1.01 * ERROR_RATE, Verdict.SAME),
    ],
)
def test_times_are_the_same_where_both_ends_of_the_interval_are_within_a_tenth(
    low, high, chance, verdict
):
    ratio = Ratio(math.sqrt(low * high), low, high, chance)
    assert judged(KEY, "seconds", ratio, chance).verdict is verdict
    inverse = Ratio(1.0 / ratio.value, 1.0 / high, 1.0 / low, chance)
    mirrored = Verdict.FASTER if verdict is Verdict.SLOWER else verdict
    assert judged(KEY, "seconds", inverse, chance).verdict is mirrored


def test_a_drift_by_the_pace_is_that_between_two_moments(make):
    """Two draws of one distribution differ by the root of two of its deviations."""
    record = make.timed("mine", 1.0)
    logs = np.array([0.0, 0.05, 0.1, 0.3])
    paced = [replace(record, conditions={"pace": float(np.exp(pace))}) for pace in logs]
    rows = {(*KEY[:3], str(k)): times.Pair(*paced[k : k + 2]) for k in (0, 2)}
    deviation = times.drift(rows).deviation
    assert deviation.value == pytest.approx(math.sqrt(2.0) * np.std(logs, ddof=1))
    assert deviation.freedom == 3


def test_of_several_records_of_a_row_the_latest_counts(make):
    first, last = make.drawn("ccd", False, 1.0), make.drawn("ccd", False, 2.0)
    last = replace(last, when="2001" + first.when[4:])
    for order in ((first, last), (last, first)):
        (kept,) = by_row(order).values()
        assert kept is last
