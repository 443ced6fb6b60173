"""The task mass_spring_motion: its cases and its judgement."""

from collections.abc import Sequence

from ..case import Case
from ..contestant import Asked
from ..greeting import Greeting
from ..judgement import TaskReport
from . import stepping
from .cases import task_cases

TASK = "mass_spring_motion"


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return cases that suit the solver, the smallest first."""
    return task_cases(TASK, greeting, seed, thorough)


def judge(asked: Sequence[Asked], greeting: Greeting, method: str) -> TaskReport:
    """Hold the answers against laws and the declared step, and name the faults."""
    return stepping.judge(TASK, asked, greeting)
