"""Programs with constants of a solver's own, fitted to each of its answers.

The step of a Jacobian method, J^T (J J^T + m I)^-1 e, has a damping m and a factor. Each solver
chooses both, or changes both between steps. The other numbers of an answer tell programs apart.
"""

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import scipy

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray

from ..case import Case
from .mutants import Program

# The names of the constants in programs.
STEP, DAMPING = "STEP", "DAMPING"
# The logarithms of dampings from the pseudo-inverse to the transpose: small rotations by any
# damping are combinations of rotations by three dampings. Then the initial dampings.
LEAST, MOST = -25.0, 25.0
DAMPINGS, BETWEEN = (0.0, LEAST, MOST), (-8.0, -6.0, -4.0, -2.0, 2.0, 4.0, 6.0, 8.0)
# Rotations farther from these combinations, over their size, belong to another program: large
# rotations by rules of the first order are this far. The nearest damping leaves less.
FAR, NEAR = 0.3, 0.1
# Levenberg and Marquardt's method, until the gap over the size of the rotations is rounding.
METHOD: Mapping[str, Any] = {
    "method": "lm", "ftol": 1e-12, "xtol": 1e-12, "gtol": 1e-12, "max_nfev": 40,
}  # fmt: skip
# Steps in directions within this difference have the same constants.
DECIMALS = 9

Answers = Mapping[str, Mapping[str, Any]]  # the comparable outputs, by the names of cases
# The logarithms of the damping and of the size of the step, by case and direction; None if far.
Memory = dict[tuple[str, bytes], FloatArray | None]


def is_fitted(program: Program) -> bool:
    """Return whether a program has constants to be fitted."""
    return {STEP, DAMPING} <= program.names.keys()


def fitted(
    program: Program,
    run: Callable[[Case], Mapping[str, Any]],
    answers: Answers,
    memory: Memory,
    case: Case,
) -> Mapping[str, Any]:
    """Return what a program answers to a case with the constants nearest to a solver's answer."""
    observed, start = answers[case.name].get("local_rotations"), case.inputs["local_rotations"]
    if observed is None or np.shape(observed) != np.shape(start):
        return run(case)
    answer = partial(program.count_passes, partial(run, case))  # each is limited alone

    def turns(constants: FloatArray) -> FloatArray:
        """The rotation vectors of all joints, of a damping and the factor of the step."""
        damping, factor = constants.tolist()
        program.names[DAMPING] = math.exp(min(max(damping, LEAST), MOST))
        program.names[STEP] = math.exp(min(factor, 2.0 * MOST))
        after: Any = answer()[0].get("local_rotations")
        if np.shape(after) != np.shape(start):
            raise ArithmeticError("no rotations")
        return _turns(start, after)

    kept = {name: program.names[name] for name in (STEP, DAMPING)}
    try:
        first = turns(np.zeros(2))
        size = max(float(np.linalg.norm(first)), 1e-300)
        shift = np.array([0.0, math.log(size)])
        key = case.name, (np.round(first / size, DECIMALS) + 0.0).tobytes()
        if key not in memory:
            constants = _constants(turns, first, _turns(start, observed))
            memory[key] = None if constants is None else constants + shift
        constants = memory[key]
        if constants is not None:
            turns(constants - shift)
        return answer()[0]
    finally:
        program.names |= kept


def _turns(start: FloatArray, after: FloatArray) -> FloatArray:
    """Return the rotation vectors of joints in their own frames, in a single array."""
    return rotation.logarithm(rotation.multiply(rotation.conjugate(start), after)).ravel()


def _constants(
    turns: Callable[[FloatArray], FloatArray], first: FloatArray, goal: FloatArray
) -> FloatArray | None:
    """Return the logarithms of the damping and the factor nearest to a goal, None if all are far.

    `first` are the rotation vectors with both constants 1.
    """
    rows = [first, *(turns(np.array([damping, 0.0])) for damping in DAMPINGS[1:])]
    size = float(np.linalg.norm(goal))
    if not (np.isfinite(rows).all() and size > 0.0 and all(row.any() for row in rows)):
        return None
    units = np.array([row / np.linalg.norm(row) for row in rows])
    weights = np.linalg.lstsq(units.T, goal, rcond=None)[0]
    if np.linalg.norm(weights @ units - goal) > FAR * size:
        return None
    rows += [turns(np.array([damping, 0.0])) for damping in BETWEEN]
    best = int(np.argmax([row @ goal / np.linalg.norm(row) for row in rows]))
    factor = float(rows[best] @ goal / (rows[best] @ rows[best]))
    if factor <= 0.0 or np.linalg.norm(factor * rows[best] - goal) > NEAR * size:
        return None
    start = np.array([(*DAMPINGS, *BETWEEN)[best], np.log(factor)])
    solve = scipy.optimize.least_squares
    return np.asarray(solve(lambda c: (turns(c) - goal) / size, start, **METHOD).x)
