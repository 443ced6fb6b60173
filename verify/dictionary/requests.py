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

FK, IK = "forward_kinematics", "inverse_kinematics"
# The tasks and methods with a dictionary.
TASKS = ((FK, ""), (IK, "ccd"), (IK, "fabrik"))
ABOUT = sentence("a request that tells mistakes apart; no part of the verdict")
# Parents, effector and target of each: a tree with an inner effector, a chain, one in a plane.
TREE = ([-1, 0, 1, 1, 3, 4], 4, (1.4, -1.0, -1.4))
CHAIN = ([-1, 0, 1, 2], 3, (-0.7, 1.1, 1.6))
IN_PLANE = ([-1, 0, 1, 2], 3, (-0.6, -0.2, 0.0))
# With tolerance and number of sweeps: single sweeps, then solves that end by either of them. CCD
# needs 12 sweeps to the tolerance, FABRIK 10: most round distances end them elsewhere.
PROBLEMS = (
    (*TREE, 0.0, 1), (*CHAIN, 0.0, 1), (*IN_PLANE, 0.0, 1), (*TREE, 0.0, 3),
    (*CHAIN[:2], (-1.1, -0.6, 0.3), 4e-3, 16),
)  # fmt: skip
# The outputs that have keys, in their order: what poses have, and what the path has alone.
OUTPUTS = {FK: ("positions", "rotations"), IK: ("local_rotations", "path")}
# A size below which answers are compared absolutely.
SMALLEST = 1e-12


def requests(task: str, method: str) -> list[Case]:
    """Return the requests of a task and a method: of poses those alone that differ in the start."""
    cases = []
    for number, problem in enumerate(PROBLEMS if task == IK else PROBLEMS[:3]):
        parents, effector, target, tolerance, sweeps = problem
        joints, start = len(parents), 7 * (number % 3)
        offsets = fractions(3 * joints, start + 1).reshape(joints, 3)
        rotations = fractions(4 * joints, start + 3).reshape(joints, 4)
        if target[2] == 0.0:
            offsets, rotations = offsets * [1, 1, 0], rotations * [1, 0, 0, 1]
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


def suitable(case: Case, greeting: Greeting) -> bool:
    """Return whether a solver takes a request: free joints, in space or in a plane."""
    is_planar = not case.inputs["offsets"][:, 2].any()
    is_free = greeting.rotations and greeting.planar is is_planar and not greeting.limits
    is_ended = greeting.fixed.tolerance is None or not case.inputs.get("tolerance")
    return (
        is_free
        and is_ended
        and suits(case.inputs["parents"], greeting, case.inputs.get("effector"))
    )


def keys(values: Mapping[str, Any], right: Mapping[str, Any], case: Case) -> FloatArray:
    """Return the key of each output of an answer, NaN where the output is missing.

    A key is the difference from the right answer over its size, projected on one direction.
    """
    return np.array(
        [_key(_output(values, name), _output(right, name)) for name in OUTPUTS[case.task]]
    )


def _output(values: Mapping[str, Any], name: str) -> FloatArray | None:
    """Return an output as numbers: of a quaternion q its products q q', which have no sign."""
    if name == "path":  # as placed by rotations, or as answered without any
        output = values.get("path_placed", values.get("path_positions"))
    else:
        output = values.get(name)
    if output is None or not name.endswith("rotations"):
        return output
    return np.asarray(output[..., :, None] * output[..., None, :])


def _key(output: FloatArray | None, right: FloatArray | None) -> float:
    if output is None or right is None or np.shape(output) != np.shape(right):
        return np.nan
    difference = np.ravel(output - right) / max(float(np.abs(right).max()), SMALLEST)
    return float(fractions(difference.size, 5) @ difference)


@cache
def fractions(count: int, start: int) -> FloatArray:
    """Return numbers spread over (-1, 1): the fractions of multiples of sqrt(2) and sqrt(3)."""
    k = np.arange(1, count + 1) + 100.0 * start
    return np.asarray(2.0 * np.mod(k * np.sqrt(2.0) + k * k * np.sqrt(3.0), 1.0) - 1.0)
