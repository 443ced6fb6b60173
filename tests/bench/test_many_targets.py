"""Many targets in parts: the same targets however they are cut up, and counts that add up."""

import numpy as np
import pytest

from plumbob.bench.experiments import Scale, blocks
from plumbob.bench.experiments.many_targets import measurement, tables
from plumbob.bench.harness.results import Results


def parts(targets):
    return list(blocks("many_targets", Scale(targets, 0.001)))


@pytest.mark.parametrize("targets", [1, 4999, 5000, 5001, 100_000, 1_000_000])
def test_the_parts_are_of_some_thousand_and_add_up(targets):
    sizes = [block.size for block in parts(targets)]
    assert sum(sizes) == targets
    assert max(sizes) <= measurement.PART
    assert len(sizes) == -(-targets // measurement.PART)


def test_a_larger_number_keeps_the_parts_that_are_there():
    few, many = parts(10_000), parts(100_000)
    for one, other in zip(few, many, strict=False):
        assert (one.problem, one.settings, one.size) == (other.problem, other.settings, other.size)


def test_a_part_that_is_cut_short_has_the_first_targets_and_no_two_parts_share_any():
    first, cut, second = (measurement.part_targets(*of) for of in ((0, 9), (0, 4), (1, 9)))
    np.testing.assert_array_equal(first.positions[:4], cut.positions)
    np.testing.assert_array_equal(first.starts[:4], cut.starts)
    assert np.abs(first.positions - second.positions).min() > 0


def test_answers_are_judged_and_not_believed(monkeypatch):
    """A solver that claims everything and solves nothing misses all and claims all falsely."""
    (block,) = parts(20)
    honest = block.measure().arrays
    assert (honest["targets"], honest["solved"], honest["false"]) == (20, 20, 0)
    assert 0 < honest["position"] <= 1e-3

    def boastful(robot, tolerance, **settings):
        return lambda positions, rotations, start: (
            lambda: measurement.plumbob.SolverOutput(start, True)
        )

    monkeypatch.setattr(measurement.plumbob, "prepare", boastful)
    found = block.measure().arrays
    assert (found["solved"], found["false"]) == (0, 20)
    np.testing.assert_array_equal(found["missed"], np.arange(20))


def test_the_table_joins_the_parts(make):
    table = tables.many_targets(Results(make.in_parts()))
    ((robot, solver, targets, missed, false, _),) = table.rows
    assert (robot, targets, missed.hits, missed.total, false) == ("KUKA iiwa14", 10, 1, 10, 1)
    assert "missed 1 of 10 targets, which is at most 40" in table.summary.sentence
