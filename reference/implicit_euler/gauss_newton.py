"""Gauss-Newton: implicit Euler with the springs linearised where the step starts.

At x_n the dampers of E are at rest length, grad g(x_n) = -h (M v_n + h f), and with their Hessian
without geometric terms the step h (v_n + dv) = -(M + h C + h² J' k J)^-1 grad g(x_n) is

    (M + h C + h² J' k J) dv = h (f - h J' k J v_n),

J here being the Jacobian of the lengths and f all forces with the dampers' -C v_n: one step of
Baraff and Witkin 1998, "Large Steps in Cloth Simulation", without geometric stiffness, and the
integrator that MuJoCo calls `discrete`.
"""

from collections.abc import Iterator

from ..linear_solver import factorize
from ..mass_spring import MassSpring
from .objective import Iterate, Objective


class GaussNewton:
    """Gauss-Newton steps from x_n, one unless more are asked for."""

    default_iterations = 1

    def __init__(self, system: MassSpring, h: float) -> None:
        """Keep nothing: the matrix is another in every step."""

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the start x_n and then one iterate after the other, without end."""
        iterate = objective.evaluate(objective.x_n)
        while True:
            yield iterate
            matrix = objective.hessian(iterate.positions, geometric=False)
            correction = factorize(matrix).solve(iterate.gradient.ravel())
            iterate = objective.evaluate(iterate.positions - correction.reshape(-1, 3))
