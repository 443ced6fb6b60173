"""What answers about robots show: sentences with counts, and none about right answers."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from plumbob.reference.skeleton import Pose
from plumbob.verify.exchange import Answer
from plumbob.verify.greeting import PROTOCOL, Greeting
from plumbob.verify.judgement import CaseJudgement
from plumbob.verify.kinematics import (
    robot_jacobian,
    robot_models,
    robot_motions,
    robot_targets,
    robot_velocity,
)
from plumbob.verify.observe.robots import robot_evidence

POSE, TRACK = robot_targets.TASK, robot_motions.TASK
GREETING = Greeting(PROTOCOL, (POSE,))


@cache
def cases(task):
    module = {POSE: robot_targets, TRACK: robot_motions, robot_jacobian.TASK: robot_jacobian,
              robot_velocity.TASK: robot_velocity}[task]  # fmt: skip
    return module.cases(GREETING, "", 0, False)


def observed(task, outputs_of, chosen):
    judgements = [CaseJudgement(case, Answer(outputs_of(case), 0.0), (), {}) for case in chosen]
    return " ".join(str(s.sentence) for s in robot_evidence(task, judgements).statements)


def poses():
    """Return near targets and single iterations of robots of at least six joints."""
    return [
        case for case in cases(POSE)
        if case.family in (robot_targets.CLOSE, robot_targets.STEP)
        and len(case.inputs["axes"]) >= 6
    ]  # fmt: skip


@cache
def right_pose(name):
    case = next(case for case in cases(POSE) if case.name == name)
    tool = Pose(case.inputs["target_position"], case.inputs["target_rotation"])
    return robot_models.solved(case.inputs, case.inputs["start"], tool)[0]


def solved(case):
    """Return right coordinates, of a single iteration those of one step."""
    inputs = case.inputs
    if inputs["max_iterations"] > 1:
        return right_pose(case.name)
    return inputs["start"] + stepped(case, 1.0, 1.0)


def stepped(case, position, rotation):
    motion = robot_motion(case)
    error = motion.twists(motion.previous)[0] * np.repeat([position, rotation], 3)
    return np.linalg.pinv(motion.jacobians[0]) @ error


def robot_motion(case):
    from plumbob.verify.kinematics.robot_inverse_kinematics import trajectory_of

    return trajectory_of(case, {"q": case.inputs["start"]})


def test_nothing_is_said_of_right_poses():
    claimed = [case for case in poses() if case.family == robot_targets.CLOSE]
    assert observed(POSE, lambda case: {"q": solved(case)}, poses()) == ""
    assert observed(POSE, lambda case: {"q": solved(case), "converged": True}, claimed) == ""


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (
            lambda case: np.where(case.inputs["slides"], 1.0, 180.0 / np.pi) * solved(case),
            "degrees",
        ),
        (lambda case: solved(case) - case.inputs["start"], "changes from the start"),
        (lambda case: solved(case)[::-1], "reverse order"),
        (lambda case: np.where(case.inputs["slides"], 1.0, -1.0) * solved(case), "opposite sense"),
    ],
)
def test_another_reading_of_coordinates_that_reaches_the_targets_is_said(answer, words):
    text = observed(POSE, lambda case: {"q": answer(case)}, poses())
    assert words in text


@pytest.mark.parametrize(
    ("factors", "words"),
    [((1.0, 0.0), "angular part"), ((1.0, -1.0), "angular part"), ((0.02, 0.02), "0.02 times"),
     ((-1.0, 1.0), "linear part")],
)  # fmt: skip
def test_the_factor_of_errors_in_a_single_iteration_is_measured(factors, words):
    steps = [case for case in poses() if case.family == robot_targets.STEP]
    text = observed(POSE, lambda case: {"q": case.inputs["start"] + stepped(case, *factors)}, steps)
    assert words in text


def test_a_part_of_the_target_that_is_missed_is_counted():
    near = [case for case in poses() if case.family == robot_targets.CLOSE]

    def off(case):
        tool = robot_models.tool_pose(case.inputs, solved(case))
        tilted = Pose(tool.positions, case.inputs["tool_rotation"])
        return robot_models.solved(case.inputs, solved(case), tilted)[0]

    def is_at(case):
        tool = robot_models.tool_pose(case.inputs, off(case))
        return np.linalg.norm(tool.positions - case.inputs["target_position"]) < 1e-6

    reached = list(filter(is_at, near))
    text = observed(POSE, lambda case: {"q": off(case)}, reached)
    assert len(reached) < 6 or f"the position of {len(reached)}" in text


def test_a_joint_that_never_moves_is_named_by_its_place():
    def stiff(case):
        q = np.array(solved(case))
        q[0] = case.inputs["start"][0]
        return q

    text = observed(POSE, lambda case: {"q": stiff(case)}, poses())
    assert "The first joint never moves" in text


@pytest.mark.parametrize(("side", "left"), [("upper", "upper"), ("lower", "lower")])
def test_the_side_of_the_limits_that_are_left_is_said(side, left):
    sign = 1.0 if side == "upper" else -1.0
    text = observed(POSE, lambda case: {"q": case.inputs[side] + 0.1 * sign}, poses())
    assert f"leave {left} limits" in text


def test_claims_that_do_not_depend_on_answers_are_counted():
    near = [case for case in poses() if case.family == robot_targets.CLOSE]
    near = [replace(case, name=f"{case.name} {i}") for case in near for i in range(6)]
    text = observed(POSE, lambda case: {"q": case.inputs["start"], "converged": True}, near)
    assert "Success is reported in all" in text


@pytest.mark.parametrize(
    ("wrong", "words"),
    [(lambda v, h: v * h, "are (q[i] - q[i-1]) in"), (lambda v, h: -v, "-(q[i] - q[i-1])/h"),
     (lambda v, h: 0.0 * v, "are 0 in"), (lambda v, h: np.vstack([v[:1], v[:-1]]), "q[i-2]")],
)  # fmt: skip
def test_the_formula_of_reported_velocities_is_found(wrong, words):
    case = next(case for case in cases(TRACK) if case.family == robot_motions.CURVE)
    rng = np.random.default_rng(3)
    q = case.inputs["start"] + 0.01 * np.cumsum(rng.standard_normal((24, 7)), axis=0)
    h = case.inputs["h"]
    v = np.diff(q, axis=0, prepend=case.inputs["start"][None]) / h
    assert "velocities" not in observed(TRACK, lambda case: {"q": q, "velocities": v}, [case])
    text = observed(TRACK, lambda case: {"q": q, "velocities": wrong(v, h)}, [case])
    assert words in text


@pytest.mark.parametrize(("linear", "angular"), [(0.4, 1.0), (1.0, -1.0), (0.0, 1.0)])
def test_the_factor_of_each_part_of_the_tool_s_velocity_is_measured(linear, angular):
    def speeds(case):
        J, twist = robot_velocity.right_equation(case.inputs)
        return np.linalg.pinv(J, 1e-6) @ (twist * np.repeat([linear, angular], 3))

    task = robot_velocity.TASK
    text = observed(task, lambda case: {"velocities": speeds(case)}, cases(task))
    part, factor = ("linear", linear) if linear != 1.0 else ("angular", angular)
    assert f"The {part} part of the tool's velocity is {factor:.3g} times" in text
    assert text.count("times") == 1


@pytest.mark.parametrize(
    ("change", "words"),
    [(lambda J, case: J * np.repeat([0.5, 1.0], 3)[:, None], "0.5 in the linear parts"),
     (lambda J, case: J * (np.arange(J.shape[1]) != case.inputs["effector"]), "the last columns")],
)  # fmt: skip
def test_the_wrong_part_of_jacobians_is_named(change, words):
    task, world = robot_jacobian.TASK, robot_jacobian.CONVENTIONS["world, linear part first"]

    def answer(case):
        J = robot_jacobian.right_jacobian(case.inputs, world)
        return {"jacobian": change(J, case)}

    assert words in observed(task, answer, cases(task))
