"""How good is anyone's answer: distances first, residuals last."""

from .step import StepJudgement, judge_step

__all__ = ["StepJudgement", "judge_step"]
