"""The end of an implicit Euler step to 25 digits, to measure errors against.

Newton's answer in float64 is about 1e-13 of the step away from it, and errors measured against that
answer say nothing below. Here the gradient follows from its definition in 40 decimal digits, by
Python's own arithmetic, which is the same on every platform; Newton steps with the Hessian of
float64 refine the answer.
"""

import decimal
from decimal import Decimal
from typing import Any, NamedTuple

import numpy as np
import scipy

from reference.arguments import FloatArray
from reference.implicit_euler.objective import Objective
from reference.mass_spring import MassSpring, State

DIGITS, REFINEMENTS = 40, 20
# Refinement ends with a correction that is smaller than this, over the norm of the positions.
ENOUGH = 1e-26


class ExactStep(NamedTuple):
    """The minimiser x* of g as a sum of two arrays of float64, (particle, 3) [m].

    Attributes:
        positions: x* rounded.
        remainder: what rounding leaves out.
        bound: the last correction's norm [m], which bounds what is still wrong.
    """

    positions: FloatArray
    remainder: FloatArray
    bound: float

    def error(self, x: FloatArray, y: FloatArray) -> float:
        """Return |x - x*| / |y - x*|, at least the bound: what is left of the error of y."""
        left, start = (float(np.linalg.norm((z - self.positions) - self.remainder)) for z in (x, y))
        return max(left, self.bound) / start


def exact_step(system: MassSpring, state: State, h: float, x: FloatArray) -> ExactStep:
    """Return the end of a step of length h [s] from a state, next to Newton's answer x to it."""
    solve = scipy.sparse.linalg.splu(Objective(system, state, h).hessian_at(x).tocsc()).solve
    with decimal.localcontext(decimal.Context(prec=DIGITS)):
        step, exact = _Step(system, state, h), _decimals(x)
        for _ in range(REFINEMENTS):
            gradient = step.gradient(exact).astype(float)
            correction = -solve(gradient.ravel()).reshape(x.shape)
            exact, bound = exact + _decimals(correction), float(np.linalg.norm(correction))
            if bound <= ENOUGH * np.linalg.norm(x):
                break
        rounded = exact.astype(float)
        return ExactStep(rounded, (exact - _decimals(rounded)).astype(float), bound)


class _Step:
    """A step's objective in decimal numbers."""

    def __init__(self, system: MassSpring, state: State, h: float) -> None:
        self._system, self._h = system, Decimal(h)
        self._masses = _decimals(system.masses)[:, None]
        x_n, v_n = _decimals(state.positions), _decimals(state.velocities)
        self._y = x_n + self._h * (system.free[:, None] * v_n)
        self._k, self._r = _decimals(system.stiffnesses), _decimals(system.rest_lengths)
        self._damping = _decimals(system.dampings) / self._h
        self._lengths_before = self._springs(x_n)[1]

    def gradient(self, x: Any) -> Any:
        """Return M (x - y) - h² f(x) [kg m], (particle, 3), zero at the pins."""
        p, lengths = self._springs(x)
        slack = self._system.tension_only & (lengths <= self._r)
        elastic = ~slack * (self._k * (lengths - self._r))
        tension = elastic + self._damping * (lengths - self._lengths_before)
        pull = (tension / lengths)[:, None] * p
        forces, (i, j) = self._masses * _decimals(self._system.gravity), self._system.springs.T
        np.subtract.at(forces, i, pull)
        np.add.at(forces, j, pull)
        gradient = self._masses * (x - self._y) - self._h**2 * forces
        return self._system.free[:, None] * gradient

    def _springs(self, x: Any) -> tuple[Any, Any]:
        """Return the vectors from end to end [m], (spring, 3), and their lengths."""
        i, j = self._system.springs.T
        p = x[i] - x[j]
        return p, np.sqrt((p * p).sum(axis=1))


def _decimals(values: FloatArray) -> Any:
    return np.vectorize(Decimal, otypes=[object])(values)
