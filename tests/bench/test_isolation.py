"""Solvers in a process of their own: one that hangs, crashes, raises or lies costs one row."""

import importlib
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from plumbob.bench.experiments import Scale
from plumbob.bench.experiments.robots import measurement as robots
from plumbob.bench.experiments.robots.tables import outcomes
from plumbob.bench.harness import stopwatch
from plumbob.bench.harness.isolation import WorkerProcess, raised
from plumbob.bench.harness.job import REPEATS, Job
from plumbob.bench.harness.measure import record_of
from plumbob.bench.harness.worker import Finished, Ready, Solved
from plumbob.bench.peers import registry
from plumbob.bench.peers.ik.protocol import SolverOutput
from plumbob.bench.peers.ik.restarts import restarted
from plumbob.bench.peers.registry import ONE_START, Peer, PeerEntry
from plumbob.bench.problems.evaluate import PoseRequest, Targets, Tolerance, evaluator_of
from plumbob.bench.problems.robots import robot
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.writers import markdown

TOLERANCE = Tolerance(1e-3, 1e-3)
COUNT = 4

# Solvers that return the start, which solves the target; each has a manner of its own, some from
# the target of number `at` on.
FAKES = """
import ctypes, os, random, sys, time
import numpy as np
from plumbob.bench.peers.ik.protocol import SolverOutput, UnableError

def prepare(robot, tolerance, manner="perfect", at=2):
    if manner == "unable":
        raise UnableError("takes no iiwas")
    if manner == "no engine":
        import an_engine_that_nobody_has
    asked = [-2]  # the first is for the warm-up

    def ask(request):
        start = request.start
        asked[0] += 1
        number = asked[0]

        def solve():
            if manner == "prints":
                print("noise", flush=True)
                os.write(1, b"more noise")
            if manner == "gives up":
                return SolverOutput(start, False)
            if manner == "rolls dice":
                libc = ctypes.CDLL(None).rand() / 2**31
                return SolverOutput(start + [random.random(), np.random.rand(), *5 * [libc]], True)
            if manner == "shapeless":
                return SolverOutput(start[:2], True)
            if manner == "none":
                return SolverOutput(None, False)
            if manner == "liar":
                return SolverOutput(start + 0.1, True)
            if manner == "beyond":
                return SolverOutput(start + 2 * np.pi, True)
            if manner == "silent":
                return SolverOutput(start, None)
            if number == at:
                if manner == "hangs":
                    time.sleep(600)
                if manner == "crashes":
                    os._exit(3)
                if manner == "raises":
                    raise ArithmeticError("on\\none target")
                if manner == "slow":
                    time.sleep(0.3)
            return SolverOutput(start, True)
        return solve
    return ask
"""


@pytest.fixture(scope="module", autouse=True)
def fakes(tmp_path_factory):
    """Let this process and the worker import the fakes."""
    folder = tmp_path_factory.mktemp("fakes")
    (folder / "fake_solvers.py").write_text(FAKES)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(folder))
        patch.syspath_prepend(folder)
        yield
    sys.modules.pop("fake_solvers", None)


@pytest.fixture(scope="module")
def worker(fakes):
    """A worker process that loses patience with a target after half a second."""
    worker = WorkerProcess(start_patience=60.0, target_patience=0.5)
    yield worker
    worker.close()


@pytest.fixture
def targets(rng):
    """Targets that their starts solve."""
    evaluator = evaluator_of("iiwa14")
    q = 0.9 * evaluator.robot.draw(rng, COUNT)
    return Targets(*evaluator.forward(q), q, np.zeros(COUNT, dtype=int))


def job(targets, manner, restarts=0, budget=60.0, **settings):
    settings = {"manner": manner, **settings}
    return Job("fake_solvers", robot("iiwa14"), targets, TOLERANCE, settings, restarts, budget)


def verdict(targets, solved):
    answers = np.array([one.q for one in solved])
    return evaluator_of("iiwa14").evaluate(targets, answers, TOLERANCE)


def test_a_perfect_solver_is_found_perfect_in_its_own_process(worker, targets):
    outcome = worker.perform(job(targets, "perfect"))
    assert outcome.trouble == ""
    assert not outcome.is_lost
    assert [one.claim for one in outcome.solved] == [1] * COUNT
    assert all(0 <= one.seconds < 1 for one in outcome.solved)
    assert outcome.setup > 0
    assert verdict(targets, outcome.solved).solved.all()


@pytest.mark.parametrize("manner", ["hangs", "crashes"])
def test_one_that_is_lost_keeps_what_it_finished_and_costs_no_other(worker, targets, manner):
    outcome = worker.perform(job(targets, manner))
    assert len(outcome.solved) == 2
    assert outcome.is_lost
    reason = {"hangs": "ended after 0.5 s of silence", "crashes": "its process ended with code 3"}
    assert outcome.trouble == reason[manner]
    again = worker.perform(job(targets, "perfect"))
    assert len(again.solved) == COUNT
    assert again.trouble == ""


def test_a_quick_solve_follows_others_and_a_slow_one_is_made_once(targets, monkeypatch):
    """What is timed is timed as in a loop of solves and nothing else."""
    monkeypatch.setattr("plumbob.bench.harness.job.QUICK", 0.1)
    counts, called = [], 0

    def timed(call):
        nonlocal called
        counts.append(called)
        called = 0
        return stopwatch.time_call(call)

    monkeypatch.setattr("plumbob.bench.harness.job.time_call", timed)
    fake = importlib.import_module("fake_solvers")
    prepare = fake.prepare

    def counting(*given, **settings):
        ask = prepare(*given, **settings)

        def asked(*target):
            solve = ask(*target)

            def one():
                nonlocal called
                called += 1
                return solve()

            return one

        return asked

    monkeypatch.setattr(fake, "prepare", counting)
    messages(targets, "slow", at=1)
    setup, warm, *each = counts
    assert (setup, warm) == (0, 0)
    assert each == [1, 1 + REPEATS, 1, 1 + REPEATS]


@pytest.mark.parametrize("again", [1, 7])
@pytest.mark.parametrize(("manner", "restarts"), [("gives up", 3), ("rolls dice", 0)])
def test_the_answers_are_the_same_however_often_a_quick_solve_is_made_again(
    targets, monkeypatch, manner, restarts, again
):
    """On a quick machine solves are warmed up and on a slow one not: no answer may depend on it."""

    def answers(quick, again):
        monkeypatch.setattr("plumbob.bench.harness.job.QUICK", quick)
        monkeypatch.setattr("plumbob.bench.harness.job.REPEATS", again)
        said = messages(targets, manner, restarts=restarts)
        return np.array([one.q for one in said if isinstance(one, Solved)])

    never = answers(0.0, 0)
    assert not np.array_equal(never, targets.starts)  # else no lot was drawn
    assert len(np.unique(never, axis=0)) == COUNT
    np.testing.assert_array_equal(answers(10.0, again), never)


def test_what_a_solver_prints_does_not_disturb_its_results(worker, targets):
    outcome = worker.perform(job(targets, "prints"))
    assert len(outcome.solved) == COUNT
    assert outcome.trouble == ""


def messages(targets, manner, **more):
    """What the worker says, in this process."""
    return list(job(targets, manner, **more).perform())


def test_the_worker_says_when_it_is_ready_each_target_and_the_end(targets):
    said = messages(targets, "perfect")
    assert [type(message) for message in said] == [Ready, *[Solved] * COUNT, Finished]


def test_one_that_raises_loses_one_target_and_says_why(targets):
    solved = [m for m in messages(targets, "raises") if isinstance(m, Solved)]
    assert [one.trouble for one in solved] == ["", "", "ArithmeticError: on one target", ""]
    assert verdict(targets, solved).solved.tolist() == [True, True, False, True]
    assert raised(solved) == "ArithmeticError: on one target, on 1 of 4 targets"


@pytest.mark.parametrize(
    ("manner", "why"),
    [("unable", "takes no iiwas"), ("no engine", "ModuleNotFoundError: No module named 'an_eng")],
)
def test_one_that_cannot_be_set_up_says_why(targets, manner, why):
    (said,) = messages(targets, manner)
    assert isinstance(said, Finished)
    assert said.trouble.startswith(why)


@pytest.mark.parametrize(
    ("manner", "claimed"), [("liar", 1), ("beyond", 1), ("none", 0), ("silent", -1)]
)
def test_what_is_claimed_and_what_is_so_are_kept_apart(targets, manner, claimed):
    solved = [m for m in messages(targets, manner) if isinstance(m, Solved)]
    assert {one.claim for one in solved} == {claimed}
    evaluation = verdict(targets, solved)
    assert evaluation.solved.all() == (manner == "silent")
    if manner == "beyond":
        assert evaluation.position.max() < 1e-12
        assert evaluation.beyond.min() > 1


def test_an_answer_of_another_shape_is_none(targets):
    solved = [m for m in messages(targets, "shapeless") if isinstance(m, Solved)]
    assert all(np.isnan(one.q).all() for one in solved)
    assert solved[0].trouble == "returned (2,) numbers, not (7,)"


def test_a_solver_without_time_left_begins_no_further_target(targets):
    said = messages(targets, "slow", at=0, budget=0.2)
    assert [type(message) for message in said] == [Ready, Solved, Finished]


class Attempts:
    """A solver that gives these answers one after the other; it raises those that are exceptions.

    It counts the starts that it is asked from, and those of the attempts that it makes.
    """

    def __init__(self, *answers):
        self.answers, self.asked, self.starts = list(answers), [], []

    def __call__(self, request):
        start = request.start
        self.asked.append(start)

        def solve():
            self.starts.append(start)
            answer = self.answers.pop(0)
            if isinstance(answer, Exception):
                raise answer
            return answer

        return solve


GOOD, SILENT = SolverOutput(np.zeros(7), True), SolverOutput(np.zeros(7), None)
BEYOND, MISSED = SolverOutput(np.full(7, 9.0), True), SolverOutput(np.ones(7), False)
NOTHING, LATER = SolverOutput(None, False), SolverOutput(np.ones(7), True)


@pytest.mark.parametrize(
    ("answers", "count", "q", "claimed", "error"),
    [
        ([BEYOND, NOTHING, GOOD, LATER], 3, 0.0, True, ""),
        ([BEYOND, NOTHING, SILENT, LATER], 4, 1.0, True, ""),
        # An exception once ended the target: a solver that solves all of them had 84 %.
        ([ArithmeticError("once"), ArithmeticError("twice"), GOOD], 3, 0.0, True, "once"),
        ([NOTHING, MISSED, NOTHING, ArithmeticError("in the end")], 4, 1.0, False, "in the end"),
        ([BEYOND] * 4, 4, None, False, ""),
    ],
    ids=["claimed", "silent", "raises", "raises in the end", "beyond"],
)
def test_restarts_end_with_the_first_claim_within_the_limits(answers, count, q, claimed, error):
    """Targets are converted for every restart before the clock runs, each from its own start."""
    attempts = Attempts(*answers)
    solve = restarted(attempts, robot("iiwa14"), 3)(PoseRequest(None, None, np.full(7, 0.5)))
    assert len(attempts.asked) == 4
    assert not attempts.starts
    answer = solve()
    assert (q is None) or (answer.q == q).all()
    assert answer.claim is claimed
    assert answer.error == (f"ArithmeticError: {error}" if error else "")
    assert len(attempts.asked) == 4
    assert len(attempts.starts) == count
    assert (attempts.starts[0] == 0.5).all()
    assert len({tuple(start) for start in attempts.starts}) == count


@pytest.fixture
def suite(monkeypatch, worker):
    """The suite with fakes for peers, on the iiwa and the character only."""

    def peer(title, package="numpy", **settings):
        return Peer(title, "fake_solvers", package, "MIT", "", (PeerEntry(ONE_START, settings),))

    peers = [
        peer("liar", manner="liar"),
        peer("hangs", manner="hangs", at=1),
        peer("raises", manner="raises", at=1),
        peer("gone", package="a-package-that-nobody-has"),
        peer("unable", manner="unable"),
    ]
    monkeypatch.setattr(registry, "PEERS", peers)
    monkeypatch.setattr(robots, "ROBOTS", ("iiwa14",))
    monkeypatch.setattr(robots, "worker_process", lambda: worker)
    blocks = {(b.solver, b.problem): b for b in robots.blocks(Scale(targets=3, seconds=10.0))}
    return SimpleNamespace(blocks=blocks)


def test_a_missing_peer_costs_one_block_that_says_so(suite):
    assert ("gone", "robots/all") in suite.blocks
    assert sum(solver == "gone" for solver, _ in suite.blocks) == 1
    arrays, notes, _ = suite.blocks["gone", "robots/all"].measure()
    assert not arrays
    assert notes["remark"] == "a-package-that-nobody-has is not installed"


def test_every_manner_becomes_one_record(suite):
    solves, notes, _ = suite.blocks["liar", "robots/iiwa14"].measure()
    assert solves.claimed.tolist() == [1] * 6
    assert not solves.solved.any()
    assert notes["remark"] == ""
    solves, notes, _ = suite.blocks["unable", "robots/iiwa14"].measure()
    assert solves.solved is None
    assert notes["remark"] == "takes no iiwas"


def test_the_target_that_a_solver_hangs_on_counts_as_failed_with_the_time_it_took(suite):
    """The next targets are given to a new process, in which it hangs on its second again."""
    solves, notes, _ = suite.blocks["hangs", "robots/iiwa14"].measure()
    assert solves.exception.tolist() == [False, True] * 3
    assert not solves.solved[1]
    assert solves.seconds[1] == 0.5
    assert np.isnan(solves.position[1])
    assert notes["remark"] == "ended after 0.5 s of silence, on 3 of 6 targets"


def test_a_process_lost_at_the_end_of_the_budget_is_not_started_again(suite, monkeypatch):
    """Else a solver that hangs on every target would take hours."""
    monkeypatch.setattr(robots, "Budget", lambda seconds: SimpleNamespace(is_spent=True))
    solves, notes, _ = suite.blocks["hangs", "robots/iiwa14"].measure()
    assert solves.exception.tolist() == [False, True]
    assert notes["remark"] == "ended after 0.5 s of silence"


@pytest.mark.parametrize(("solver", "count"), [("hangs", 3), ("raises", 1)])
def test_what_a_solver_raises_is_printed_as_such_and_not_as_no_answer(suite, solver, count):
    block = suite.blocks[solver, "robots/iiwa14"]
    table = outcomes(Results([record_of(block, block.measure(), 0.0)]))
    heading, _, row = (line.split(" | ") for line in markdown(table).splitlines() if "|" in line)
    printed = {name.strip("| "): cell.strip("| ") for name, cell in zip(heading, row, strict=True)}
    assert printed["wrong claim"] == str(6 - count)
    assert printed["exception or crash"] == str(count)
    assert printed["no answer"] == printed["not begun"] == "0"
    expected = f"{solver}: {6 - count} wrong claim and {count} exception or crash, of 6"
    assert table.summary.points[0] == expected
