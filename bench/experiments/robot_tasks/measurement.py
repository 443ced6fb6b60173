"""Tasks of arms held out from tuning, by the solvers with tasks."""

import importlib
from collections.abc import Iterator
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np

from ...harness.block import Block, Measured, Scale
from ...harness.progress import announce
from ...harness.timing import attempt, restarted
from ...peers.catalogue import PLUMBOB, PLUMBOB_LM, TASK_SOLVERS
from ...peers.peer import ONE_START, RESTARTS, Peer
from ...problems.evaluate import evaluator_of
from ...problems.robot_tasks import ROBOT_TASKS, TaskRequest, is_met, middle
from ...problems.robots import HELD_OUT, UnableError, is_installed, robot, seed_of, title
from . import ROBOT_TASK, TOLERANCE

SUITE = "robot_tasks"
# Targets of a robot per target of a scale.
_TARGETS = 0.01


class TaskJob(NamedTuple):
    """Targets of a robot, and a solver."""

    robot: str
    task: str
    peer: Peer
    kind: str  # `ONE_START` or `RESTARTS`
    target_count: int
    seed: int


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every task of every arm held out, by every installed solver, with one start or more."""
    count = max(1, round(_TARGETS * scale.targets))
    for name in filter(is_installed, HELD_OUT):
        peers = [peer for peer in TASK_SOLVERS if peer.is_installed]
        for task, peer, kind in product(ROBOT_TASKS, peers, (ONE_START, RESTARTS)):
            facts = {"task": ROBOT_TASK, "kind": kind}
            facts["title"] = f"{title(name)}, {ROBOT_TASKS[task].title}"
            settings = {"version": peer.version, "seed": scale.seed, "attempts": kind}
            measure = partial(meet, TaskJob(name, task, peer, kind, count, scale.seed))
            solver = PLUMBOB if peer is PLUMBOB_LM else peer.title
            yield Block(SUITE, f"{task}/{name}", solver, measure, settings, count, facts)


def meet(job: TaskJob) -> Measured:
    """Ask a solver for all targets; MuJoCo evaluates the answers."""
    announce(f"{job.task}, {job.robot}, {job.peer.title}")
    arm, task, entry = robot(job.robot), ROBOT_TASKS[job.task], job.peer.first(job.kind)
    module, settings = importlib.import_module(job.peer.module), entry.settings
    if job.peer is PLUMBOB_LM:
        settings = {"restarts": settings["restarts"]}
    try:
        ask = module.prepare_task(arm, task, TOLERANCE, **settings)
    except UnableError as error:
        return {"remark": str(error)}
    if entry.restarts:
        ask = restarted(ask, arm, entry.restarts)
    rng = np.random.default_rng([job.seed, seed_of(job.robot)])
    pairs = (arm.draw(rng, job.target_count) for _ in range(2))
    requests = [TaskRequest(goal, start) for goal, start in zip(*pairs, strict=True)]
    attempt(ask(requests[0]))  # whatever is loaded or compiled with the first call
    outputs = [attempt(ask(request)) for request in requests]
    evaluator, no_answer = evaluator_of(job.robot), np.full(len(arm.lower), np.inf)
    rows = [no_answer if output.q is None else output.q for output in outputs]
    solved = [
        bool(np.isfinite(q).all()) and is_met(evaluator, task, request, q, TOLERANCE)
        for q, request in zip(rows, requests, strict=True)
    ]
    seconds = [output.time.seconds if output.time else np.nan for output in outputs]
    distance = np.sqrt(np.mean((np.array(rows) - middle(arm)) ** 2, axis=1))
    return {"solved": np.array(solved), "seconds": np.array(seconds), "distance": distance}
