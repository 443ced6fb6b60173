"""Laws of the wind."""

import numpy as np
import pytest

from plumbob.reference import rotation, scenes
from plumbob.reference.backend import compiled
from plumbob.reference.mass_spring import State
from plumbob.reference.wind import wind_forces

WIND = np.array([3.0, -1.0, 2.0])
BOTH = {"drag": 1.1, "lift": 0.4}
# Sums of some ten terms round by a few units in the last place of the largest.
ROUNDING = 1e-14


@pytest.fixture
def sail(rng):
    """Return the state of a crumpled 4 x 3 cloth in motion, and its triangles."""
    _, state = scenes.grid_cloth(4, 3)
    x = state.positions + rng.uniform(-0.05, 0.05, state.positions.shape)
    return State(x, rng.standard_normal(x.shape)), scenes.grid_triangles(4, 3)


def plate():
    """Return a right triangle of 2 m², level and at rest; its normal points up."""
    x = [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0]]
    return State(x, np.zeros((3, 3))), [[0, 1, 2]]


class TestByHand:
    @pytest.mark.parametrize("degrees", [0, 20, 45, 70, 90])
    def test_drag_and_lift_go_with_the_angle_of_attack(self, backend, degrees):
        """Drag like its sine, lift like its sine times its cosine."""
        angle = np.radians(degrees)
        e, across = np.array([np.cos(angle), np.sin(angle), 0]), [-np.sin(angle), np.cos(angle), 0]
        total = wind_forces(*plate(), 5.0 * e, density=1.2, **BOTH).sum(axis=0)
        pressure = 0.5 * 1.2 * 25.0 * 2.0
        assert total @ e == pytest.approx(1.1 * pressure * np.sin(angle), rel=1e-14, abs=1e-13)
        lift = 0.4 * pressure * np.sin(angle) * np.cos(angle)
        assert total @ across == pytest.approx(lift, rel=1e-14, abs=1e-13)
        assert total[2] == 0


class TestLaws:
    def test_what_moves_with_the_wind_feels_none(self, sail, backend):
        state, triangles = sail
        drifting = State(state.positions, np.tile(WIND, (12, 1)))
        np.testing.assert_array_equal(wind_forces(drifting, triangles, WIND, **BOTH), 0)

    def test_the_forces_rotate_with_the_world(self, sail, rng, backend):
        state, triangles = sail
        R = rotation.to_matrix(rotation.random(rng, 1))[0]
        rotated = State(state.positions @ R.T + [1.0, -2.0, 3.0], state.velocities @ R.T)
        expected = wind_forces(state, triangles, WIND, **BOTH) @ R.T
        actual = wind_forces(rotated, triangles, R @ WIND, **BOTH)
        np.testing.assert_allclose(actual, expected, rtol=0, atol=10 * ROUNDING)

    def test_order_and_orientation_of_triangles_do_not_matter(self, sail, backend):
        state, triangles = sail
        other = triangles[::-1].copy()
        other[::2] = other[::2, ::-1]
        expected = wind_forces(state, triangles, WIND, **BOTH)
        actual = wind_forces(state, other, WIND, **BOTH)
        np.testing.assert_allclose(actual, expected, rtol=0, atol=10 * ROUNDING)

    def test_still_air_takes_energy_from_a_rigid_motion_and_lift_none(self, sail, backend):
        state, triangles = sail
        gliding = State(state.positions, np.tile(WIND, (12, 1)))
        total = wind_forces(gliding, triangles, np.zeros(3)).sum(axis=0)
        assert total @ WIND < -1
        rise = wind_forces(gliding, triangles, np.zeros(3), drag=0, lift=1.0).sum(axis=0)
        assert np.linalg.norm(rise) > 0.1
        assert abs(rise @ WIND) < 100 * ROUNDING

    def test_wind_may_differ_between_particles(self, sail, rng, backend):
        """A triangle feels the mean at its corners."""
        state, triangles = sail
        gusts = rng.standard_normal((12, 3))
        one = wind_forces(state, triangles, gusts, **BOTH)
        windless = State(state.positions, state.velocities - gusts)
        np.testing.assert_array_equal(one, wind_forces(windless, triangles, np.zeros(3), **BOTH))
        np.testing.assert_array_equal(
            wind_forces(state, triangles, np.tile(WIND, (12, 1))), wind_forces(*sail, WIND)
        )

    def test_both_speeds_round_alike(self, sail):
        ends = []
        for name in compiled.BACKENDS:
            with compiled.set_backend(name):
                ends.append(wind_forces(*sail, WIND, **BOTH))
        np.testing.assert_array_equal(*ends)


def test_there_is_no_force_on_a_triangle_without_area(backend):
    state = State([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0], [0, 0, 0]], np.zeros((4, 3)))
    forces = wind_forces(state, [[0, 1, 2], [0, 3, 1]], WIND, **BOTH)
    np.testing.assert_array_equal(forces, np.zeros((4, 3)))
