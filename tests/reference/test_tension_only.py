"""Laws of springs that go slack; those of all springs hold for the "ropes" among the networks."""

import numpy as np
import pytest

from plumbob.reference import scenes
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.reference.mass_spring import (
    MassSpring,
    State,
    damper_forces,
    damping_matrix,
    forces,
    rest_vectors,
    spring_energy,
    spring_forces,
    stiffness_matrix,
    stretches,
)

h = 0.05


def rope(length, **changes):
    """Return two particles on the x axis, a length apart, and the rope of 1.5 m between them."""
    arguments = {
        "masses": [1.0, 3.0],
        "springs": [[0, 1]],
        "rest_lengths": 1.5,
        "stiffnesses": 4.0,
        "tension_only": True,
        "gravity": (0, 0, 0),
    }
    return MassSpring(**(arguments | changes)), np.array([[length, 0.0, 0.0], [0.0, 0.0, 0.0]])


class TestSlack:
    @pytest.mark.parametrize("length", [0.0, 0.3, 1.5])
    def test_a_slack_rope_is_not_there(self, backend, length):
        system, x = rope(length)
        assert stretches(system, x).tolist() == [0.0]
        assert spring_energy(system, x) == 0
        np.testing.assert_array_equal(spring_forces(system, x), np.zeros((2, 3)))
        np.testing.assert_array_equal(stiffness_matrix(system, x).toarray(), np.zeros((6, 6)))
        np.testing.assert_array_equal(rest_vectors(system, x), [[length, 0.0, 0.0]])

    def test_a_rope_without_length_is_a_linear_spring_even_at_length_zero(self, backend):
        for length in (0.0, 0.7):
            system, x = rope(length, rest_lengths=0.0)
            expected = np.kron([[4.0, -4.0], [-4.0, 4.0]], np.eye(3))
            # k u u' and k (I - u u') are added.
            np.testing.assert_allclose(stiffness_matrix(system, x).toarray(), expected, rtol=1e-15)
            np.testing.assert_array_equal(spring_forces(system, x)[0], [-4.0 * length, 0, 0])

    def test_the_damper_of_a_slack_rope_acts(self, backend):
        system, x = rope(0.5, dampings=2.0)
        state = State(x, [[3.0, 5.0, 0.0], [1.0, 0.0, 0.0]])
        expected = [[-4.0, 0, 0], [4.0, 0, 0]]
        np.testing.assert_array_equal(damper_forces(system, state), expected)
        np.testing.assert_array_equal(forces(system, state), expected)
        pull = damping_matrix(system, x) @ state.velocities.ravel()
        np.testing.assert_array_equal(pull.reshape(2, 3), np.negative(expected))


class TestKink:
    """At the rest length energy and force are continuous, the stiffness jumps."""

    def test_the_stiffness_there_is_that_of_the_slack_side(self, backend):
        assert not stiffness_matrix(*rope(1.5)).toarray().any()
        just_taut = stiffness_matrix(*rope(np.nextafter(1.5, 2))).toarray()
        assert just_taut[0, 0] == pytest.approx(4.0, rel=1e-15)


class TestStep:
    def test_a_slack_net_falls_freely(self, backend):
        """Folded to three quarters of its size, so that no rope becomes taut in the step."""
        system, state = scenes.net(4, 4)
        folded = State(0.75 * state.positions, state.velocities)
        result = ImplicitEuler(system, h=h).step(folded)
        fall = result.state.velocities[system.free]
        # Velocities are differences of positions, 1e-16 of 1 m, over h.
        np.testing.assert_allclose(fall, np.tile([0, -9.81 * h, 0], (12, 1)), rtol=0, atol=1e-14)
        # The Hessian is M: the second iteration only mends the rounding of the first.
        assert result.iterations <= 2
