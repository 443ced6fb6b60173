"""Growing cloths and chains: what is measured is the work it says, and tables follow records."""

import json
import subprocess
import sys

import numpy as np
import pytest
import scipy

from plumbob.bench.experiments import scale as suite
from plumbob.bench.measure.block import Scale
from plumbob.bench.measure.progress import listening
from plumbob.bench.tables.results import Results
from plumbob.reference.sparse import CholeskyFactor

SMALL = min(suite.SIZES)
COST = {"memory": 2.0**28, "growth": 4.0e6, "reading": 2e-3, "computing": 1e-3}


@pytest.fixture(scope="module")
def costs():
    """The costs of a small cloth by every method, measured in this process."""
    return {
        solver: suite.measure_cloth(SMALL, solver, suite.STIFFNESS, 0.0)
        for solver in suite.CLOTH_METHODS
    }


def cloth(make, size, solver="newton_cg", stiffness=suite.STIFFNESS, **values):
    settings = {"size": size * size, "h": suite.H, "stiffness": stiffness}
    return make.record("scale", f"cloth/{size}x{size}", solver, settings, COST | values, size=0,
                       facts={"task": "cloth"})  # fmt: skip


@pytest.mark.parametrize("solver", suite.CLOTH_METHODS)
def test_every_method_of_a_cloth_is_measured(costs, solver):
    cost = costs[solver]
    json.dumps(cost)
    assert len(cost["seconds"]) >= suite.ROUNDS[0]
    assert min(cost["seconds"]) > 0.1 * cost["computing"] > 0
    assert (cost["reading"] > 0) == (solver in (suite.EXPLICIT, *suite.STOPS))
    assert cost["memory"] > 1e7


def test_a_converged_step_is_proven(costs):
    assert costs["newton_cg"]["residual"] <= 1e-10
    assert costs["newton_cg"]["distance"] < 1e-9
    assert 0.9 < costs["newton_cg"]["curvature"] < 1.0
    assert costs["newton_cg"]["remark"] == ""
    assert costs["local_global"]["iterations"] == 10


def test_explicit_steps_of_a_frame_are_stable_and_pass_the_springs():
    system, state = suite.billowing_cloth(SMALL)
    work = suite.frame(suite.EXPLICIT, system, state)
    assert np.abs(work.result.positions).max() < 3
    assert work.flops == suite.STEPS * suite.SPRING_FLOPS * len(system.springs)
    assert work.bytes_read == suite.STEPS * suite.spring_bytes(system)
    assert suite.spring_bytes(system) == len(system.springs) * (16 + 8 + 8 + 1) + 100 * 48


def test_the_solves_of_iterations_are_counted():
    system, state = suite.billowing_cloth(SMALL)
    work = suite.frame("local_global", system, state)
    entries = CholeskyFactor(suite.global_matrix(system, suite.H)).entries
    assert work.passes == 10
    assert work.bytes_read == 10 * (16 * entries + suite.spring_bytes(system))
    assert suite.frame("newton_cg", system, state).passes > 10


def test_a_dense_factor_has_the_flops_of_its_columns():
    dense = scipy.sparse.csc_array(np.eye(6) + 1.0)
    assert suite.factor_flops(CholeskyFactor(dense)) == 1 + 4 + 9 + 16 + 25 + 36


def test_the_plain_read_sums_every_pass():
    assert suite.total(np.ones(1000), 3) == 3000


def test_a_chain_is_solved_and_its_costs_are_those_of_a_target():
    ccd, kinematics = (suite.measure_chain(10, name, 0.0) for name in ("ccd", suite.KINEMATICS))
    assert ccd["solved"] == 1.0
    assert ccd["computing"] > 10 * kinematics["computing"]
    assert ccd["iterations"] > 10
    assert kinematics["iterations"] == 1.0
    assert "solved" not in kinematics


def test_the_memory_of_a_process_is_not_that_of_its_parent():
    held = np.ones(25_000_000)
    code = f"from {suite.__name__} import memory; print(memory())"
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert int(child.stdout) < held.nbytes < suite.memory()


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the peak is that of the process")
def test_the_peak_begins_anew():
    np.ones(25_000_000)
    assert suite.memory(anew=True) < suite.memory() + 1
    np.ones(12_500_000)
    assert 0.5e8 < suite.memory() - suite.memory(anew=True) < 1.5e8


def test_progress_is_announced():
    messages = []
    with listening(lambda progress: messages.append(progress.subject)):
        suite.measure_cloth(SMALL, "newton_cg", suite.STIFFNESS, 0.0)
    name = f"cloth/{SMALL}x{SMALL}, newton_cg: "
    rounds = [f"{name}round {i + 1}" for i in range(suite.ROUNDS[0])]
    assert messages == [f"{name}cloth", f"{name}proof", *rounds]


@pytest.mark.slow
def test_a_failure_in_its_process_is_reported():
    with pytest.raises(RuntimeError, match="ValueError: size"):
        suite.in_a_fresh_process(60.0, suite.compiled_and_measured, 1, "newton_cg", 1e4, 0.0)


@pytest.mark.parametrize(("seconds", "largest", "count"), [(0.2, 10_000, 3), (2.0, 1_000_000, 5)])
def test_the_largest_cloth_has_three_stiffnesses_and_scipy_the_others(seconds, largest, count):
    blocks = list(suite.blocks(Scale(targets=1, seconds=seconds)))
    cloths = [block for block in blocks if block.problem.startswith("cloth")]
    assert len({block.problem for block in cloths}) == count
    stiff = [b for b in cloths if b.settings["size"] == largest and b.solver == "newton_cg"]
    assert sorted(block.settings["stiffness"] for block in stiff) == [1e3, 1e4, 1e5]
    scipys = [block.settings["size"] for block in cloths if block.solver == suite.SCIPY]
    assert len(scipys) == min(count, 4)
    assert {b.settings["size"] for b in blocks if "chain" in b.problem} == {10, 30, 100, 300, 1000}


def test_exponents_are_those_of_the_next_smaller_size(make):
    records = [
        cloth(make, 100, seconds=[0.08], growth=9.0e6),
        cloth(make, 10, seconds=[0.01], growth=100.0),
        cloth(make, 1000, seconds=[8.0, 8.0, 9.0], growth=9.0e8, computing=4.0),
        cloth(make, 100, solver="local_global", seconds=[0.01]),
    ]
    table = suite.cloth(Results(records))
    column = [table.columns[j].title for j in range(len(table.columns))].index
    rows = [row for row in table.rows if row[0] == "Newton-CG"]
    assert [row[column("particles")] for row in rows] == [100, 10_000, 1_000_000]
    exponents = [row[column("exponent of time")] for row in rows]
    assert exponents == [None, pytest.approx(np.log10(8) / 2), pytest.approx(1.0)]
    memory = [row[column("exponent of memory")] for row in rows]
    assert memory == [None, None, pytest.approx(1.0)]
    assert rows[-1][column("relative to the limit")] == 2.0
    assert [row[column("limited by")] for row in rows] == ["memory", "memory", "flops"]
    assert rows[0][column("peak memory")] == 0.25
    assert "With 1,000,000 particles: Newton-CG 8.00 s (2.00 times" in table.summary.sentence


def test_proofs_are_sorted_and_a_missing_one_says_why(make):
    proof = {"proof": 1.0, "proof_memory": 2.0**30, "iterations": 5.0, "residual": 1e-11}
    records = [
        cloth(make, 1000, stiffness=1e5, seconds=[3.0], distance=2e-10, curvature=0.5, **proof),
        cloth(make, 1000, stiffness=1e3, seconds=[2.0], distance=1e-11, curvature=0.9, **proof),
        cloth(make, 10, seconds=[1e-3], distance=np.inf, curvature=0.0, remark="No", **proof),
    ]
    table = suite.proof(Results(records))
    assert [row[:2] for row in table.rows] == [(100, 1e4), (1_000_000, 1e3), (1_000_000, 1e5)]
    assert table.rows[0][-1] == "No"
    assert "1,000 and 100,000 N/m a minimiser is proven within 2.0e-10 m." in table.summary.sentence
    assert suite.cloth(Results(records)).rows[0][1] == 100


def test_charts_show_methods_beside_their_limits(make):
    records = [cloth(make, size, name, seconds=[size * 1e-5]) for size in (10, 100)
               for name in suite.CLOTH_METHODS]  # fmt: skip
    records += [
        make.record("scale", f"chain/{n}", name, {"size": n}, {**COST, "iterations": 4.0,
                    "seconds": [8.0]}, size=0, facts={"task": "chain"})
        for n in (10, 100) for name in (*suite.IK, suite.KINEMATICS)
    ]  # fmt: skip
    results = Results(records)
    explicit, *_, factor = suite.cloth_chart(results).data.panels
    assert [curve.solver for curve in explicit.series] == ["Plumbob", "limit"]
    assert [curve.solver for curve in factor.series] == ["Plumbob", "limit", "scipy"]
    assert len(suite.memory_chart(results).data.panels[0].series) == 5
    solves, iterations = suite.chain_chart(results).data.panels
    assert len(solves.series) == 5
    assert iterations.series[0].y.tolist() == [2.0, 2.0]
    assert iterations.series[-1].solver == "limit"
    assert suite.cloth_chart(Results([])) is suite.chain_chart(Results([])) is None
