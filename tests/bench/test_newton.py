"""One step certified: the suite, its table and its sentence."""

import numpy as np
import pytest

from plumbob.bench.experiments import newton as suite
from plumbob.bench.tables.results import Results

SIZE = 6


@pytest.fixture(scope="module")
def stiff():
    """Answers to a small stiff cloth, by solver, start and most iterations."""
    wanted = [
        ("newton", suite.FROM_Y, 100),
        ("lbfgs", suite.FROM_Y, 2000),
        ("local_global", suite.FROM_Y, 3),
        ("local_global", suite.NEAR_NEWTON, 500),
    ]
    return {which: suite.certified_step(SIZE, 1e5, *which) for which in wanted}


def is_certified(arrays):
    return arrays["covered"] and arrays["same"]


def test_newton_reaches_the_tolerance_and_is_covered(stiff):
    arrays = stiff["newton", suite.FROM_Y, 100]
    assert arrays["residual"] <= suite.TOLERANCE or arrays["at_floor"]
    assert is_certified(arrays)
    assert arrays["balance"] < 1e-10
    assert 0 < arrays["distance"] < 1e-9


@pytest.mark.parametrize(
    "key", [("lbfgs", suite.FROM_Y, 2000), ("local_global", suite.NEAR_NEWTON, 500)]
)
def test_the_limits_of_other_solvers_are_newtons_where_both_are_covered(stiff, key):
    assert is_certified(stiff[key])
    assert 0 < stiff[key]["error"] < 1e-4
    assert abs(stiff[key]["above"]) < 1e-9


def test_an_answer_far_from_the_limit_has_no_bound_but_an_error(stiff):
    arrays = stiff["local_global", suite.FROM_Y, 3]
    assert not any(arrays[name] for name in ("covered", "same", "different"))
    assert arrays["distance"] == np.inf
    assert arrays["error"] > 0.1
    assert arrays["above"] > 0


def test_table_and_sentence_follow_the_records(make, stiff):
    records = [
        make.certified(solver, {"start": start, "iterations": limit}).with_measured(**step)
        for (solver, start, limit), step in stiff.items()
    ]
    table = suite.proofs(Results(records))
    cells = dict(zip([c.title for c in table.columns], zip(*table.rows, strict=True), strict=True))
    assert cells["same minimiser as Newton"] == ("yes", "yes", "yes", "not proven")
    assert [bound == "yes" for bound in cells["bound"]] == [True, True, True, False]
    assert cells["distance to a minimiser, at most"][3] is None
    assert cells["stiffness"][0] == 1e5
    for part in ("in 1 of 1 cloth.", "2 of 3 solutions by other solvers are proven"):
        assert part in table.summary.sentence


def test_another_minimiser_and_a_newton_that_fails_are_reported(make):
    arrays = {"residual": 1.0, "at_floor": False, "same": False, "different": True}
    table = suite.proofs(Results([make.certified(arrays=arrays)]))
    assert "no" in table.rows[0]
    assert "in 0 of 1 cloth." in table.summary.sentence
