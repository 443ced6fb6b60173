"""Findings: the numbers of the records reach the tables, and the sentences follow the numbers."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bench.findings import SECTIONS, Results, check, cloth, kinematics, tables, timing


def column(table, heading):
    index = [c.heading for c in table.columns].index(heading)
    return [row[index] for row in table.rows]


def test_without_records_every_table_is_empty_and_none_fails():
    made = tables(Results([]))
    assert [table.rows for table in made] == [()] * len(made)


def test_every_table_has_a_name_of_its_own_and_says_how_it_was_measured():
    made = tables(Results([]))
    assert len({table.name for table in made}) == len(made)
    assert all(table.shows and table.measured for table in made)


def test_every_section_has_a_name_of_its_own():
    assert len({section.name for section in SECTIONS}) == len(SECTIONS)


def test_a_missed_claim_is_named_in_table_and_answer(make):
    table = check.verdicts(Results([make.claim(), make.claim("damper forces", held=False)]))
    assert column(table, "verdict") == ["held", "MISSED: they differ"]
    assert table.answer.sentence.startswith("1 of 2 claims held")
    assert table.answer.points == ("Missed: damper forces",)


def test_chains_are_counted_as_straight_only_if_they_are(make):
    table = kinematics.beyond_reach(Results([make.beyond("ccd", 0.5), make.beyond("fabrik", 1e-9)]))
    assert column(table, "off the line, largest [m]") == [0.5, 1e-9]
    ccd, fabrik = table.answer.points
    assert ccd.startswith("CCD: 1 of 2; at worst 25.0 % of the reach")
    assert fabrik.startswith("FABRIK: 2 of 2;")


def test_iterations_count_for_whoever_needs_fewer(records):
    table = kinematics.iterations(Results(records))
    assert column(table, "problem") == ["arm, circle", "arm, beyond", "chain, near"]
    assert column(table, "CCD / FABRIK, means") == [2.5, 1.0, 1.0]
    assert "fewer iterations than CCD on 1 of 3 problems" in table.answer.sentence


def test_jitter_is_the_largest_turn_in_degrees(make):
    records = [make.drawn("ccd", False, 1.0), make.drawn("ccd", True, 0.5)]
    table = kinematics.jitter(Results(records))
    assert column(table, "from rest, largest [°]") == [pytest.approx(math.degrees(1.0))]
    assert column(table, "largest, rest / last") == [2.0]
    assert "smaller in 1 of 1 cases" in table.answer.sentence


def test_jitter_that_grows_is_said_too(make):
    records = [make.drawn("ccd", False, 0.5), make.drawn("ccd", True, 1.0)]
    assert "smaller in 0 of 1 cases" in kinematics.jitter(Results(records)).answer.sentence


def test_success_is_counted_by_the_residual_not_by_the_solver(records):
    table = kinematics.accuracy(Results(records))
    shares = column(table, "within tolerance (95 % interval)")
    assert [(share.hits, share.total) for share in shares] == [(2, 3)] * 4 + [(2, 2)] * 2
    assert max(column(table, "residual, largest [m]")) == 3e-4


def test_the_cloths_tables_count_iterations_and_drift(records):
    results = Results(records)
    assert "at most 3 iterations" in cloth.newton_steps(results).answer.sentence
    points = cloth.convergence(results).answer.points
    assert points == ("stiffness × 1: local/global 2, Newton 2",)
    table = cloth.few_iterations(results)
    assert column(table, "drift, share of the path [%]") == [10.0, 10.0]
    assert len(table.answer.points) == 1


def test_iterations_that_do_not_suffice_are_said_so(make):
    made = make.stepped("newton")
    short = replace(made, arrays=made.arrays | {"error": np.array([1.0, 0.5])})
    assert "Newton more than 1" in cloth.convergence(Results([short])).answer.points[0]


def test_times_are_medians_beside_ours(records):
    table = timing.kinematics(Results(records))
    assert column(table, "median [ns]") == pytest.approx([2000.0, 1000.0])
    assert column(table, "of our compiled time") == [None, 0.5]


def test_a_limit_stands_in_a_column_and_not_in_a_row(make):
    limit = make.timed("limit: copying as many bytes", 1e-7)
    table = timing.kinematics(Results([make.timed("Plumbob, compiled", 1e-6), limit]))
    assert column(table, "by") == ["Plumbob, compiled"]
    assert column(table, "times the limit") == pytest.approx([10.0])


def test_a_failed_block_gives_no_row(make):
    failed = make.record("arm", "arm/beyond", "ccd", notes={"failed": "ValueError: no"})
    assert kinematics.beyond_reach(Results([failed])).rows == ()
