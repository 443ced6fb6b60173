"""What answers about robots show: sentences with counts, and none about right answers."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from plumbob.reference.skeleton import Pose
from plumbob.verify.disciplines import DISCIPLINES
from plumbob.verify.exchange import Answer
from plumbob.verify.greeting import PROTOCOL, Greeting
from plumbob.verify.judgement import CaseJudgement
from plumbob.verify.kinematics import robot_jacobian, robot_models, robot_velocity
from plumbob.verify.kinematics.robot_targets import AT_A_LIMIT, CLOSE, STEP, TASK
from plumbob.verify.kinematics.trajectories import trajectory_of
from plumbob.verify.laws import finding
from plumbob.verify.observe.observations import of_tables
from plumbob.verify.observe.robots import robot_evidence

POSE, TRACK = TASK, "robot_track"
JACOBIAN, VELOCITY = robot_jacobian.TASK, robot_velocity.TASK


@cache
def cases(task):
    return DISCIPLINES[task].cases(Greeting(PROTOCOL, (task,)), "", 0, False)


def observed(task, outputs_of, chosen=None, findings_of=lambda case: ()):
    """Return what is said of answers, and the places of tables."""
    judgements = [
        CaseJudgement(case, Answer(outputs_of(case), 0.0), findings_of(case), {})
        for case in chosen or cases(task)
    ]
    evidence = robot_evidence(task, judgements)
    places = [place for place in of_tables(list(evidence.tables.values())) if place.is_exact]
    return " ".join(str(s.sentence) for s in (*evidence.statements, *places))


@cache
def poses(family):
    """Return cases of robots of at least six joints."""
    return [c for c in cases(POSE) if c.family == family and len(c.inputs["axes"]) >= 6]


@cache
def right_pose(name, **limits):
    case = next(case for case in cases(POSE) if case.name == name)
    limits = {side: np.full(len(case.inputs["axes"]), limit) for side, limit in limits.items()}
    tool = Pose(case.inputs["target_position"], case.inputs["target_rotation"])
    return robot_models.solved({**case.inputs, **limits}, case.inputs["start"], tool)[0]


def solved(case, position=1.0, angle=1.0):
    """Return right coordinates, of a single iteration those of one step for factors of errors."""
    if case.inputs["max_iterations"] > 1:
        return right_pose(case.name)
    motion = trajectory_of(case, {"q": case.inputs["start"]})
    error = motion.twists(motion.previous)[0] * np.repeat([position, angle], 3)
    return case.inputs["start"] + np.linalg.pinv(motion.jacobians[0]) @ error


def stiff(case, joint):
    return np.where(
        np.arange(len(case.inputs["axes"])) == joint, case.inputs["start"], solved(case)
    )


def beyond(case, side, joints=slice(None)):
    q = 0.5 * (case.inputs["lower"] + case.inputs["upper"])
    q[joints] = case.inputs[side][joints] + (0.1 if side == "upper" else -0.1)
    return q


def test_nothing_is_said_of_right_poses():
    assert observed(POSE, lambda case: {"q": solved(case)}, poses(CLOSE) + poses(STEP)) == ""


WRONG_POSES = [
    (lambda case: np.where(case.inputs["slides"], 1, 180 / np.pi) * solved(case), "as degrees"),
    (lambda case: solved(case) - case.inputs["start"], "changes from the start"),
    (lambda case: solved(case)[::-1], "reverse order"),
    (lambda case: np.where(case.inputs["slides"], 1.0, -1.0) * solved(case), "opposite sense"),
    (lambda case: stiff(case, 0), "Wrong at the root and nowhere else: joints that have to move"),
    (lambda case: beyond(case, "upper"), "Wrong at upper limits and nowhere else"),
    (lambda case: beyond(case, "lower"), "Wrong everywhere but at upper limits: limits of joints"),
]


@pytest.mark.parametrize(("answer", "words"), WRONG_POSES)
def test_another_meaning_of_coordinates_and_the_place_of_wrong_ones_are_said(answer, words):
    assert words in observed(POSE, lambda case: {"q": answer(case)}, poses(CLOSE))


def test_targets_that_joints_at_limits_alone_miss_are_counted():
    def clamped(case):
        free = right_pose(case.name, lower=-9.0, upper=9.0)
        return np.clip(free, case.inputs["lower"], case.inputs["upper"])

    limited = poses(AT_A_LIMIT)
    text = observed(POSE, lambda case: {"q": clamped(case)}, limited)
    assert "are missed by joints at their limits alone" in text
    assert "limits alone" not in observed(POSE, lambda case: {"q": solved(case)}, limited)


@pytest.mark.parametrize(
    ("factors", "words"),
    [((1.0, 0.0), "angular part"), ((1.0, -1.0), "angular part"), ((0.02, 0.02), "0.02 times"),
     ((-1.0, 1.0), "linear part")],
)  # fmt: skip
def test_the_factor_of_errors_in_a_single_iteration_is_measured(factors, words):
    assert words in observed(POSE, lambda case: {"q": solved(case, *factors)}, poses(STEP))


def test_a_part_of_the_target_that_is_missed_is_counted():
    tilted = [
        replace(case, name=f"{case.name} {i}", inputs={
            **case.inputs, "target_rotation": case.inputs["target_rotation"][[1, 0, 3, 2]]})
        for case in poses(CLOSE) for i in range(6)
    ]  # fmt: skip
    text = observed(POSE, lambda case: {"q": right_pose(case.name[:-2])}, tilted)
    assert f"the position of {len(tilted)} and to the rotation of 0" in text


@pytest.mark.parametrize(
    ("wrong", "words"),
    [(lambda v, h: v * h, "are (q[i] - q[i-1]) in"), (lambda v, h: -v, "-(q[i] - q[i-1])/h"),
     (lambda v, h: 0.0 * v, "are 0 in"), (lambda v, h: np.vstack([v[:1], v[:-1]]), "q[i-2]"),
     (lambda v, h: v, "")],
)  # fmt: skip
def test_the_formula_of_reported_velocities_is_found(wrong, words):
    case = next(case for case in cases(TRACK) if case.family == "curve")
    steps, h = 0.01 * np.random.default_rng(3).standard_normal((24, 7)), case.inputs["h"]
    q = case.inputs["start"] + np.cumsum(steps, axis=0)
    text = observed(TRACK, lambda case: {"q": q, "velocities": wrong(steps / h, h)}, [case])
    assert words in text
    assert ("velocities" in text) is bool(words)


@pytest.mark.parametrize(("linear", "angular"), [(0.4, 1.0), (1.0, -1.0), (0.0, 1.0)])
def test_the_factor_of_each_part_of_the_tool_s_velocity_is_measured(linear, angular):
    def speeds(case):
        J, twist = robot_velocity.right_equation(case.inputs)
        return np.linalg.pinv(J, 1e-6) @ (twist * np.repeat([linear, angular], 3))

    text = observed(VELOCITY, lambda case: {"velocities": speeds(case)})
    part, factor = ("linear", linear) if linear != 1.0 else ("angular", angular)
    assert f"The {part} part of the tool's velocity is {factor:.3g} times" in text
    assert text.count("times") == 1


WRONG_JACOBIANS = [
    (lambda J, case: J * np.repeat([0.5, 1.0], 3)[:, None], "0.5 in the linear parts"),
    (lambda J, case: J * (np.arange(J.shape[1]) != case.inputs["effector"]),
     "Wrong at the effector and nowhere else: parts of columns"),
    (lambda J, case: J + np.repeat([[0.0], [0.1]], 3, axis=0),
     "Wrong in angular parts and nowhere else"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "words"), WRONG_JACOBIANS)
def test_the_wrong_part_of_jacobians_is_named(change, words):
    world = robot_jacobian.CONVENTIONS["world, linear part first"]
    right = {c.name: robot_jacobian.right_jacobian(c.inputs, world) for c in cases(JACOBIAN)}
    assert words in observed(JACOBIAN, lambda case: {"jacobian": change(right[case.name], case)})


def is_of_rotated_tool(case):
    return (case.inputs["tool_rotation"] != robot_models.IDENTITY).any()


def is_of_opposite_quaternion(case):
    tool = robot_models.tool_pose(case.inputs, case.inputs["start"])
    return tool.rotations @ case.inputs["target_rotation"] < 0.0


@pytest.mark.parametrize(
    ("task", "output", "is_wrong", "words"),
    [(VELOCITY, "velocities", is_of_rotated_tool, "robots with a rotated tool (tool_rotation)"),
     (POSE, "q", is_of_opposite_quaternion, "targets whose quaternion is opposite")],
)  # fmt: skip
def test_what_all_requests_with_wrong_answers_have_is_said(task, output, is_wrong, words):
    text = observed(
        task,
        lambda case: {output: 0.1 * np.ones(len(case.inputs["axes"]))},
        findings_of=lambda case: (finding("target reached", float(is_wrong(case)), 0.5),),
    )
    assert f"Wrong for {words}" in text
    assert "and nowhere else: answers" in text
