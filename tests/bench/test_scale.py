"""Growing cloths: what is measured adds up, and the tables follow the records."""

import json
import subprocess
import sys

import numpy as np
import pytest

from plumbob.bench.experiments import cloth_scale as suite
from plumbob.bench.measure.block import Scale
from plumbob.bench.measure.progress import listening
from plumbob.bench.tables.results import Results
from plumbob.reference.implicit_euler.objective import Objective

SMALL = min(suite.SIZES)
SETTINGS = {"particles": 10_000, "h": 1 / 60, "stiffness": 1e4, "iterations": 10}
OURS = {
    "before": 2**20, "entries": 500_000, "residual": 1e-3, "factor": 2.0, "refactor": 0.5,
    "memory": 2**31, "solve": [0.01], "local": [0.02], "step": [0.3, 0.3, 0.5], "limit": [0.015],
}  # fmt: skip
THEIRS = {"before": 2**20, "factor": 4.0, "solve": [0.02, 0.02], "memory": 2**30}


def measured(make, solver, arrays):
    return make.record("cloth_scale", "cloth/100x100", solver, SETTINGS, arrays, size=0)


@pytest.fixture
def ours():
    """A small cloth measured in this process."""
    return suite.measure(SMALL, suite.SUPERNODAL)


def test_what_is_measured_is_the_work_it_says(ours):
    json.dumps(ours)
    system, state = suite.billowing_cloth(SMALL)
    objective = Objective(system, state, suite.H)
    assert len(ours["history"]) == suite.ITERATIONS + 1
    assert 0 < ours["residual"] < 0.1
    assert objective.start.gradient_norm > 1e-3
    assert system.particle_count < ours["entries"]
    assert ours["memory"] >= ours["before"] > 1e7
    for name in ("solve", "local", "step", "limit"):
        assert len(ours[name]) == suite.ROUNDS[1]
        assert min(ours[name]) > 0


def test_the_memory_of_a_process_is_not_that_of_its_parent():
    held = np.ones(25_000_000)
    code = f"from {suite.__name__} import memory; print(memory())"
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert int(child.stdout) < held.nbytes < suite.memory()


def test_progress_is_announced():
    messages = []
    with listening(lambda progress: messages.append(progress.subject)):
        suite.measure(SMALL, suite.SUPERNODAL)
    assert messages[0] == f"cloth/{SMALL}x{SMALL}, supernodal: cloth"
    assert messages[-1].endswith("second factor")
    assert sum("round" in message for message in messages) == suite.ROUNDS[1] + 1


@pytest.mark.slow
def test_a_failure_in_its_process_is_reported():
    with pytest.raises(RuntimeError, match="ValueError: size"):
        suite.in_its_own_process(1, "scipy")


def test_all_cloths_but_the_largest_are_measured_by_scipy_too():
    solvers = {}
    for block in suite.blocks(Scale(targets=1, seconds=1.0)):
        solvers.setdefault(block.settings["particles"], []).append(block.solver)
    *others, largest = solvers.values()
    assert others == [["supernodal", "scipy"]] * 3
    assert largest == ["supernodal"]


def test_scipy_factors_the_same_matrix():
    costs = suite.measure(SMALL, "scipy")
    assert costs.keys() == {"factor", "solve", "memory", "before"}
    assert len(costs["solve"]) == suite.ROUNDS[1]


def test_the_limit_reads_what_it_says():
    assert suite.reading(8 * 1000)() == 1000
    system, _ = suite.billowing_cloth(3)
    assert suite.local_bytes(system) == 26 * (16 + 8 + 8 + 1) + 9 * 144


def test_our_parts_stand_beside_scipys(make):
    records = [measured(make, "supernodal", OURS), measured(make, "scipy", THEIRS)]
    table = suite.scale(Results(records))
    ours, theirs = table.rows
    assert (ours[1], theirs[1]) == ("ours", "SciPy's SuperLU")
    np.testing.assert_allclose(
        ours[2:], [2.0, 0.5, 10.0, 2.0, 3000, 2, 1e-3, 30, 2000, 1000, 20, 50], rtol=1e-12
    )
    assert theirs[2:] == (4.0, None, 20.0, 1.0, *[None] * 5, 2000.0, None, None)
    for part in ("10,000 particles 10 iterations", "0.300 s", "30.0 solves", "0.00100."):
        assert part in table.summary.sentence
