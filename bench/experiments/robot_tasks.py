"""Tasks of arms held out from tuning, beyond the pose of the effector: success and time."""

import importlib
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ..measure import metrics
from ..measure.block import Block, Measured, Scale
from ..measure.progress import announce
from ..measure.record import Record
from ..measure.timing import attempt, restarted
from ..measure.values import Booleans1, Fact, Floats1, Values
from ..peers.catalogue import PLAIN_CALL, PLUMBOB_LM, TASK_SOLVERS, calls_of
from ..peers.peer import ONE_START, RESTARTS, Peer
from ..problems.evaluate import evaluator_of
from ..problems.robot_tasks import ROBOT_TASKS, TaskRequest, is_met, middle
from ..problems.robots import HELD_OUT, UnableError, is_installed, robot, seed_of, title

SUITE = "robot_tasks"
# The task of records.
ROBOT_TASK = "robot task"
TOLERANCE = 1e-3  # [m], [rad]
# Targets of a robot per target of a scale.
_TARGETS = 0.01
# The median of three calls leaves out a disturbed call, and the first, whose caches are cold.
ROUNDS = 3


class TaskValues(Values, frozen=True, kw_only=True):
    """The answers of a solver to the targets of a robot, (target,)."""

    kind: Fact[str]  # of the attempts
    solved: Booleans1  # whether MuJoCo confirms the answer within the limits
    seconds: Floats1  # the time of a call, all attempts together, the median of its rounds [s]
    distance: Floats1  # from the middle of the limits, root mean square of all joints [rad]


KINDS = {ROBOT_TASK: TaskValues}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every task of every arm held out, by every installed solver, with one start or more."""
    count = max(1, round(_TARGETS * scale.targets))
    for name in filter(is_installed, HELD_OUT):
        rows = product(ROBOT_TASKS, calls_of(TASK_SOLVERS), (ONE_START, RESTARTS))
        for task, (solver, peer, call), kind in rows:
            facts = {"task": ROBOT_TASK, "kind": kind}
            facts["title"] = f"{title(name)}, {ROBOT_TASKS[task].title}"
            settings = {"version": peer.version, "seed": scale.seed, "attempts": kind}
            measure = partial(meet, name, task, peer, kind, count, scale.seed, **call)
            yield Block(SUITE, f"{task}/{name}", solver, measure, settings, count, facts)


def meet(
    name: str, task_name: str, peer: Peer, kind: str, count: int, seed: int, **call: bool
) -> Measured:
    """Solve all targets by a solver, from one start or with restarts; MuJoCo evaluates them."""
    announce(f"{task_name}, {name}, {peer.title}")
    arm, task, entry = robot(name), ROBOT_TASKS[task_name], peer.first(kind)
    module, settings = importlib.import_module(peer.module), entry.settings
    if peer is PLUMBOB_LM:
        settings = {key: settings.get(key) for key in ("restarts", "phases")} | call
    try:
        make_solve = module.prepare_task(arm, task, TOLERANCE, **settings)
    except UnableError as error:
        return {"remark": str(error)}
    if entry.restarts:
        make_solve = restarted(make_solve, arm, entry.restarts)
    rng = np.random.default_rng([seed, seed_of(name)])
    requests = [*map(TaskRequest, arm.draw(rng, count), arm.draw(rng, count))]
    attempt(make_solve(requests[0]))  # whatever is loaded or compiled with the first call
    outputs = [[attempt(solve) for _ in range(ROUNDS)] for solve in map(make_solve, requests)]
    evaluator, no_answer = evaluator_of(name), np.full(len(arm.lower), np.inf)
    rows = [no_answer if output.q is None else output.q for output, *_ in outputs]
    solved = [
        bool(np.isfinite(q).all()) and is_met(evaluator, task, request, q, TOLERANCE)
        for q, request in zip(rows, requests, strict=True)
    ]
    seconds = [[o.time.seconds if o.time else np.nan for o in rounds] for rounds in outputs]
    distance = np.sqrt(np.mean((np.array(rows) - middle(arm)) ** 2, axis=1))
    times = np.median(seconds, axis=1)
    return {"solved": np.array(solved), "seconds": times, "distance": distance}


# What is shown.

from ..ranking.scores import PENALTY
from ..tables.captions import Captions
from ..tables.columns import text, words_in
from ..tables.results import Results, grouped, listed
from ..tables.table import INTERVAL, Column, Summary, listing, words


class SolverTask(NamedTuple):
    """A task for a solver, on all arms."""

    task: str
    attempts: str
    solver: str
    records: list[Record]

    def concatenation(self, read: Callable[[TaskValues], np.ndarray]) -> np.ndarray | None:
        """Return an array of the records with numbers, one after the other; None without any."""
        arrays = [read(record.values) for record in self.records if record.has_numbers]
        return np.concatenate(arrays) if arrays else None

    @property
    def solved(self) -> metrics.Share | None:
        """The share of targets whose task is met."""
        solved = self.concatenation(lambda values: values.solved)
        return None if solved is None else metrics.share(solved)


def _median(title: str, unit: str, read: Callable[[TaskValues], Floats1], **looks: Any) -> Column:
    def cell(row: SolverTask) -> float | None:
        numbers = row.concatenation(read)
        return None if numbers is None or not len(numbers) else float(np.median(numbers))

    return Column(f"{title}, median", unit, read=cell, **looks)


def _penalised_seconds(values: TaskValues) -> Floats1:
    """Return the time of each target, at least the penalty where the task is not met [s]."""
    return metrics.penalised(values.seconds, values.solved, PENALTY)


COLUMNS = (
    text("task", lambda row: row.task),
    text("attempts", lambda row: row.attempts),
    text("solver", lambda row: row.solver),
    Column("solved", note=INTERVAL, best="greatest", read=lambda row: row.solved),
    _median("time", "µs", _penalised_seconds, best="least"),
    text("remark", lambda row: row.records[0].values.remark),
    _median("distance", "rad", lambda values: values.distance[values.solved], folded=True),
)


def _rows(results: Results) -> list[SolverTask]:
    records = results.all(SUITE, task=ROBOT_TASK)
    groups = grouped(records, lambda r: (r.title.rpartition(", ")[2], r.values.kind, r.solver))
    return [SolverTask(*names, members) for names, members in groups.items()]


def _summary(rows: Sequence[SolverTask]) -> Summary:
    points = []
    for (task, attempts), members in grouped(rows, lambda row: row[:2]).items():
        solved = {row.solver: row.solved for row in members if row.solver != PLAIN_CALL.name}
        shares = [f"{solver} {words(share)}" for solver, share in solved.items() if share]
        points.append(f"{task}, {attempts}: {listed(shares)}")
    return listing("The share of the targets whose tasks each solver meets.", points)


_CAPTIONS = Captions(
    __file__,
    tolerance=words(TOLERANCE),
    penalty=words_in(PENALTY, "ms"),
    restarts=words(PLUMBOB_LM.first(RESTARTS).settings["restarts"]),
    rounds=words(ROUNDS),
)

robot_tasks = _CAPTIONS.layout("robot_tasks", _rows, _summary, columns=COLUMNS, compared=2)

LAYOUTS = (robot_tasks,)
