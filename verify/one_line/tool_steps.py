"""Answers about robots as equations J dq = e of a tool's step, whatever their damping and length.

Solvers of the same equations give different coordinates: each solver damps and shortens steps in a
way of its own. A single iteration of any solver shows its J and e nevertheless, and at the end of a
solve e is zero.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..case import Case
from ..exchange import Answer
from ..judgement import CaseJudgement, TaskReport
from ..kinematics.robot_motions import TASK as TRACK
from ..kinematics.robot_targets import LIMIT_STEP, TOLERANCE
from ..kinematics.robot_targets import TASK as INVERSE
from ..kinematics.trajectories import trajectory_of
from ..laws import finding
from .mutants import Program

SOLVES, MOTIONS = (INVERSE, TRACK), TRACK
# The task of the right programs of J and e, which no solver is asked.
TASK = "tool_step"
# Directions of steps agree to this: dampings between the tried dampings leave less.
SAME_STEP = 3e-3
# Fewer joints than this reach no pose in other kinematics, and any damping fits their steps.
MIN_JOINTS = 6
# How many motions are compared.
MAX_MOTIONS = 6
# Steps shorter than this are rounding [rad, m], and joints as near to a limit are at the limit.
SHORTEST = 1e-6
# A solver has reached targets within so many tolerances, by a test of its own.
LENIENT = 10.0
# How far from its answer a solver is not at its target [rad, m].
ELSEWHERE = 0.3
# Squared dampings [m^2], and the ratios by which the best damping is refined twice.
DAMPINGS = np.geomspace(1e-9, 1e4, 53)
REFINEMENTS = (np.geomspace(0.57, 1.77, 25), np.geomspace(0.95, 1.05, 25))
# No further program is changed after so many changes, by task: programs of steps take a
# millisecond.
MAX_MUTANTS = {TASK: 3_000, "robot_jacobian": 14_000, "robot_velocity": 14_000}
# Fewer answers would be met by many changes by chance.
MIN_VIEW = 3
# Of a motion this many frames, spread evenly, tell enough.
MAX_FRAMES = 3


def views(report: TaskReport) -> Iterator[TaskReport]:
    """Yield reports on the same answers as single steps, and as coordinates on their targets."""
    if report.task not in SOLVES:
        return
    poses = [pose for judgement in report.judgements for pose in _poses(judgement)]
    steps = [_as_step(pose) for pose in poses if _is_step(pose)]
    ends = [_as_end(pose) for pose in poses if _is_end(pose)]
    for judgements in (steps, ends):
        if len(judgements) >= MIN_VIEW:
            yield replace(report, task=TASK, judgements=judgements)


def _poses(judgement: CaseJudgement) -> Iterator[CaseJudgement]:
    """Yield the answer to a single target, or some frames of a motion as single answers."""
    case, answer = judgement.case, judgement.answer
    if not isinstance(answer, Answer) or not np.isfinite(answer.values.get("q", np.nan)).all():
        return
    if len(case.inputs["axes"]) < MIN_JOINTS or case.family in (LIMIT_STEP, TOLERANCE):
        return
    if case.task == INVERSE:
        yield judgement
        return
    q = answer.values["q"]
    previous = np.concatenate([case.inputs["start"][None], q[:-1]])
    for i in np.unique(np.linspace(0, len(q) - 1, MAX_FRAMES).astype(int)):
        inputs = {**case.inputs, "start": previous[i]}
        inputs |= {f"target_{name}": case.inputs[f"target_{name}s"][i]
                   for name in ("position", "rotation")}  # fmt: skip
        frame = replace(case, name=f"{case.name}, frame {i}", inputs=inputs)
        yield replace(judgement, case=frame, answer=Answer({"q": q[i]}, 0.0))


def _is_step(pose: CaseJudgement) -> bool:
    """Return whether an answer is a single iteration away from limits."""
    assert isinstance(pose.answer, Answer)
    inputs, q = pose.case.inputs, pose.answer.values["q"]
    is_free = (q < inputs["upper"] - SHORTEST) & (q > inputs["lower"] + SHORTEST)
    is_moved = np.abs(q - inputs["start"]).max() > SHORTEST
    return bool(inputs["max_iterations"] == 1 and is_free.all() and is_moved)


def _is_end(pose: CaseJudgement) -> bool:
    """Return whether an answer is a whole solve for a target in reach."""
    return bool(pose.case.inputs["max_iterations"] > 1 and np.all(pose.case.facts["reachable"]))


def _as_step(pose: CaseJudgement) -> CaseJudgement:
    """Return a single iteration as the direction of its step."""
    assert isinstance(pose.answer, Answer)
    start = pose.case.inputs["start"]
    step = pose.answer.values["q"] - start
    direction = step / np.linalg.norm(step)
    inputs = {**pose.case.inputs, "q": start}
    case = replace(pose.case, task=TASK, inputs=inputs, facts={"step": step})
    motion = trajectory_of(pose.case, pose.answer.values)
    (J,), (e,) = motion.jacobians, motion.twists(motion.previous)
    gap = float(np.abs(nearest_step(J, e, step) - direction).max())
    findings = (finding("target reached", gap, SAME_STEP),)
    return replace(pose, case=case, answer=Answer({"step": direction}, 0.0), findings=findings)


def _as_end(pose: CaseJudgement) -> CaseJudgement:
    """Return an answer as coordinates on a solver's target, off target elsewhere."""
    assert isinstance(pose.answer, Answer)
    inputs = {**pose.case.inputs, "q": pose.answer.values["q"]}
    case = replace(pose.case, task=TASK, inputs=inputs, facts={})
    return replace(pose, case=case, answer=Answer({"is_reached": np.ones(2)}, 0.0))


def answer_of(program: Program, case: Case) -> Mapping[str, Any]:
    """Return what the equations of a program make of an answer; raise ArithmeticError if nothing.

    These are the nearest step by its equations, or whether the program is on its target at the
    answer, and off target in both parts elsewhere.
    """
    inputs = dict(case.inputs)
    q = inputs.pop("q")
    equation = program.names[TASK]
    try:
        if "step" in case.facts:
            J, e = equation(q, **inputs)
            return {"step": nearest_step(J, e, case.facts["step"])}
        other = q + ELSEWHERE * np.cos(np.arange(len(q)))
        errors = [equation(at, **inputs)[1] for at in (q, other)]
    except Exception as error:  # of a changed program any may come
        raise ArithmeticError from error
    bound = LENIENT * max(inputs["tolerance"], inputs["tolerance_rotation"])
    here, there = (np.linalg.norm(np.reshape(e, (2, 3)), axis=1) <= bound for e in errors)
    # who leaves a part of the error out is at its target wherever that part leads
    return {"is_reached": np.array([here.all(), ~there.any()], dtype=float)}


def nearest_step(J: FloatArray, e: FloatArray, step: FloatArray) -> FloatArray:
    """Return the direction of the damped step J' (J J' + d 1)^-1 e nearest to another step's."""
    values, U = np.linalg.eigh(J @ J.T)
    V, parts = U.T @ J, U.T @ e
    direction, dampings = step / np.linalg.norm(step), DAMPINGS
    for ratios in (*REFINEMENTS, None):
        steps = (parts / (np.maximum(values, 0.0) + dampings[:, None])) @ V
        steps /= np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), 1e-300)
        best = int(np.argmax(steps @ direction))
        dampings = dampings[best] * (ratios if ratios is not None else np.ones(1))
    return np.asarray(steps[best])
