"""Constants of a solver in place of inputs, measured from its answers."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import msgspec
import numpy as np

from ..case import Case
from ..exchange import Answer, Connection, Exchange
from ..gaps import largest_gap
from ..greeting import Fixed
from ..judgement import CaseJudgement, TaskReport, Verdict
from ..kinematics import problems
from ..kinematics.pose_laws import read_pose
from ..kinematics.predictions import solve
from ..kinematics.rounding import STALL
from ..kinematics.sweeps import PoseTrial
from ..kinematics.textbook import SOLVERS, Choices
from .examination import SAME, TRIALS, outputs_of

# Outputs about a solve; inputs without an effect on the pose may change these outputs.
CLAIMS = {"residual", "iterations", "converged"}
# Two values of an input by which right answers differ, and other inputs for both requests.
CHANGES: Mapping[str, tuple[Mapping[str, Any], Mapping[str, Any]]] = {
    "tolerance": ({"max_iterations": 100, "tolerance": 0.0}, {"tolerance": 0.1}),
    "max_iterations": ({"max_iterations": 100, "tolerance": 0.0}, {"max_iterations": 1}),
    "h": ({"h": 0.01}, {"h": 0.02}),
    "gravity": ({"gravity": np.array([0.0, -9.81, 0.0])}, {"gravity": np.array([1.0, -8.0, 3.0])}),
}
# Distances at the ends of solves are at most this share of the reach, and this distance [m].
LOOSEST, FARTHEST = 0.02, 0.1
# The largest number of counted sweeps.
MOST_SWEEPS = 200
# A constant distance ends solves at this scale too; other ends become as many times smaller.
SCALE = 0.25
# The longest step of a greeting [s].
LONGEST = 1.0
# The energies with a part of gravity.
ENERGIES = ("gravitational", "potential", "total")


class Constant(NamedTuple):
    """A number in place of an input, by which answers are judged."""

    value: Any
    is_own: bool = True  # whether answers show that it is the program's, and no other near it


def is_unread(connection: Connection, report: TaskReport, name: str) -> bool:
    """Return whether the largest requests get the same answers with two values of an input."""
    cases = [j.case for j in _unlimited(report) if not {"sweeps", "of"} & {*j.case.facts}]
    first, second = CHANGES[name]
    for case in sorted(cases, key=lambda case: -case.size)[:TRIALS]:
        outputs, other_outputs = (
            outputs_of(connection, case, {**first, **change}) for change in (first, second)
        )
        names = outputs.keys() - CLAIMS
        if not names or any(
            largest_gap(outputs[n], other_outputs.get(n, np.inf)) > SAME for n in names
        ):
            return False
    return bool(cases)


def _unlimited(report: TaskReport) -> list[CaseJudgement]:
    """Return the judgements of obligatory cases without limits of joints."""
    judgements = (j for j in report.judgements if j.case.requirement == "must")
    return [j for j in judgements if "cones" not in j.case.inputs]


def tolerance(connection: Connection, report: TaskReport) -> Constant | None:
    """Return the least round number above the distances at which solves end [m].

    The number is 0 if solves end as near as requested. None stands for ends far from most targets,
    or for sweeps of another method.
    """
    if max_iterations(connection, report) is None:
        return None
    ends = [
        (finding, judgement.case.facts)
        for judgement in _unlimited(report)
        for finding in judgement.findings
        if finding.law == "target reached"
    ]
    if all(finding.verdict is Verdict.RIGHT for finding, _ in ends):
        return Constant(0.0)
    reaches = [facts.get("frames", [facts])[0]["reach"] for _, facts in ends]
    pairs = zip([finding.error for finding, _ in ends], reaches, strict=True)
    near = [error for error, reach in pairs if 0.0 < error <= min(LOOSEST * reach, FARTHEST)]
    if len(near) < len(ends) / 2:
        return None
    smaller = _ends_of_smaller(connection, report)
    value = _round_bound(near)
    return Constant(value, bool(smaller) and _round_bound(smaller) == value)


def _round_bound(ends: Sequence[float]) -> float:
    """Return the least round number above distances."""
    power = 10.0 ** np.floor(np.log10(max(ends)))
    return next(float(f"{n * power:.1g}") for n in (1, 2, 5, 10) if n * power >= max(ends))


def _ends_of_smaller(connection: Connection, report: TaskReport) -> list[float]:
    """Return the distances at which solves of smaller skeletons end [m], () of tracks."""
    distances = []
    for case in (judgement.case for judgement in _unlimited(report)):
        if "target" not in case.inputs or "sweeps" in case.facts:
            continue
        lengths = {name: SCALE * case.inputs[name] for name in ("offsets", "target")}
        inputs = {**case.inputs, **lengths}
        outputs = outputs_of(connection, case, lengths)
        distance = read_pose(outputs, inputs, case.facts).distance
        distances += [distance] if case.facts["least"] == 0.0 and distance > 0.0 else []
    return [distance for distance in distances if distance <= FARTHEST]


def max_iterations(connection: Connection, report: TaskReport) -> Constant | None:
    """Return the number of sweeps of a solver, of other solvers the allowed number.

    None stands for sweeps of another method.
    """
    count = _sweeps(connection, report)
    if count is None and report.method.lower() in SOLVERS:
        return None
    is_own = count not in (None, MOST_SWEEPS)
    return Constant(count if is_own else problems.ALLOWED, is_own)


def _sweeps(connection: Connection, report: TaskReport) -> int | None:
    """Return the number of a textbook's sweeps in the solves of a solver, None for other sweeps.

    Targets are beyond reach, so only the number of sweeps ends a solve.
    """
    fixed = Fixed(max_iterations=1, tolerance=problems.LOOSE)
    greeting = msgspec.structs.replace(connection.greeting, fixed=fixed)
    cases = [c for c in problems.cases(greeting, "", 0, False) if "sweeps" in c.facts][:TRIALS]
    trials = [PoseTrial(_exchange(connection, report, case)) for case in cases]
    if not trials or not all(trial.pose.finite for trial in trials):
        return None
    methods = [m for m in SOLVERS if m == report.method.lower()] or SOLVERS
    gaps = [
        np.max([_gaps(trial, method, root_first) for trial in trials], axis=0)
        for method in methods
        for root_first in (False, True)
    ]
    best = min(gaps, key=np.min)
    return int(np.argmin(best)) + 1 if best.min() <= STALL["single"] else None


def _exchange(connection: Connection, report: TaskReport, case: Case) -> Exchange:
    """Return a case of inverse kinematics with the answer, of a track its first frame."""
    inputs = {**case.inputs, "method": report.method}
    if report.task == "track":
        inputs["curve"] = inputs.pop("target")[None]
    outputs = outputs_of(connection, replace(case, task=report.task, inputs=inputs), {})
    frame = 0 if report.task == "track" else slice(None)
    answer = Answer({name: outputs[name][frame] for name in outputs.keys() - CLAIMS}, 0.0)
    return Exchange(case, answer, answer)


def _gaps(trial: PoseTrial, method: str, root_first: bool) -> list[float]:
    """Return the distances from a pose to the poses after a textbook's sweeps, over the reach."""
    inputs, gaps = {**trial.case.inputs, "tolerance": 0.0, "max_iterations": 1}, []
    for _ in range(MOST_SWEEPS):
        inputs["local_rotations"], x, _ = solve(method, inputs, Choices(root_first=root_first))
        gaps.append(trial.pose.distance_to(x) / trial.case.facts["reach"])
    return gaps


def _flight(report: TaskReport) -> Case | None:
    """Return the case of a free particle, None if there is none."""
    return next((j.case for j in report.judgements if j.case.family == "flight"), None)


def gravity(connection: Connection, report: TaskReport) -> Constant | None:
    """Return the acceleration of a free particle [m/s²], or None."""
    case = _flight(report)
    if case is None:
        return None
    x, masses, h = (case.inputs.get(name, 1.0) for name in ("positions", "masses", "h"))
    at_rest = {"velocities": np.zeros_like(x)}
    outputs = outputs_of(connection, case, at_rest)
    if "forces" in outputs:
        g = outputs["forces"][0] / masses[0]
    elif "velocities" in outputs:
        g = outputs["velocities"].reshape(-1, *x.shape)[0, 0] / h
    elif "positions" in outputs:
        g = (outputs["positions"].reshape(-1, *x.shape)[0, 0] - x[0]) / h**2
    elif name := next((name for name in ENERGIES if name in outputs), None):
        lifted = (outputs_of(connection, case, at_rest | {"positions": x + e}) for e in np.eye(3))
        g = [(outputs[name] - other.get(name, np.nan)) / masses.sum() for other in lifted]
    else:
        return None
    g = np.where(np.abs(g) > 1e-6, g, 0.0)
    if not np.isfinite(g).all():
        return None
    return Constant([float(f"{component:.6g}") for component in g])


def step_length(connection: Connection, report: TaskReport) -> Constant | None:
    """Return by how much a free particle moves for 1 m/s more [s], None if answers do not tell."""
    case = _flight(report)
    if case is None:
        return None
    x = case.inputs["positions"]
    answers = [
        outputs_of(connection, case, {"velocities": np.full_like(x, speed)}) for speed in (0.0, 1.0)
    ]
    if not all("positions" in answer for answer in answers):
        return None
    ends = [answer["positions"].reshape(-1, *x.shape)[0, 0, 0] for answer in answers]
    h = float(ends[1] - ends[0])
    return Constant(float(f"{h:.6g}")) if 0.0 < h <= LONGEST else None


# How the constants in place of inputs are measured.
MEASURES: Mapping[str, Callable[[Connection, TaskReport], Constant | None]] = {
    "tolerance": tolerance, "max_iterations": max_iterations, "gravity": gravity,
    "h": step_length,
}  # fmt: skip
