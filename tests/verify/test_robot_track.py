"""Robots that follow targets: laws at their edges, honest controllers."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from plumbob.reference.jacobians import jacobian
from plumbob.reference.skeleton import Pose
from plumbob.verify.exchange import Answer, Exchange
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import PROTOCOL, Greeting
from plumbob.verify.judgement import Verdict
from plumbob.verify.kinematics import robot_motions
from plumbob.verify.kinematics.robot_models import mechanism, tool_at, twists_between
from plumbob.verify.kinematics.robot_motions import TASK, followed
from plumbob.verify.kinematics.robot_track import judge
from plumbob.verify.verify import verify

GREETING = Greeting(PROTOCOL, (TASK,), velocity_limits=True)


@cache
def all_cases():
    """Return the cases by their families."""
    return {case.family: case for case in robot_motions.cases(GREETING, "", 0, False)}


def tool_of(case):
    return Pose(case.inputs["target_positions"], case.inputs["target_rotations"])


def tracked(solver="levenberg_marquardt", **inputs):
    tool = Pose(inputs["target_positions"], inputs["target_rotations"])
    return {"q": followed(inputs, inputs["start"], tool, solver)}


def right(case):
    return tracked(**case.inputs)["q"]


def broken(case, q, **outputs):
    """The laws that coordinates break, with their verdicts."""
    answer = Answer({"q": q, **outputs}, 0.0)
    exchanges = [Exchange(case, answer, answer)]
    (judgement,) = judge(exchanges, GREETING, "").judgements
    return {found.law: found.verdict for found in judgement.findings if found.verdict}


def step(J, e, damping):
    return J.T @ np.linalg.solve(J @ J.T + damping * np.eye(6), e)


def controller(gain=1.0, damping=1e-3, iterations=None, posture=0.0, weights=1.0):
    """A solver with a gain, a damping, weights of the joints and a posture in the null space."""

    def track(start, lower, upper, max_iterations, **inputs):
        robot, q, frames = mechanism({**inputs, "lower": lower, "upper": upper}), start, []
        for target in zip(inputs["target_positions"], inputs["target_rotations"], strict=True):
            for _ in range(iterations or max_iterations):
                e = twists_between(tool_at(robot, q), Pose(*target))
                if np.abs(e).max() < 0.5 * inputs["tolerance_rotation"]:
                    break
                J = jacobian(robot, q, -1) * np.sqrt(weights)
                rest = 0.5 * (lower + upper) - q
                rest = posture * (rest - step(J, J @ rest, damping))
                q = np.clip(q + np.sqrt(weights) * step(J, gain * e, damping) + rest, lower, upper)
            frames.append(q)
        return {"q": np.array(frames)}

    return track


HONEST = {
    "damped least squares": controller(),
    "one step in a frame": controller(iterations=1),
    "strongly damped, one step": controller(damping=0.04, iterations=1),
    "gain of a half": controller(gain=0.5),
    "weighted joints": controller(weights=np.array([1, 1, 2, 1, 0.3, 0.5, 0.3])),
    "posture in the null space": controller(iterations=1, posture=0.05),
    "fixed damping": partial(tracked, solver="damped_least_squares"),
}


@pytest.mark.sample("damped least")
@pytest.mark.parametrize("name", HONEST)
def test_no_honest_controller_is_accused(name):
    connection = FunctionConnection({TASK: HONEST[name]}, Greeting(PROTOCOL, (TASK,)))
    report = verify(connection).tasks[0]
    assert report.verdict <= Verdict.RIGHT_EXCEPT
    assert not report.diagnosis.explanations


def test_the_reference_breaks_no_law():
    for family, case in all_cases().items():
        laws = broken(case, right(case))
        allowed = {"velocity limits kept"} if "speeds" in family else {"no drift over laps"}
        assert laws.keys() <= allowed, family


def test_speeds_are_limited_where_the_request_says_so():
    case = all_cases()["jump, limited speeds"]
    assert broken(case, right(case)) == {"velocity limits kept": Verdict.WRONG}
    frames, q = [], case.inputs["start"]
    longest = case.inputs["h"] * case.inputs["velocity_limits"]
    for target in right(case):
        q = q + np.clip(target - q, -longest, longest)
        frames.append(q)
    assert set(broken(case, np.array(frames)).values()) <= {Verdict.RIGHT_EXCEPT}


@pytest.mark.parametrize(
    ("excess", "last", "verdict"),
    [([0.2, 0.1, 0.05, 0.02], 0.0, Verdict.RIGHT_EXCEPT),
     ([0.2, 0.1, 0.05, 0.02], 0.01, Verdict.WRONG),
     ([0.2, 0.25, 0.05, 0.02], 0.0, Verdict.WRONG)],
)  # fmt: skip
def test_a_start_beyond_a_limit_may_only_come_nearer_and_stays_within(excess, last, verdict):
    case = all_cases()["start beyond a limit"]
    q, lower = right(case).copy(), case.inputs["lower"][1]
    q[:4, 1] = lower - excess
    q[-1, 1] = lower - last
    assert broken(case, q)["limits kept"] is verdict


@pytest.mark.parametrize(("steps", "verdict"), [(4.9, Verdict.RIGHT_EXCEPT), (5.1, Verdict.WRONG)])
def test_a_tool_may_trail_its_target_by_five_of_the_steps_so_far(steps, verdict):
    """A step is the largest displacement of the target in a frame up to then."""
    case = all_cases()["curve"]
    tool, tolerance = tool_of(case), case.inputs["tolerance"]
    displacements = twists_between(
        Pose(*(part[:-1] for part in tool)), Pose(*(p[1:] for p in tool))
    )
    lengths = np.linalg.norm(displacements.reshape(-1, 2, 3), axis=-1)
    lengths /= [tolerance, case.inputs["tolerance_rotation"]]
    largest = np.maximum.accumulate(np.concatenate([[0.0], lengths.max(axis=1)]))
    behind = tool.positions - steps * tolerance * largest[:, None] * np.array([0.0, 0.6, 0.8])
    precise = {**case.inputs, "tolerance": 1e-9, "tolerance_rotation": 1e-9}
    q = followed(precise, case.inputs["start"], tool._replace(positions=behind))
    assert broken(case, q)["target followed"] is verdict


@pytest.mark.parametrize(("move", "is_jump"), [(0.99, False), (1.01, True)])
def test_a_joint_that_moves_a_radian_while_its_target_rests_jumps(move, is_jump):
    case = all_cases()["rest"]
    q = right(case).copy()
    frame = len(q) - case.facts["rest"] // 2
    q[frame:] = q[frame]
    moved = q.copy()
    moved[frame:, 0] += move
    assert "no jumps" not in broken(case, q)
    assert ("no jumps" in broken(case, moved)) == is_jump


def test_an_arm_that_does_not_rest_with_its_target_is_seen():
    case = all_cases()["rest"]
    q = right(case)
    tremor = q + 2e-4 * (-1.0) ** np.arange(len(q))[:, None]
    assert broken(case, tremor)["rest"] is Verdict.WRONG
    fading = q + 0.01 * 0.9 ** np.arange(len(q))[:, None]
    assert broken(case, fading)["rest"] is Verdict.RIGHT_EXCEPT


def test_speeds_that_are_reported_are_those_of_the_coordinates():
    case = all_cases()["curve"]
    q, h = right(case), case.inputs["h"]
    v = np.diff(q, axis=0, prepend=case.inputs["start"][None]) / h
    assert "velocities and coordinates" not in broken(case, q, velocities=v)
    later = np.concatenate([v[1:], v[-1:]])
    for wrong in (later, 1.2 * v):
        assert broken(case, q, velocities=wrong)["velocities and coordinates"] is Verdict.WRONG


def test_answers_without_numbers_are_broken():
    case = all_cases()["rest"]
    assert broken(case, np.full((32, 7), np.nan)) == {"numbers": Verdict.BROKEN}
    connection = FunctionConnection({TASK: lambda h: {"velocities": np.zeros((1, 7))}}, GREETING)
    assert verify(connection).verdict is Verdict.BROKEN


def test_quaternions_of_either_sign_are_compared_with_the_same_curve():
    exchanges = []
    for family in ("curve", "opposite quaternions"):
        case = replace(all_cases()[family], name=f"arm, {family}")
        q = right(case) + (0.02 if family == "curve" else 0.0)
        exchanges.append(Exchange(case, Answer({"q": q}, 0.0), Answer({"q": q}, 0.0)))
    _, flipped = judge(exchanges, GREETING, "").judgements
    assert "both signs of a quaternion" in {
        found.law for found in flipped.findings if found.verdict
    }
