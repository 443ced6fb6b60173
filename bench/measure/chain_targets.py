"""Targets of chains of balls, solved by us, on the kinematics of engines, and by users."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import forward_kinematics, solve_ik
from plumbob.reference.arguments import FloatArray

from ..peers import catalogue
from ..peers.protocol import NoAnswerError, describe
from ..problems import chains
from . import metrics
from .block import Block, Group, Measured, Scale
from .isolation import JobOutcome, raised
from .measure import failure
from .record import FIRST_TARGETS
from .timing import Job, answers, first_targets, times_in_turns

SUITE = "ik"
# The figure shows the residuals of the first HISTORY iterations.
HISTORY = 200
# A user's solver is followed over fewer targets and iterations: each iteration count takes a solve
# from the start.
FOLLOWED_TARGETS, FOLLOWED_ITERATIONS = 10, 20
# Time every fourth target, at most 20, three times each.
PER_TIMED, ROUNDS, MAX_TIMED = 4, 3, 20
NOT_FOLLOWED = "not followed, for its answers do not depend on max_iterations"


class SolverLimits(NamedTuple):
    """The residual at which a target is reached [m], and the most iterations."""

    tolerance: float
    max_iterations: int


class ChainJob(NamedTuple):
    """The work of a solver: to answer all targets, and to be timed on the first."""

    answers: Callable[[], Measured]
    job: Job

    def block(self, problem: chains.TargetsForSkeleton, solver: str, limits: SolverLimits) -> Block:
        """Return the block of the targets; solvers of the same targets are measured together."""
        group, settings = Group(problem.name, solve_together, self), limits._asdict()
        return Block(SUITE, problem.name, solver, group.measure_alone, settings, group=group)


def solve_together(jobs: Sequence[ChainJob]) -> list[Measured]:
    """Solve the targets of every solver; then time the first targets, the solvers in turns."""
    results = [_answer_of(job) for job in jobs]
    places = [i for i, r in enumerate(results) if np.isfinite(r.get("residual", np.nan)).any()]
    places = [i for i in places if FIRST_TARGETS not in results[i]]
    turns = times_in_turns([jobs[i].job for i in places], _timed_count(jobs[0].job), ROUNDS)
    for i, times in zip(places, turns, strict=True):
        if times is not None:
            results[i] = {**results[i], **times._asdict()}
    return results


def _timed_count(job: Job) -> int:
    return min(MAX_TIMED, -(-job.targets.shape[0] // PER_TIMED))


def _answer_of(job: ChainJob) -> Measured:
    try:
        return job.answers()
    except NoAnswerError as error:
        return failure(describe(error))


def blocks_of_users(
    problem: chains.TargetsForSkeleton, limits: SolverLimits, scale: Scale, followed: bool = False
) -> Iterator[Block]:
    """Yield targets for each method of users' solvers."""
    for peer in catalogue.chain_peers(scale.user_solvers):
        settings = {**peer.run.settings, **peer.spec}
        job = job_of(problem, limits, peer.module, settings, peer.user_solver_name)
        answers = partial(solve_one_by_one, problem, job, limits, followed=followed)
        yield ChainJob(answers, job).block(problem, peer.title, limits).of(peer.user_solver)


def job_of(
    problem: chains.TargetsForSkeleton,
    limits: SolverLimits,
    module: str,
    settings: dict[str, str],
    user_solver: str = "",
) -> Job:
    """Return the job of an adapter with these settings."""
    requests = chains.ChainRequests(problem, np.full(len(problem.targets), limits.max_iterations))
    model = (module, problem.skeleton, requests, limits.tolerance, settings)
    return Job(*model, user_solver=user_solver, warms_up=False)


def solve_targets(
    problem: chains.TargetsForSkeleton, solver: str, limits: SolverLimits, record: bool = False
) -> Measured:
    """Solve all targets with a solver of ours; an engine recomputes residuals from the solutions.

    `record` keeps residuals by iteration.
    """
    from plumbob.crosscheck.engines import SKELETON_ENGINES, forward_kinematics_by

    from ..problems.evaluate import arbiter_of

    options: dict[str, Any] = {**limits._asdict(), "record": record}
    solution = solve_ik(problem.skeleton, problem.starts, problem.targets, solver, **options)
    engine = SKELETON_ENGINES[arbiter_of("")](problem.skeleton)
    positions = forward_kinematics_by(engine, solution.local_rotations).positions
    arrays = _evaluated(problem, limits, positions, solution.iterations)
    arrays["outcome"] = np.asarray(solution.outcome)
    if record:
        arrays |= _quantiles(solution.history[:, : HISTORY + 1])
    return arrays


def solve_one_by_one(
    problem: chains.TargetsForSkeleton, job: Job, limits: SolverLimits, followed: bool = False
) -> Measured:
    """Have a solver solve all targets in a process of its own.

    A target without an answer has an infinite residual. A slow solver gets the first targets only,
    and is timed meanwhile.
    """
    total, outcome = len(problem.targets), answers(job)
    solves, count = outcome.solved, len(outcome.solved)
    if not solves:
        raise NoAnswerError(outcome.trouble or "It answered nothing.")
    arrays = _evaluated(problem, limits, *_answers(job.targets, outcome))
    if facts := first_targets(job, outcome):
        arrays |= {name: arrays[name][:count] for name in arrays if np.ndim(arrays[name])}
        arrays["seconds"] = np.array([[solve.seconds for solve in solves[: _timed_count(job)]]])
    has_answer = np.isfinite(arrays["residual"][:count])
    arrays["solved"] = arrays["solved"][:count]
    arrays["claims"] = np.where(has_answer, [solve.claim for solve in solves], -1)
    remarks = [outcome.note]
    if facts:
        remarks += [f"slow: its first {count:,} of {total:,} targets"]
    elif count < total:
        remarks += [f"not finished: {count:,} of {total:,} targets, others count as not reached"]
    if followed and not outcome.is_lost:
        history = _history(problem, job)
        arrays |= history
        remarks += [] if history or facts else [NOT_FOLLOWED]
    remark = "; ".join(filter(None, remarks))
    return {**arrays, **facts, "trouble": raised(solves), "remark": remark}


def _answers(requests: chains.ChainRequests, outcome: JobOutcome) -> tuple[FloatArray, FloatArray]:
    """Return the joints' positions and the iterations of every target; NaN where there are none."""
    answers = np.full(requests.shape, np.nan)
    answers[: len(outcome.solved)] = [solve.q for solve in outcome.solved]
    return answers[:, 1:].reshape(len(answers), -1, 3), answers[:, 0]


def _evaluated(
    problem: chains.TargetsForSkeleton, limits: SolverLimits, positions: FloatArray, iterations: Any
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


def _history(problem: chains.TargetsForSkeleton, job: Job) -> dict[str, FloatArray]:
    """Return the residuals by the iterations allowed; empty if independent of the iterations."""
    allowed = np.arange(1, FOLLOWED_ITERATIONS + 1)
    starts, targets = problem.every_start[:FOLLOWED_TARGETS], problem.targets[:FOLLOWED_TARGETS]
    first = forward_kinematics(problem.skeleton, starts).positions[:, -1]
    starts, repeated = (np.repeat(part, len(allowed), axis=0) for part in (starts, targets))
    every = replace(problem, starts=starts, targets=repeated)
    requests = chains.ChainRequests(every, np.tile(allowed, len(targets)))
    outcome = answers(job._replace(targets=requests))
    count = len(outcome.solved) // len(allowed)
    if outcome.is_lost or not count:
        return {}
    positions = _answers(requests, outcome)[0][:, -1].reshape(len(targets), len(allowed), 3)
    effectors = np.concatenate([first[:, None], positions], axis=1)
    history = np.linalg.norm(effectors - targets[:, None], axis=-1)[:count]
    if not np.isfinite(history).all() or (history[:, 1:] == history[:, 1:2]).all():
        return {}
    return _quantiles(history)


def _quantiles(history: FloatArray) -> dict[str, FloatArray]:
    """Return the 10th, 50th and 90th percentile over targets of residuals, (target, iteration).

    A finished target keeps its last residual.
    """
    names = ("history_low", "history_median", "history_high")
    return dict(zip(names, np.quantile(history, [0.1, 0.5, 0.9], axis=0), strict=True))
