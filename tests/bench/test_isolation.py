"""Solvers in a process of their own: one that hangs, crashes, raises or lies costs one row."""

import numpy as np
import pytest

from plumbob.bench.experiments import Scale, robots
from plumbob.bench.experiments.robots import outcomes, robot_by_robot
from plumbob.bench.measure import timing
from plumbob.bench.measure.isolation import Finished, Solved, WorkerProcess, raised
from plumbob.bench.measure.measure import record_of
from plumbob.bench.measure.timing import Job, restarted, times_in_turns
from plumbob.bench.peers import catalogue
from plumbob.bench.peers.peer import ONE_START, Peer, Run
from plumbob.bench.peers.protocol import OwnTime, SolverOutput
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
from plumbob.bench.peers.protocol import SolverOutput, UnableError

def behave(manner, start):
    if manner == "prints":
        print("noise", flush=True)
        os.write(1, b"more noise")
    libc = ctypes.CDLL(None)
    return {
        "gives up": lambda: (start, False),
        "rolls dice": lambda: (
            start + [random.random(), np.random.rand(), *5 * [libc.rand() / 2**31]], True),
        "shapeless": lambda: (start[:2], True),
        "none": lambda: (None, False),
        "liar": lambda: (start + 0.1, True),
        "beyond": lambda: (start + 2 * np.pi, True),
        "silent": lambda: (start, None),
    }.get(manner, lambda: (start, True))()

def misbehave(manner):
    if manner == "hangs":
        time.sleep(600)
    if manner == "crashes":
        os._exit(3)
    if manner == "raises":
        raise ArithmeticError("on\\none target")

def prepare(robot, tolerance, manner="perfect", at=2):
    if manner == "unable":
        raise UnableError("takes no iiwas")
    if manner == "no engine":
        import an_engine_that_nobody_has
    requests = [-2]  # the first is for the warm-up

    def ask(request):
        requests[0] += 1
        number = requests[0]

        def solve():
            if number == at:
                misbehave(manner)
            return SolverOutput(*behave(manner, request.start))
        return solve
    return ask
"""


@pytest.fixture(scope="module", autouse=True)
def fakes(importable):
    return importable("fake_solvers", FAKES)


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


def job(targets, manner, restarts=0, **settings):
    settings = {"manner": manner, **settings}
    return Job("fake_solvers", robot("iiwa14"), targets, TOLERANCE, settings, restarts)


def messages(targets, manner, **more):
    """The messages of the worker, in this process."""
    return list(job(targets, manner, **more).perform())


def solved(targets, manner, **more):
    return [m for m in messages(targets, manner, **more) if isinstance(m, Solved)]


def evaluation(targets, answers):
    q = np.array([answer.q for answer in answers])
    return evaluator_of("iiwa14").evaluate(targets, q, TOLERANCE)


def test_a_perfect_solver_is_perfect_in_its_own_process_whatever_it_prints(worker, targets):
    outcome = worker.perform(job(targets, "prints"))
    assert (outcome.trouble, outcome.is_lost) == ("", False)
    assert [answer.claim for answer in outcome.solved] == [1] * COUNT
    assert all(0 <= answer.seconds < 1 for answer in outcome.solved)
    assert outcome.setup > 0
    assert evaluation(targets, outcome.solved).solved.all()


@pytest.mark.parametrize(("manner", "restarts"), [("gives up", 3), ("rolls dice", 0)])
def test_an_answer_depends_on_its_target_only(targets, manner, restarts):
    """Neither on the targets before it nor on how often they were solved."""
    forwards = np.array([a.q for a in solved(targets, manner, restarts=restarts)])
    assert not np.array_equal(forwards, targets.starts)  # else nothing was drawn
    assert len(np.unique(forwards, axis=0)) == COUNT
    reverse = Targets(*(part[::-1] for part in targets))
    backwards = np.array([a.q for a in solved(reverse, manner, restarts=restarts)])
    np.testing.assert_array_equal(backwards[::-1], forwards)
    later = solved(targets.after(2), manner, restarts=restarts)
    np.testing.assert_array_equal([a.q for a in later], forwards[2:])


def test_solvers_take_turns_and_a_lost_one_costs_its_own_times(worker, targets, monkeypatch):
    monkeypatch.setattr(timing, "worker_process", lambda: worker)
    jobs = [job(targets, manner) for manner in ("perfect", "hangs", "unable", "raises")]
    perfect, *others, raises = times_in_turns(jobs, 3, 2)
    assert others == [None, None]
    for times in (perfect, raises):
        assert times.seconds.shape == (2, 3)
        assert times.control.shape == (2,)
        assert (times.seconds > 0).all()


class Recorder(WorkerProcess):
    """A worker in this process, which keeps its turns."""

    def __init__(self):
        super().__init__()
        self.turns = []

    def stream(self, job):
        self.turns.append(job)
        return job.perform()


def test_the_order_of_a_round_is_drawn_and_all_targets_are_converted_first(targets, monkeypatch):
    recorder = Recorder()
    monkeypatch.setattr(timing, "worker_process", lambda: recorder)
    jobs = [job(targets, "perfect") for _ in range(4)]
    assert None not in times_in_turns(jobs, 2, 3)
    rounds = np.reshape([turn.number for turn in recorder.turns], (3, 4))
    assert (np.sort(rounds, axis=1) == range(4)).all()
    assert len(np.unique(rounds, axis=0)) > 1
    steps = []

    def ask(request):
        steps.append("converts")
        return lambda: steps.append("solves") or SolverOutput(request.start, True)

    monkeypatch.setitem(timing._factories, 0, ask)
    ready, *answers, _ = timing.Turn("fake_solvers", 0, jobs[0], 2, is_first=False).perform()
    assert steps == ["converts"] * 2 + ["solves"] * 3  # the first twice, uncounted once
    assert len(answers) == 2
    assert ready.pace > 0.0


def test_a_slow_turn_is_not_silent(targets, monkeypatch):
    """The times of fast solves are sent at the end, lest the messages disturb the solves."""
    sent = []
    slow, fast = OwnTime(timing._SILENCE * 1.1), OwnTime(timing._SILENCE / 10)
    for number, time in enumerate((slow, fast)):
        ask = lambda request, time=time: (  # noqa: E731
            lambda: sent.append("solve") or SolverOutput(request.start, True, time)
        )
        monkeypatch.setitem(timing._factories, number, ask)
    orders = []
    for number in (0, 1):
        sent.clear()
        turn = timing.Turn("fake_solvers", number, job(targets, "perfect"), 2, is_first=False)
        sent.extend(type(message).__name__ for message in turn.perform())
        orders.append(" ".join(sent))
    assert orders == [
        "Ready solve solve Solved solve Solved Finished",
        "Ready solve solve solve Solved Solved Finished",
    ]


def test_a_solver_whose_clock_stands_still_uses_up_its_budget(targets, monkeypatch):
    """A user's solver is given the first targets only if it is slow, whatever it claims."""
    monkeypatch.setattr(timing, "_LEAST_SECONDS", 0.0)
    monkeypatch.setattr(timing, "_TARGET_SECONDS", 1.0)
    ask = lambda request: lambda: SolverOutput(request.start, True, OwnTime(1e-9, 2.0))  # noqa: E731
    request = job(targets, "perfect")._replace(user_solver="mine")
    assert len(list(request.answers(ask))) == 3  # the third is begun within 4 s


def test_an_exception_of_a_conversion_costs_one_target(targets):
    def ask(request):
        if (request.start == targets.starts[1]).all():
            raise ValueError("no such target")
        return lambda: SolverOutput(request.start, True)

    troubles = [answer.trouble for answer in job(targets, "perfect").answers(ask)]
    assert troubles == ["", "ValueError: no such target", "", ""]


def test_an_exception_costs_one_target_and_is_reported(targets):
    answers = solved(targets, "raises")
    troubles = ["", "", "ArithmeticError: on one target", ""]
    assert [answer.trouble for answer in answers] == troubles
    assert evaluation(targets, answers).solved.tolist() == [True, True, False, True]
    assert raised(answers) == "ArithmeticError: on one target, on 1 of 4 targets"


@pytest.mark.parametrize(
    ("manner", "why"),
    [("unable", "takes no iiwas"), ("no engine", "ModuleNotFoundError: No module named 'an_eng")],
)
def test_a_solver_that_cannot_be_set_up_says_why(targets, manner, why):
    (message,) = messages(targets, manner)
    assert isinstance(message, Finished)
    assert message.trouble.startswith(why)


@pytest.mark.parametrize(
    ("manner", "claim"), [("liar", 1), ("beyond", 1), ("none", 0), ("silent", -1)]
)
def test_claims_are_independent_of_the_evaluation(targets, manner, claim):
    answers = solved(targets, manner)
    assert {answer.claim for answer in answers} == {claim}
    errors = evaluation(targets, answers)
    assert errors.solved.all() == (manner == "silent")
    if manner == "beyond":
        assert errors.position.max() < 1e-12
        assert errors.beyond.min() > 1


def test_an_answer_of_another_shape_is_none(targets):
    answers = solved(targets, "shapeless")
    assert all(np.isnan(answer.q).all() for answer in answers)
    assert answers[0].trouble == "returned (2,) numbers, not (7,)"


class Attempts:
    """A solver that gives these answers one after the other, and raises exceptions among them.

    It keeps the starts of its requests, and those of the attempts that it makes.
    """

    def __init__(self, *answers):
        self.answers, self.requests, self.starts = list(answers), [], []

    def __call__(self, request):
        self.requests.append(request)

        def solve():
            self.starts.append(request.start)
            answer = self.answers.pop(0)
            if isinstance(answer, Exception):
                raise answer
            return answer._replace(time=OwnTime(0.25))

        return solve


GOOD, SILENT = SolverOutput(np.zeros(7), True), SolverOutput(np.zeros(7), None)
BEYOND, MISSED = SolverOutput(np.full(7, 9.0), True), SolverOutput(np.ones(7), False)
NOTHING, LATER = SolverOutput(None, False), SolverOutput(np.ones(7), True)


@pytest.mark.parametrize(
    ("answers", "count", "q", "claim", "error"),
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
def test_restarts_end_with_the_first_claim_within_the_limits(answers, count, q, claim, error):
    """Targets are converted for every restart before the clock runs, each from its own start.

    Times that a solver measures are added.
    """
    attempts = Attempts(*answers)
    request = PoseRequest(None, None, np.full(7, 0.5))
    solve = restarted(attempts, robot("iiwa14"), 3)(request)
    assert (len(attempts.requests), len(attempts.starts)) == (4, 0)
    answer = solve()
    assert (q is None) or (answer.q == q).all()
    assert answer.claim is claim
    assert answer.error == (f"ArithmeticError: {error}" if error else "")
    assert (len(attempts.requests), len(attempts.starts)) == (4, count)
    assert error or answer.time == OwnTime(0.25 * count)
    assert (attempts.starts[0] == 0.5).all()
    assert len({tuple(start) for start in attempts.starts}) == count


@pytest.fixture
def suite(monkeypatch, worker):
    """The blocks of fakes for peers, on the iiwa only, by solver and problem."""

    def peer(title, package="numpy", **settings):
        return Peer(title, "fake_solvers", package, "MIT", "", "", (Run(ONE_START, settings),))

    peers = [
        peer("liar", manner="liar"),
        peer("hangs", manner="hangs", at=1),
        peer("raises", manner="raises", at=1),
        peer("gone", package="a-package-that-nobody-has"),
        peer("unable", manner="unable"),
    ]
    monkeypatch.setattr(catalogue, "PEERS", peers)
    monkeypatch.setattr(robots, "ROBOTS", ("iiwa14",))
    monkeypatch.setattr(timing, "worker_process", lambda: worker)
    yield {(b.solver, b.problem): b for b in robots.blocks(Scale(targets=3, seconds=10.0))}
    catalogue._by_name.cache_clear()  # where the fakes stand in place of the peers


def test_every_manner_becomes_one_record(suite):
    """The target that a solver hangs on costs the time it took; a new process continues."""
    measured = suite["liar", "robots/iiwa14"].measure()
    assert measured["claims"].tolist() == [1] * 6
    assert not measured["solved"].any()
    assert not measured["remark"]
    measured = suite["unable", "robots/iiwa14"].measure()
    assert "solved" not in measured
    assert measured["remark"] == "takes no iiwas"
    measured = suite["hangs", "robots/iiwa14"].measure()
    assert measured["exception"].tolist() == [False, True] * 3
    assert "seconds" not in measured  # it hangs on a target that is timed
    assert np.isnan(measured["position"][1])
    assert measured["remark"] == "ended after 0.5 s of silence, on 3 of 6 targets"
    assert sum(solver == "gone" for solver, _ in suite) == 1
    measured = suite["gone", "robots/all"].measure()
    assert measured == {"remark": "a-package-that-nobody-has is not installed"}


def test_a_solver_that_hangs_thrice_does_not_finish(suite, monkeypatch):
    """Else a solver that hangs on every target would take hours; its share is not known."""
    monkeypatch.setattr(timing, "MAXIMUM_SILENCES", 1)
    block = suite["hangs", "robots/iiwa14"]
    measured = block.measure()
    assert measured["exception"].tolist() == [False, True]
    table = robot_by_robot(Results([record_of(block, measured, 0.0)]))
    row = dict(zip([column.title for column in table.columns], table.rows[0], strict=True))
    assert (row["solved"], row["mark"].partition(";")[0]) == (None, "not finished")


def test_exceptions_are_counted_apart_from_missing_answers(suite):
    block = suite["raises", "robots/iiwa14"]
    table = outcomes(Results([record_of(block, block.measure(), 0.0)]))
    heading, _, row = (line.split(" | ") for line in markdown(table).splitlines() if "|" in line)
    printed = {name.strip("| "): cell.strip("| ") for name, cell in zip(heading, row, strict=True)}
    assert printed["exception or crash"] == "1"
    assert printed["wrong claim"] == "5"
    assert printed["no answer"] == printed["not begun"] == "0"
