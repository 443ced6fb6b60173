"""Gauss-Newton: implicit Euler with the springs linearised where the step starts.

At x_n the dampers of E are at rest length, grad g(x_n) = -h (M v_n + h f), and with their Hessian
without geometric terms the step h (v_n + dv) = -(M + h C + h² J' k J)^-1 grad g(x_n) is

    (M + h C + h² J' k J) dv = h (f - h J' k J v_n),

J here being the Jacobian of the lengths and f all forces with the dampers' -C v_n: one step of
Baraff and Witkin 1998, "Large Steps in Cloth Simulation", without geometric stiffness, and the
integrator that MuJoCo calls `discrete`. Pins that move do so from x_n, where the springs are still
linearised: their way adds h² J' k J (x_pins - x_n) to the gradient of the free particles.
"""

from collections.abc import Iterator

import numpy as np

from ..mass_spring import MassSpring
from ..sparse.linear_solver import NotPositiveDefiniteError
from .factor_cache import hessian_factor
from .objective import Iterate, Objective


class GaussNewton:
    """Gauss-Newton steps from x_n, one unless more are asked for; the pattern is analysed here."""

    default_iterations = 1

    def __init__(self, system: MassSpring, h: float) -> None:
        """Analyse the pattern; the matrix is another in every step."""
        self._analysed = hessian_factor(system)

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield x_n, but for the pins, and then one iterate after the other, without end.

        It is the last one again where the matrix is singular to rounding.
        """
        x = objective.x_n
        iterate = objective._evaluate(x)
        gradient = iterate.gradient + objective._pull_of_pins(x, geometric=False)
        if np.any(objective.y[objective.system.pinned] != x[objective.system.pinned]):
            iterate = objective._evaluate(np.where(objective.system.free[:, None], x, objective.y))
        while True:
            yield iterate
            try:
                factor = self._analysed.refactorize(objective._hessian(x, geometric=False))
            except NotPositiveDefiniteError:  # to rounding the masses are nothing beside h² k
                continue
            correction = factor.solve(gradient.ravel()).reshape(-1, 3)
            iterate = objective._evaluate(iterate.positions - correction)
            x, gradient = iterate.positions, iterate.gradient
