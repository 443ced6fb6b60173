"""The requests whose answers tell changes apart, and the keys of answers.

The requests are the same for every seed and solver. Their directions are generic: none is straight,
opposite to another or with equal components, where honest programs branch differently.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray, IndexArray
from plumbob.text.sentence import sentence

from ..case import Case
from ..greeting import Greeting
from ..kinematics.problems import facts
from ..kinematics.skeletons import suits
from ..mass_spring.cases import ONE_MASS, UNDAMPED

FK, IK = "forward_kinematics", "inverse_kinematics"
FORCES, ENERGY, STEP = "mass_spring_forces", "energy", "mass_spring_step"
OF_SPRINGS = (FORCES, ENERGY, STEP)
# The tasks and methods with a dictionary.
TASKS = ((FK, ""), (IK, "ccd"), (IK, "fabrik"), (FORCES, ""), (ENERGY, ""), (STEP, ""))
ABOUT = sentence("a request that tells mistakes apart; no part of the verdict")
# Parents, effector and target of each: a tree with an inner effector, a chain, one in a plane.
TREE = ([-1, 0, 1, 1, 3, 4], 4, (1.4, -1.0, -1.4))
CHAIN = ([-1, 0, 1, 2], 3, (-0.7, 1.1, 1.6))
IN_PLANE = ([-1, 0, 1, 2], 3, (-0.6, -0.2, 0.0))
# For solvers of positions alone: without rotations, in a plane as well.
AT_REST = ([-1, 0, 1, 2], 3, (-0.5, -0.4, 0.0))
# With tolerance and number of sweeps: single sweeps, then solves that end by either of them. CCD
# needs 12 sweeps to the tolerance, FABRIK 10: most round distances end them elsewhere.
PROBLEMS = (
    (*TREE, 0.0, 1), (*CHAIN, 0.0, 1), (*IN_PLANE, 0.0, 1), (*TREE, 0.0, 3),
    (*CHAIN[:2], (-1.1, -0.6, 0.3), 4e-3, 16), (*AT_REST, 0.0, 1),
)  # fmt: skip
# A triangle with a tail; every spring has numbers of its own.
SPRINGS = np.array([[0, 1], [2, 0], [1, 2], [2, 3]])
# What is zero in each request of a mass-spring system: the first three show springs, gravity and
# motion alone, so that a mistake in one hides none in another; the last shows all of them.
ZEROS = (
    ("dampings", "gravity", "velocities"),
    ("stiffnesses", "dampings", "velocities"),
    ("stiffnesses", "gravity"),
    (),
)
# A step's pins show beside dampers of any kind: without them.
PINNED, UNDAMPED_PINS = [0, 3], ("dampings",)
# Steps are short enough for ten local/global iterations to converge, so that the number of
# iterations hides no mistake. Plain requests have the step that many solvers keep [s].
H, PLAIN_H = 0.13, 1.0 / 60.0
# The outputs that have keys, in their order: what poses have, and what the path has alone.
OUTPUTS = {
    FK: ("positions", "rotations"),
    IK: ("local_rotations", "path"),
    FORCES: ("forces",),
    ENERGY: ("total", "kinetic", "potential", "elastic", "gravitational"),
    STEP: ("positions", "velocities"),
}
# Keys beyond this come from divisions by nearly zero.
LARGEST = 1e6
# A size below which answers are compared absolutely.
SMALLEST = 1e-12


def requests(task: str, method: str) -> list[Case]:
    """Return the requests of a task and a method: of poses those alone that differ in the start."""
    if task in OF_SPRINGS:
        return _spring_requests(task)
    cases = []
    for number, problem in enumerate(PROBLEMS if task == IK else PROBLEMS[:3]):
        parents, effector, target, tolerance, sweeps = problem
        joints, start = len(parents), 7 * (number % 3)
        offsets = fractions(3 * joints, start + 1).reshape(joints, 3)
        rotations = fractions(4 * joints, start + 3).reshape(joints, 4)
        if target[2] == 0.0:
            offsets, rotations = offsets * [1, 1, 0], rotations * [1, 0, 0, 1]
        if problem[:3] == AT_REST:
            rotations = np.eye(4)[[0] * joints]
        inputs: dict[str, Any] = {
            "parents": np.array(parents),
            "offsets": offsets,
            "local_rotations": rotations / np.linalg.norm(rotations, axis=1, keepdims=True),
        }
        if task == IK:
            inputs |= {"target": np.array(target), "effector": effector, "method": method}
            inputs |= {"tolerance": tolerance, "max_iterations": sweeps}
        about = facts(inputs) if task == IK else {}
        cases.append(Case(f"telling {number + 1}", task, inputs, "telling", ABOUT, facts=about))
    return cases


def is_solve(case: Case) -> bool:
    """Return whether a request is of more than a single sweep."""
    return bool(case.inputs.get("max_iterations", 1) > 1)


def _spring_requests(task: str) -> list[Case]:
    """Return the requests of a task of mass-spring systems, those with plain numbers last."""
    systems = [_system(zeros) for zeros in ZEROS]
    if task == STEP:
        pins = np.array(PINNED)
        systems = [{**system, "pinned": pins[:0], "h": H} for system in systems]
        systems.append({**_system(UNDAMPED_PINS), "pinned": pins, "h": H})
        for system in systems:  # free or not, these particles are at rest
            system["velocities"] = _at_rest(system["velocities"], pins)
        pin = np.array([1])
        systems.append({**_plain_system(0.0), "pinned": pin[:0], "h": PLAIN_H})
        systems.append({**_plain_system(0.7), "pinned": pin, "h": PLAIN_H})
        systems[-1]["velocities"] = _at_rest(systems[-1]["velocities"], pin)
    else:
        systems.append(_plain_system(0.7))
    return [
        Case(f"telling {number}", task, system, "telling", ABOUT)
        for number, system in enumerate(systems, 1)
    ]


def _at_rest(velocities: FloatArray, particles: IndexArray) -> FloatArray:
    """Return velocities that are zero for some particles."""
    is_moving = ~np.isin(np.arange(len(velocities)), particles)
    return np.where(is_moving[:, None], velocities, 0.0)


def _system(zeros: Sequence[str]) -> dict[str, Any]:
    """Return a mass-spring system in which some inputs are zero."""
    count, springs = 1 + int(SPRINGS.max()), SPRINGS.copy()
    x = fractions(3 * count, 31).reshape(count, 3)
    lengths = np.linalg.norm(np.diff(x[springs], axis=1)[:, 0], axis=1)
    inputs: dict[str, Any] = {
        "masses": 1.5 + fractions(count, 32),
        "springs": springs,
        # half of the springs are stretched, and half are compressed
        "rest_lengths": lengths * (1.0 + 0.3 * np.array([1, -1, -1, 1]) * (1.5 + fractions(4, 33))),
        "stiffnesses": 3.0 + 2.0 * fractions(4, 34),
        "dampings": 1.5 + fractions(4, 35),
        "gravity": np.array([1.1, -2.3, 0.7]),
        "positions": x,
        "velocities": fractions(3 * count, 36).reshape(count, 3),
    }
    return inputs | {name: 0.0 * inputs[name] for name in zeros}


def _plain_system(damping: float) -> dict[str, Any]:
    """Return a system in a plane with equal numbers, for solvers that take no others."""
    rest = 0.8 * np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0], [-0.1, 0.75**0.5 + 0.8, 0]])
    return {
        "masses": np.full(4, ONE_MASS),
        "springs": SPRINGS.copy(),
        "rest_lengths": np.full(4, 0.8),
        "stiffnesses": np.full(4, 90.0),
        "dampings": np.full(4, damping),
        "gravity": np.array([0.0, -9.81, 0.0]),
        "positions": rest + 0.1 * fractions(12, 37).reshape(4, 3) * [1, 1, 0] + [0.3, 1.1, 0.0],
        "velocities": fractions(12, 38).reshape(4, 3) * [1, 1, 0],
        "rest_positions": rest,
    }


def suitable(case: Case, greeting: Greeting) -> bool:
    """Return whether a solver takes a request: any numbers, or free joints in space or a plane."""
    if case.task in OF_SPRINGS:
        return _suits_springs(case, greeting)
    is_planar = not case.inputs["offsets"][:, 2].any()
    is_at_rest = bool((case.inputs["local_rotations"][:, 0] == 1.0).all())
    is_free = greeting.rotations is not is_at_rest and not greeting.limits
    is_free &= greeting.planar is is_planar or is_at_rest
    is_ended = greeting.fixed.tolerance is None or not case.inputs.get("tolerance")
    return (
        is_free
        and is_ended
        and suits(case.inputs["parents"], greeting, case.inputs.get("effector"))
    )


def _suits_springs(case: Case, greeting: Greeting) -> bool:
    """Return whether a solver takes the numbers of a mass-spring system."""
    system, fixed, inputs = greeting.system, greeting.fixed, case.inputs
    numbers = {system.masses, system.stiffnesses, system.dampings, system.rest_lengths}
    takes_all = numbers == {"each", "given"} and system.gravity == "vector"
    is_in_plane = not inputs["positions"][:, 2].any()
    is_damped = case.task != ENERGY and bool(inputs["dampings"].any())
    return (
        (is_in_plane or not greeting.planar)
        and (is_in_plane or takes_all)
        and (system.pinned or not len(inputs.get("pinned", ())))
        and not (is_damped and greeting.step.damper in UNDAMPED)
        and not system.continues
        and (fixed.gravity is None or np.array_equal(fixed.gravity, inputs["gravity"]))
        and fixed.h in (None, inputs.get("h"))
    )


def fitted_to(case: Case, greeting: Greeting) -> Case:
    """Return a request with the optional inputs that a solver takes, and no others."""
    inputs, system = dict(case.inputs), greeting.system
    if case.task not in OF_SPRINGS:
        return case
    if system.rest_lengths != "measured":
        inputs.pop("rest_positions", None)
    if system.state == "previous_positions" and case.task == STEP:
        inputs["previous_positions"] = inputs["positions"] - inputs["h"] * inputs["velocities"]
    if system.external_forces and case.task == STEP:
        inputs["external_forces"] = np.zeros_like(inputs["positions"])
    if system.tension_only:
        inputs["tension_only"] = np.zeros(len(inputs["springs"]), bool)
    return replace(case, inputs=inputs)


def keys(values: Mapping[str, Any], right: Mapping[str, Any], case: Case) -> FloatArray:
    """Return the key of each output of an answer, NaN where the output is missing.

    A key is the difference from the right answer over its size, projected on one direction.
    """
    names = OUTPUTS[case.task]
    if case.task == STEP:  # displacements are small beside positions
        right = {**right, "positions": right["positions"] - case.inputs["positions"]}
        if "positions" in values:
            values = {**values, "positions": values["positions"] - case.inputs["positions"]}
    sizes = [
        float(np.abs(output).max())
        for name in names
        if (output := _output(right, name)) is not None
    ]
    size = max(sizes) if case.task == ENERGY else None  # an energy may be zero
    return np.array([_key(_output(values, name), _output(right, name), size) for name in names])


def _output(values: Mapping[str, Any], name: str) -> FloatArray | None:
    """Return an output as numbers: of a quaternion q its products q q', which have no sign."""
    if name == "path":  # as placed by rotations, or as answered without any
        output = values.get("path_placed", values.get("path_positions"))
    else:
        output = values.get(name)
    if output is None or not name.endswith("rotations"):
        return output
    return np.asarray(output[..., :, None] * output[..., None, :])


def _key(output: FloatArray | None, right: FloatArray | None, size: float | None) -> float:
    if output is None or right is None or np.shape(output) != np.shape(right):
        return np.nan
    size = float(np.abs(right).max()) if size is None else size
    difference = np.ravel(output - right) / max(size, SMALLEST)
    key = float(fractions(difference.size, 5) @ difference)
    return key if abs(key) < LARGEST else np.nan


@cache
def fractions(count: int, start: int) -> FloatArray:
    """Return numbers spread over (-1, 1): the fractions of multiples of sqrt(2) and sqrt(3)."""
    k = np.arange(1, count + 1) + 100.0 * start
    numbers: FloatArray = 2.0 * np.mod(k * np.sqrt(2.0) + k * k * np.sqrt(3.0), 1.0) - 1.0
    numbers.setflags(write=False)  # they are kept
    return numbers
