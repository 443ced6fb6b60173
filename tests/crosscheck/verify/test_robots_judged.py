"""Robots with limits: right solvers pass, wrong ones are told by a law and named by their fault."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from plumbob.crosscheck.verify.contestant import Answer, Asked
from plumbob.crosscheck.verify.functions import FunctionContestant
from plumbob.crosscheck.verify.greeting import PROTOCOL, Greeting
from plumbob.crosscheck.verify.judgement import Verdict
from plumbob.crosscheck.verify.kinematics import robot_models
from plumbob.crosscheck.verify.kinematics.robot_inverse_kinematics import FAULTS, TASK, judge
from plumbob.crosscheck.verify.kinematics.robot_models import CLOSE, apart, tool_pose
from plumbob.crosscheck.verify.verify import judge_cases
from plumbob.reference import forward_kinematics, rotation
from plumbob.reference.formats import urdf

GREETING = Greeting(PROTOCOL, (TASK,), name="robots")
CASES = robot_models.cases(GREETING, "", 0, False)
# Of each family a few, for the solver here is slow.
FEW = [
    case for case in CASES
    if case.name.startswith(("two", "seven")) and case.family != robot_models.ANYWHERE
]  # fmt: skip


def error(inputs, q):
    """The displacement and the rotation vector that are left."""
    pose = tool_pose(inputs, q)
    d = rotation.multiply(inputs["target_rotation"], pose.rotation * [1, -1, -1, -1])
    left = 2.0 * d[1:] * np.sign(d[0] or 1.0)
    return np.concatenate([inputs["target_position"] - pose.position, left])


def damped_least_squares(claim=None):
    """A right solver, but for what it claims."""

    def solve(**inputs):
        q = inputs["start"]
        for _ in range(30):
            e = error(inputs, q)
            if np.abs(e).max() < 0.1 * inputs["tolerance_rotation"]:
                break
            J = np.array([error(inputs, q + 1e-6 * one) - e for one in np.eye(len(q))]).T / 1e-6
            q = q - np.linalg.solve(J.T @ J + 1e-9 * np.eye(len(q)), J.T @ e)
            q = np.clip(q, inputs["lower"], inputs["upper"])
        distance, angle = apart(tool_pose(inputs, q), inputs)
        reached = distance <= inputs["tolerance"] and angle <= inputs["tolerance_rotation"]
        return {"q": q, "converged": reached if claim is None else claim}

    return solve


def misled(case, fault):
    """The case with a target that a solver with this fault believes to have reached."""
    q, inputs = 0.7 * case.inputs["upper"] + 0.2, dict(case.inputs)
    pose = tool_pose(inputs, q, fault.reading)
    order = fault.order or (0, 1, 2, 3)
    turned = np.empty(4)
    turned[list(order)] = pose.rotation
    if fault.order is None:
        turned = rotation.multiply(turned, rotation.random(np.random.default_rng(3)))
    inputs |= {"target_position": pose.position, "target_rotation": turned}
    answer = Answer({"q": q}, 0.0)
    return Asked(replace(case, inputs=inputs), answer, answer)


def judged(function):
    return judge_cases(FunctionContestant({TASK: function}, GREETING), TASK, "", FEW)


def broken(report):
    return {f.law for one in report.judgements for f in one.findings if f.verdict >= Verdict.WRONG}


def test_a_right_solver_is_right_or_stuck_somewhere():
    report = judged(damped_least_squares())
    assert report.verdict <= Verdict.RIGHT_BUT
    assert broken(report) == set()
    assert len(report.judgements) == len(FEW) == 15


@pytest.mark.parametrize("key", FAULTS)
def test_a_fault_breaks_a_law_and_is_named(key):
    report = judge(
        [misled(case, FAULTS[key]) for case in FEW if case.family == CLOSE], GREETING, ""
    )
    assert broken(report) & {"target reached", "rotation reached"}
    assert [one.faults for one in report.diagnosis.explanations] == [(key,)]


def test_limits_that_are_left_aside_are_seen():
    report = judged(lambda upper, **_: {"q": upper + 0.01})
    assert "limits kept" in broken(report)


def test_a_claim_that_is_not_so_is_seen_beyond_reach():
    report = judged(damped_least_squares(claim=True))
    assert broken(report) == {"claims"}


def test_what_is_no_number_is_broken():
    report = judged(lambda start, **_: {"q": np.full_like(start, np.nan)})
    assert report.verdict is Verdict.BROKEN


@pytest.mark.parametrize("case", CASES[::4], ids=lambda case: case.name)
def test_kinematics_are_those_of_the_same_text_by_the_reference_and_by_mujoco(case):
    inputs, q = case.inputs, 0.5 * (case.inputs["lower"] + case.inputs["upper"])
    pose = tool_pose(inputs, q)
    robot = urdf.parse(inputs["urdf"])
    ours = forward_kinematics(robot.articulation, q)
    at = robot.articulation.names.index("tool")
    np.testing.assert_allclose(ours.positions[at], pose.position, atol=1e-12)
    turned = ours.rotations[at]
    np.testing.assert_allclose(turned * np.sign(turned @ pose.rotation), pose.rotation, atol=1e-12)
    text = inputs["urdf"].replace("<robot name=\"robot\">", "<robot name=\"robot\"><mujoco>"
        "<compiler fusestatic=\"false\" balanceinertia=\"true\"/></mujoco>")  # fmt: skip
    inertia = ('<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
               'iyz="0"/></inertial></link>')  # fmt: skip
    links = text.replace('"/><link', f'">{inertia}<link').replace(
        '"/><joint', f'">{inertia}<joint', 1
    )
    model = mujoco.MjModel.from_xml_string(links)
    data = mujoco.MjData(model)
    for j in range(len(q)):
        data.qpos[model.joint(f"joint_{j}").qposadr[0]] = q[j]
    mujoco.mj_kinematics(model, data)
    np.testing.assert_allclose(data.xpos[model.body("tool").id], pose.position, atol=1e-6)
