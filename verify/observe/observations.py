"""What the answers of a wrong solver show, in a few sentences.

Observations come before the mistakes of a catalogue, are true of all counted answers, and need no
knowledge of mistakes. The verdict never depends on observations.
"""

from collections.abc import Sequence

import numpy as np

from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..exchange import Answer, Connection, Failure, FailureKind, is_hung
from ..greeting import Greeting
from ..judgement import CaseJudgement, TaskReport, Verdict
from ..kinematics import forward_kinematics, problems
from ..mass_spring import energy, forces
from ..mass_spring.cases import UNDAMPED
from ..mass_spring.cases import telling_cases as spring_cases
from . import inputs, robots
from .joints import forward_evidence, inverse_evidence, sound_cases
from .separation import ElementTable, Findings, Statement, joined, separation
from .spring_law import energy_law
from .springs import spring_evidence

STEP = "mass_spring_step"
OF_SPRINGS = (forces.TASK, energy.TASK, STEP)
TASKS = (forward_kinematics.TASK, problems.TASK, *OF_SPRINGS, *robots.TASKS)
# Fewer cases let chance speak: of 5 random cases 27 % of the statements were false on all cases.
# Uncounted requests about springs, 20 or more, may make up for cases without an answer.
MIN_ANSWERS = 14
# Failures after which no more is asked.
ENDS = (FailureKind.CRASHED, FailureKind.HUNG, FailureKind.MEMORY)
# A smaller part of wrong elements may be of honest choices: some right solves end early.
MIN_PART = 0.25
# The largest numbers of sentences before the sentence on right quantities, and of quantities there.
SENTENCES, RIGHT = 3, 4


def observe(connection: Connection, report: TaskReport, seed: int) -> tuple[Sentence, ...]:
    """Return what the answers to a task show, () for right or too few answers.

    The solver is asked about 20 requests more, and some again with a changed input.
    """
    answered = [j for j in report.judgements if _is_usable(j)]
    is_stuck = any(is_hung(judgement.answer) for judgement in report.judgements)
    if (
        report.task not in TASKS
        or report.verdict < Verdict.WRONG
        or len(answered) < (1 if report.task in OF_SPRINGS else MIN_ANSWERS)
        or is_stuck
        or connection.greeting.system.continues
    ):
        return ()
    method, greeting = report.method.lower(), report.greeting or connection.greeting
    cases = _telling_cases(report, greeting, seed)
    answered += _ask(connection, cases, method)
    if len(answered) < MIN_ANSWERS:
        return ()
    counted = [judgement.case for judgement in report.judgements]
    unread = inputs.unread_inputs(connection, counted, greeting, method)
    with np.errstate(all="ignore"):
        return sentences(report, answered, greeting, unread)


def _is_usable(judgement: CaseJudgement) -> bool:
    """Return whether a case has an answer, and a unique right answer."""
    is_must = judgement.case.requirement == "must" and "cones" not in judgement.case.inputs
    return is_must and isinstance(judgement.answer, Answer)


def _telling_cases(report: TaskReport, greeting: Greeting, seed: int) -> list[Case]:
    """Return suitable requests beyond the cases, never counted."""
    if report.task in (forward_kinematics.TASK, problems.TASK):
        module = forward_kinematics if report.task == forward_kinematics.TASK else problems
        return module.telling_cases(greeting, report.method, seed)
    return [] if report.task in robots.TASKS else spring_cases(report.task, greeting, seed)


def _ask(connection: Connection, cases: Sequence[Case], method: str) -> list[CaseJudgement]:
    """Return the answers to requests, with right answers of kinematics, and without findings.

    Requests without an answer are left out; after a crash or a hang no more are sent.
    """
    judgements = []
    for case in cases:
        answer = connection.answer(case)
        if isinstance(answer, Failure):
            if answer.kind in ENDS:
                break
            continue
        expected = inputs.right_answer(case, method) if case.task == forward_kinematics.TASK else {}
        judgements.append(CaseJudgement(case, answer, (), expected))
    return judgements


def sentences(
    report: TaskReport,
    judgements: Sequence[CaseJudgement],
    greeting: Greeting,
    unread: Sequence[str] = (),
) -> tuple[Sentence, ...]:
    """Return the observations on answers, given the unread inputs."""
    evidence = _evidence(report, judgements, greeting, unread)
    tables, equations = list(evidence.tables.values()), sorted(evidence.statements, key=_score)
    # the places say more than the statements before if they are exact
    is_vague_told = evidence.is_more_wrong or not equations
    places = [place for place in of_tables(tables) if place.is_exact or is_vague_told]
    first = [inputs.statement_of(unread)] if unread else []
    words = [statement.sentence for statement in (*first, *equations, *places)][:SENTENCES]
    right = [*evidence.right, *(table.right_words() for table in tables if table.is_right)][:RIGHT]
    if words and right:
        words.append(sentence("Right everywhere: {quantities}.", quantities=joined(right)))
    return tuple(words)


def of_tables(tables: Sequence[ElementTable]) -> list[Statement]:
    """Return exact separations, else one-sided separations, else quantities wrong everywhere.

    Without a separation come quantities with some wrong elements as well, wherever found.
    """
    exact, vague, everywhere = list[Statement](), list[Statement](), list[Statement]()
    for table in tables:
        statement = separation(table)
        if statement is not None:
            (exact if statement.is_exact else vague).append(statement)
        elif table.is_wrong_everywhere:
            words = sentence(
                "Wrong everywhere: {quantity} ({count}).",
                quantity=table.quantity,
                count=len(table.elements),
            )
            (exact if table.is_law else everywhere).append(Statement(0.0, words, table.is_law))
    partly = [
        _wrong_in_part(table)
        for table in tables
        if table.wrong_count >= MIN_PART * len(table.elements)
        and table.wrong_count
        and not table.is_wrong_everywhere
    ]
    return sorted(exact, key=_score) or sorted(vague, key=_score) or [*everywhere, *partly]


def _wrong_in_part(table: ElementTable) -> Statement:
    """Return how many elements of a quantity are wrong."""
    words = sentence(
        "Wrong in part: {quantity} ({wrong} wrong, {right} right).",
        quantity=table.quantity,
        wrong=table.wrong_count,
        right=len(table.elements) - table.wrong_count,
    )
    return Statement(0.0, words, is_exact=False)


def _score(statement: Statement) -> float:
    return statement.score


def _evidence(
    report: TaskReport,
    judgements: Sequence[CaseJudgement],
    greeting: Greeting,
    unread: Sequence[str],
) -> Findings:
    """Return what the answers to a task show."""
    if report.task == forward_kinematics.TASK:
        return forward_evidence(judgements)
    if report.task in robots.TASKS:
        return robots.robot_evidence(report.task, judgements)
    if report.task == problems.TASK:
        return inverse_evidence(report, judgements, {*unread})
    if report.task == energy.TASK:
        law = energy_law(judgements)
        return Findings({}, [] if law is None else [Statement(0.0, law, True)], [])
    is_damped = greeting.step.damper not in UNDAMPED
    substeps, sound = greeting.step.substeps or 1, sound_cases(judgements)
    return spring_evidence(judgements, greeting.epsilon, sound, is_damped, substeps)
