"""Find constants that a solver has in place of inputs, and measure them from its answers."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np

from .case import Case
from .contestant import Answer, Contestant
from .explain import largest_gap
from .greeting import Fixed
from .judgement import TaskReport, Verdict
from .kinematics import problems
from .kinematics.pose_laws import read_pose
from .kinematics.predictions import solve
from .kinematics.rounding import STALL
from .kinematics.switches import Switches
from .mass_spring.cases import GRAVITY
from .task import TASKS

# The requests in which an input is changed; all answers must stay the same.
TRIALS = 3
# Answers that differ by less are the same, in any unit.
SAME = 1e-12
# What a program may claim of a solve by an input that does not change its pose.
CLAIMS = ("residual", "iterations", "converged")
# The inputs that are changed, each from one value to another; the others are plain.
CHANGES: Mapping[str, tuple[Any, Any]] = {
    "tolerance": (0.0, 0.1),
    "max_iterations": (100, 1),
    "gravity": (GRAVITY, GRAVITY + [1.0, -2.0, 3.0]),
}
SOLVING = ("inverse_kinematics", "track")
PLAIN = {"tolerance": 0.0, "max_iterations": 100}
# A distance that ends solves is no larger than this share of the reach.
LOOSEST = 0.02
# The most sweeps that are counted, and the orders of joints in them.
MOST_SWEEPS, ORDERS = 200, (0, 1)


def measured(contestant: Contestant, report: TaskReport) -> dict[str, Any]:
    """Return the constants, by the names of inputs, that answers do not depend on.

    A number of iterations that does not show is None.
    """
    names = [field.name for field in TASKS[report.task].inputs]
    constants: dict[str, Any] = {}
    if report.task in SOLVING:
        if _is_unread(contestant, report, "tolerance"):
            tolerance = _tolerance(report)
            constants |= {} if tolerance is None else {"tolerance": tolerance}
        if _is_unread(contestant, report, "max_iterations"):
            count = _sweeps(contestant, report, constants.get("tolerance", 0.0))
            constants["max_iterations"] = count or _claimed_iterations(report)
    elif "gravity" in names and _is_unread(contestant, report, "gravity"):
        gravity = _gravity(contestant, report)
        constants |= {} if gravity is None else {"gravity": gravity}
    return constants


def _is_unread(contestant: Contestant, report: TaskReport, name: str) -> bool:
    """Return whether the largest requests get the same answers with two values of an input."""
    cases = [
        case
        for case in (judgement.case for judgement in report.judgements)
        if case.requirement == "must" and not {"sweeps", "like"} & {*case.facts}
        if "cones" not in case.inputs and not case.follows
    ]
    for case in sorted(cases, key=lambda case: -case.size)[:TRIALS]:
        plain = PLAIN if report.task in SOLVING else {}
        first, second = (
            contestant.answer(replace(case, inputs={**case.inputs, **plain, name: value}))
            for value in CHANGES[name]
        )
        if not (isinstance(first, Answer) and isinstance(second, Answer)):
            return False
        outputs = first.values.keys() - CLAIMS
        if not outputs or any(
            largest_gap(first.values[output], second.values.get(output, np.inf)) > SAME
            for output in outputs
        ):
            return False
    return bool(cases)


def _tolerance(report: TaskReport) -> float | None:
    """Return the least round number above the distances at which solves end [m].

    It is 0 if they end as near as they are asked to, None if most end far from their targets.
    """
    ends = [
        (finding.error, finding.verdict, judgement.case.facts)
        for judgement in report.judgements
        if judgement.case.requirement == "must" and "cones" not in judgement.case.inputs
        for finding in judgement.findings
        if finding.law == "target reached"
    ]
    if all(verdict is Verdict.RIGHT for _, verdict, _ in ends):
        return 0.0
    near = [e for e, _, facts in ends if e <= LOOSEST * facts.get("frames", [facts])[0]["reach"]]
    if len(near) < len(ends) / 2:
        return None
    power = 10.0 ** np.floor(np.log10(max(near)))
    return next(float(f"{n * power:.1g}") for n in (1, 2, 5, 10) if n * power >= max(near))


def _claimed_iterations(report: TaskReport) -> int | None:
    """Return the largest number of iterations that answers claim, None if they claim none."""
    answers = (j.answer.values for j in report.judgements if isinstance(j.answer, Answer))
    return max((int(values["iterations"]) for values in answers if "iterations" in values),
               default=0) or None  # fmt: skip


def _sweeps(contestant: Contestant, report: TaskReport, tolerance: float) -> int | None:
    """Return the number of a textbook's sweeps after which answers stand, None if none do.

    Targets are beyond reach, so that nothing else ends a solve.
    """
    fixed = Fixed(max_iterations=1, tolerance=tolerance)
    greeting = msgspec.structs.replace(contestant.greeting, fixed=fixed)
    cases = [c for c in problems.cases(greeting, "", 0, False) if "sweeps" in c.facts][:TRIALS:2]
    answers = [_end(contestant, report, case) for case in cases]
    if not cases or any(x is None for x in answers):
        return None
    named = [method for method in problems.SOLVERS if report.method.lower() in ("", method)]
    gaps = {
        (method, order): np.max([
            [np.abs(x - y).max() / case.facts["reach"] for y in _followed(method, order, case)]
            for case, x in zip(cases, answers, strict=True)
        ], axis=0)
        for method in named for order in ORDERS
    }  # fmt: skip
    best = min(gaps.values(), key=np.min, default=np.array([np.inf]))
    return int(np.argmin(best)) + 1 if best.min() <= STALL["single"] else None


def _end(contestant: Contestant, report: TaskReport, case: Case) -> Any:
    """Return where a solve leaves the joints of the path [m], None if it fails."""
    inputs = {**case.inputs, "method": report.method}
    if report.task == "track":
        inputs["curve"] = inputs["target"][None]
    answer = contestant.answer(replace(case, task=report.task, inputs=inputs))
    if not isinstance(answer, Answer):
        return None
    frame = 0 if report.task == "track" else slice(None)
    outputs = {name: x[frame] for name, x in answer.values.items() if name not in CLAIMS}
    pose = read_pose(outputs, case.inputs, case.facts)
    return pose.positions[pose.path] if pose.finite else None


def _followed(method: str, order: int, case: Case) -> Iterator[Any]:
    """Yield where each of a textbook's sweeps leaves the joints of the path [m]."""
    inputs = {**case.inputs, "tolerance": 0.0, "max_iterations": 1}
    for _ in range(MOST_SWEEPS):
        inputs["local_rotations"], x, _ = solve(method, inputs, Switches(order=order))
        yield x[case.facts["path"]]


def _gravity(contestant: Contestant, report: TaskReport) -> list[float] | None:
    """Return the acceleration of a free particle [m/s²], None if answers do not tell it."""
    case = next(j.case for j in report.judgements if j.case.family == "flight")
    inputs = {**case.inputs, "velocities": np.zeros_like(case.inputs["velocities"])}
    shifts = np.vstack([np.zeros(3), np.eye(3)]) if report.task == "energy" else np.zeros((1, 3))
    answers = [
        contestant.answer(replace(case, inputs={**inputs, "positions": inputs["positions"] + s}))
        for s in shifts
    ]
    values = [answer.values for answer in answers if isinstance(answer, Answer)]
    if len(values) < len(answers):
        return None
    masses, h, last = inputs["masses"], inputs.get("h", 1.0), values[0]
    if "forces" in last:
        g = last["forces"][0] / masses[0]
    elif name := next((n for n in ("gravitational", "potential", "total") if n in last), None):
        g = (last[name] - np.array([v[name] for v in values[1:]])) / masses.sum()
    elif "velocities" in last:
        g = last["velocities"].reshape(-1, len(masses), 3)[0, 0] / h
    elif "positions" in last:
        x = last["positions"].reshape(-1, len(masses), 3)[0, 0]
        g = (x - inputs["positions"][0]) / h**2
    else:
        return None
    return [float(f"{component:.6g}") if abs(component) > 1e-6 else 0.0 for component in g]
