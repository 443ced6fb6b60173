"""How good is anyone's answer: distances first, residuals last."""

from .pose import PoseJudgement, judge_pose

__all__ = ["PoseJudgement", "judge_pose"]
