"""Jacobians of robots and speeds for a velocity: every convention and way is right."""

import numpy as np
import pytest

from plumbob.verify.disciplines import DISCIPLINES
from plumbob.verify.exchange import Answer, Exchange
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import PROTOCOL, Greeting
from plumbob.verify.judgement import Verdict
from plumbob.verify.kinematics.robot_jacobian import CONVENTIONS, right_jacobian
from plumbob.verify.kinematics.robot_models import tool_pose, twists_between
from plumbob.verify.kinematics.robot_velocity import SINGULAR, judge, right_equation
from plumbob.verify.verify import verify

JACOBIAN, VELOCITY = "robot_jacobian", "robot_velocity"
GREETINGS = {task: Greeting(PROTOCOL, (task,)) for task in (JACOBIAN, VELOCITY)}
CASES = {task: DISCIPLINES[task].cases(g, "", 0, False) for task, g in GREETINGS.items()}


def world(inputs):
    return right_jacobian(inputs, CONVENTIONS["world, linear part first"])


def report_of(task, output, predict):
    """Return the report on a solver, given its output by inputs."""
    functions = {task: lambda **inputs: {output: predict(inputs)}}
    return verify(FunctionConnection(functions, GREETINGS[task])).tasks[0]


def differences(inputs, step):
    """Return central differences of the tool's pose, (6, joint)."""
    q, steps = inputs["q"], step * np.eye(len(inputs["q"]))
    before, after = tool_pose(inputs, q - steps), tool_pose(inputs, q + steps)
    return twists_between(before, after).T / (2.0 * step)


@pytest.mark.parametrize("case", CASES[JACOBIAN][::3], ids=lambda case: case.name)
def test_columns_are_derivatives_of_the_tool_s_pose(case):
    """Central differences of 1e-5 are wrong by 1e-10, and rounding adds 1e-11."""
    np.testing.assert_allclose(world(case.inputs), differences(case.inputs, 1e-5), atol=1e-8)


@pytest.mark.sample(every=2)
@pytest.mark.parametrize("name", CONVENTIONS)
def test_every_convention_is_right_and_reported(name):
    answer = CONVENTIONS[name]
    report = report_of(JACOBIAN, "jacobian", lambda inputs: right_jacobian(inputs, answer))
    assert report.verdict is Verdict.RIGHT
    assert report.diagnosis.behaviour.values == {"convention": name}


JACOBIANS = {
    "a factor": (lambda J: 1.01 * J, Verdict.WRONG),
    "the angular part first in robots of an even number of joints": (
        lambda J: J if J.shape[1] % 2 else np.roll(J, 3, axis=0), Verdict.WRONG),
    "no numbers": (lambda J: np.nan * J, Verdict.BROKEN),
    "single precision": (lambda J: J.astype(np.float32), Verdict.RIGHT_EXCEPT),
    "the transpose": (lambda J: J.T, Verdict.BROKEN),
}  # fmt: skip


@pytest.mark.parametrize("name", JACOBIANS)
@pytest.mark.usefixtures("verdict_alone")
def test_other_numbers_and_a_convention_that_changes_between_answers_are_not_right(name):
    change, verdict = JACOBIANS[name]
    report = report_of(JACOBIAN, "jacobian", lambda inputs: change(world(inputs)))
    assert report.verdict is verdict


def by_differences(inputs):
    """Return right speeds by a Jacobian of differences."""
    _, twist = right_equation(inputs)
    return np.linalg.pinv(differences(inputs, 1e-6), 1e-4) @ twist


@pytest.mark.parametrize(
    ("task", "output", "answer"),
    [(JACOBIAN, "jacobian", lambda inputs: differences(inputs, 1e-6)),
     (VELOCITY, "velocities", by_differences)],
)  # fmt: skip
@pytest.mark.usefixtures("verdict_alone")
def test_differences_of_poses_are_a_jacobian_of_fewer_digits(task, output, answer):
    report = report_of(task, output, answer)
    assert report.verdict is Verdict.RIGHT_EXCEPT


def shortest(J, twist):
    return np.linalg.pinv(J, 1e-6) @ twist


def with_null_space(J, twist):
    speeds = shortest(J, twist)
    return speeds + np.ones_like(speeds) - np.linalg.pinv(J, 1e-6) @ J @ np.ones_like(speeds)


def damped(J, twist, damping):
    return np.linalg.solve(J.T @ J + damping**2 * np.eye(J.shape[1]), J.T @ twist)


def failing(J, twist):
    if np.linalg.matrix_rank(J, 1e-6) < min(6, np.count_nonzero(J.any(axis=0))):
        raise ValueError("singular matrix")
    return shortest(J, twist)


@pytest.mark.parametrize(
    ("solve", "verdict", "words"),
    [(shortest, Verdict.RIGHT, "least length"),
     (with_null_space, Verdict.RIGHT, "does not move the tool"),
     (failing, Verdict.RIGHT_EXCEPT, "singular matrix")],
)  # fmt: skip
def test_every_solution_is_right_and_the_report_says_which_it_is(solve, verdict, words):
    report = report_of(VELOCITY, "velocities", lambda inputs: solve(*right_equation(inputs)))
    assert report.verdict is verdict
    complaints = [str(one) for judged in report.judgements for one in judged.complaints]
    assert words in str([str(report.diagnosis.behaviour), *complaints])


@pytest.mark.parametrize("damping", [1e-3, 0.02])
@pytest.mark.usefixtures("verdict_alone")
def test_damping_is_told_and_no_fault(damping):
    report = report_of(
        VELOCITY, "velocities", lambda inputs: damped(*right_equation(inputs), damping)
    )
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
    case = next(case for case in CASES[VELOCITY] if len(case.inputs["q"]) == 1)
    speeds = (1.0 - loss) * shortest(*right_equation(case.inputs))
    answer = Answer({"velocities": speeds}, 0.0)
    (judgement,) = judge([Exchange(case, answer, answer)], GREETINGS[VELOCITY], "").judgements
    verdicts = {found.law: found.verdict for found in judgement.findings}
    assert verdicts["velocity of the tool"] is verdict
