"""Inputs on which right answers depend and the answers of a solver do not."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics
from plumbob.text.sentence import sentence

from ..case import Case
from ..exchange import Answer, Connection, is_hung
from ..gaps import difference
from ..greeting import Greeting
from ..kinematics.pose_laws import read_pose
from ..kinematics.predictions import solve
from ..kinematics.robot_models import urdf
from ..kinematics.textbook import SOLVERS
from ..mass_spring.problem import all_forces, problem_of
from .separation import MIN_CASES, Statement

# The requests in which each input is changed alone.
REQUESTS = 3
# Answers within this share of each other are the same. Right answers within DIFFERENT of each other
# do not tell whether an input is read.
SAME, DIFFERENT = 1e-10, 1e-4
# Inputs for the number of joints and springs: other numbers are another problem.
STRUCTURE = ("parents", "springs", "pinned", "method", "effector", "steps", "tension_only")
# The declarations of steps without a need of dampings.
DAMPERS = (None, "none", "global_factor")
# A solve with an early end by a tolerance of LOOSE [m], and with further sweeps otherwise.
TIGHT, LOOSE, SWEEPS, FEW_SWEEPS = 1e-6, 0.3, 60, 2
# The inputs of robots with an effect on all right answers, and the requests and frames for a proof.
ROBOT_INPUTS = {
    "robot_jacobian": ("origins", "orientations", "axes", "tool_position", "q"),
    "robot_velocity": ("origins", "orientations", "axes", "tool_position", "q",
                       "linear_velocity", "angular_velocity"),
    "robot_inverse_kinematics": ("origins", "orientations", "axes", "tool_position",
                                 "tool_rotation", "target_position", "target_rotation"),
    "robot_track": ("origins", "orientations", "axes", "tool_position", "tool_rotation",
                    "target_positions", "target_rotations"),
}  # fmt: skip
ROBOT_FAMILIES, FRAMES = ("any configuration", "any pose", "near start", "curve"), 3
DIRECTIONS = ("rotation", "rotations", "orientations", "axes")
# Outputs about a solve by inputs without an effect on the pose.
CLAIMS = {"residual", "iterations", "converged"}


def unread_inputs(
    connection: Connection, cases: Sequence[Case], greeting: Greeting, method: str
) -> list[str]:
    """Return the inputs without an effect on answers, where enough right answers change."""
    counts: dict[str, list[bool]] = {}
    for case in _telling(cases):
        before = connection.answer(case)
        if not isinstance(before, Answer):
            continue
        for name, changed in _changes(case, greeting):
            # a solve without arrival does not show its tolerance
            is_hidden = name == "tolerance" and not _arrives(case, before)
            if is_hidden or not _matters(case, changed, method):
                continue
            answer = connection.answer(replace(case, inputs=changed))
            if is_hung(answer):
                return []
            is_same = isinstance(answer, Answer) and _are_same(before, answer)
            counts.setdefault(name, []).append(is_same)
    return [name for name, same in counts.items() if len(same) >= MIN_CASES and all(same)]


def statement_of(names: Sequence[str]) -> Statement:
    """Return the words about unread inputs."""
    words = sentence(
        "The answers do not depend on {inputs}, on which right answers do: each was changed alone "
        "in {count} requests.",
        inputs=", ".join(names),
        count=REQUESTS,
    )
    return Statement(0.0, words, is_exact=True)


def _telling(cases: Sequence[Case]) -> list[Case]:
    """Return small requests of several joints or springs, without special numbers."""
    if cases[0].task == "inverse_kinematics":
        whole = {"tolerance": TIGHT, "max_iterations": SWEEPS}
        easy = [
            case for case in cases if case.family == "chain of 4" or case.family == "chain of 7"
        ]
        easy += [case for case in cases if case.family.startswith("one sweep")]
        return [replace(case, inputs={**case.inputs, **whole}) for case in easy[:REQUESTS]]
    if cases[0].task in ROBOT_INPUTS:
        suitable = [c for c in cases if c.family in ROBOT_FAMILIES and "rotated frames" in c.name]
        return [_shortened(case) for case in suitable[:REQUESTS]]
    families = ("three joints", "several springs", "gravity", "pins", "random", "dampers")
    suitable = [case for case in cases if case.family in families]
    return sorted(suitable, key=lambda case: -case.size)[:REQUESTS]


def _shortened(case: Case) -> Case:
    """Return a motion's first frames, or another request unchanged."""
    frames = {name: value[:FRAMES] for name, value in case.inputs.items()
              if name.startswith("target") and case.task == "robot_track"}  # fmt: skip
    return replace(case, inputs={**case.inputs, **frames})


def _changes(case: Case, greeting: Greeting) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield an input beside the solver's constants, and the inputs with another value."""
    rng = np.random.default_rng(3)
    for name, value in case.inputs.items():
        if case.task in ROBOT_INPUTS and name not in ROBOT_INPUTS[case.task]:
            continue
        if name in STRUCTURE or _is_optional(name, case, greeting) or not _is_telling(name, value):
            continue
        if name == "max_iterations":
            new: Any = FEW_SWEEPS
        elif name == "tolerance":
            new = LOOSE
        elif name.endswith(DIRECTIONS):
            new = np.array(value) + 0.2 * rng.standard_normal(np.shape(value))
            new /= np.linalg.norm(new, axis=-1, keepdims=True)
        else:  # one factor for all, which solvers of one mass or stiffness take
            new = np.asarray(value) * rng.uniform(1.05, 1.3)
            new = float(new) if np.ndim(value) == 0 else new
        changed = {**case.inputs, name: new}
        yield name, changed | {"urdf": urdf(changed)} if "urdf" in changed else changed


def _is_optional(name: str, case: Case, greeting: Greeting) -> bool:
    """Return whether a right solver of this greeting need not read an input."""
    return (
        getattr(greeting.fixed, name, None) is not None
        or (name == "dampings" and "h" in case.inputs and greeting.step.damper in DAMPERS)
        or (name == "rest_lengths" and greeting.system.rest_lengths == "measured")
        or (name == "velocities" and greeting.system.state == "previous_positions")
        or (name == "local_rotations" and not greeting.rotations)
    )


def _is_telling(name: str, value: Any) -> bool:
    """Return whether another value of an input changes right answers: zeros times 2 are zeros."""
    return bool(np.any(value)) or name in ("tolerance", "velocities")


def _matters(case: Case, changed: Mapping[str, Any], method: str) -> bool:
    """Return whether right answers differ with the change."""
    if case.task not in _RIGHT:  # of steps each number matters, whatever the method
        return True
    changed_case = replace(case, inputs=changed)
    return difference(right_answer(case, method), right_answer(changed_case, method)) > DIFFERENT


def right_answer(case: Case, method: str) -> Mapping[str, Any]:
    """Return the right answer to a case of kinematics or forces."""
    return _RIGHT[case.task](case.inputs, method)


def _arrives(case: Case, answer: Answer) -> bool:
    """Return whether a loose tolerance would end a solve at the pose, near its target."""
    pose = read_pose(answer.values, case.inputs, case.facts)
    return pose.distance <= LOOSE


def _are_same(first: Answer, second: Answer) -> bool:
    names = (first.values.keys() & second.values.keys()) - CLAIMS
    values, repeats = ({name: answer.values[name] for name in names} for answer in (first, second))
    return bool(names) and difference(values, repeats) <= SAME


def _forward(inputs: Mapping[str, Any], method: str) -> Mapping[str, Any]:
    skeleton = Skeleton(inputs["parents"], inputs["offsets"])
    return forward_kinematics(skeleton, inputs["local_rotations"])._asdict()


def _inverse(inputs: Mapping[str, Any], method: str) -> Mapping[str, Any]:
    local, positions, _ = solve(method if method in SOLVERS else "ccd", inputs)
    return {"local_rotations": local, "positions": positions}


def _forces(inputs: Mapping[str, Any], method: str) -> Mapping[str, Any]:
    return {"forces": all_forces(problem_of(inputs))}


_RIGHT: Mapping[str, Callable[[Mapping[str, Any], str], Mapping[str, Any]]] = {
    "forward_kinematics": _forward,
    "inverse_kinematics": _inverse,
    "mass_spring_forces": _forces,
}
