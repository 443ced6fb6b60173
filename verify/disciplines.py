"""The tasks, each with its cases, its laws, and the search for the cause of wrong answers."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from .case import Case
from .cause_search import JudgedAnswers
from .exchange import Exchange
from .greeting import Greeting
from .judgement import Diagnosis, TaskReport
from .kinematics import (
    forward_kinematics,
    inverse_diagnosis,
    inverse_kinematics,
    resample,
    robot_inverse_kinematics,
    robot_jacobian,
    robot_track,
    robot_velocity,
    track,
    track_diagnosis,
)
from .mass_spring import energy, forces, step_diagnosis
from .mass_spring.stepping import Stepping


class Discipline(NamedTuple):
    """Cases, laws and diagnosis of a task."""

    # returns suitable cases by greeting, method and seed, more if thorough; from trivial
    # to hostile, the smallest first
    cases: Callable[[Greeting, str, int, bool], list[Case]]
    # judges answers by laws, the reference, the declaration and honest programs
    judge: Callable[[Sequence[Exchange], Greeting, str], TaskReport]
    # explains a verdict, which stands
    diagnose: Callable[[JudgedAnswers], Diagnosis]


def _by_laws(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the diagnosis by laws alone; changed lines of right programs may explain answers."""
    return replace(judged_answers.report.diagnosis, explanations=())


# The laws of each task, and what explains wrong answers besides changed lines.
_PAIRS: Sequence[tuple[Any, Any]] = (
    (forward_kinematics, None),
    (inverse_kinematics, inverse_diagnosis),
    (track, track_diagnosis),
    (resample, None),
    (forces, None),
    (energy, None),
    (Stepping("mass_spring_step"), step_diagnosis),
    (Stepping("mass_spring_motion"), step_diagnosis),
    (robot_jacobian, None),
    (robot_velocity, None),
    (robot_inverse_kinematics, None),
    (robot_track, None),
)
DISCIPLINES: dict[str, Discipline] = {
    laws.TASK: Discipline(laws.cases, laws.judge, causes.diagnose if causes else _by_laws)
    for laws, causes in _PAIRS
}
