"""An entrant on targets of a skeleton of balls: residuals are recomputed from its answers."""

import functools
from typing import NamedTuple

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics
from plumbob.reference.arguments import FloatArray

from ..experiments.chain.measurement import Limits
from ..harness import metrics
from ..harness.block import Measured
from ..harness.isolation import Outcome, WorkerProcess, raised
from ..harness.worker import NoAnswerError
from .chain_job import ChainJob
from .entrant import Spec

# Residuals after each iteration are kept for so many targets and iterations: each is a solve from
# the start with that many at most.
FOLLOWED_TARGETS, FOLLOWED_ITERATIONS = 20, 30


class ChainProblem(NamedTuple):
    """Targets of a skeleton of balls.

    Attributes:
        skeleton: the balls.
        starts: local rotations, (target, joint, 4) or (joint, 4) for all.
        targets: global positions [m], (target, 3).
        effector: the joint that is to reach them; the last one if -1.
    """

    skeleton: Skeleton
    starts: FloatArray
    targets: FloatArray
    effector: int = -1


def solve_chain(
    spec: Spec,
    method: str,
    problem: ChainProblem,
    limits: Limits,
    budget: float,
    *,
    followed: bool = False,
) -> Measured:
    """Put all targets to an entrant, for as long as its budget lasts.

    A target without an answer, or never begun, counts as infinitely far from being reached.
    """
    count = len(problem.targets)
    most = np.full(count, limits.max_iterations)
    outcome = _asked(spec, method, problem, limits.tolerance, most, budget)
    if not outcome.solved:
        raise NoAnswerError(outcome.trouble or "It answered nothing.")
    positions, made = _understood(outcome, problem)
    arrays = _arrays(problem, positions, made)
    arrays["claimed"] = np.array([one.claimed for one in outcome.solved])
    arrays["seconds"] = np.array([one.seconds for one in outcome.solved])
    arrays["solved"] = arrays["residual"][: len(outcome.solved)] <= limits.tolerance
    remarks = [outcome.note, _cut(outcome, count, budget)]
    if followed and not outcome.lost:
        history = _followed(spec, method, problem, limits, budget)
        arrays |= history
        remarks += (
            [] if history else ["not followed, for its answers do not depend on max_iterations"]
        )
    facts = {"trouble": raised(outcome.solved)}
    return Measured(arrays, {"remark": "; ".join(filter(None, remarks))}, facts)


def _cut(outcome: Outcome, count: int, budget: float) -> str:
    done = len(outcome.solved)
    if done == count:
        return ""
    why = "" if outcome.lost else f" by its time budget of {budget:g} s"
    return f"cut{why} at {done} of {count} targets, the others count as not reached"


def _asked(
    spec: Spec, method: str, problem: ChainProblem, tolerance: float, most: np.ndarray,
    budget: float,
) -> Outcome:  # fmt: skip
    skeleton, count = problem.skeleton, len(problem.targets)
    starts = np.broadcast_to(problem.starts, (count, skeleton.joint_count, 4))
    effector = problem.effector % skeleton.joint_count
    known = (spec, method, skeleton.parents, skeleton.offsets, starts, problem.targets, effector)
    return worker_process().perform(ChainJob(*known, tolerance, most, budget))


def _understood(outcome: Outcome, problem: ChainProblem) -> tuple[FloatArray, FloatArray]:
    """Return the joints' positions and the iterations of every target; NaN where there are none."""
    count, joints = len(problem.targets), problem.skeleton.joint_count
    answers = np.full((count, 1 + 3 * joints), np.nan)
    answers[: len(outcome.solved)] = [one.q for one in outcome.solved]
    return answers[:, 1:].reshape(count, joints, 3), answers[:, 0]


def _residuals(problem: ChainProblem, positions: FloatArray) -> FloatArray:
    return np.linalg.norm(positions[:, problem.effector] - problem.targets, axis=-1)


def _arrays(
    problem: ChainProblem, positions: FloatArray, iterations: FloatArray
) -> dict[str, np.ndarray]:
    distance = np.linalg.norm(problem.targets - problem.skeleton.offsets[0], axis=-1)
    residual, reach = _residuals(problem, positions), problem.skeleton.reach()
    bend = metrics.bend(positions, problem.targets)
    excess = metrics.excess(residual, distance, reach)
    answered = np.isfinite(residual)
    return {
        "residual": np.where(answered, residual, np.inf),
        "iterations": iterations,
        "distance": distance,
        "bend": np.where(answered, bend, np.inf),
        "excess": np.where(answered, excess, np.inf),
        "reach": np.array(reach),
    }


def _followed(
    spec: Spec, method: str, problem: ChainProblem, limits: Limits, budget: float
) -> dict[str, FloatArray]:
    """Return how residuals fall with the iterations allowed; nothing if they do not depend on them.

    A solver that makes as many as it likes answers the same whatever it is allowed.
    """
    few = min(FOLLOWED_TARGETS, len(problem.targets))
    skeleton, allowed = problem.skeleton, np.arange(1, FOLLOWED_ITERATIONS + 1)
    starts = np.broadcast_to(problem.starts, (len(problem.targets), skeleton.joint_count, 4))[:few]
    before = forward_kinematics(skeleton, starts).positions
    some = problem._replace(targets=problem.targets[:few])
    first = _residuals(some, before)
    every = problem._replace(
        starts=np.repeat(starts, len(allowed), axis=0),
        targets=np.repeat(some.targets, len(allowed), axis=0),
    )
    outcome = _asked(spec, method, every, limits.tolerance, np.tile(allowed, few), budget)
    if len(outcome.solved) < len(every.targets):
        return {}
    positions, _ = _understood(outcome, every)
    after = _residuals(every, positions).reshape(few, len(allowed))
    if not np.isfinite(after).all() or (after == after[:, :1]).all():
        return {}
    history = np.concatenate([first[:, None], after], axis=1)
    kept = metrics.convergence(history)
    return {f"history_{name}": values for name, values in kept._asdict().items()}


@functools.cache
def worker_process() -> WorkerProcess:
    """Return the one process in which entrants work on chains, one after the other."""
    return WorkerProcess()
