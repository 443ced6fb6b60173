"""Laws of energy, forces and their matrices, and what the model and the state refuse."""

import numpy as np
import pytest

from plumbob.reference.backend import compiled
from plumbob.reference.mass_spring import (
    MassSpring,
    State,
    damper_forces,
    damping_matrix,
    derivation,
    forces,
    kinetic_energy,
    lengths,
    potential_energy,
    rest_vectors,
    spring_forces,
    stiffness_matrix,
)

pytestmark = pytest.mark.both_backends

# Sums of a few dozen terms round by a few units in the last place of the largest.
ROUNDING = 1e-14


def assert_close(actual, expected, tolerance=ROUNDING):
    """Compare with the largest expected number as the scale, which must not be zero."""
    scale = np.abs(expected).max()
    assert scale > 0
    np.testing.assert_allclose(actual, expected, rtol=0, atol=tolerance * scale)


def pair(**changes):
    """Return two particles 2 m apart along y, joined by a spring of rest length 1.5 m."""
    arguments = {"masses": [1.0, 3.0], "springs": [[0, 1]], "rest_lengths": 1.5, "stiffnesses": 4.0}
    return MassSpring(**(arguments | {"gravity": (0, -10, 0)} | changes))


PAIR = np.array([[0.0, 2.0, 0.0], [0.0, 0.0, 0.0]])


class TestDerivatives:
    def test_damping_matrix_gives_the_damper_forces(self, network, altered, backend):
        system, state = altered(network[0], pinned=()), network[1]
        matrix = damping_matrix(system, state.positions)
        expected = damper_forces(system, state)
        assert_close(-(matrix @ state.velocities.ravel()).reshape(-1, 3), expected)


class TestDerivation:
    """A, S, L, J and d of the lab's derivation."""

    def test_l_x_minus_j_d_is_the_gradient_of_the_spring_energy(self, network, backend):
        system, state = network
        _, _, L, J = derivation(system)
        x = state.positions
        assert_close(L @ x - J @ rest_vectors(system, x), -spring_forces(system, x))

    def test_d_is_the_nearest_vector_of_rest_length(self, network, rng, backend):
        system, state = network
        p = derivation(system).A.T @ state.positions
        d = rest_vectors(system, state.positions)
        length, r = lengths(system, state.positions), system.rest_lengths
        slack = system.tension_only & (length < r)
        expected = np.where(slack, length, r)
        np.testing.assert_allclose(np.linalg.norm(d, axis=1), expected, rtol=ROUNDING)
        gap = np.linalg.norm(p - d, axis=1)
        assert_close(gap, np.where(slack, 0, np.abs(length - r)))
        for _ in range(20):
            other = rng.standard_normal(d.shape)
            other *= (system.rest_lengths / np.linalg.norm(other, axis=1))[:, None]
            assert (np.linalg.norm(p - other, axis=1) > gap).all()


class TestCoincidentEnds:
    """A spring of length zero has the direction (1, 0, 0)."""

    HERE = np.full((2, 3), 0.7)

    def test_a_spring_with_a_rest_length_pushes_along_x(self, backend):
        expected = [[6.0, 0, 0], [-6.0, 0, 0]]
        np.testing.assert_array_equal(spring_forces(pair(), self.HERE), expected)
        np.testing.assert_array_equal(rest_vectors(pair(), self.HERE), [[1.5, 0, 0]])
        block = stiffness_matrix(pair(), self.HERE).toarray()[:3, :3]
        np.testing.assert_array_equal(block, np.diag([4.0, 0, 0]))

    def test_a_spring_without_rest_length_is_linear(self, backend):
        system = pair(rest_lengths=0.0)
        np.testing.assert_array_equal(spring_forces(system, self.HERE), np.zeros((2, 3)))
        here, there = (stiffness_matrix(system, x).toarray() for x in (self.HERE, PAIR))
        np.testing.assert_array_equal(here, there)
        np.testing.assert_array_equal(here[:3, :3], 4.0 * np.eye(3))

    def test_a_slack_rope_between_them_has_no_direction_to_push(self, backend):
        system = pair(tension_only=True)
        np.testing.assert_array_equal(spring_forces(system, self.HERE), np.zeros((2, 3)))
        np.testing.assert_array_equal(rest_vectors(system, self.HERE), np.zeros((1, 3)))

    @pytest.mark.parametrize("gap", [1e-140, 1e-149, 1e-155, 1e-161, 5e-324])
    def test_directions_are_of_length_one_however_close_the_ends(self, backend, gap):
        """Squares of less than 1e-308 lose digits: ends as close as that coincide."""
        x = np.array([[gap, gap, 0.0], [0.0, 0.0, 0.0]])
        d = rest_vectors(pair(), x)
        assert np.linalg.norm(d) == pytest.approx(1.5, rel=1e-15)


class TestFewParticles:
    @pytest.mark.parametrize("springs", [[], (), np.empty((0, 2)), np.empty((0, 2), dtype=int)])
    def test_a_single_particle_needs_no_springs(self, backend, springs):
        system = MassSpring([2.0], springs, 1.0, 1.0, gravity=(0, -10, 0))
        state = State([[1.0, 2.0, 3.0]], [[3.0, 0, 0]])
        np.testing.assert_array_equal(forces(system, state), [[0, -20.0, 0]])
        assert potential_energy(system, state.positions) == 40.0
        assert kinetic_energy(system, state) == 9.0
        assert stiffness_matrix(system, state.positions).shape == (3, 3)
        assert not stiffness_matrix(system, state.positions).toarray().any()
        assert rest_vectors(system, state.positions).shape == (0, 3)
        assert [m.shape for m in derivation(system)] == [(1, 0), (0, 0), (1, 1), (1, 0)]


class TestPins:
    def test_the_velocity_of_a_pin_in_a_state_is_ignored(self, backend):
        pinned = pair(pinned=[1], dampings=0.5)
        state = State(PAIR, [[0, 3.0, 0], [0, 1.0, 0]])
        np.testing.assert_array_equal(damper_forces(pinned, state)[0], [0, -0.5 * 3.0, 0])
        assert kinetic_energy(pinned, state) == 0.5 * 1 * 9

    def test_pins_are_kept_once_and_in_order(self):
        system = MassSpring(np.ones(4), [[0, 1]], 1.0, 1.0, pinned=[3, 0, 3])
        assert system.pinned.tolist() == [0, 3]
        assert system.free.tolist() == [False, True, True, False]


def test_both_speeds_round_alike(network):
    system, state = network
    results = []
    for backend in compiled.BACKENDS:
        with compiled.set_backend(backend):
            x = state.positions
            matrix = stiffness_matrix(system, x).toarray()
            results.append((forces(system, state), matrix, lengths(system, x)))
    for one, other in zip(*results, strict=True):
        np.testing.assert_array_equal(one, other)


class TestInputs:
    def test_scalars_stand_for_all_springs(self):
        ends = [[0, 1], [1, 2]]
        system = MassSpring(np.ones(3), ends, 1.5, 4, dampings=0.5, tension_only=True)
        assert system.tension_only.tolist() == [True, True]
        assert system.rest_lengths.tolist() == [1.5, 1.5]
        assert system.stiffnesses.tolist() == [4.0, 4.0]
        assert system.dampings.tolist() == [0.5, 0.5]

    @pytest.mark.parametrize(
        ("name", "value", "message"),
        [
            ("masses", [], "at least one particle"),
            ("masses", [1.0, -1.0], "none below 0, got -1.0 at index 1"),
            ("masses", [1.0, 0.0], "free particles to have mass, got 0 at index 1"),
            ("springs", [[0, 2]], "from 0 to 1, got 2"),
            ("springs", [[0, -1]], "from 0 to 1, got -1"),
            ("springs", [[0, 1], [1, 1]], "two different particles, got 1 twice in spring 1"),
            ("rest_lengths", -0.1, "none below 0, got -0.1"),
            ("stiffnesses", [-1.0], "none below 0"),
            ("dampings", -1.0, "none below 0"),
            ("pinned", [2], "from 0 to 1, got 2"),
        ],
    )
    def test_a_wrong_model_is_named(self, name, value, message):
        with pytest.raises(ValueError, match=f"^{name}: .*{message}"):
            pair(**{name: value})

    @pytest.mark.parametrize("function", [forces, kinetic_energy, damper_forces])
    def test_a_state_of_another_system_is_refused(self, network, function):
        with pytest.raises(ValueError, match=r"^state: expected 2 particles, got 7"):
            function(pair(), network[1])
        with pytest.raises(ValueError, match=r"^state: expected a State, got ndarray"):
            function(pair(), PAIR)
