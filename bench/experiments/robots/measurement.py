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
from ...harness.isolation import Outcome, raised
from ...harness.job import Job, worker_process
from ...harness.measure import not_asked, not_installed
from ...harness.stopwatch import Budget
from ...harness.worker import Solved
from ...peers import registry
from ...peers.entrant import ROBOT_TASK
from ...peers.registry import Peer, PeerEntry
from ...problems.evaluate import Targets, Tolerance, evaluator_of
from ...problems.own import OwnProblem
from ...problems.robot_targets import STRATA, least_distances, robot_targets, unreachable_targets
from ...problems.robots import PACKAGE, ROBOTS, enter, is_installed, title
from . import REACHABLE, UNREACHABLE
from .values import RobotSolves

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
ANY = {"kind": "any"}
NO_ROBOTS = "not asked for robots: it offers no robot_inverse_kinematics"


class Run(NamedTuple):
    """One solver with its settings, on one robot."""

    robot: str
    peer: Peer
    entry: PeerEntry
    tolerance: Tolerance
    budget: float

    def block(self, problem: str, measure: Any, size: float, facts: dict[str, Any]) -> Block:
        """Return the block of a problem for this solver."""
        solver = self.peer.label_of(self.entry)
        settings = settings_of(self.peer, self.entry, self.tolerance)
        block = Block(SUITE, problem, solver, measure, settings, size, facts, budget=self.budget)
        return block.of(self.peer.entrant)


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield each solver on each robot; one block for a solver or a robot that is not installed.

    The solvers of a robot follow each other in an order drawn by lot, so that a machine that gets
    slower or faster does so to all of them.
    """
    own: dict[str, OwnProblem] = {}
    for problem in scale.problems:
        if problem.robot is not None:
            enter(problem.robot)
            own[problem.name] = problem
    here = [name for name in ROBOTS if is_installed(name)]
    for name in ROBOTS:
        if name not in here:
            absent, facts = partial(not_installed, PACKAGE), _facts(REACHABLE, title(name))
            yield Block(SUITE, f"robots/{name}", EVERY_SOLVER, absent, ANY, 0, facts)
    peers = registry.robot_peers(scale.entrants)
    made = by_lot(block for peer in peers for block in blocks_of(peer, [*here, *own], scale))
    entered = {f"{kind}/{name}": own[name] for kind in ("robots", "unreachable") for name in own}
    for block in made:
        yield block.on(entered[block.problem]) if block.problem in entered else block
    for entrant in scale.entrants:
        if entrant.offers(SUITE) and ROBOT_TASK not in entrant.tasks:
            measure, facts = partial(not_asked, NO_ROBOTS), _facts(REACHABLE, "every robot")
            yield Block(SUITE, "robots/all", entrant.name, measure, ANY, 0, facts).of(entrant)


def _facts(task: str, title: str) -> dict[str, Any]:
    return {"task": task, "title": title}


def blocks_of(peer: Peer, robots: list[str], scale: Scale) -> Iterator[Block]:
    """Yield a solver on robots that are installed, by each of its entries."""
    count = max(1, round(_TARGETS * scale.targets))
    beyond = max(OUT_OF_REACH, count)
    for entry in peer.entries:
        if not peer.is_installed:
            run = Run("", peer, entry, TOLERANCE, 0.0)
            absent = partial(not_installed, peer.package)
            yield run.block("robots/all", absent, 0, _facts(REACHABLE, "every robot"))
            continue
        for name in robots:
            run = Run(name, peer, entry, TOLERANCE, _BUDGET * scale.seconds)
            measure, size = partial(_solve_strata, run, count), count * len(STRATA)
            yield run.block(f"robots/{name}", measure, size, _facts(REACHABLE, title(name)))
            run = run._replace(budget=_BUDGET_BEYOND * scale.seconds)
            measure = partial(_solve_unreachable, run, beyond)
            facts = _facts(UNREACHABLE, title(name))
            yield run.block(f"unreachable/{name}", measure, beyond, facts)


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


def settings_of(peer: Peer, entry: PeerEntry, tolerance: Tolerance) -> dict[str, Any]:
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
    solves, notes, facts = solve(run, targets)
    bound = least_distances(run.robot, targets)[: np.size(solves.solved)]
    is_begun = solves.solved is not None
    return Measured(replace(solves, bound=bound) if is_begun else solves, notes, facts)


def solve(run: Run, targets: Targets) -> Measured:
    """Solve the targets, and evaluate what came of it, finished or not.

    Of targets never begun there is nothing, and tables count them as not solved.
    """
    evaluator = evaluator_of(run.robot)
    robot, outcome = evaluator.robot, _performed(run, targets, Budget(run.budget))
    arrays = _evaluated(run, targets, outcome.solved) if outcome.solved else {}
    return Measured(
        RobotSolves(**arrays, setup=outcome.setup),
        {"remark": outcome.note},
        {
            "strata": list(STRATA),
            "tips": list(robot.effectors),  # as the file of records calls them
            "joints": len(robot.joints),
            "freedom": int(evaluator.model.nv),
            "wanted": "pose" if robot.oriented else "position",
            "trouble": raised(outcome.solved),
        },
    )


def _performed(run: Run, targets: Targets, budget: Budget) -> Outcome:
    """Return what came of targets; where one costs the process, a new one goes on behind it."""
    peer, entry, robot = run.peer, run.entry, evaluator_of(run.robot).robot
    asked = (peer.module, robot, targets, run.tolerance, {**entry.settings, **peer.spec})
    outcome = worker_process().perform(Job(*asked, entry.restarts, run.budget, peer.entrant_name))
    count, size = targets.shape
    if not outcome.is_lost or len(outcome.solved) == count:
        return outcome
    lost = Solved(np.full(size, np.nan), 0, worker_process().patience, outcome.trouble)
    done = [*outcome.solved, lost]
    if budget.is_spent or len(done) == count:
        return outcome._replace(solved=done)
    following = _performed(run, targets.after(len(done)), budget)
    done += following.solved
    return following._replace(setup=outcome.setup, solved=done, trouble=raised(done))


def _evaluated(run: Run, targets: Targets, done: list[Solved]) -> dict[str, np.ndarray]:
    answers = np.array([one.q for one in done])
    evaluation = evaluator_of(run.robot).evaluate(targets, answers, run.tolerance)
    return {
        "solved": evaluation.solved,
        "claimed": np.array([one.claim for one in done]),
        "seconds": _short(np.array([one.seconds for one in done])),
        "position": _short(evaluation.position),
        "rotation": _short(evaluation.rotation),
        "beyond": _short(evaluation.beyond),
        "exception": np.array([bool(one.trouble) for one in done]),
        "stratum": targets.strata[: len(done)],
    }


def _short(values: np.ndarray) -> np.ndarray:
    return np.array([float(f"{value:.{_DIGITS - 1}e}") for value in values])
