"""Inverse kinematics of a ten-ball chain, by us, on the kinematics of engines, and by users."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.crosscheck.engines import SKELETON_ENGINES
from plumbob.crosscheck.engines.skeleton_engine import coordinates
from plumbob.reference import IK_SOLVERS, forward_kinematics, solve_ik
from plumbob.reference.arguments import FloatArray

from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ...harness.isolation import Outcome, raised
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
from .values import Reached

SUITE = "ik"
TOLERANCE = 1e-4
# Beyond reach it is the distance from the best answer there is; small, to see how straight it is.
BEYOND_TOLERANCE = 1e-6
MAX_ITERATIONS = 1000
# The residuals of so many iterations are kept for the figure; of a user's solver those of so many
# targets and iterations, each a solve from the start with that many at most.
HISTORY = 200
FOLLOWED_TARGETS, FOLLOWED_ITERATIONS = 20, 30
# Seconds that a user's solver has for a stratum, for those of a scale: enough for as many
# iterations as ours may make, in the interpreter.
BUDGET = 250.0
NO_BALLS = "not asked for chains: it offers no inverse_kinematics"


NOT_FOLLOWED = "not followed, for its answers do not depend on max_iterations"


class Limits(NamedTuple):
    """When a solver stops: the distance that counts as reached [m], and the most iterations."""

    tolerance: float
    max_iterations: int


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every stratum, and a user's targets, for every solver."""
    for stratum in STRATA:
        problem = chain_targets(stratum, scale.targets)
        tolerance = BEYOND_TOLERANCE if stratum == BEYOND else TOLERANCE
        yield from _blocks_on(problem, stratum, Limits(tolerance, MAX_ITERATIONS), scale)
    for own in scale.problems:
        if own.targets is not None:
            limits = Limits(TOLERANCE, MAX_ITERATIONS)
            yield from (b.on(own) for b in _blocks_on(own.targets, "yours", limits, scale))
    facts = {"task": CHAIN, "stratum": BEYOND, "title": "every chain"}
    for entrant in scale.entrants:
        if entrant.offers(SUITE) and CHAIN_TASK not in entrant.tasks:
            measure = partial(not_asked, NO_BALLS)
            yield Block(SUITE, "chain/all", entrant.name, measure, facts=facts).of(entrant)


def _blocks_on(
    problem: TargetsForSkeleton, stratum: str, limits: Limits, scale: Scale
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
    problem: TargetsForSkeleton, limits: Limits, scale: Scale, followed: bool = False
) -> Iterator[Block]:
    """Yield targets for each method of users' solvers."""
    budget, settings = BUDGET * scale.seconds, limits._asdict()
    for peer in registry.chain_peers(scale.entrants):
        measure = partial(solve_one_by_one, problem, peer, limits, budget, followed=followed)
        block = Block(SUITE, problem.name, peer.title, measure, settings, budget=budget)
        yield block.of(peer.entrant)


def solve_targets(
    problem: TargetsForSkeleton, solver: str, limits: Limits, record: bool = False
) -> Measured:
    """Solve all targets with a solver of ours; residuals are recomputed from the answers.

    `record` keeps residuals by iteration, and times.
    """
    asked = (problem.skeleton, problem.starts, problem.targets, solver)
    solution = solve_ik(*asked, **limits._asdict(), record=record)
    positions = forward_kinematics(problem.skeleton, solution.local_rotations).positions
    arrays = _evaluated(problem, limits, positions, solution.iterations)
    arrays["outcome"] = np.asarray(solution.outcome)
    if record:
        arrays |= _convergence(solution.history[:, : HISTORY + 1])
        arrays["seconds"] = _seconds(problem, solver, limits)
    return Measured(Reached(**arrays))


def _seconds(problem: TargetsForSkeleton, solver: str, limits: Limits) -> FloatArray:
    """Return how long each target takes by a call of its own [s], (target,)."""
    solves = [
        partial(solve_ik, problem.skeleton, start, target, solver, **limits._asdict())
        for start, target in zip(problem.every_start, problem.targets, strict=True)
    ]
    solves[0]()  # may compile
    return np.array([time_call(solve)[1] for solve in solves])


def solve_with_engine(problem: TargetsForSkeleton, name: str, limits: Limits) -> Measured:
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
    return Measured(Reached(**arrays, seconds=np.array([seconds for _, seconds in results])))


def solve_one_by_one(
    problem: TargetsForSkeleton,
    peer: ChainPeer,
    limits: Limits,
    budget: float,
    followed: bool = False,
) -> Measured:
    """Put all targets to a user's solver, for as long as its budget lasts.

    A target without an answer, or never begun, counts as infinitely far from being reached.
    """
    count = len(problem.targets)
    requests = ChainRequests(problem, np.full(count, limits.max_iterations))
    outcome = _performed(requests, peer, limits.tolerance, budget)
    if not outcome.solved:
        raise NoAnswerError(outcome.trouble or "It answered nothing.")
    arrays = _evaluated(problem, limits, *_answers(requests, outcome))
    done = len(outcome.solved)
    answered = np.isfinite(arrays["residual"][:done])
    arrays["solved"] = arrays["solved"][:done]
    arrays["claimed"] = np.where(answered, [one.claim for one in outcome.solved], -1)
    arrays["seconds"] = np.where(answered, [one.seconds for one in outcome.solved], 0.0)
    remarks = [outcome.note]
    if done < count:
        why = "" if outcome.is_lost else f" by its time budget of {budget:g} s"
        remarks += [f"cut{why} at {done} of {count} targets, the others count as not reached"]
    if followed and not outcome.is_lost:
        history = _followed(problem, peer, limits, budget)
        arrays |= history
        remarks += [] if history else [NOT_FOLLOWED]
    facts = {"trouble": raised(outcome.solved)}
    return Measured(Reached(**arrays), {"remark": "; ".join(filter(None, remarks))}, facts)


def _performed(
    requests: ChainRequests, peer: ChainPeer, tolerance: float, budget: float
) -> Outcome:
    settings, skeleton = {"method": peer.method, **peer.spec}, requests.problem.skeleton
    limits = (tolerance, settings, 0, budget)
    return worker_process().perform(
        Job(peer.module, skeleton, requests, *limits, peer.entrant_name, warms_up=False)
    )


def _answers(requests: ChainRequests, outcome: Outcome) -> tuple[FloatArray, FloatArray]:
    """Return the joints' positions and the iterations of every target; NaN where there are none."""
    answers = np.full(requests.shape, np.nan)
    answers[: len(outcome.solved)] = [one.q for one in outcome.solved]
    return answers[:, 1:].reshape(len(answers), -1, 3), answers[:, 0]


def _evaluated(
    problem: TargetsForSkeleton, limits: Limits, positions: FloatArray, iterations: Any
) -> dict[str, Any]:
    """Return what the joints' positions, (target, joint, 3), come to; no answer is NaN."""
    reach = problem.skeleton.reach()
    distance = np.linalg.norm(problem.targets - problem.skeleton.offsets[0], axis=-1)
    residual = np.linalg.norm(positions[:, -1] - problem.targets, axis=-1)
    errors = {
        "residual": residual,
        "bend": metrics.bend(positions, problem.targets),
        "excess": metrics.excess(residual, distance, reach),
    }
    answered = np.isfinite(residual)
    return {
        **{name: np.where(answered, values, np.inf) for name, values in errors.items()},
        "solved": residual <= limits.tolerance,
        "iterations": np.asarray(iterations),
        "distance": distance,
        "reach": np.array(reach),
    }


def _followed(
    problem: TargetsForSkeleton, peer: ChainPeer, limits: Limits, budget: float
) -> dict[str, FloatArray]:
    """Return how residuals fall with the iterations allowed; nothing if they do not depend on them.

    A solver that makes as many as it likes answers the same whatever it is allowed.
    """
    allowed = np.arange(1, FOLLOWED_ITERATIONS + 1)
    starts, targets = problem.every_start[:FOLLOWED_TARGETS], problem.targets[:FOLLOWED_TARGETS]
    first = forward_kinematics(problem.skeleton, starts).positions[:, -1]
    starts, repeated = (np.repeat(part, len(allowed), axis=0) for part in (starts, targets))
    every = replace(problem, starts=starts, targets=repeated)
    requests = ChainRequests(every, np.tile(allowed, len(targets)))
    outcome = _performed(requests, peer, limits.tolerance, budget)
    if len(outcome.solved) < len(repeated):
        return {}
    after = _answers(requests, outcome)[0][:, -1].reshape(len(targets), len(allowed), 3)
    history = np.linalg.norm(
        np.concatenate([first[:, None], after], axis=1) - targets[:, None], axis=-1
    )
    if not np.isfinite(history).all() or (history[:, 1:] == history[:, 1:2]).all():
        return {}
    return _convergence(history)


def _convergence(history: FloatArray) -> dict[str, FloatArray]:
    """Return the quantiles of residuals, (target, iteration), by names in records."""
    convergence = metrics.convergence(history)
    return {f"history_{name}": values for name, values in convergence._asdict().items()}
