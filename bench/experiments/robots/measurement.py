"""Robots: every solver that is installed on every arm and on the character, in all strata.

Each solver works in a process of its own. Its answers are evaluated here, by MuJoCo's kinematics.
"""

import zlib
from collections.abc import Iterable, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from msgspec.structs import replace

from ...harness.block import Block, Measured, Scale
from ...harness.isolation import JobOutcome, raised
from ...harness.job import Job, worker_process
from ...harness.measure import not_asked, not_installed
from ...harness.stopwatch import Budget
from ...harness.worker import Solved
from ...peers import registry
from ...peers.entrant import ROBOT_TASK
from ...peers.registry import Peer, PeerEntry
from ...problems.evaluate import Targets, Tolerance, evaluator_of
from ...problems.robot_targets import STRATA, least_distances, robot_targets, unreachable_targets
from ...problems.robots import PACKAGE, ROBOTS, enter, is_installed, title
from . import REACHABLE, UNREACHABLE
from .values import RobotSolves

SUITE = "ik"
TOLERANCE = Tolerance(1e-3, 1e-3)
# Targets in a stratum, and a solver's seconds for a robot within reach and beyond, for those of a
# scale.
_TARGETS = 0.1
_BUDGET, _BUDGET_BEYOND = 5.0, 3.0
# Targets out of reach are no fewer than these, however few are asked for in a stratum.
OUT_OF_REACH = 100
# Digits kept of times and residuals: more would fill the disk with noise.
_DIGITS = 5
_ANY = {"kind": "any"}
NO_ROBOTS = "not asked for robots: it offers no robot_inverse_kinematics"


class RobotJob(NamedTuple):
    """A robot, and a solver with its settings, tolerance and budget [s]."""

    robot: str
    peer: Peer
    entry: PeerEntry
    tolerance: Tolerance
    budget: float

    def block(self, problem: str, measure: Any, size: float, facts: dict[str, Any]) -> Block:
        """Return the block of a problem; its settings are all that changes an answer."""
        settings = {
            **self.entry.settings,
            "kind": self.entry.kind,
            "attempts": self.entry.restarts + 1,
            "version": self.peer.version,
            "tolerance": self.tolerance.position,
            "tolerance_rotation": self.tolerance.rotation,
        }
        solver = self.peer.label_of(self.entry)
        block = Block(SUITE, problem, solver, measure, settings, size, facts, budget=self.budget)
        return block.of(self.peer.entrant)


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield each solver on each robot, and a block for each that is not installed.

    The solvers of a robot follow each other in a drawn order, so that a machine that gets slower or
    faster does so to all of them.
    """
    own = {problem.name: problem for problem in scale.problems if problem.robot is not None}
    for problem in own.values():
        if problem.robot is not None:
            enter(problem.robot)
    installed = [name for name in ROBOTS if is_installed(name)]
    for name in ROBOTS:
        if name not in installed:
            absent, facts = partial(not_installed, PACKAGE), _facts(REACHABLE, title(name))
            yield Block(SUITE, f"robots/{name}", "all solvers", absent, _ANY, 0, facts)
    peers = registry.robot_peers(scale.entrants)
    robots = [*installed, *own]
    groups = ("robots", "unreachable")
    owners = {f"{group}/{name}": problem for name, problem in own.items() for group in groups}
    for block in _drawn(block for peer in peers for block in _blocks_of(peer, robots, scale)):
        yield block.on(owners[block.problem]) if block.problem in owners else block
    for entrant in scale.entrants:
        if entrant.offers(SUITE) and ROBOT_TASK not in entrant.tasks:
            measure, facts = partial(not_asked, NO_ROBOTS), _facts(REACHABLE, "every robot")
            yield Block(SUITE, "robots/all", entrant.name, measure, _ANY, 0, facts).of(entrant)


def _facts(task: str, title: str) -> dict[str, Any]:
    return {"task": task, "title": title}


def _blocks_of(peer: Peer, robots: list[str], scale: Scale) -> Iterator[Block]:
    """Yield a solver on installed robots, with each of its settings."""
    count = max(1, round(_TARGETS * scale.targets))
    beyond = max(OUT_OF_REACH, count)
    for entry in peer.entries:
        if not peer.is_installed:
            absent = partial(not_installed, peer.package)
            job = RobotJob("", peer, entry, TOLERANCE, 0.0)
            yield job.block("robots/all", absent, 0, _facts(REACHABLE, "every robot"))
            continue
        for name in robots:
            job = RobotJob(name, peer, entry, TOLERANCE, _BUDGET * scale.seconds)
            measure, size = partial(_solve_strata, job, count), count * len(STRATA)
            yield job.block(f"robots/{name}", measure, size, _facts(REACHABLE, title(name)))
            job = job._replace(budget=_BUDGET_BEYOND * scale.seconds)
            measure, facts = partial(_solve_beyond, job, beyond), _facts(UNREACHABLE, title(name))
            yield job.block(f"unreachable/{name}", measure, beyond, facts)


def _drawn(blocks: Iterable[Block]) -> list[Block]:
    """Return blocks problem by problem, the solvers of each in an order of its own.

    It is the same every time, whichever other solvers take part.
    """
    blocks = list(blocks)
    problems = list(dict.fromkeys(block.problem for block in blocks))

    def rank(block: Block) -> tuple[int, int]:
        lot = zlib.crc32(f"{block.problem}, {block.solver}".encode())
        return problems.index(block.problem), lot

    return sorted(blocks, key=rank)


def _solve_strata(job: RobotJob, count: int) -> Measured:
    return solve(job, robot_targets(job.robot, count))


def _solve_beyond(job: RobotJob, count: int) -> Measured:
    """Solve targets out of reach; keep beside them how near any pose may come."""
    targets = unreachable_targets(job.robot, count)
    solves, notes, facts = solve(job, targets)
    if solves.solved is not None:
        bound = least_distances(job.robot, targets)[: np.size(solves.solved)]
        solves = replace(solves, bound=bound)
    return Measured(solves, notes, facts)


def solve(job: RobotJob, targets: Targets) -> Measured:
    """Solve the targets, and evaluate the answers, finished or not.

    Of targets never begun there is nothing, and tables count them as not solved.
    """
    evaluator = evaluator_of(job.robot)
    robot, outcome = evaluator.robot, _performed(job, targets, Budget(job.budget))
    arrays = _evaluated(job, targets, outcome.solved) if outcome.solved else {}
    return Measured(
        RobotSolves(**arrays, setup=outcome.setup, overhead=outcome.overhead),
        {"remark": outcome.note},
        {
            "strata": list(STRATA),
            "tips": list(robot.effectors),
            "joints": len(robot.joints),
            "freedom": int(evaluator.model.nv),
            "wanted": "pose" if robot.oriented else "position",
            "trouble": raised(outcome.solved),
        },
    )


def _performed(job: RobotJob, targets: Targets, budget: Budget) -> JobOutcome:
    """Return the solves of targets; continue in a new process behind a target that crashes it."""
    peer, entry, robot = job.peer, job.entry, evaluator_of(job.robot).robot
    request = (peer.module, robot, targets, job.tolerance, {**entry.settings, **peer.spec})
    outcome = worker_process().perform(Job(*request, entry.restarts, job.budget, peer.entrant_name))
    count, size = targets.shape
    if not outcome.is_lost or len(outcome.solved) == count:
        return outcome
    crash = Solved(np.full(size, np.nan), 0, worker_process().patience, outcome.trouble)
    solves = [*outcome.solved, crash]
    if budget.is_spent or len(solves) == count:
        return outcome._replace(solved=solves)
    following = _performed(job, targets.after(len(solves)), budget)
    solves += following.solved
    return following._replace(
        setup=outcome.setup, overhead=outcome.overhead, solved=solves, trouble=raised(solves)
    )


def _evaluated(job: RobotJob, targets: Targets, solves: list[Solved]) -> dict[str, np.ndarray]:
    answers = np.array([solve.q for solve in solves])
    evaluation = evaluator_of(job.robot).evaluate(targets, answers, job.tolerance)
    return {
        "solved": evaluation.solved,
        "claims": np.array([solve.claim for solve in solves]),
        "seconds": _rounded([solve.seconds for solve in solves]),
        "position": _rounded(evaluation.position),
        "rotation": _rounded(evaluation.rotation),
        "beyond": _rounded(evaluation.beyond),
        "exception": np.array([bool(solve.trouble) for solve in solves]),
        "stratum": targets.strata[: len(solves)],
    }


def _rounded(numbers: Iterable[float]) -> np.ndarray:
    return np.array([float(f"{number:.{_DIGITS - 1}e}") for number in numbers])
