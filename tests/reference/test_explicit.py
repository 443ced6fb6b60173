"""Laws of the explicit integrators."""

import numpy as np
import pytest

from plumbob.reference.backend import compiled
from plumbob.reference.explicit import runge_kutta, symplectic_euler
from plumbob.reference.mass_spring import MassSpring, State

INTEGRATORS = [symplectic_euler, runge_kutta]


def oscillator(stiffness=4.0, mass=1.0, damping=0.0):
    """Return a mass on a spring along x, pinned at the origin, stretched by 0.5 m and at rest."""
    system = MassSpring(
        [1.0, mass], [[0, 1]], 1.0, stiffness, damping, pinned=[0], gravity=(0, 0, 0)
    )
    return system, State([[0, 0, 0], [1.5, 0, 0]], np.zeros((2, 3)))


def run(integrator, system, state, h, steps):
    for _ in range(steps):
        state = integrator(system, state, h)
    return state


@pytest.mark.parametrize("integrator", INTEGRATORS)
class TestEveryIntegrator:
    def test_both_speeds_round_alike(self, network, integrator):
        ends = []
        for backend in compiled.BACKENDS:
            with compiled.set_backend(backend):
                ends.append(run(integrator, *network, 0.01, 3))
        np.testing.assert_array_equal(ends[0].positions, ends[1].positions)
        np.testing.assert_array_equal(ends[0].velocities, ends[1].velocities)

    def test_an_unstable_step_ends_in_an_error_not_in_nan(self, integrator):
        system, state = oscillator(stiffness=1e6)
        with pytest.raises(FloatingPointError, match=f"^{integrator.__name__}: .*h is too large"):
            run(integrator, system, state, 1.0, 200)
