"""Jacobians of robots: every convention is right, derivatives agree."""

import numpy as np
import pytest

from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import PROTOCOL, Greeting
from plumbob.verify.judgement import Verdict
from plumbob.verify.kinematics.robot_jacobian import CONVENTIONS, TASK, cases, right_jacobian
from plumbob.verify.kinematics.robot_models import tool_pose, twists_between
from plumbob.verify.verify import verify

GREETING = Greeting(PROTOCOL, (TASK,))
CASES = cases(GREETING, "", 0, False)


def world(inputs):
    return right_jacobian(inputs, CONVENTIONS["world, linear part first"])


def report_of(predict):
    functions = {TASK: lambda **inputs: {"jacobian": predict(inputs)}}
    return verify(FunctionConnection(functions, GREETING)).tasks[0]


@pytest.mark.parametrize("case", CASES[::3], ids=lambda case: case.name)
def test_columns_are_derivatives_of_the_tool_s_pose(case):
    """Central differences of 1e-5 are wrong by 1e-10, and rounding adds 1e-11."""
    q, h = case.inputs["q"], 1e-5
    steps = h * np.eye(len(q))
    before, after = tool_pose(case.inputs, q - steps), tool_pose(case.inputs, q + steps)
    differences = twists_between(before, after).T / (2.0 * h)
    np.testing.assert_allclose(world(case.inputs), differences, atol=1e-8)


@pytest.mark.sample(every=2)
@pytest.mark.parametrize("name", CONVENTIONS)
def test_every_convention_is_right_and_reported(name):
    report = report_of(lambda inputs: right_jacobian(inputs, CONVENTIONS[name]))
    assert report.verdict is Verdict.RIGHT
    assert report.diagnosis.behaviour.values == {"convention": name}


CHANGES = {
    "a factor": (lambda J: 1.01 * J, Verdict.WRONG),
    "the angular part first in robots of an even number of joints": (
        lambda J: J if J.shape[1] % 2 else np.roll(J, 3, axis=0), Verdict.WRONG),
    "no numbers": (lambda J: np.nan * J, Verdict.BROKEN),
    "single precision": (lambda J: J.astype(np.float32), Verdict.RIGHT_EXCEPT),
    "the transpose": (lambda J: J.T, Verdict.BROKEN),
}  # fmt: skip


@pytest.mark.parametrize("name", CHANGES)
@pytest.mark.usefixtures("verdict_alone")
def test_other_numbers_and_a_convention_that_changes_between_answers_are_not_right(name):
    change, verdict = CHANGES[name]
    assert report_of(lambda inputs: change(world(inputs))).verdict is verdict
