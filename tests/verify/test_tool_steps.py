"""Equations of steps: three forms agree, and any damping or length of steps leads to them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from plumbob.verify.disciplines import DISCIPLINES
from plumbob.verify.exchange import Answer, Exchange
from plumbob.verify.fault_programs import coded_faults, connection_to, source_of
from plumbob.verify.greeting import PROTOCOL, Greeting
from plumbob.verify.kinematics import robot_targets
from plumbob.verify.kinematics.robot_motions import STEPS
from plumbob.verify.kinematics.robot_motions import TASK as TRACK
from plumbob.verify.kinematics.robot_targets import TASK
from plumbob.verify.one_line.search import changed_lines, with_changed_line
from plumbob.verify.one_line.tool_steps import nearest_step, views

GREETING = Greeting(PROTOCOL, (TASK,))
FORMS = ("tool step", "tool step by matrices", "tool step by screws")
ITERATIONS = 30


@cache
def cases():
    """Return near targets and single iterations of robots that can move freely."""
    return [
        replace(case, inputs={**case.inputs, "max_iterations": min(
            case.inputs["max_iterations"], ITERATIONS)})
        for case in robot_targets.cases(GREETING, "", 0, False)
        if case.family in (robot_targets.CLOSE, robot_targets.STEP)
        and len(case.inputs["axes"]) >= 6
    ]  # fmt: skip


def equation(source):
    names = {}
    exec(source, names)
    return names["tool_step"]


def solve(step, inputs, damping, gain):
    """Return the coordinates of another solver of an equation, with its own damping and gain."""
    inputs = dict(inputs)
    q, lower, upper = (np.array(inputs.pop(name)) for name in ("start", "lower", "upper"))
    for _ in range(inputs["max_iterations"]):
        J, e = step(q, **inputs)
        if np.linalg.norm(e) <= 0.5 * inputs["tolerance_rotation"]:
            break
        change = gain * J.T @ np.linalg.solve(J @ J.T + damping * np.eye(6), e)
        q = np.clip(q + change, lower, upper)
    return q


def report_of(source, damping=1e-4, gain=0.9):
    step, exchanges = equation(source), []
    for case in cases():
        answer = Answer({"q": solve(step, case.inputs, damping, gain)}, 0.0)
        exchanges.append(Exchange(case, answer, answer))
    return replace(DISCIPLINES[TASK].judge(exchanges, GREETING, ""), exchanges=exchanges,
                   greeting=GREETING)  # fmt: skip


@pytest.mark.parametrize("damping", [1e-8, 1e-3, 1.0, 300.0])
def test_steps_of_any_damping_and_length_are_near_their_equation(damping):
    rng = np.random.default_rng(5)
    for _ in range(20):
        J, e = rng.standard_normal((6, 7)), rng.standard_normal(6)
        step = 0.3 * J.T @ np.linalg.solve(J @ J.T + damping * np.eye(6), e)
        direction = step / np.linalg.norm(step)
        np.testing.assert_allclose(nearest_step(J, e, step), direction, atol=1e-3)
        other = nearest_step(J, rng.standard_normal(6), step)
        assert np.abs(other - direction).max() > 0.01


@pytest.mark.parametrize("form", FORMS)
def test_each_form_leads_to_the_target_and_nothing_is_named_in_its_steps(form):
    report = report_of(source_of(form), 1e-8, 1.0)
    assert not [j for j in report.judgements if j.verdict.name == "WRONG"]
    steps, ends = views(report)
    assert changed_lines(steps, GREETING) == changed_lines(ends, GREETING) == ()


@pytest.mark.parametrize("number", ["016", "017", "053", "082"])
def test_known_faults_are_named_whatever_the_damping_of_the_solver_is(number):
    """The faults are planted in the form that has their lines."""
    fault = coded_faults()[f"PB-ROBOT-{number}"]
    form = next(f for f in FORMS if all(source_of(f).count(a) == 1 for a, _ in fault.lines))
    report = report_of(fault.planted_in(source_of(form)))
    (explanation, *_) = with_changed_line(report, GREETING).diagnosis.explanations
    assert fault.code in explanation.codes


def test_nothing_is_named_where_right_steps_are_clamped_and_some_solves_do_not_move():
    report = report_of(source_of("tool step"), 1e-3, 1.0)
    exchanges = [
        replace(exchange, answer=Answer({"q": exchange.case.inputs["start"]}, 0.0))
        if exchange.case.family == robot_targets.CLOSE else exchange
        for exchange in report.exchanges
    ]  # fmt: skip
    report = replace(DISCIPLINES[TASK].judge(exchanges, GREETING, ""), exchanges=exchanges,
                     greeting=GREETING)  # fmt: skip
    assert report.verdict.name == "WRONG"
    assert with_changed_line(report, GREETING).diagnosis.explanations == ()


def test_frames_of_motions_are_poses_too():
    case = next(c for c in DISCIPLINES[TRACK].cases(Greeting(PROTOCOL, (TRACK,)), "", 0, False))
    q = np.tile(case.inputs["start"], (len(case.inputs["target_positions"]), 1)) + 0.1
    exchange = Exchange(case, Answer({"q": q}, 0.0), Answer({"q": q}, 0.0))
    report = DISCIPLINES[TRACK].judge([exchange], GREETING, "")
    (ends,) = views(report)
    assert [np.shape(j.case.inputs["target_position"]) for j in ends.judgements] == [(3,)] * 3


def test_a_known_fault_of_whole_motions_is_named():
    connection = connection_to(coded_faults()["PB-ROBOT-091"].wrong_program)
    motions = DISCIPLINES[TRACK].cases(connection.greeting, "", 0, False)
    exchanges = []
    for case in [case for case in motions if case.family == STEPS]:
        answer = connection.answer(case)
        exchanges.append(Exchange(case, answer, answer))
    report = replace(DISCIPLINES[TRACK].judge(exchanges, connection.greeting, ""),
                     exchanges=exchanges, greeting=connection.greeting)  # fmt: skip
    (explanation, *_) = with_changed_line(report, connection.greeting).diagnosis.explanations
    assert explanation.codes == ("PB-ROBOT-091",)
