"""The tasks, each with its cases, its laws, and the search for the cause of wrong answers."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from .case import Case
from .cause_search import JudgedAnswers
from .contestant import Exchange
from .greeting import Greeting
from .judgement import Diagnosis, TaskReport
from .kinematics import (
    forward_kinematics,
    inverse_diagnosis,
    inverse_kinematics,
    resample,
    resample_diagnosis,
    robot_diagnosis,
    robot_inverse_kinematics,
    robot_jacobian,
    robot_track,
    robot_velocity,
    track,
    track_diagnosis,
)
from .kinematics.report import with_hints
from .mass_spring import energy, energy_diagnosis, force_diagnosis, forces, step_diagnosis
from .mass_spring.stepping import Stepping


class Discipline(NamedTuple):
    """How one task is tried."""

    # returns cases that suit a solver by greeting, method and seed, more if thorough; from trivial
    # to hostile, the smallest first
    cases: Callable[[Greeting, str, int, bool], list[Case]]
    # judges answers by laws, the reference, the declaration and honest programs
    judge: Callable[[Sequence[Exchange], Greeting, str], TaskReport]
    # explains a verdict, which stands
    diagnose: Callable[[JudgedAnswers], Diagnosis]


def _of_laws(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the diagnosis of answers of which nothing is known but broken laws."""
    report = judged_answers.report
    return with_hints(report.judgements, Diagnosis(behaviour=report.diagnosis.behaviour))


# The laws of each task, and what explains wrong answers before changed lines do, if anything.
_PAIRS: Sequence[tuple[Any, Any]] = (
    (forward_kinematics, None),
    (inverse_kinematics, inverse_diagnosis),
    (track, track_diagnosis),
    (resample, resample_diagnosis),
    (forces, force_diagnosis),
    (energy, energy_diagnosis),
    (Stepping("mass_spring_step"), step_diagnosis),
    (Stepping("mass_spring_motion"), step_diagnosis),
    (robot_jacobian, robot_diagnosis),
    (robot_velocity, robot_diagnosis),
    (robot_inverse_kinematics, robot_diagnosis),
    (robot_track, robot_diagnosis),
)
DISCIPLINES: dict[str, Discipline] = {
    laws.TASK: Discipline(laws.cases, laws.judge, causes.diagnose if causes else _of_laws)
    for laws, causes in _PAIRS
}
