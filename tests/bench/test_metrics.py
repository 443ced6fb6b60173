"""Metrics against closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from plumbob.bench.measure import metrics
from plumbob.bench.problems.cloth_truth import rms_distance


@pytest.mark.parametrize("total", [1, 7, 200, 100_000])
def test_wilsons_interval_is_that_of_scipy(total):
    """Newcombe 1998, method 3."""
    for hits in {0, 1, total // 3, total - 1, total}:
        found = metrics.share(np.arange(total) < hits)
        low, high = stats.binomtest(hits, total).proportion_ci(0.95, method="wilson")
        assert found[:2] == (hits, total)
        np.testing.assert_allclose([found.low, found.high], [low, high], rtol=1e-12, atol=1e-15)


def test_closed_forms():
    assert metrics.share(np.array([], bool)) == (0, 0, 0.0, 1.0)
    assert np.isnan([metrics.spread(np.array([])), metrics.spread(np.array([1.0, np.nan]))]).all()
    assert metrics.spread(np.arange(101)) == (50.0, 95.0, 100.0)
    assert metrics.whole(np.array([1, 2])) == (1.5, pytest.approx(1.95), 2)
    assert isinstance(metrics.whole(np.array([1, 2]))[2], int)
    excess = metrics.excess(np.array([1.0, 0.25]), np.array([2.5, 1.0]), 2.0)
    np.testing.assert_array_equal(excess, [0.5, 0.25])
    points = np.array([[3.0, 4, 0], [0, 0, 0]])
    assert rms_distance(points, np.zeros((2, 3))) == pytest.approx(math.sqrt(12.5))
    assert metrics.first_below(np.array([1.0, 0.1, 0.2, 0.01]), 0.1) == 1
    assert metrics.first_below(np.array([1.0, np.nan]), 0.1) is None
    assert metrics.timing(np.arange(11.0))[:4] == (5.0, 1.0, 9.0, 11)
    seconds, solved = np.array([1.0, 2.0, 50.0, np.inf]), np.array([True, False, False, False])
    assert metrics.penalised(seconds, solved, 10.0).tolist() == [1.0, 10.0, 50.0, 10.0]
    assert metrics.relative_spread(np.array([0.9, 1.0, 1.1] * 10)) == pytest.approx(0.1)
    assert math.isnan(metrics.relative_spread(np.array([])))


def test_bend_of_a_right_angle_and_of_a_straight_line():
    """Joints at 0, (1, 0), (1, 1): the corner is 1 off the y axis, 1/sqrt 2 off the diagonal."""
    joints = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]]) + 5.0
    targets = np.array([[0.0, 3, 0], [2, 2, 0]]) + 5.0
    bends = metrics.bend(np.array([joints, joints]), targets)
    np.testing.assert_allclose(bends, [1.0, math.sqrt(0.5)], rtol=1e-15)
    straight = np.linspace([0.0, 0, 0], [1, 2, 3], 5)
    assert metrics.bend(straight, np.array([2.0, 4, 6])) < 1e-15


solves = st.lists(st.tuples(st.floats(1e-6, 10.0), st.booleans()), min_size=1, max_size=30)


@given(solves, st.integers(0, 30))
def test_a_budget_curve_rises_to_the_share_of_all_targets_with_its_interval(made, untimed):
    """Though only some are timed."""
    seconds, solved = (np.array(column) for column in zip(*made, strict=True))
    share = metrics.share(np.append(solved, np.arange(untimed) % 3 == 0))
    budgets = np.array([0.0, 1e-4, 0.1, 1.0, 10.0])
    curve, (low, high) = metrics.within_budget(share, seconds[solved], budgets)
    if share.hits and not solved.any():
        assert np.isnan(curve).all()
        return
    assert (np.diff(curve) >= 0).all()
    assert curve[0] == 0
    assert (curve[-1], low[-1], high[-1]) == pytest.approx(
        (share.hits / share.total, share.low, share.high)
    )


def test_a_budget_counts_targets_solved_in_exactly_that_time():
    share, budgets = metrics.share(np.arange(4) < 2), np.array([0.9, 1.0, 2.0, 5.0])
    curve, (low, high) = metrics.within_budget(share, np.array([1.0, 2.0]), budgets)
    assert curve.tolist() == [0.0, 0.25, 0.5, 0.5]
    assert ((low <= curve) & (curve <= high)).all()


def test_fewer_timed_targets_widen_the_interval_within_a_budget():
    share, half = metrics.share(np.ones(1000, dtype=bool)), np.array([1.5])
    few, many = (
        metrics.within_budget(share, np.tile([1.0, 2.0], count), half)[1] for count in (10, 500)
    )
    assert few[1] - few[0] > 5 * (many[1] - many[0])


@given(st.lists(st.tuples(*[st.tuples(st.floats(1e-6, 10.0), st.booleans())] * 3), min_size=1))
def test_a_profile_rises_to_the_success_and_some_solver_is_first(made):
    seconds, solved = np.moveaxis(np.array(made), 1, 0)[..., 0], np.moveaxis(
        np.array(made), 1, 0)[..., 1].astype(bool)  # fmt: skip
    ratios = np.array([1.0, 2.0, 10.0, 1e8])
    curves = metrics.performance_profiles(seconds, solved, ratios)
    possible = solved.any(axis=0)
    if not possible.any():
        assert np.isnan(curves).all()
        return
    assert (np.diff(curves, axis=-1) >= 0).all()
    np.testing.assert_allclose(curves[:, -1], solved[:, possible].mean(axis=-1))
    assert curves[:, 0].sum() >= 1 - 1e-12


def test_the_profile_of_a_textbook():
    """Two solvers, three targets, the last solved by none: the second is 4 times slower once."""
    seconds = np.array([[1.0, 2.0, 1.0], [4.0, 1.0, 1.0]])
    solved = np.array([[True, False, False], [True, True, False]])
    curves = metrics.performance_profiles(seconds, solved, np.array([1.0, 3.9, 4.0]))
    assert curves.tolist() == [[0.5, 0.5, 0.5], [0.5, 0.5, 1.0]]


def test_the_interval_of_a_median_is_that_of_the_quantile_test(rng):
    for count in range(1, 80):
        values = rng.normal(size=count)
        expected = stats.quantile_test(values, p=0.5).confidence_interval(0.95)
        assert metrics.median_interval(values)[0] == np.median(values)
        np.testing.assert_array_equal(metrics.median_interval(values)[1:], expected)
    assert np.isnan(metrics.median_interval(np.array([]))).all()
    low, high = metrics.median_interval(np.arange(1e6))[1:]
    assert low + high == 999_999
    assert high - low == pytest.approx(1.96 * 1e3, rel=0.01)  # of the normal distribution


def test_the_interval_of_a_mean_is_that_of_students_test(rng):
    values = rng.normal(size=7)
    expected = stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert metrics.mean_interval(values) == pytest.approx((values.mean(), *expected), rel=1e-12)
    assert metrics.mean_interval(np.ones(5)) == (1.0, 1.0, 1.0)
    assert math.isnan(metrics.mean_interval(np.ones(1)).low)


def flags(hits, total):
    return np.arange(total) < hits


def test_a_leader_within_chance_of_a_rival_ties_with_it():
    scores = {"a": flags(98, 100), "b": flags(97, 100), "c": flags(60, 100)}
    assert metrics.ranking(scores) == (("a", "b", "c"), ("a", "b"))
    assert metrics.ranking({"c": flags(60, 100), "a": flags(98, 100)}).first == ("a",)
    assert metrics.ranking({}) == ((), ())
    assert metrics.ranking({"a": flags(1, 2)}).first == ("a",)


@pytest.mark.parametrize(("gained", "lost"), [(6, 0), (5, 1), (0, 0), (8_900, 9_100)])
def test_truth_values_are_compared_by_mcnemars_exact_test(gained, lost):
    a = np.concatenate([np.ones(gained), np.zeros(lost), np.ones(30)])
    b = np.concatenate([np.zeros(gained), np.ones(lost), np.ones(30)])
    chance = 2.0 * stats.binom.cdf(min(gained, lost), gained + lost, 0.5)
    assert metrics.chance_of_pairs(a, b) == pytest.approx(min(1.0, chance), rel=1e-9)


def test_pairs_differ_where_two_intervals_overlap(rng):
    """Targets differ by thousands, the solvers by a tenth on each."""
    hard = rng.lognormal(0.0, 3.0, 200)
    scores = {"fast": -np.log(hard), "slow": -np.log(1.1 * hard * rng.lognormal(0.0, 0.1, 200))}
    assert metrics.ranking(scores).first == ("fast",)


def test_equals_differ_in_at_most_five_of_a_hundred(rng):
    """Four equals, ranked 400 times: rarely does one differ (the error is 0.011)."""
    scores = (dict(zip("abcd", rng.lognormal(size=(4, 40)), strict=True)) for _ in range(400))
    differing = sum(len(metrics.ranking(score).first) < 4 for score in scores)
    assert differing <= 0.075 * 400


def test_the_shifted_geometric_mean_is_that_of_its_definition(rng):
    values = np.array([1e-6, 1e-4, 1e-2])
    mean, low, high = metrics.shifted_geometric_mean(values, 1e-5)
    assert mean == pytest.approx(np.prod(values + 1e-5) ** (1 / 3) - 1e-5, rel=1e-12)
    assert low <= mean <= high
    many = rng.lognormal(size=400)
    assert metrics.shifted_geometric_mean(many, 1e-5) == metrics.shifted_geometric_mean(many, 1e-5)


def test_the_bootstrap_draws_within_each_group():
    """Two groups, each of equal times: nothing is left to chance."""
    values = np.repeat([1.0, 100.0], 20)
    mean, low, high = metrics.shifted_geometric_mean(values, 0.0, (20, 20))
    assert low == pytest.approx(mean, rel=1e-12)
    assert high == pytest.approx(mean, rel=1e-12)
    _, low, high = metrics.shifted_geometric_mean(values, 0.0)
    assert high > 2.0 * low


def test_the_intervals_of_the_bootstrap_contain_the_truth(rng):
    count = 0
    for _ in range(200):
        _, low, high = metrics.shifted_geometric_mean(rng.lognormal(0.0, 1.0, 60), 0.0)
        count += low <= 1.0 <= high
    assert count >= 0.89 * 200  # 0.94 of these; 200 draws err by 0.017


def test_very_many_targets_have_the_same_interval_without_draws(rng, monkeypatch):
    values = np.concatenate([rng.lognormal(0.0, 1.0, 3000), rng.lognormal(3.0, 0.1, 3000)])
    drawn = metrics.shifted_geometric_mean(values, 1e-5, (3000, 3000))
    monkeypatch.setattr(metrics, "LARGE", 5000)
    np.testing.assert_allclose(
        metrics.shifted_geometric_mean(values, 1e-5, (3000, 3000)), drawn, rtol=0.01
    )


def test_the_interval_of_a_timing_is_that_of_its_sweeps():
    """Rounds of one sweep are alike: ten sweeps are ten values, however many rounds they have."""
    sweeps = np.repeat(np.arange(1.0, 11.0)[:, None], 50, axis=1)
    assert metrics.timing(sweeps).interval == (5.5, 2.0, 9.0)
    assert metrics.timing(sweeps).rounds == 500
    assert metrics.timing(sweeps.ravel()).interval.high < 9.0
