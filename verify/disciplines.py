"""The tasks, each with its cases, its laws, and the search for the cause of wrong answers."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from .case import Case
from .cause_search import JudgedAnswers
from .contestant import Exchange
from .greeting import Greeting
from .judgement import Diagnosis, TaskReport
from .kinematics import (
    forward_kinematics,
    inverse_kinematics,
    resample,
    robot_inverse_kinematics,
    robot_jacobian,
    robot_track,
    robot_velocity,
    track,
)
from .mass_spring import energy, energy_diagnosis, force_diagnosis, forces, stepping
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


STEPS, MOTIONS = Stepping("mass_spring_step"), Stepping("mass_spring_motion")
DISCIPLINES: Mapping[str, Discipline] = (
    {
        task.TASK: Discipline(task.cases, task.judge, task.diagnose)
        for task in (forward_kinematics, inverse_kinematics, track, resample)
    }
    | {
        forces.TASK: Discipline(forces.cases, forces.judge, force_diagnosis.diagnose),
        energy.TASK: Discipline(energy.cases, energy.judge, energy_diagnosis.diagnose),
        STEPS.task: Discipline(STEPS.cases, STEPS.judge, stepping.diagnose),
        MOTIONS.task: Discipline(MOTIONS.cases, MOTIONS.judge, stepping.diagnose),
    }
    | {
        task.TASK: Discipline(task.cases, task.judge, task.diagnose)
        for task in (robot_jacobian, robot_velocity, robot_inverse_kinematics, robot_track)
    }
)
