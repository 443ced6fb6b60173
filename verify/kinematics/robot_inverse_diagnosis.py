"""Name the faults of wrong coordinates of robots."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..cause_search import JudgedAnswers
from ..judgement import CaseJudgement, Diagnosis, Explanation, Verdict
from . import motion_faults
from .report import with_hints
from .robot_inverse_kinematics import SAME, trajectory_of
from .robot_targets import FEW, MOST
from .trajectories import Trajectory, trajectories


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the faults that explain the coordinates, likely those of the Jacobian."""
    judgements = judged_answers.report.judgements
    motions = trajectories(judged_answers.exchanges, trajectory_of)
    diagnosis = _diagnosis(judgements, motions, judged_answers.base)
    if not diagnosis.explained:
        diagnosis = replace(diagnosis, behaviour=judged_answers.report.diagnosis.behaviour)
    return with_hints(judgements, diagnosis)


def _diagnosis(
    judgements: Sequence[CaseJudgement],
    motions: Mapping[str, Trajectory],
    base: Sequence[str] | None,
) -> Diagnosis:
    """Return the faults of motions and of solves of few iterations."""
    diagnosis = motion_faults.diagnosis_of(judgements, motions, base)
    if [explanation.faults for explanation in diagnosis.explanations] in ([], [("stopped early",)]):
        return _with_iterations(diagnosis, motions.values(), judgements)
    return diagnosis


def _with_iterations(
    diagnosis: Diagnosis, motions: Iterable[Trajectory], judgements: Sequence[CaseJudgement]
) -> Diagnosis:
    """Return a diagnosis with what solves of one iteration, of two and so on show."""
    solves = [motion for motion in motions if motion.case.family == FEW]
    verdict = max(judgement.verdict for judgement in judgements)
    if len(solves) < MOST or verdict == Verdict.RIGHT:
        return diagnosis
    motion = replace(solves[0], q=np.concatenate([solve.q for solve in solves]))  # by iteration
    gaps, dampings = _fitted(motion, motion.jacobians)
    frozen, _ = _fitted(motion, np.repeat(motion.jacobians[:1], MOST, axis=0))
    is_falling = (np.diff(np.linalg.norm(motion.twists(motion.q), axis=-1)) < 0.0).all()
    is_growing = (np.diff(dampings) >= 0.0).all() and dampings[-1] > GROWTH * dampings[0]
    if frozen.max() < SAME_ITERATION < gaps[1:].max():
        key = "Jacobian kept"
    elif verdict >= Verdict.WRONG and gaps.max() <= SAME_ITERATION and is_falling and is_growing:
        key = "damping grows"
    else:
        return diagnosis
    return Diagnosis((Explanation((key,), motion_faults.SENTENCES[key], 1.0, 0.0),))


def _fitted(motion: Trajectory, J: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how far iterations are from damped steps, relative to them, and their dampings."""
    e, lengths = motion.twists(motion.previous), np.linalg.norm(motion.changes, axis=-1)
    fits = []
    for weight in WEIGHTS:
        rows = np.repeat([1.0, weight], 3)
        steps = motion_faults.damped_steps(J * rows[:, None], e * rows, DAMPINGS)
        gaps = np.linalg.norm(motion.changes[:, None] - steps, axis=-1) * (lengths > SAME)[:, None]
        gaps /= np.maximum(lengths, SAME)[:, None]
        fits.append((gaps.min(axis=-1), DAMPINGS[gaps.argmin(axis=-1), 0]))
    return min(fits, key=lambda fit: float(fit[0].max()))


# Iterations agree with damped steps to this share, with one of these weights of the rotation and
# squared dampings; a damping grows if it is so many times as large in the end.
SAME_ITERATION, GROWTH = 0.1, 50.0


WEIGHTS, DAMPINGS = np.geomspace(0.05, 10.0, 101), np.geomspace(1e-9, 1e4, 401)[:, None]
