"""Robots: every installed solver on every arm and on the character, in all strata.

Each solver works in a process of its own and is given a fixed number of targets. Its answers are
evaluated here, by an engine that the solver is not built on. Then the solvers of a robot are timed
in turns.
"""

import dataclasses
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ...harness.block import Block, Group, Measured, Scale
from ...harness.isolation import JobOutcome, Solved, raised
from ...harness.measure import not_asked, not_installed
from ...harness.progress import announce
from ...harness.timing import Job, Times, answers, first_targets, times_in_turns
from ...peers import catalogue
from ...peers.entrant import ROBOT_TASK
from ...peers.peer import Peer, Run
from ...problems.evaluate import AGREEMENT, Targets, Tolerance, arbiter_of, evaluator_of
from ...problems.robot_targets import (
    SEED,
    STRATA,
    least_distances,
    robot_targets,
    unreachable_targets,
)
from ...problems.robots import HELD_OUT, PACKAGE, ROBOTS, enter, group_of, is_installed, title
from . import REACHABLE, REPEATS, UNREACHABLE

SUITE = "ik"
TOLERANCE = Tolerance(1e-3, 1e-3)
# Targets in a stratum, and out of reach of a robot, per target of a scale. Targets out of reach are
# few: solvers try all of their restarts, which takes long.
_TARGETS, _TARGETS_BEYOND = 0.05, 0.03
# Time every tenth target of a stratum, in `ROUNDS`; every third out of reach, in `ROUNDS_BEYOND`.
_PER_TIMED, _PER_TIMED_BEYOND = 10, 3
# Time at least four targets of a stratum: a clear difference is then beyond chance.
_LEAST_TIMED = 4
ROUNDS, ROUNDS_BEYOND = 3, 1
# Digits kept of times and residuals: more would fill the disk with noise.
_DIGITS = 5
_ANY = {"kind": "any"}
NO_ROBOTS = "not asked for robots: it offers no robot_inverse_kinematics"


class RobotJob(NamedTuple):
    """Targets of a robot, and a solver with its settings and tolerance."""

    robot: str
    peer: Peer
    entry: Run
    tolerance: Tolerance
    targets: Callable[[], Targets]
    size: int  # how many targets there are
    timed_count: int  # so many of them, the first, are timed
    seed: int = SEED  # of the targets
    seeds: int = 1  # that they are drawn from
    is_beyond: bool = False  # whether the targets are out of reach

    @property
    def job(self) -> Job:
        """The job of a worker process."""
        settings = {**self.entry.settings, **self.peer.spec}
        model, restarts = evaluator_of(self.robot).robot, self.entry.restarts
        request = (self.peer.module, model, self.targets(), self.tolerance, settings, restarts)
        return Job(*request, self.peer.entrant_name)

    def block(self, problem: str, facts: dict[str, Any]) -> Block:
        """Return the block of a problem; only its settings change an answer.

        Solvers of the same targets are measured together; a solver with a time limit is by itself.
        """
        settings = {
            **self.entry.settings,
            "kind": self.entry.kind,
            "attempts": self.entry.restarts + 1,
            "version": self.peer.version,
            "tolerance": self.tolerance.position,
            "tolerance_rotation": self.tolerance.rotation,
            "seed": self.seed,
            "seeds": self.seeds,
        }
        solver = self.peer.label_of(self.entry)
        group = Group(problem, solve_together, self)
        block = Block(SUITE, problem, solver, group.measure_alone, settings, self.size, facts)
        block = block if self.entry.has_time_limit else dataclasses.replace(block, group=group)
        return block.of(self.peer.entrant)


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield each solver on each robot, and a block for each solver not installed."""
    own = {problem.name: problem for problem in scale.problems if problem.robot is not None}
    for problem in own.values():
        if problem.robot is not None:
            enter(problem.robot)
    installed = [name for name in ROBOTS if is_installed(name)]
    for name in ROBOTS:
        if name not in installed:
            absent, facts = partial(not_installed, PACKAGE), _facts(REACHABLE, title(name))
            yield Block(SUITE, f"robots/{name}", "all solvers", absent, _ANY, 0, facts)
    peers = catalogue.robot_peers(scale.entrants)
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
    for entry in peer.runs:
        if not peer.is_installed:
            no_targets = partial(robot_targets, "", 0)
            job = RobotJob("", peer, entry, TOLERANCE, no_targets, 0, 0, scale.seed)
            block = job.block("robots/all", _facts(REACHABLE, "every robot"))
            absent = partial(not_installed, peer.package)
            yield dataclasses.replace(block, measure=absent, group=None)
            continue
        for name in robots:
            targets = partial(robot_targets, name, count, scale.seed, scale.seeds)
            rounds = scale.seeds * count
            timings = max(min(rounds, _LEAST_TIMED), -(-rounds // _PER_TIMED))
            sizes = (rounds * len(STRATA), len(STRATA) * timings)
            job = RobotJob(name, peer, entry, TOLERANCE, targets, *sizes, scale.seed, scale.seeds)
            yield job.block(f"robots/{name}", _facts(REACHABLE, title(name)))
            if name in HELD_OUT:
                continue
            beyond = max(1, round(_TARGETS_BEYOND * scale.targets))
            targets = partial(unreachable_targets, name, beyond, scale.seed)
            sizes = (beyond, -(-beyond // _PER_TIMED_BEYOND))
            job = RobotJob(
                name, peer, entry, TOLERANCE, targets, *sizes, scale.seed, is_beyond=True
            )
            yield job.block(f"unreachable/{name}", _facts(UNREACHABLE, title(name)))


def _drawn(blocks: Iterable[Block]) -> list[Block]:
    """Return blocks problem by problem, a group's blocks in a row, in an order of its own.

    The order is the same every time, whichever other solvers take part.
    """
    blocks = list(blocks)
    problems = list(dict.fromkeys(block.problem for block in blocks))

    def rank(block: Block) -> tuple[int, bool, int]:
        lot = zlib.crc32(f"{block.problem}, {block.solver}".encode())
        return problems.index(block.problem), block.group is None, lot

    return sorted(blocks, key=rank)


def solve_together(jobs: Sequence[RobotJob]) -> list[Measured]:
    """Solve the targets of every solver; then time the first targets, the solvers in turns."""
    outcomes = []
    for job in jobs:
        announce(f"{job.peer.label_of(job.entry)}: answers")
        outcomes.append(answers(job.job))
    finished = [i for i, outcome in enumerate(outcomes) if len(outcome.solved) == jobs[i].size]
    slow = [i for i, job in enumerate(jobs) if first_targets(job.job, outcomes[i])]
    turns = [i for i in finished if not jobs[i].entry.has_time_limit]
    times: dict[int, Times | None] = {i: _own_times(jobs[i], outcomes[i]) for i in finished + slow}
    if turns:
        announce("times, all solvers in turns")
        requests = [jobs[i].job for i in turns]
        rounds = ROUNDS_BEYOND if jobs[0].is_beyond else ROUNDS
        times |= zip(turns, times_in_turns(requests, jobs[0].timed_count, rounds), strict=True)
    return [
        _measured(job, outcome, times.get(i))
        for i, (job, outcome) in enumerate(zip(jobs, outcomes, strict=True))
    ]


def _repeats(job: RobotJob, outcome: JobOutcome) -> np.ndarray:
    """Return how many targets are solved in each repetition of all targets."""
    announce(f"{job.peer.label_of(job.entry)}: answers again")
    outcomes = [outcome, *(answers(job.job) for _ in range(REPEATS - 1))]
    engine = arbiter_of(job.peer.built_on)
    return np.array([_evaluated(job, o.solved, engine)["solved"].sum() for o in outcomes])


def _own_times(job: RobotJob, outcome: JobOutcome) -> Times:
    """Return the times taken with the answers, of a solver with a time limit."""
    seconds = [answer.seconds for answer in outcome.solved[: job.timed_count]]
    return Times(np.array([seconds]), np.zeros(0))


def _measured(job: RobotJob, outcome: JobOutcome, times: Times | None) -> Measured:
    """Return the numbers of answers and times.

    Of targets never begun there is nothing, and the solver did not finish.
    """
    evaluator, engine = evaluator_of(job.robot), arbiter_of(job.peer.built_on)
    robot = evaluator.robot
    arrays = _evaluated(job, outcome.solved, engine) if outcome.solved else {}
    if times is not None:
        arrays |= {"seconds": _rounded(times.seconds), "control": _rounded(times.control)}
    if job.entry.has_time_limit and not job.is_beyond and outcome.solved:
        arrays["repeats"] = _repeats(job, outcome)
    return {
        **arrays,
        "setup": outcome.setup,
        "overhead": outcome.overhead,
        "remark": outcome.note,
        "strata": list(STRATA),
        "effectors": list(robot.effectors),
        "joints": len(robot.joints),
        "freedom": int(evaluator.model.nv),
        "target": "pose" if robot.oriented else "position",
        "trouble": raised(outcome.solved),
        "arbiter": engine,
        "group": group_of(job.robot),
        "time_limited": job.entry.has_time_limit,
        **first_targets(job.job, outcome),
    }


def _evaluated(job: RobotJob, solved: list[Solved], engine: str) -> dict[str, np.ndarray]:
    q, targets = np.array([answer.q for answer in solved]), job.targets()
    evaluation = evaluator_of(job.robot).evaluate(targets, q, job.tolerance, engine)
    arrays = {
        "solved": evaluation.solved,
        "claims": np.array([answer.claim for answer in solved]),
        "position": _rounded(evaluation.position),
        "rotation": _rounded(evaluation.rotation),
        "beyond": _rounded(evaluation.beyond),
        "exception": np.array([bool(answer.trouble) for answer in solved]),
        "stratum": targets.strata[: len(solved)],
        "disputed": np.flatnonzero(evaluation.difference > AGREEMENT),
    }
    if job.is_beyond:  # how near any pose may come
        arrays["bound"] = least_distances(job.robot, targets)[: len(solved)]
    return arrays


def _rounded(numbers: np.ndarray) -> np.ndarray:
    return np.vectorize(lambda number: float(f"{number:.{_DIGITS - 1}e}"), otypes=[float])(numbers)
