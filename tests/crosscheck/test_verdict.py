"""Laws of `check_claim`: which comparisons pass and which do not."""

import numpy as np
import pytest

from plumbob.crosscheck.tolerances import Tolerance
from plumbob.crosscheck.verdict import Claim, Comparison, check_claim

TOLERANCE = Tolerance(1e-12, "made up")


def comparison(ours=(1.0, 2.0), theirs=(1.0, 2.0), baseline=(0.0, 0.0), scale=2.0):
    return Comparison(np.array(ours), np.array(theirs), np.array(baseline), scale)


def verdict_of(*comparisons):
    claim = Claim("a", "b", "c", lambda cases: comparisons[:cases], TOLERANCE, cases=10)
    return check_claim(claim)


def test_equal_values_away_from_the_baseline_hold():
    verdict = verdict_of(comparison(), comparison(theirs=(1.0, 2.0 + 1e-12)))
    assert verdict.holds
    assert verdict.cases == 2
    assert verdict.difference == pytest.approx(5e-13, rel=1e-3)
    assert verdict.displacement == 1.0


FAILURES = {
    "no cases": ([], "no cases", 0.0),
    "one bad case among many": (
        [comparison(), comparison(theirs=(1.0, 2.1)), comparison()], "they differ", 0.05
    ),
    "one case at its baseline among many": (
        [comparison(), comparison(baseline=(1.0, 2.0 + 1e-5))], "nothing moved", 0.0
    ),
    "the same infinity": (
        [comparison(ours=(1.0, np.inf), theirs=(1.0, np.inf))], "not a number", np.nan
    ),
    **{
        f"{bad} in {field}": ([comparison(**{field: (1.0, bad)})], "not a number", np.nan)
        for field in ("ours", "theirs", "baseline")
        for bad in (np.nan, np.inf)
    },
    **{
        f"a scale of {scale}": ([comparison(scale=scale)], "not a number", np.nan)
        for scale in (0.0, -1.0, np.nan, np.inf)
    },
}  # fmt: skip


@pytest.mark.parametrize("name", FAILURES)
def test_a_claim_is_missed(name):
    comparisons, failure, difference = FAILURES[name]
    verdict = verdict_of(*comparisons)
    assert verdict.failure == failure
    if "baseline" not in name:
        assert verdict.difference == pytest.approx(difference, nan_ok=True)


@pytest.mark.parametrize(("ours", "theirs"), [((1.0, 2.0), (1.0,)), ((), ())])
def test_shapes_must_be_equal_and_not_empty(ours, theirs):
    with pytest.raises(ValueError, match="comparison: expected"):
        verdict_of(comparison(ours=ours, theirs=theirs))
