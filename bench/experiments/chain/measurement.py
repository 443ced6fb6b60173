"""Inverse kinematics of a ten-ball chain, by us, on the kinematics of engines, and by users."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.crosscheck.engines import SKELETON_ENGINES
from plumbob.crosscheck.engines.skeleton_engine import coordinates
from plumbob.reference import IK_SOLVERS, IKSolution, forward_kinematics, solve_ik
from plumbob.reference.arguments import FloatArray

from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ...harness.isolation import JobOutcome, raised
from ...harness.job import Job, worker_process
from ...harness.measure import not_asked
from ...harness.stopwatch import time_call
from ...peers import registry
from ...peers.entrant import CHAIN_TASK
from ...peers.ik.levenberg_marquardt import levenberg_marquardt, within_reach
from ...peers.protocol import NoAnswerError
from ...peers.registry import ChainPeer
from ...problems.chains import BEYOND, STRATA, ChainRequests, TargetsForSkeleton, chain_targets
from . import CHAIN
from .values import ChainSolves

SUITE = "ik"
TOLERANCE = 1e-4
# Beyond reach: of the distance from the closest pose; small, so that the chain must be straight.
BEYOND_TOLERANCE = 1e-6
MAX_ITERATIONS = 1000
# The residuals of so many iterations are kept for the figure. A user's solver is followed over so
# many targets and iterations, each by a solve from the start with that many at most.
HISTORY = 200
FOLLOWED_TARGETS, FOLLOWED_ITERATIONS = 20, 30
# Seconds that a user's solver has for a stratum, for those of a scale: enough for as many
# iterations as ours may make, in the interpreter.
BUDGET = 250.0
NO_BALLS = "not asked for chains: it offers no inverse_kinematics"
NOT_FOLLOWED = "not followed, for its answers do not depend on max_iterations"


class SolverLimits(NamedTuple):
    """The residual at which a target is reached [m], and the most iterations."""

    tolerance: float
    max_iterations: int


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every stratum, and a user's targets, for every solver."""
    for stratum in STRATA:
        problem = chain_targets(stratum, scale.targets)
        tolerance = BEYOND_TOLERANCE if stratum == BEYOND else TOLERANCE
        yield from _blocks_on(problem, stratum, SolverLimits(tolerance, MAX_ITERATIONS), scale)
    limits = SolverLimits(TOLERANCE, MAX_ITERATIONS)
    for own in scale.problems:
        if own.targets is not None:
            yield from (b.on(own) for b in _blocks_on(own.targets, "yours", limits, scale))
    facts = {"task": CHAIN, "stratum": BEYOND, "title": "every chain"}
    for entrant in scale.entrants:
        if entrant.offers(SUITE) and CHAIN_TASK not in entrant.tasks:
            measure = partial(not_asked, NO_BALLS)
            yield Block(SUITE, "chain/all", entrant.name, measure, facts=facts).of(entrant)


def _blocks_on(
    problem: TargetsForSkeleton, stratum: str, limits: SolverLimits, scale: Scale
) -> Iterator[Block]:
    """Yield targets for every solver of ours, for one loop on each engine, and for users'."""
    facts = {"task": CHAIN, "stratum": stratum, "title": problem.title}
    common = (limits._asdict(), len(problem.targets), facts)
    for solver in IK_SOLVERS:
        measure = partial(solve_targets, problem, solver, limits, record=True)
        yield Block(SUITE, problem.name, solver, measure, *common)
    for loop in registry.LOOPS:
        measure = partial(solve_with_engine, problem, loop.engine, limits)
        yield Block(SUITE, problem.name, loop.name, measure, *common)
    for block in blocks_of_users(problem, limits, scale, followed=stratum != BEYOND):
        yield replace(block, size=len(problem.targets), facts={**facts, **block.facts})


def blocks_of_users(
    problem: TargetsForSkeleton, limits: SolverLimits, scale: Scale, followed: bool = False
) -> Iterator[Block]:
    """Yield targets for each method of users' solvers."""
    budget, settings = BUDGET * scale.seconds, limits._asdict()
    for peer in registry.chain_peers(scale.entrants):
        measure = partial(solve_one_by_one, problem, peer, limits, budget, followed=followed)
        block = Block(SUITE, problem.name, peer.title, measure, settings, budget=budget)
        yield block.of(peer.entrant)


def solve_targets(
    problem: TargetsForSkeleton, solver: str, limits: SolverLimits, record: bool = False
) -> Measured:
    """Solve all targets with a solver of ours; recompute residuals from the solutions.

    `record` keeps residuals by iteration, and the seconds of each target by a call of its own.
    """

    def solve(starts: FloatArray, targets: FloatArray, record: bool = False) -> IKSolution:
        options = {**limits._asdict(), "record": record}
        return solve_ik(problem.skeleton, starts, targets, solver, **options)

    solution = solve(problem.starts, problem.targets, record)
    positions = forward_kinematics(problem.skeleton, solution.local_rotations).positions
    arrays = _evaluated(problem, limits, positions, solution.iterations)
    arrays["outcome"] = np.asarray(solution.outcome)
    if record:
        arrays |= _quantiles(solution.history[:, : HISTORY + 1])
        pairs = zip(problem.every_start, problem.targets, strict=True)
        calls = [partial(solve, start, target) for start, target in pairs]
        calls[0]()  # may compile
        arrays["seconds"] = np.array([time_call(call)[1] for call in calls])
    return Measured(ChainSolves(**arrays))


def solve_with_engine(problem: TargetsForSkeleton, name: str, limits: SolverLimits) -> Measured:
    """Solve all targets by Levenberg-Marquardt on an engine's kinematics."""
    engine = SKELETON_ENGINES[name](problem.skeleton)
    effector, root = problem.skeleton.joint_count - 1, problem.skeleton.offsets[0]
    targets = within_reach(problem.targets, root, problem.skeleton.reach())
    results = [
        time_call(partial(levenberg_marquardt, engine, q, target, effector, **limits._asdict()))
        for q, target in zip(coordinates(engine, problem.starts), targets, strict=True)
    ]
    rotations = np.array([answer.q[engine.columns] for answer, _ in results])
    positions = forward_kinematics(problem.skeleton, rotations).positions
    arrays = _evaluated(problem, limits, positions, [answer.iterations for answer, _ in results])
    return Measured(ChainSolves(**arrays, seconds=np.array([seconds for _, seconds in results])))


def solve_one_by_one(
    problem: TargetsForSkeleton,
    peer: ChainPeer,
    limits: SolverLimits,
    budget: float,
    followed: bool = False,
) -> Measured:
    """Have a user's solver solve all targets, for as long as its budget lasts.

    A target without an answer, or not attempted, counts as infinitely far from being reached.
    """
    total = len(problem.targets)
    requests = ChainRequests(problem, np.full(total, limits.max_iterations))
    outcome = _performed(requests, peer, limits.tolerance, budget)
    solves, count = outcome.solved, len(outcome.solved)
    if not solves:
        raise NoAnswerError(outcome.trouble or "It answered nothing.")
    arrays = _evaluated(problem, limits, *_answers(requests, outcome))
    has_answer = np.isfinite(arrays["residual"][:count])
    arrays["solved"] = arrays["solved"][:count]
    arrays["claims"] = np.where(has_answer, [solve.claim for solve in solves], -1)
    arrays["seconds"] = np.where(has_answer, [solve.seconds for solve in solves], 0.0)
    remarks = [outcome.note]
    if count < total:
        reason = "" if outcome.is_lost else f" by its time budget of {budget:g} s"
        remarks += [f"cut{reason} at {count} of {total} targets, the others count as not reached"]
    if followed and not outcome.is_lost:
        history = _history(problem, peer, limits, budget)
        arrays |= history
        remarks += [] if history else [NOT_FOLLOWED]
    facts = {"trouble": raised(solves)}
    return Measured(ChainSolves(**arrays), {"remark": "; ".join(filter(None, remarks))}, facts)


def _performed(
    requests: ChainRequests, peer: ChainPeer, tolerance: float, budget: float
) -> JobOutcome:
    settings, skeleton = {"method": peer.method, **peer.spec}, requests.problem.skeleton
    limits = (tolerance, settings, 0, budget)
    return worker_process().perform(
        Job(peer.module, skeleton, requests, *limits, peer.entrant_name, warms_up=False)
    )


def _answers(requests: ChainRequests, outcome: JobOutcome) -> tuple[FloatArray, FloatArray]:
    """Return the joints' positions and the iterations of every target; NaN where there are none."""
    answers = np.full(requests.shape, np.nan)
    answers[: len(outcome.solved)] = [solve.q for solve in outcome.solved]
    return answers[:, 1:].reshape(len(answers), -1, 3), answers[:, 0]


def _evaluated(
    problem: TargetsForSkeleton, limits: SolverLimits, positions: FloatArray, iterations: Any
) -> dict[str, Any]:
    """Return the errors of the joints' positions, (target, joint, 3); NaN without an answer."""
    reach = problem.skeleton.reach()
    distance = np.linalg.norm(problem.targets - problem.skeleton.offsets[0], axis=-1)
    residual = np.linalg.norm(positions[:, -1] - problem.targets, axis=-1)
    errors = {
        "residual": residual,
        "bend": metrics.bend(positions, problem.targets),
        "excess": metrics.excess(residual, distance, reach),
    }
    has_answer = np.isfinite(residual)
    return {
        **{name: np.where(has_answer, error, np.inf) for name, error in errors.items()},
        "solved": residual <= limits.tolerance,
        "iterations": np.asarray(iterations),
        "distance": distance,
        "reach": np.array(reach),
    }


def _history(
    problem: TargetsForSkeleton, peer: ChainPeer, limits: SolverLimits, budget: float
) -> dict[str, FloatArray]:
    """Return the residuals by the iterations allowed; nothing if they do not depend on them."""
    allowed = np.arange(1, FOLLOWED_ITERATIONS + 1)
    starts, targets = problem.every_start[:FOLLOWED_TARGETS], problem.targets[:FOLLOWED_TARGETS]
    first = forward_kinematics(problem.skeleton, starts).positions[:, -1]
    starts, repeated = (np.repeat(part, len(allowed), axis=0) for part in (starts, targets))
    every = replace(problem, starts=starts, targets=repeated)
    requests = ChainRequests(every, np.tile(allowed, len(targets)))
    outcome = _performed(requests, peer, limits.tolerance, budget)
    if len(outcome.solved) < len(repeated):
        return {}
    positions = _answers(requests, outcome)[0][:, -1].reshape(len(targets), len(allowed), 3)
    effectors = np.concatenate([first[:, None], positions], axis=1)
    history = np.linalg.norm(effectors - targets[:, None], axis=-1)
    if not np.isfinite(history).all() or (history[:, 1:] == history[:, 1:2]).all():
        return {}
    return _quantiles(history)


def _quantiles(history: FloatArray) -> dict[str, FloatArray]:
    """Return the quantiles of residuals, (target, iteration), by names in records."""
    quantiles = metrics.convergence(history)._asdict()
    return {f"history_{name}": residuals for name, residuals in quantiles.items()}
