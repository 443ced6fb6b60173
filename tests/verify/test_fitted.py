"""Jacobian methods: the step and the damping are a solver's own; mistakes are found beside them."""

from functools import cache

import pytest

from plumbob.text.sentence import sentence
from plumbob.verify.fault_programs import connection_to, source_of
from plumbob.verify.greeting import Greeting, Step
from plumbob.verify.judgement import CaseJudgement, Diagnosis, Finding, TaskReport, Verdict
from plumbob.verify.kinematics import problems
from plumbob.verify.one_line import answers, search
from plumbob.verify.one_line.candidates import Evidence
from plumbob.verify.one_line.right_programs import programs_of

TASK, METHOD = "inverse_kinematics", "jacobian"
SOLVE = "J.T @ np.linalg.solve(A, short / distance * error)"
UPDATE = "multiply(q[j], exponential(w))"
COLUMN, ARM = "np.cross(rotate(R[j], axis), arm)", "arm = x[effector] - x[j]"
TRANSPOSE = (SOLVE, "J.T @ error / (J * J).sum()")
CONSTANT = ("DAMPING * reach * short", "0.04")
BOUNDED = ("zip(joints, step", "zip(joints, (step * min(1.0, 0.3 / abs(step).max()))")
FIRST_ORDER = (UPDATE, "multiply(q[j], np.array([1.0, *(0.5 * w)]))")
HONEST = {
    "pseudo-inverse": [(SOLVE, "np.linalg.pinv(J) @ error")],
    "transpose": [TRANSPOSE],
    "constant damping": [CONSTANT],
    "bounded rotations": [BOUNDED],
    "first order": [FIRST_ORDER, CONSTANT],
    "axes of the world": [
        (COLUMN, "np.cross(axis, arm)"),
        (UPDATE, "turned(parents, R, j, exponential(w), q[j])"),
        TRANSPOSE,
    ],
}
LEFT = (UPDATE, "multiply(exponential(w), q[j])")
WRONG = {
    "left, transpose": ([LEFT, TRANSPOSE], "PB-JACOBIAN-001"),
    "left, bounded": ([LEFT, CONSTANT, BOUNDED], "PB-JACOBIAN-001"),
    "arms from the root, first order": (
        [(ARM, "arm = x[effector] - x[0]"), FIRST_ORDER], "PB-JACOBIAN-008",
    ),
    "away": ([("STEP * J.T", "-0.1 * J.T"), CONSTANT], "PB-JACOBIAN-028"),
}  # fmt: skip
LINES = {
    "arms of the parent": ([(ARM, "arm = x[effector] - x[max(parents[j], 0)]"), CONSTANT], "x[j]"),
    "conjugates": ([(COLUMN, COLUMN.replace("R[j]", "conjugate(R[j])")), TRANSPOSE], "rotate(R[j]"),
}


@cache
def sweeps():
    greeting = Greeting(1, (TASK,), methods=(METHOD,))
    cases = problems.cases(greeting, METHOD, 0, False)
    return [case for case in cases if case.facts.get("sweeps") == 1]


def planted(changes):
    """Return the source of the right program with other texts."""
    source = source_of(METHOD)
    for right, wrong in changes:
        assert source.count(right) == 1
        source = source.replace(right, wrong)
    return source


def report_of(changes, count=None):
    """Return a report that calls all single sweeps of a changed program wrong."""
    connection = connection_to(planted(changes))
    found = (Finding("one sweep", Verdict.WRONG, 1.0, 0.0, "", sentence("")),)
    answers = [(case, connection.answer(case)) for case in sweeps()[:count]]
    judgements = [CaseJudgement(case, answer, found, {}) for case, answer in answers]
    return TaskReport(TASK, METHOD, judgements, Diagnosis())


def explained(report):
    return search.changed_lines(report, Greeting(1, (TASK,), methods=(METHOD,)))


@pytest.mark.sample("transpose")
@pytest.mark.parametrize("name", HONEST)
def test_a_right_program_gives_honest_steps_of_other_constants(name):
    report = report_of(HONEST[name], 6)
    evidence = Evidence(report, answers.compared_answers(report, []), 1e-7)
    programs = [p for p in programs_of(TASK, METHOD, Step()) if "within" not in p.names]
    assert any(search._gives(program, evidence) for program in programs)


@pytest.mark.sample("bounded")
@pytest.mark.parametrize("name", WRONG)
def test_a_known_mistake_is_named_beside_other_constants(name):
    changes, code = WRONG[name]
    assert [one.codes for one in explained(report_of(changes))[:1]] == [(code,)]


@pytest.mark.slow
@pytest.mark.parametrize("name", LINES)
def test_a_changed_line_is_found_beside_other_constants(name):
    changes, text = LINES[name]
    (first, *_) = explained(report_of(changes))
    assert first.codes[0].startswith("PB-LINE")
    assert text in str(first.sentence)
