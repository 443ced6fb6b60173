"""The end of an implicit Euler step to 25 digits, to measure errors against.

Newton's answer in float64 is off by about 1e-13 of the step. Newton steps with a gradient in 40
decimal digits, the same on every platform, refine the answer.
"""

import decimal
from collections.abc import Callable
from decimal import Decimal
from typing import Any, NamedTuple

import numpy as np
import scipy

from plumbob.reference.arguments import FloatArray
from plumbob.reference.implicit_euler.objective import Objective
from plumbob.reference.mass_spring import MassSpring, State

# Decimal digits: 25 of an error, and 15 for digits cancelled in a gradient.
DIGITS = 40
# A correction gains some 15 digits: random networks of 5 to 108 particles take two.
REFINEMENTS = 20
# Refinement ends with a correction smaller than this, over the norm of the positions.
CORRECTION_LIMIT = 1e-26


class ExactStep(NamedTuple):
    """The end x* of a step as rounded positions and their remainder, and a bound of its error."""

    positions: FloatArray
    remainder: FloatArray
    bound: float

    def error(self, x: FloatArray, y: FloatArray) -> float:
        """Return |x - x*| / |y - x*|, at least the bound: relative to the error of y."""
        error, start = (
            float(np.linalg.norm((z - self.positions) - self.remainder)) for z in (x, y)
        )
        return max(error, self.bound) / start


def exact_step(system: MassSpring, state: State, h: float, x: FloatArray) -> ExactStep:
    """Return the end of a step of length h [s] from a state, next to Newton's answer x."""
    solve = scipy.sparse.linalg.splu(Objective(system, state, h).hessian_at(x).tocsc()).solve
    with decimal.localcontext(decimal.Context(prec=DIGITS)):
        gradient, exact = _gradient(system, state, Decimal(h)), _decimals(x)
        for _ in range(REFINEMENTS):
            correction = -solve(gradient(exact).astype(float).ravel()).reshape(x.shape)
            exact, bound = exact + _decimals(correction), float(np.linalg.norm(correction))
            if bound <= CORRECTION_LIMIT * np.linalg.norm(x):
                break
        rounded = exact.astype(float)
        return ExactStep(rounded, (exact - _decimals(rounded)).astype(float), bound)


def _gradient(system: MassSpring, state: State, h: Decimal) -> Callable[[Any], Any]:
    """Return the function of decimals x, M (x - y) - h² f(x) [kg m], zero at the pins."""
    (i, j), free = system.springs.T, system.free[:, None]
    x_n, masses = _decimals(state.positions), _decimals(system.masses)[:, None]
    k, c, rest = map(_decimals, (system.stiffnesses, system.dampings, system.rest_lengths))
    y = x_n + h * (free * _decimals(state.velocities))
    before = np.sqrt(((x_n[i] - x_n[j]) ** 2).sum(axis=1))

    def gradient(x: Any) -> Any:
        p = x[i] - x[j]
        lengths = np.sqrt((p * p).sum(axis=1))
        slack = system.tension_only & (lengths <= rest)
        tension = ~slack * (k * (lengths - rest)) + c / h * (lengths - before)
        pull, forces = (tension / lengths)[:, None] * p, masses * _decimals(system.gravity)
        np.subtract.at(forces, i, pull)
        np.add.at(forces, j, pull)
        return free * (masses * (x - y) - h**2 * forces)

    return gradient


def _decimals(values: FloatArray) -> Any:
    return np.vectorize(Decimal, otypes=[object])(values)
