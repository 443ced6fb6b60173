"""Robots with limits: right solvers pass, wrong ones are told by a law and named by their fault."""

from dataclasses import replace

import numpy as np
import pytest

from plumbob.crosscheck.engines import MujocoRobot
from plumbob.crosscheck.verify.contestant import Answer, Exchange
from plumbob.crosscheck.verify.functions import FunctionContestant
from plumbob.crosscheck.verify.greeting import PROTOCOL, Greeting
from plumbob.crosscheck.verify.judgement import Verdict
from plumbob.crosscheck.verify.kinematics import robot_models
from plumbob.crosscheck.verify.kinematics.robot_inverse_kinematics import (
    FAULTS,
    TASK,
    judge,
    solve_wrongly,
)
from plumbob.crosscheck.verify.kinematics.robot_models import CLOSE, tool_pose
from plumbob.crosscheck.verify.verify import judge_cases
from plumbob.reference import forward_kinematics, rotation
from plumbob.reference.formats import urdf

GREETING = Greeting(PROTOCOL, (TASK,), name="robots")
CASES = robot_models.cases(GREETING, "", 0, False)
FEW = [
    case for case in CASES
    if case.name.startswith(("two", "seven")) and case.family != robot_models.ANYWHERE
]  # fmt: skip


def misled(case, key):
    """The case with a target that a solver with this fault believes to have reached."""
    inputs, fault = dict(case.inputs), FAULTS[key]
    q = 0.7 * inputs["upper"] + 0.2 - 0.1 * np.arange(len(inputs["upper"]))
    pose = tool_pose(fault.read(inputs), fault.coordinates(inputs, q))
    target = np.roll(pose.rotations, -1) if key == "scalar last" else pose.rotations
    if key == "position only":
        target = rotation.multiply(target, rotation.random(np.random.default_rng(3)))
    inputs |= {"target_position": pose.positions, "target_rotation": target}
    answer = Answer({"q": q}, 0.0)
    return Exchange(replace(case, inputs=inputs), answer, answer)


def judged(function):
    return judge_cases(FunctionContestant({TASK: function}, GREETING), TASK, "", FEW)


def broken(report):
    return {f.law for one in report.judgements for f in one.findings if f.verdict >= Verdict.WRONG}


def test_a_right_solver_is_right_or_stuck_somewhere():
    report = judged(lambda **inputs: solve_wrongly(None, **inputs))
    assert report.verdict <= Verdict.RIGHT_EXCEPT
    assert broken(report) == set()
    assert len(report.judgements) == len(FEW) == 15


@pytest.mark.parametrize("key", FAULTS)
def test_a_fault_breaks_a_law_and_is_named(key):
    report = judge([misled(case, key) for case in FEW if case.family == CLOSE], GREETING, "")
    assert broken(report) & {"target reached", "rotation reached"}
    assert [one.faults for one in report.diagnosis.explanations] == [(key,)]


@pytest.mark.parametrize(("turns", "is_wrapped"), [(1, True), (-2, True), (0.3, False)])
def test_angle_beyond_its_limits_by_whole_turns_is_said_to_be(turns, is_wrapped):
    case = next(case for case in FEW if case.family == CLOSE)
    q = 0.5 * (case.inputs["lower"] + case.inputs["upper"])
    joint = int(np.argmin(case.inputs["slides"]))
    q[joint] = case.inputs["upper"][joint] + 0.1 if turns == 0.3 else q[joint] + turns * 2.0 * np.pi
    answer = Answer({"q": q}, 0.0)
    (judgement,) = judge([Exchange(case, answer, answer)], GREETING, "").judgements
    limits = next(finding for finding in judgement.findings if finding.law == "limits kept")
    assert limits.verdict is Verdict.WRONG
    assert ("whole turns" in str(limits.sentence)) is is_wrapped


@pytest.mark.parametrize("key", FAULTS)
def test_an_answer_means_what_it_was_given_for(key):
    inputs = CASES[8].inputs
    assert inputs["slides"].any()
    q = inputs["start"] + 0.1
    answer = FAULTS[key].answer(inputs, q)
    np.testing.assert_allclose(FAULTS[key].coordinates(inputs, answer), q, atol=1e-14)


def test_limits_that_are_left_aside_are_seen():
    assert "limits kept" in broken(judged(lambda upper, **_: {"q": upper + 0.01}))


def test_a_claim_that_is_not_so_is_seen_beyond_reach():
    claiming = judged(lambda **inputs: {**solve_wrongly(None, **inputs), "converged": True})
    assert broken(claiming) == {"claims"}


@pytest.mark.parametrize("number", [np.nan, 1e300])
def test_what_is_no_coordinate_is_wrong(number):
    report = judged(lambda start, **_: {"q": np.full_like(start, number)})
    assert report.verdict is (Verdict.BROKEN if np.isnan(number) else Verdict.WRONG)


@pytest.mark.parametrize("case", CASES[::4], ids=lambda case: case.name)
def test_kinematics_are_those_of_the_same_text_by_the_reference_and_by_mujoco(case, tmp_path):
    inputs, q = case.inputs, 0.5 * (case.inputs["lower"] + case.inputs["upper"])
    pose = tool_pose(inputs, q)
    robot = urdf.parse(inputs["urdf"]).articulation
    ours = forward_kinematics(robot, q)
    at = robot.names.index("tool")
    np.testing.assert_allclose(ours.positions[at], pose.positions, atol=1e-12)
    np.testing.assert_allclose(rotation.angle(ours.rotations[at], pose.rotations), 0, atol=1e-12)
    (tmp_path / "robot.urdf").write_text(inputs["urdf"])
    engine = MujocoRobot(tmp_path / "robot.urdf")
    engine.update_kinematics({f"joint_{j}": q[j : j + 1] for j in range(len(q))})
    theirs = engine.link_poses(["tool"])
    np.testing.assert_allclose(theirs.positions[0], pose.positions, atol=1e-12)
    matrix = rotation.to_matrix(pose.rotations)
    np.testing.assert_allclose(theirs.matrices[0], matrix, atol=1e-12)
