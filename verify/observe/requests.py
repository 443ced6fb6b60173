"""Requests that tell more than the cases: asked after a wrong verdict alone, and never counted."""

from collections.abc import Sequence

from ..case import Case
from ..contestant import Answer, Contestant
from ..greeting import Greeting
from ..judgement import CaseJudgement
from ..kinematics import forward_kinematics, problems
from ..mass_spring.cases import telling_cases as spring_cases
from .inputs import right_answer


def telling_cases(task: str, greeting: Greeting, method: str, seed: int) -> list[Case]:
    """Return the requests of a task that suit the solver, () if it has none."""
    if task == forward_kinematics.TASK:
        return forward_kinematics.telling_cases(greeting, method, seed)
    if task == problems.TASK:
        return problems.telling_cases(greeting, method, seed)
    return spring_cases(task, greeting, seed)


def ask(contestant: Contestant, cases: Sequence[Case], method: str) -> list[CaseJudgement]:
    """Return the answers to requests, with the right ones of kinematics, and without findings.

    After a request without an answer no more are sent: the solver may crash or hang.
    """
    judgements = []
    for case in cases:
        answer = contestant.answer(case)
        if not isinstance(answer, Answer):
            break
        expected = right_answer(case, method) if case.task == forward_kinematics.TASK else {}
        judgements.append(CaseJudgement(case, answer, (), expected))
    return judgements
