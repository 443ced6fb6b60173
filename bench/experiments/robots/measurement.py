"""Robots: every solver that is installed on every arm and on the character, in all strata.

Each solver works in a process of its own. Its answers are evaluated here, by MuJoCo's kinematics.
"""

import functools
import zlib
from collections.abc import Iterable, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ...harness.block import Block, Measured, Scale
from ...harness.isolation import Outcome, WorkerProcess, raised
from ...harness.measure import not_installed
from ...harness.stopwatch import Budget
from ...harness.worker import Solved
from ...peers import registry
from ...peers.registry import Entry, Peer
from ...problems.evaluate import Targets, Tolerance, evaluator_of
from ...problems.robot_targets import STRATA, least_distances, robot_targets, unreachable_targets
from ...problems.robots import PACKAGE, ROBOTS, is_installed, title
from . import REACHABLE, UNREACHABLE
from .job import Job

SUITE = "ik"
TOLERANCE = Tolerance(1e-3, 1e-3)
# Targets in a stratum, and seconds that a solver has for a robot within reach and beyond, for
# those of a scale.
_TARGETS = 0.1
_BUDGET, _BUDGET_BEYOND = 5.0, 3.0
# Targets out of reach are no fewer than these, however few are asked for in a stratum.
OUT_OF_REACH = 100
EVERY_SOLVER = "all solvers"
# Digits kept of times and residuals: more would fill the disk with noise.
_DIGITS = 5


class Run(NamedTuple):
    """One solver with its settings, on one robot."""

    robot: str
    peer: Peer
    entry: Entry
    tolerance: Tolerance
    budget: float


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield each solver on each robot; one block for a solver or a robot that is not installed.

    The solvers of a robot follow each other in an order drawn by lot, so that a machine that gets
    slower or faster does so to all of them.
    """
    here = [name for name in ROBOTS if is_installed(name)]
    for name in ROBOTS:
        if name not in here:
            absent = partial(not_installed, PACKAGE)
            facts = {"task": REACHABLE, "title": title(name)}
            yield Block(SUITE, f"robots/{name}", EVERY_SOLVER, absent, {"kind": "any"}, 0, facts)
    made = [block for peer in registry.PEERS for block in blocks_of(peer, here, scale)]
    yield from by_lot(made)


def blocks_of(peer: Peer, robots: list[str], scale: Scale) -> Iterator[Block]:
    """Yield a solver on robots that are installed, by each of its entries."""
    count = max(1, round(_TARGETS * scale.targets))
    for entry in peer.entries:
        yield from _entry_blocks(peer, entry, robots, count, scale.seconds)


def by_lot(blocks: Iterable[Block]) -> list[Block]:
    """Return blocks problem by problem, the solvers of each in an order of its own.

    It is the same every time, whichever other solvers are asked for.
    """
    problems: dict[str, list[Block]] = {}
    for block in blocks:
        problems.setdefault(block.problem, []).append(block)
    return [block for group in problems.values() for block in sorted(group, key=_lot)]


def _lot(block: Block) -> int:
    return zlib.crc32(f"{block.problem}, {block.solver}".encode())


def _entry_blocks(
    peer: Peer, entry: Entry, robots: list[str], count: int, seconds: float
) -> Iterator[Block]:
    solver = peer.called(entry)
    settings = settings_of(peer, entry, TOLERANCE)
    if not peer.version:
        absent = partial(not_installed, peer.package)
        facts = {"task": REACHABLE, "title": "every robot"}
        yield Block(SUITE, "robots/all", solver, absent, settings, 0, facts)
        return
    beyond = max(OUT_OF_REACH, count)
    for name in robots:
        run = Run(name, peer, entry, TOLERANCE, _BUDGET * seconds)
        measure = partial(_solve_strata, run, count)
        facts = {"task": REACHABLE, "title": title(name)}
        yield Block(SUITE, f"robots/{name}", solver, measure, settings, count * len(STRATA), facts)
        run = run._replace(budget=_BUDGET_BEYOND * seconds)
        measure = partial(_solve_unreachable, run, beyond)
        facts = {"task": UNREACHABLE, "title": title(name)}
        yield Block(SUITE, f"unreachable/{name}", solver, measure, settings, beyond, facts)


def settings_of(peer: Peer, entry: Entry, tolerance: Tolerance) -> dict[str, Any]:
    """Return all that changes the answers of an entry, the version included."""
    return {
        **entry.settings,
        "kind": entry.kind,
        "attempts": entry.restarts + 1,
        "version": peer.version,
        "tolerance": tolerance.position,
        "tolerance_rotation": tolerance.rotation,
    }


def _solve_strata(run: Run, count: int) -> Measured:
    return solve(run, robot_targets(run.robot, count))


def _solve_unreachable(run: Run, count: int) -> Measured:
    """Solve targets out of reach; keep beside them how near any pose may come."""
    targets = unreachable_targets(run.robot, count)
    arrays, notes, facts = solve(run, targets)
    bound = least_distances(run.robot, targets)[: len(arrays.get("solved", ()))]
    return Measured({**arrays, "bound": bound} if len(bound) else arrays, notes, facts)


def solve(run: Run, targets: Targets) -> Measured:
    """Solve the targets, and evaluate what came of it, finished or not.

    Of targets never begun there is nothing, and tables count them as not solved.
    """
    robot = evaluator_of(run.robot).robot
    asked, entry = (run.peer.module, robot, targets, run.tolerance), run.entry
    job = Job(*asked, entry.settings, entry.restarts, run.budget)
    outcome = _performed(job, Budget(run.budget))
    arrays = _evaluated(run, targets, outcome.solved) if outcome.solved else {}
    return Measured(
        {**arrays, "setup": np.array(outcome.setup)},
        {"remark": outcome.note},
        {
            "strata": list(STRATA),
            "tips": list(robot.effectors),  # as the file of records calls them
            "joints": len(robot.joints),
            "freedom": int(evaluator_of(run.robot).model.nv),
            "wanted": "pose" if robot.posed else "position",
            "trouble": raised(outcome.solved),
        },
    )


def _performed(job: Job, budget: Budget) -> Outcome:
    """Return what came of a job; where a target costs the process, a new one goes on behind it."""
    outcome, starts = worker_process().perform(job), job.targets.starts
    if not outcome.lost or len(outcome.solved) == len(starts):
        return outcome
    lost = Solved(np.full_like(starts[0], np.nan), 0, worker_process().patience, outcome.trouble)
    done = [*outcome.solved, lost]
    remaining = Targets(*(values[len(done) :] for values in job.targets))
    if budget.is_spent or not len(remaining.starts):
        return outcome._replace(solved=done)
    following = _performed(job._replace(targets=remaining), budget)
    done += following.solved
    return following._replace(setup=outcome.setup, solved=done, trouble=raised(done))


def _evaluated(run: Run, targets: Targets, done: list[Solved]) -> dict[str, np.ndarray]:
    answers = np.array([one.q for one in done])
    evaluation = evaluator_of(run.robot).evaluate(targets, answers, run.tolerance)
    return {
        "solved": evaluation.solved,
        "claimed": np.array([one.claimed for one in done]),
        "seconds": _short(np.array([one.seconds for one in done])),
        "position": _short(evaluation.position),
        "rotation": _short(evaluation.rotation),
        "beyond": _short(evaluation.beyond),
        "exception": np.array([bool(one.trouble) for one in done]),
        "stratum": targets.strata[: len(done)],
    }


@functools.cache
def worker_process() -> WorkerProcess:
    """Return the one process in which all solvers work, one after the other."""
    return WorkerProcess()


def _short(values: np.ndarray) -> np.ndarray:
    return np.array([float(f"{value:.{_DIGITS - 1}e}") for value in values])
