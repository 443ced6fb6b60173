"""Robots with limits: right solvers pass, wrong ones break a law."""

from functools import cache

import numpy as np
import pytest
from honest_solvers import solve_by_reference
from kinematics_solvers import explained

from plumbob.crosscheck.engines import MujocoRobot
from plumbob.reference import forward_kinematics, rotation
from plumbob.reference.formats import urdf
from plumbob.reference.skeleton import Pose
from plumbob.verify.exchange import Answer, Exchange
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import PROTOCOL, Greeting
from plumbob.verify.judgement import Verdict
from plumbob.verify.kinematics.robot_inverse_kinematics import TASK, cases, judge
from plumbob.verify.kinematics.robot_models import solved, tool_pose
from plumbob.verify.kinematics.robot_targets import ANYWHERE, AT, AT_A_LIMIT, CLOSE
from plumbob.verify.verify import judge_cases

GREETING = Greeting(PROTOCOL, (TASK,), name="robots")


@cache
def all_cases():
    return cases(GREETING, "", 0, False)


def few_cases():
    """Return the cases of two robots, without their targets anywhere."""
    names = ("two", "seven")
    return [c for c in all_cases() if c.name.startswith(names) and c.family != ANYWHERE]


def judged(function, cases):
    return judge_cases(FunctionConnection({TASK: function}, GREETING), TASK, "", cases)


def exchange_of(case, q, **claims):
    answer = Answer({"q": q, **claims}, 0.0)
    return Exchange(case, answer, answer)


def solution(case, **limits):
    """Return the reference's coordinates, with other limits of all joints."""
    inputs = case.inputs
    robot = {**inputs, **{name: np.full(len(inputs["start"]), x) for name, x in limits.items()}}
    tool = Pose(inputs["target_position"], inputs["target_rotation"])
    return solved(robot, inputs["start"], tool)[0]


def broken(report):
    return {f.law for one in report.judgements for f in one.findings if f.verdict >= Verdict.WRONG}


@pytest.mark.usefixtures("verdict_alone")
def test_a_right_solver_is_right_or_stuck_somewhere():
    cases = few_cases()[::6]
    report = judged(lambda **inputs: solve_by_reference("damped_least_squares", **inputs), cases)
    assert report.verdict <= Verdict.RIGHT_EXCEPT
    assert broken(report) == set()
    assert len(report.judgements) == len(cases) > 3


@pytest.mark.parametrize(("turns", "is_wrapped"), [(1, True), (-2, True), (0.3, False)])
def test_angle_beyond_its_limits_by_whole_turns_is_said_to_be(turns, is_wrapped):
    case = next(case for case in few_cases() if case.family == CLOSE)
    q = 0.5 * (case.inputs["lower"] + case.inputs["upper"])
    joint = int(np.argmin(case.inputs["slides"]))
    q[joint] = case.inputs["upper"][joint] + 0.1 if turns == 0.3 else q[joint] + turns * 2.0 * np.pi
    (judgement,) = judge([exchange_of(case, q)], GREETING, "").judgements
    limits = next(finding for finding in judgement.findings if finding.law == "limits kept")
    assert limits.verdict is Verdict.WRONG
    assert ("whole turns" in str(limits.sentence)) is is_wrapped


@pytest.mark.parametrize(
    ("change", "verdict", "law"),
    [
        (lambda q: q + 0.01, Verdict.WRONG, "limits kept"),
        (lambda q: np.nan * q, Verdict.BROKEN, "numbers"),
        (lambda q: np.full_like(q, 1e300), Verdict.WRONG, "limits kept"),
    ],
    ids=["beyond", "no numbers", "huge"],
)
@pytest.mark.usefixtures("verdict_alone")
def test_coordinates_beyond_limits_or_without_numbers_are_wrong(change, verdict, law):
    report = judged(lambda upper, **_: {"q": change(upper)}, few_cases()[:4])
    assert report.verdict is verdict
    assert law in broken(report)


@pytest.mark.parametrize("number", range(0, 40, 4))
def test_kinematics_are_those_of_the_same_text_by_the_reference_and_by_mujoco(number, tmp_path):
    case = all_cases()[number]
    inputs, q = case.inputs, 0.5 * (case.inputs["lower"] + case.inputs["upper"])
    pose = tool_pose(inputs, q)
    robot = urdf.parse(inputs["urdf"]).articulation
    links = [robot.names.index(f"link_{joint}") for joint in range(len(q))]
    order = np.argsort([robot.coordinates_of(link).start for link in links])
    ours = forward_kinematics(robot, q[order])
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


def test_limits_that_are_kept_only_after_the_solve_break_a_law():
    exchanges = []
    for case in [case for case in all_cases() if case.family == AT_A_LIMIT][:4]:
        free = solution(case, lower=-9.0, upper=9.0)
        clamped = np.clip(free, case.inputs["lower"], case.inputs["upper"])
        exchanges.append(exchange_of(case, clamped))
        assert broken(judge([exchange_of(case, solution(case))], GREETING, "")) == set()
    assert "limits in the solve" in broken(judge(exchanges, GREETING, ""))


def test_failure_at_the_target_alone_says_what_divides_by_zero():
    near = [case for case in all_cases() if case.family in (AT, CLOSE)]
    exchanges = [exchange_of(c, solution(c), converged=c.family == CLOSE) for c in near]
    report = explained(TASK, exchanges, GREETING)
    assert report.verdict is Verdict.RIGHT_EXCEPT
    assert "0 / 0" in str([words for one in report.judgements for words in one.complaints])
