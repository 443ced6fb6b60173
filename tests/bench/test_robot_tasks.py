"""Tasks of arms: what is met is confirmed, in every part, and counted."""

import dataclasses

import numpy as np
import pytest
from table_cells import column

from plumbob.bench.experiments.robot_tasks import TOLERANCE, blocks, meet, robot_tasks
from plumbob.bench.measure.block import Scale
from plumbob.bench.peers.catalogue import PLUMBOB_LM, TASK_SOLVERS
from plumbob.bench.peers.peer import ONE_START, RESTARTS
from plumbob.bench.problems.evaluate import evaluator_of
from plumbob.bench.problems.robot_tasks import POSTURE, ROBOT_TASKS, TaskRequest, is_met
from plumbob.bench.tables.results import Results

# Published dimensions, which need no package.
ARM = "iiwa14"
FAULTY = """
import numpy as np
from plumbob.bench.problems.robots import UnableError

def prepare_task(robot, task, tolerance, **settings):
    from plumbob.bench.peers.protocol import Solve
    if len(task.parts) > 1:
        raise UnableError("takes one part")
    return lambda request: Solve(lambda: request.goal + 0.01, lambda q: (q, True))
"""


@pytest.mark.parametrize("name", ROBOT_TASKS)
def test_a_task_is_met_by_its_goal_only(name, rng):
    task, evaluator = ROBOT_TASKS[name], evaluator_of(ARM)
    goal, start = 0.9 * evaluator.robot.draw(rng, 2)
    request = TaskRequest(goal, start)
    assert is_met(evaluator, task, request, goal, TOLERANCE)
    assert not is_met(evaluator, task, request, goal + 0.01, TOLERANCE)
    assert not is_met(evaluator, task, request, goal + 2.0 * np.pi, TOLERANCE)
    for i, part in enumerate(task.parts):  # each part counts
        rest = dataclasses.replace(task, parts=task.parts[:i] + task.parts[i + 1 :])
        q = meet_part(rest, request) if rest.parts and part.kind != POSTURE else None
        assert q is None or not is_met(evaluator, task, request, q, TOLERANCE)


def meet_part(task, request):
    """Return coordinates that Plumbob finds for the remaining parts."""
    from plumbob.bench.peers.ik import plumbob

    robot = evaluator_of(ARM).robot
    solve = plumbob.prepare_task(robot, task, TOLERANCE, restarts=20)(request)
    q = solve().q
    assert is_met(evaluator_of(ARM), task, request, q, TOLERANCE)
    return q


@pytest.mark.parametrize("name", ROBOT_TASKS)
@pytest.mark.parametrize("peer", TASK_SOLVERS, ids=lambda peer: peer.title)
def test_every_installed_solver_meets_tasks_with_restarts_or_says_why_not(name, peer):
    if not peer.is_installed:
        pytest.skip(f"{peer.package} is not installed")
    measured = meet(ARM, name, peer, RESTARTS, 2, 1986)
    if "solved" not in measured:
        assert measured["remark"] == "has no task to look at a point"
        assert name == "look_at"
        assert peer is not PLUMBOB_LM
        return
    assert measured["solved"].all()
    assert (measured["seconds"] > 0.0).all()
    assert (measured["distance"] < 3.0).all()


@pytest.mark.parametrize("kind", [ONE_START, RESTARTS])
def test_a_plain_call_gives_the_answers_of_the_prepared_call(kind):
    prepared, plain = (
        meet(ARM, "axis", PLUMBOB_LM, kind, 3, 1986, **call) for call in ({}, {"prepared": False})
    )
    assert prepared["distance"].tolist() == plain["distance"].tolist()
    assert prepared["solved"].tolist() == plain["solved"].tolist()


def test_every_solver_has_a_row_and_ours_has_two():
    made = {block.solver for block in blocks(Scale(targets=100, seconds=0.1))}
    assert made == {"Plumbob", "Plumbob, plain call"} | {
        peer.title for peer in TASK_SOLVERS[1:] if peer.is_installed
    }


def test_a_false_claim_is_not_counted_and_an_unable_solver_says_why(importable):
    importable("faulty_tasks", FAULTY)
    peer = dataclasses.replace(PLUMBOB_LM, module="faulty_tasks", title="faulty")
    assert not meet(ARM, "axis", peer, ONE_START, 2, 1986)["solved"].any()
    assert meet(ARM, "loop", peer, ONE_START, 2, 1986)["remark"] == "takes one part"


def test_the_table_adds_up_the_robots(make):
    records = [make.sample("met"), make.sample("met", problem="axis/z1")]
    plain = make.sample("met", solver="Plumbob, plain call")
    lacking = make.sample("met", solver="pink", arrays=None, notes={"remark": "has no task"})
    table = robot_tasks(Results([*records, plain, lacking]))
    assert column(table, "remark") == ["", "", "has no task"]
    share, _, none = column(table, "solved (95 % interval)")
    assert (share.hits, share.total, none) == (2, 4, None)
    (point,) = table.summary.points
    assert "Plumbob 2/4" in point
    assert "plain call" not in point, "its answers are those of the prepared call"
    (microseconds,) = column(table, "time, median [µs]")[:1]
    assert microseconds >= 5e4, "two of four targets are missed, which count as 100 ms"
