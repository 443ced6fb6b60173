"""Lists of all solutions: what a solver misses and makes up is counted, and shown."""

import importlib

import numpy as np
import pytest
from table_cells import column

from plumbob import PreparedSolutions
from plumbob.bench.experiments.branches import blocks, branches, lists
from plumbob.bench.measure.block import Scale
from plumbob.bench.problems.robot_targets import robot_targets
from plumbob.bench.problems.robots import is_installed, robot
from plumbob.bench.tables.results import Results

OURS = "plumbob.bench.peers.ik.plumbob"
FAULTY = """
import numpy as np
from plumbob.bench.peers.ik import plumbob
from plumbob.bench.peers.protocol import Solve

def prepare_all(robot):
    ask = plumbob.prepare_all(robot)
    def read(solutions):
        q = solutions.coordinates
        return np.vstack([q[1:], q[:1] + 0.1]), None
    return lambda request: Solve(ask(request).call, read)
"""
UNABLE = """
from plumbob.bench.problems.robots import UnableError

def prepare_all(robot):
    raise UnableError("takes no arm")
"""


@pytest.mark.slow
@pytest.mark.skipif(not is_installed("ur5"), reason="example-robot-data is not installed")
def test_missing_and_false_solutions_are_counted(importable):
    importable("faulty_lists", FAULTY)
    importable("unable_lists", UNABLE)
    jobs = [(OURS, {}), (OURS, {"prepared": False}), ("faulty_lists", {}), ("unable_lists", {})]
    ours, plain, faulty, unable = map(lists("ur5", jobs, 1, 1986).get, range(4))
    count = len(ours["solutions"])
    assert count + ours["singular"] == 6
    assert (ours["solutions"] > 0).all()
    assert (ours["seconds"] > 0.0).all()
    assert ours["missing"].tolist() == ours["wrong"].tolist() == [0] * count
    assert faulty["missing"].tolist() == faulty["wrong"].tolist() == [1] * count
    assert plain["solutions"].tolist() == ours["solutions"].tolist()
    assert unable == {"remark": "takes no arm"}


@pytest.mark.skipif(not is_installed("ur5"), reason="example-robot-data is not installed")
def test_our_call_is_prepared_as_those_of_others_are():
    request = robot_targets("ur5", 1).request(0)
    solve = importlib.import_module(OURS).prepare_all(robot("ur5"))(request)
    assert isinstance(solve.call.func, PreparedSolutions)
    answer = solve()
    expected = solve.call().coordinates
    np.testing.assert_array_equal(answer.q, expected)
    assert not np.shares_memory(answer.q, expected)


@pytest.mark.skipif(not is_installed("ur5"), reason="example-robot-data is not installed")
def test_every_arm_of_six_hinges_is_a_problem():
    made = list(blocks(Scale(targets=20, seconds=0.1)))
    assert {"branches/ur5", "branches/jaco2"} <= {block.problem for block in made}
    assert {"Plumbob", "Plumbob, plain call"} <= {block.solver for block in made}
    assert "branches/panda" not in {block.problem for block in made}


def test_the_table_adds_up_the_targets(make):
    record = make.sample("listed")
    lacking = make.sample("listed", solver="EAIK", arrays=None, notes={"remark": "takes no arm"})
    table = branches(Results([record, lacking]))
    assert column(table, "solutions") == [11, None]
    assert column(table, "missing") == [1, None]
    assert column(table, "false") == [2, None]
    assert column(table, "remark") == ["", "takes no arm"]
    assert column(table, "targets with missing solutions") == [1, None]
    assert table.summary.sentence == "Plumbob lists 11 of 12 solutions."
    assert table.summary.points == ("Plumbob: 1 missing, 2 false; UR5 20.0 µs",)
