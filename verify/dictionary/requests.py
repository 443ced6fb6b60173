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
# Parents, effector and target of each: a tree with an inner effector, and a chain.
SKELETONS = (
    ([-1, 0, 1, 2, 1], 2, (0.9, -1.3, 0.8)),
    ([-1, 0, 1, 2], 3, (-0.7, 1.1, 1.6)),
)
# The outputs that have keys, in their order: what poses have, and what the path has alone.
OUTPUTS = {FK: ("positions", "rotations"), IK: ("local_rotations", "path")}
# A size below which answers are compared absolutely.
SMALLEST = 1e-12


def requests(task: str, method: str) -> list[Case]:
    """Return the requests of a task and a method."""
    cases = []
    for number, (parents, effector, target) in enumerate(SKELETONS):
        joints = len(parents)
        rotations = fractions(4 * joints, 7 * number + 3).reshape(joints, 4)
        inputs: dict[str, Any] = {
            "parents": np.array(parents),
            "offsets": fractions(3 * joints, 7 * number + 1).reshape(joints, 3),
            "local_rotations": rotations / np.linalg.norm(rotations, axis=1, keepdims=True),
        }
        if task == IK:
            inputs |= {"target": np.array(target), "effector": effector, "method": method}
            inputs |= {"tolerance": 0.0, "max_iterations": 1}
        about = facts(inputs) if task == IK else {}
        cases.append(Case(f"telling {number + 1}", task, inputs, "telling", ABOUT, facts=about))
    return cases


def suitable(case: Case, greeting: Greeting) -> bool:
    """Return whether a solver takes a request: free joints, which rotate in space."""
    is_free = greeting.rotations and not (greeting.planar or greeting.limits)
    return is_free and suits(case.inputs["parents"], greeting, case.inputs.get("effector"))


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
