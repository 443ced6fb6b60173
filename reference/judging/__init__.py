"""Errors of a pose or a step from any solver."""

from .pose import PoseJudgement, judge_pose
from .step import StepJudgement, judge_step

__all__ = ["PoseJudgement", "StepJudgement", "judge_pose", "judge_step"]
