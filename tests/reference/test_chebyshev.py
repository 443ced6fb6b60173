"""Laws of the acceleration of local/global iterations."""

import itertools
import math

import numpy as np
import pytest

from plumbob.reference import ImplicitEuler, scenes
from plumbob.reference.implicit_euler import local_global
from plumbob.reference.implicit_euler.local_global import PLAIN, Acceleration

h = 1 / 30


def errors(rho, iterations):
    """Return the size of the plain step before each iteration of a linear problem, and R's end.

    A plain iteration multiplies the errors of 200 unknowns by numbers from 0 to rho.
    """
    share = np.linspace(0, rho, 200)
    x = before = np.ones(200)
    acceleration, sizes = Acceleration(), []
    for _ in range(iterations):
        step = -(1 - share) * x
        sizes.append(math.sqrt(np.sum(step**2)))
        weight, relaxation = acceleration.next(sizes[-1])
        x, before = x + (weight - 1) * (x - before) + weight * relaxation * step, x
    return np.array(sizes), acceleration._R


@pytest.mark.parametrize("rho", [0.9, 0.99, 0.999])
def test_accelerated_iterations_number_as_the_square_root_of_plain_ones(rho):
    plain = math.log(1e-8) / math.log(rho)
    sizes, _ = errors(rho, iterations=int(6 * math.sqrt(plain) + 30))
    assert sizes[-1] < 1e-6 * sizes[0]


def test_iterations_are_plain_first():
    acceleration = Acceleration()
    assert [acceleration.next(0.5**k) for k in range(PLAIN)] == [(1.0, 1.0)] * PLAIN
    weight, relaxation = acceleration.next(0.5**PLAIN)
    assert (weight, relaxation) == (1.0, pytest.approx(4 / 3))
    R = relaxation - 1
    second, _ = acceleration.next(0.01)
    assert second == pytest.approx(2 / (2 - R**2))
    assert acceleration.next(0.001)[0] == pytest.approx(4 / (4 - R**2 * second))


def test_g_does_not_grow_whatever_the_weights(monkeypatch):
    """A plain iteration takes the place of one that leaps too far."""
    system, state = scenes.lab_cloth(size=5, stiffness=1000.0)
    swinging = state.of(state.positions, np.cross(state.positions, [0.3, 0.5, 2.0]))
    leaps = []

    def leaping(acceleration, size):
        leaps.append(size)
        return (1.0, 10.0) if len(leaps) % 3 == 2 else (1.0, 1.0)

    monkeypatch.setattr(local_global.Acceleration, "next", leaping)
    integrator = ImplicitEuler(system, h=h, solver="chebyshev")
    iterates = list(itertools.islice(integrator.iterates(swinging), 31))
    for before, after in itertools.pairwise(iterates):
        assert after.value <= before.value + after.value_floor
    start, x = iterates[1:3]
    correction = integrator._solver._factor.solve(start.gradient)
    np.testing.assert_array_equal(x.positions, start.positions - correction)
    assert len(leaps) == 30
