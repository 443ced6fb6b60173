"""The requests whose answers tell changes apart, and the keys of answers.

The requests are the same for every seed and solver. Their directions are generic: none is straight,
opposite to another or with equal components, where honest programs branch differently.
"""

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import sentence

from ..case import Case
from ..greeting import Greeting
from ..kinematics.problems import facts
from ..kinematics.skeletons import suits
from ..mass_spring.cases import UNDAMPED

FK, IK = "forward_kinematics", "inverse_kinematics"
FORCES, ENERGY = "mass_spring_forces", "energy"
# The tasks and methods with a dictionary.
TASKS = ((FK, ""), (IK, "ccd"), (IK, "fabrik"), (FORCES, ""), (ENERGY, ""))
ABOUT = sentence("a request that tells mistakes apart; no part of the verdict")
# Parents, effector and target of each: a tree with an inner effector, a chain, a chain in a plane.
TREE = ([-1, 0, 1, 1, 3, 4], 4, (1.4, -1.0, -1.4))
CHAIN = ([-1, 0, 1, 2], 3, (-0.7, 1.1, 1.6))
IN_PLANE = ([-1, 0, 1, 2], 3, (-0.6, -0.2, 0.0))
# For solvers of positions alone: without rotations, in a plane as well.
AT_REST = ([-1, 0, 1, 2], 3, (-0.5, -0.4, 0.0))
# With tolerance and number of sweeps: single sweeps, then solves with an end by either limit. CCD
# needs 12 sweeps to the tolerance, FABRIK 10: most round distances end solves elsewhere.
PROBLEMS = (
    (*TREE, 0.0, 1), (*CHAIN, 0.0, 1), (*IN_PLANE, 0.0, 1), (*TREE, 0.0, 3),
    (*CHAIN[:2], (-1.1, -0.6, 0.3), 4e-3, 16), (*AT_REST, 0.0, 1),
)  # fmt: skip
# A triangle with a tail; every spring has numbers of its own.
SPRINGS = np.array([[0, 1], [2, 0], [1, 2], [2, 3]])
# The zeros in each request of a mass-spring system. The first three show springs, gravity and
# motion alone, so a mistake in springs hides no mistake in gravity; the last shows all three.
ZEROS = (
    ("dampings", "gravity", "velocities"),
    ("stiffnesses", "dampings", "velocities"),
    ("stiffnesses", "gravity"),
    (),
)
# The outputs with keys, in their order: outputs of poses, and outputs of the path alone.
OUTPUTS = {
    FK: ("positions", "rotations"),
    IK: ("local_rotations", "path"),
    FORCES: ("forces",),
    ENERGY: ("total", "kinetic", "potential", "elastic", "gravitational"),
}
# Keys beyond this come from divisions by nearly zero.
LARGEST = 1e6
# A size below which answers are compared absolutely.
SMALLEST = 1e-12


def requests(task: str, method: str) -> list[Case]:
    """Return the requests of a task and a method, of poses with different starts alone."""
    if task in (FORCES, ENERGY):
        return [_spring_request(task, number) for number in range(len(ZEROS))]
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


def _spring_request(task: str, number: int) -> Case:
    """Return a request of a mass-spring system in which some inputs are zero."""
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
    inputs |= {name: 0.0 * inputs[name] for name in ZEROS[number]}
    return Case(f"telling {number + 1}", task, inputs, "telling", ABOUT)


def suitable(case: Case, greeting: Greeting) -> bool:
    """Return whether a solver takes a request: any numbers, or free joints in space or a plane."""
    if case.task in (FORCES, ENERGY):
        system = greeting.system
        numbers = {system.masses, system.stiffnesses, system.dampings, system.rest_lengths}
        takes_all = numbers == {"each", "given"} and system.gravity == "vector"
        is_damped = case.task == ENERGY or greeting.step.damper not in UNDAMPED
        return takes_all and is_damped and greeting.fixed.gravity is None and not greeting.planar
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


def keys(values: Mapping[str, Any], right: Mapping[str, Any], case: Case) -> FloatArray:
    """Return the key of each output of an answer, NaN where the output is missing.

    A key is the difference from the right answer over its size, projected on a direction.
    """
    names = OUTPUTS[case.task]
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
    return np.asarray(2.0 * np.mod(k * np.sqrt(2.0) + k * k * np.sqrt(3.0), 1.0) - 1.0)
