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


def test_no_cases_is_missed():
    assert verdict_of().failure == "no cases"


def test_one_bad_case_among_many_is_missed():
    verdict = verdict_of(comparison(), comparison(theirs=(1.0, 2.1)), comparison())
    assert verdict.failure == "they differ"
    assert verdict.difference == pytest.approx(0.05)


def test_one_case_at_its_baseline_among_many_is_missed():
    verdict = verdict_of(comparison(), comparison(baseline=(1.0, 2.0 + 1e-5)))
    assert verdict.failure == "nothing moved"
    assert verdict.displacement == pytest.approx(5e-6)


@pytest.mark.parametrize("field", ["ours", "theirs", "baseline"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_a_number_is_missed(field, bad):
    verdict = verdict_of(comparison(), comparison(**{field: (1.0, bad)}))
    assert verdict.failure == "not a number"


def test_the_same_infinity_is_missed():
    verdict = verdict_of(comparison(ours=(1.0, np.inf), theirs=(1.0, np.inf)))
    assert verdict.failure == "not a number"
    assert np.isnan(verdict.difference)


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan, np.inf])
def test_a_scale_that_measures_nothing_is_missed(scale):
    assert verdict_of(comparison(scale=scale)).failure == "not a number"


@pytest.mark.parametrize(("ours", "theirs"), [((1.0, 2.0), (1.0,)), ((), ())])
def test_shapes_must_be_equal_and_not_empty(ours, theirs):
    with pytest.raises(ValueError, match="comparison: expected"):
        verdict_of(comparison(ours=ours, theirs=theirs))
