"""The named mass-spring scenes are what they are said to be."""

import numpy as np
import pytest

from reference import scenes
from reference.mass_spring import forces, lengths

SCENES = [scenes.lab_cloth, scenes.hanging_rope]


class TestLabCloth:
    def test_it_is_the_labs(self):
        system, state = scenes.lab_cloth()
        x = state.positions
        assert system.particle_count == 121
        assert (x[:, 1] == 1.5).all()
        expected = [(0.2 * i, -1 + 0.2 * j) for i in range(11) for j in range(11)]
        np.testing.assert_allclose(x[:, [0, 2]], expected, rtol=0, atol=1e-15)
        assert (system.masses == 1.0).all()
        assert (system.stiffnesses == 100.0).all()
        assert (system.dampings == 0.0).all()
        assert system.gravity.tolist() == [0.0, -0.3, 0.0]

    def test_two_corners_of_the_edge_at_x_0_are_pinned(self):
        system, state = scenes.lab_cloth()
        expected = [[0, 1.5, -1], [0, 1.5, 1]]
        np.testing.assert_array_equal(state.positions[system.pinned], expected)

    @pytest.mark.parametrize("size", [2, 3, 5, 11])
    def test_every_spring_is_there_once(self, size):
        """By brute force: all pairs whose distance on the grid is one of six kinds."""
        system, _ = scenes.lab_cloth(size=size)
        found = {tuple(sorted(pair)) for pair in system.springs.tolist()}
        assert len(found) == len(system.springs)
        kinds = {(0, 1), (1, 0), (0, 2), (2, 0), (1, 1)}
        expected = set()
        for a in range(size * size):
            for b in range(a):
                rows, columns = abs(a // size - b // size), abs(a % size - b % size)
                if (rows, columns) in kinds:
                    expected.add((b, a))
        assert found == expected

    def test_it_keeps_its_side_at_any_size(self):
        _, state = scenes.lab_cloth(size=4, side=3.0, height=0.5)
        np.testing.assert_allclose(state.positions.max(axis=0), [3.0, 0.5, 1.5])
        np.testing.assert_allclose(state.positions.min(axis=0), [0.0, 0.5, -1.5])

    def test_stiffness_damping_mass_and_gravity_are_settings(self):
        system, _ = scenes.lab_cloth(size=3, stiffness=1e4, damping=0.2, mass=0.1, gravity=9.81)
        assert set(system.stiffnesses) == {1e4}
        assert set(system.dampings) == {0.2}
        assert set(system.masses) == {0.1}
        assert system.gravity[1] == -9.81


class TestHangingRope:
    def test_it_hangs_straight_down_from_its_pin(self):
        system, state = scenes.hanging_rope(particles=5, length=2.0)
        np.testing.assert_array_equal(state.positions[:, 1], [0, -0.5, -1, -1.5, -2])
        assert (state.positions[:, [0, 2]] == 0).all()
        assert system.pinned.tolist() == [0]
        assert system.springs.tolist() == [[0, 1], [1, 2], [2, 3], [3, 4]]

    def test_the_promised_equilibrium_is_one(self):
        """Spring i is longer by the weight below it over its stiffness."""
        system, state = scenes.hanging_rope(particles=6, mass=0.2, stiffness=50.0)
        x = state.positions.copy()
        below = 6 - 1 - np.arange(5)
        x[1:, 1] = -np.cumsum(system.rest_lengths + below * 0.2 * 9.81 / 50.0)
        pulls = forces(system, type(state)(x, np.zeros_like(x)))
        # The springs' forces, of about 10 N, cancel the weights to rounding.
        np.testing.assert_allclose(pulls[1:], 0, atol=1e-13)
        assert pulls[0, 1] == pytest.approx(-6 * 0.2 * 9.81, rel=1e-13)


@pytest.mark.parametrize("scene", SCENES)
def test_it_starts_at_rest_and_unstretched(scene):
    system, state = scene()
    assert (state.velocities == 0).all()
    # Two ways to round a length of at most 1 m.
    found = lengths(system, state.positions)
    np.testing.assert_allclose(found, system.rest_lengths, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("scene", "name", "value"),
    [
        (scenes.lab_cloth, "size", 1),
        (scenes.lab_cloth, "size", 2.5),
        (scenes.lab_cloth, "side", 0.0),
        (scenes.lab_cloth, "height", np.nan),
        (scenes.hanging_rope, "particles", 1),
        (scenes.hanging_rope, "length", -1.0),
        *((scene, "mass", 0.0) for scene in SCENES),
        *((scene, "stiffness", -1.0) for scene in SCENES),
        *((scene, "damping", -0.2) for scene in SCENES),
        *((scene, "gravity", np.inf) for scene in SCENES),
    ],
)
def test_wrong_settings_are_named(scene, name, value):
    with pytest.raises(ValueError, match=f"^{name}: "):
        scene(**{name: value})
