"""First calls: every public function can be measured, and the table follows the records."""

import subprocess
import sys

import pytest

from plumbob.bench.experiments import SCALES, blocks
from plumbob.bench.experiments.first_call import measurement as suite
from plumbob.bench.experiments.first_call import tables as first_call
from plumbob.bench.harness.results import Results
from plumbob.reference import IK_SOLVERS, STEP_SOLVERS


def test_the_first_process_compiles_and_the_next_one_does_not():
    (block,) = [b for b in blocks("first_call", SCALES["quick"]) if b.solver == suite.OURS]
    arrays = block.measure().arrays
    assert (arrays["cold compiled"], arrays["warm compiled"]) == (1, 0)
    assert 0 < arrays["warm processor"] < arrays["cold processor"]
    assert min(arrays["warm wall"], arrays["cold wall"]) > 0


def test_a_short_bench_measures_few_and_a_long_one_every_solver():
    quick, full = (
        {(b.problem, b.solver) for b in blocks("first_call", SCALES[scale])}
        for scale in ("quick", "full")
    )
    assert len(quick) == 3
    assert quick < full
    for name, solvers in [
        ("solve_ik/chain", IK_SOLVERS),
        ("solve_ik/robot", IK_SOLVERS),
        ("ImplicitEuler(...).step/cloth", STEP_SOLVERS),
    ]:
        assert {solver for problem, solver in full if problem == name} == set(solvers)


@pytest.mark.parametrize(
    "call",
    [
        pytest.param(call, marks=[] if call in suite.QUICK else pytest.mark.slow, id=" ".join(call))
        for call in suite.calls()
    ],
)
def test_every_call_can_be_measured(call):
    found = suite.measure(*call)
    assert found["wall"] > 0
    assert found["compiled"] >= 0


def test_a_call_that_fails_says_why(tmp_path):
    with pytest.raises(RuntimeError, match="KeyError"):
        suite.in_a_process("no such function", suite.OURS, tmp_path)


def test_importing_the_suite_does_not_import_the_compiler():
    """Its import is part of what a first call costs."""
    module = "plumbob.bench.experiments.first_call.measurement"
    code = f"import sys, {module}; sys.exit('numba' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_table_gives_both_and_names_the_dearest(make):
    records = [
        make.first_called("forward_kinematics/skeleton", suite.OURS, 0.6),
        make.first_called("solve_ik/robot", "ccd", 8.0, warm=0.4),
    ]
    table = first_call.first_calls(Results(records))
    assert [row[:3] for row in table.rows] == [
        ("forward_kinematics, skeleton", "Plumbob", 2),
        ("solve_ik, robot", "CCD", 2),
    ]
    assert table.rows[1][3:] == (8.0, 16.0, 0.4, 0.8)
    assert "solve_ik, robot by CCD, takes 8.00 s" in table.summary.sentence
    assert "no first call takes more than 0.400 s" in table.summary.sentence


def test_without_records_the_table_is_empty():
    table = first_call.first_calls(Results([]))
    assert table.rows == ()
    assert not table.summary.sentence
