"""Speeds for a velocity of the tool: right ways are right, damping is told."""

import numpy as np
import pytest

from plumbob.verify.exchange import Answer, Exchange
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import PROTOCOL, Greeting
from plumbob.verify.judgement import Verdict
from plumbob.verify.kinematics.robot_models import tool_pose, twists_between
from plumbob.verify.kinematics.robot_velocity import (
    SINGULAR,
    TASK,
    cases,
    judge,
    right_equation,
    solving,
)
from plumbob.verify.verify import verify

GREETING = Greeting(PROTOCOL, (TASK,))
CASES = cases(GREETING, "", 0, False)


def shortest(J, twist):
    return np.linalg.pinv(J, 1e-6) @ twist


def damped(J, twist, damping):
    return np.linalg.solve(J.T @ J + damping**2 * np.eye(J.shape[1]), J.T @ twist)


def report_of(solve):
    functions = {TASK: lambda **inputs: {"velocities": solve(*right_equation(inputs))}}
    return verify(FunctionConnection(functions, GREETING)).tasks[0]


def with_null_space(J, twist):
    speeds = shortest(J, twist)
    return speeds + np.ones_like(speeds) - np.linalg.pinv(J, 1e-6) @ J @ np.ones_like(speeds)


@pytest.mark.parametrize(
    ("solve", "words"),
    [(shortest, "least length"), (with_null_space, "does not move the tool")],
)
def test_every_solution_is_right_and_the_report_says_which_it_is(solve, words):
    report = report_of(solve)
    assert report.verdict is Verdict.RIGHT
    assert words in str(report.diagnosis.behaviour)


@pytest.mark.parametrize("damping", [1e-3, 0.02])
@pytest.mark.usefixtures("verdict_alone")
def test_damping_is_told_and_no_fault(damping):
    report = report_of(lambda J, twist: damped(J, twist, damping))
    assert report.verdict is Verdict.RIGHT_EXCEPT
    values = [found.sentence.values["damping"]
              for judged in report.judgements for found in judged.findings
              if found.law == "velocity of the tool" and "damping" in found.sentence.values
              and judged.case.family != SINGULAR and len(judged.case.inputs["q"]) > 1]  # fmt: skip
    np.testing.assert_allclose(values, damping, rtol=1e-3)


@pytest.mark.parametrize(
    ("loss", "verdict"),
    [(0.24, Verdict.RIGHT_EXCEPT), (0.26, Verdict.WRONG), (-0.1, Verdict.WRONG)],
)
def test_damping_may_take_a_quarter_of_the_velocity_away_and_add_nothing(loss, verdict):
    """Of one joint a factor s² / (s² + d²) is a damping d."""
    case = next(case for case in CASES if len(case.inputs["q"]) == 1)
    answer = Answer({"velocities": (1.0 - loss) * shortest(*right_equation(case.inputs))}, 0.0)
    (judgement,) = judge([Exchange(case, answer, answer)], GREETING, "").judgements
    verdicts = {found.law: found.verdict for found in judgement.findings}
    assert verdicts["velocity of the tool"] is verdict


def test_an_inverse_that_fails_in_singular_poses_alone_is_right_except():
    def solve(J, twist):
        if np.linalg.matrix_rank(J, 1e-6) < min(6, np.count_nonzero(J.any(axis=0))):
            raise ValueError("singular matrix")
        return shortest(J, twist)

    report = report_of(solve)
    assert report.verdict is Verdict.RIGHT_EXCEPT
    text = str([str(one) for judged in report.judgements for one in judged.complaints])
    assert "singular matrix" in text


@pytest.mark.parametrize("case", CASES[::4], ids=lambda case: case.name)
def test_the_tool_moves_as_asked_by_the_speeds(case):
    """Forward differences of 1e-6 are wrong by 1e-6 times the speeds' square."""
    J, twist = right_equation(case.inputs)
    q, h = case.inputs["q"], 1e-6
    after = tool_pose(case.inputs, q + h * shortest(J, twist))
    np.testing.assert_allclose(
        twists_between(tool_pose(case.inputs, q), after) / h, twist, atol=1e-4
    )


def test_the_nearest_solution_is_the_answer_itself_if_that_solves():
    J, twist = right_equation(CASES[-1].inputs)
    for damping in (0.0, 0.1):
        answer = damped(J, twist, damping) if damping else shortest(J, twist)
        nearest, found = solving((J, twist), answer)
        np.testing.assert_allclose(nearest, answer, atol=1e-12)
        assert found == pytest.approx(damping, abs=1e-6)
