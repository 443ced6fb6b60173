"""Name the faults of wrong motions of robots."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..cause_search import JudgedAnswers
from ..judgement import Diagnosis, Explanation
from . import motion_faults, robot_motions
from .report import with_hints
from .robot_track import NO_DRIFT, motion_of, speed_ratios
from .trajectories import Trajectory, trajectories


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the faults that explain the motions, likely those of the Jacobian."""
    judgements = judged_answers.report.judgements
    motions = trajectories(judged_answers.exchanges, motion_of)
    diagnosis = motion_faults.diagnosis_of(judgements, motions, judged_answers.base)
    if not diagnosis.explanations and (keys := _too_fast(motions)):
        explanation = Explanation(keys, motion_faults.SENTENCES[keys[0]], 1.0, 0.0)
        diagnosis = replace(diagnosis, explanations=(explanation,))
    return with_hints(judgements, diagnosis)


def _too_fast(motions: Mapping[str, Trajectory]) -> tuple[str, ...]:
    """Return the fault by which joints exceed their greatest speeds, () if none is known.

    Of limits with another factor the largest speeds of several frames are alike.
    """
    for name, motion in motions.items():
        twin = motions.get(name.replace(robot_motions.LIMITED_JUMP, robot_motions.JUMP))
        if twin is None or twin is motion:
            continue
        fastest = speed_ratios(motion).max(axis=1)
        is_capped = (fastest >= ALIKE * fastest.max()).sum() > 1
        if fastest.max() <= SPEEDING or is_capped:
            continue
        count = min(len(motion.q), len(twin.q))
        is_same = np.abs(motion.q[:count] - twin.q[:count]).max() <= NO_DRIFT
        return ("speed limits ignored" if is_same else "speed limits of iterations",)
    return ()


# A limit of speeds that is kept in some way is exceeded by more than this.
SPEEDING = 1.1


# The share of the largest speed from which on speeds are alike.
ALIKE = 1.0 - 1e-6
