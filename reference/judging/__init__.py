"""How good is anyone's answer: distances first, residuals last."""

from .pose import PoseJudgement, judge_pose
from .step import StepJudgement, judge_step

__all__ = ["PoseJudgement", "StepJudgement", "judge_pose", "judge_step"]
