"""The named mass-spring scenes are what they are said to be."""

import itertools

import numpy as np
import pytest

from plumbob.reference import scenes
from plumbob.reference.mass_spring import lengths, stretches

SCENES = [scenes.lab_cloth, scenes.hanging_rope, scenes.grid_cloth, scenes.net, scenes.lattice]

# Two triangles that share an edge of 1 m, and a vertex that belongs to neither.
KITE = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0, 0.6], [0.5, 0, -0.8], [9, 9, 9]], dtype=float)
TWO = np.array([[0, 1, 2], [1, 0, 3]])


def pairs(system):
    """Return the two ends of each spring, in ascending order, as a set; they must be different."""
    found = {tuple(sorted(pair)) for pair in system.springs.tolist()}
    assert len(found) == len(system.springs)
    return found


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
        kinds = {(0, 1), (1, 0), (0, 2), (2, 0), (1, 1)}
        expected = set()
        for a in range(size * size):
            for b in range(a):
                rows, columns = abs(a // size - b // size), abs(a % size - b % size)
                if (rows, columns) in kinds:
                    expected.add((b, a))
        assert pairs(system) == expected


class TestGridCloth:
    @pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 4), (3, 1), (2, 5), (4, 3)])
    def test_rows_lie_along_x_and_columns_along_z(self, rows, columns):
        system, state = scenes.grid_cloth(rows, columns, spacing=0.5)
        x = state.positions.reshape(rows, columns, 3)
        np.testing.assert_array_equal(x[..., 0], np.tile(0.5 * np.arange(rows)[:, None], columns))
        assert (np.diff(x[..., 2], axis=1) == 0.5).all()
        assert x[..., 2].mean() == 0
        steps = {(0, 1), (1, 0), (0, 2), (2, 0), (1, 1)}
        for a, b in pairs(system):
            assert (b // columns - a // columns, abs(b % columns - a % columns)) in steps

    def test_the_three_families_have_stiffnesses_of_their_own(self):
        system, _ = scenes.grid_cloth(
            4, 5, spacing=1.0, stiffness=1.0, shear_stiffness=2.0, bending_stiffness=3.0
        )
        expected = {1.0: 1.0, np.sqrt(2): 2.0, 2.0: 3.0}
        assert set(system.rest_lengths) == set(expected)
        assert [expected[r] for r in system.rest_lengths] == system.stiffnesses.tolist()

    def test_a_family_without_stiffness_is_left_out(self):
        system, _ = scenes.grid_cloth(4, 5, shear_stiffness=0.0, bending_stiffness=0.0)
        assert len(system.springs) == 4 * 4 + 3 * 5

    def test_triangles_cover_it_facing_up(self):
        _, state = scenes.grid_cloth(4, 3, spacing=0.5)
        a, b, c = state.positions[scenes.grid_triangles(4, 3).T]
        areas = np.cross(b - a, c - a) / 2
        np.testing.assert_allclose(areas, np.tile([0, 0.125, 0], (12, 1)), rtol=0, atol=1e-15)


class TestNet:
    def test_it_joins_neighbours_by_ropes_and_is_pinned_at_its_corners(self):
        system, _ = scenes.net(3, 4)
        expected = {(a, a + 1) for a in range(12) if a % 4 < 3} | {(a, a + 4) for a in range(8)}
        assert pairs(system) == expected
        assert system.tension_only.all()
        assert system.pinned.tolist() == [0, 3, 8, 11]


class TestLattice:
    def test_springs_are_the_edges_of_tetrahedra_that_fill_each_cube(self):
        """Six to a cube: each path from corner to opposite corner along x, y and z in any order."""
        system, state = scenes.lattice((2, 2, 2), spacing=1.0)
        edges = set()
        volume = 0.0
        for order in itertools.permutations(np.eye(3)):
            corners = np.cumsum([np.zeros(3), *order], axis=0)
            volume += abs(np.linalg.det(np.diff(corners, axis=0))) / 6
            ids = [int(corner @ [4, 2, 1]) for corner in corners]
            np.testing.assert_array_equal(state.positions[ids], corners)
            edges |= set(itertools.combinations(sorted(ids), 2))
        assert volume == pytest.approx(1.0)
        assert pairs(system) == edges

    def test_it_is_clamped_at_x_0(self):
        system, state = scenes.lattice((3, 2, 2))
        clamped = np.zeros(12, dtype=bool)
        clamped[system.pinned] = True
        np.testing.assert_array_equal(clamped, state.positions[:, 0] == 0)


class TestClothFromMesh:
    def test_every_edge_is_a_spring_once(self):
        system, state = scenes.cloth_from_mesh(KITE, TWO, mass=0.1)
        assert pairs(system) == {(0, 1), (0, 2), (1, 2), (0, 3), (1, 3)}
        np.testing.assert_array_equal(state.positions, KITE)

    def test_a_bending_spring_joins_what_faces_across_an_edge(self):
        system, _ = scenes.cloth_from_mesh(
            KITE, TWO, mass=0.1, stiffness=5.0, bending_stiffness=2.0, tension_only=True
        )
        assert system.springs[-1].tolist() == [2, 3]
        assert system.rest_lengths[-1] == pytest.approx(1.4)
        assert system.stiffnesses.tolist() == [5.0] * 5 + [2.0]
        assert system.tension_only.tolist() == [True] * 5 + [False]

    def test_its_triangles_mass_goes_to_its_corners(self):
        system, _ = scenes.cloth_from_mesh(KITE, TWO, density=6.0, pinned=[4])
        # 0.3 and 0.4 m² of 6 kg/m², a third for each corner.
        np.testing.assert_allclose(system.masses, [1.4, 1.4, 0.6, 0.8, 0.0], rtol=1e-15)

    def test_every_two_of_three_triangles_at_an_edge_bend(self):
        x = np.vstack([KITE[:4], [[0.5, 1.0, 0]]])
        triangles = np.vstack([TWO, [[0, 1, 4]]])
        system, _ = scenes.cloth_from_mesh(x, triangles, mass=0.1, bending_stiffness=1.0)
        assert pairs(system) >= {(2, 3), (2, 4), (3, 4)}
        assert len(system.springs) == 7 + 3

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"triangles": [[0, 1, 5]]}, "^triangles: .*from 0 to 4, got 5"),
            ({"triangles": [[0, 1, -1]]}, "^triangles: .*got -1"),
            ({"triangles": [[0, 1, 2], [3, 1, 3]]}, r"^triangles: .*\[3, 1, 3\] at index 1"),
            ({"triangles": [[0, 1, 2], [1, 0, 3], [2, 0, 1]]}, "^triangles: .*indices 0, 2"),
            ({"density": 1.0}, "^density, mass: .*got both"),
            ({"mass": None}, "^density, mass: .*neither"),
            ({"mass": None, "density": 1.0}, "^masses: .*free particles.*index 4"),
        ],
    )
    def test_wrong_meshes_are_named(self, change, message):
        arguments = {"vertices": KITE, "triangles": TWO, "mass": 0.1} | change
        with pytest.raises(ValueError, match=message):
            scenes.cloth_from_mesh(**arguments)

    def test_a_fan_about_one_edge_is_refused_before_it_fills_the_memory(self):
        wings = np.arange(2, 20)
        triangles = np.stack([0 * wings, 0 * wings + 1, wings], axis=1)
        x = np.random.default_rng(0).standard_normal((20, 3))
        scenes.cloth_from_mesh(x, triangles[:16], mass=1.0, bending_stiffness=1.0)
        with pytest.raises(ValueError, match=r"^triangles: expected at most 16 at an edge"):
            scenes.cloth_from_mesh(x, triangles[:17], mass=1.0, bending_stiffness=1.0)


class TestRandomNetwork:
    @pytest.mark.parametrize("seed", range(5))
    def test_it_hangs_together_without_twins(self, seed):
        system, state = scenes.random_network(seed, particles=17, pinned=2)
        reached = {0}
        for _ in range(17):
            reached |= {b for pair in pairs(system) for b in pair if reached & set(pair)}
        assert len(reached) == 17
        assert len(system.pinned) == 2
        assert len(set(system.stiffnesses)) == len(system.springs)
        strain = stretches(system, state.positions) / system.rest_lengths
        assert np.abs(strain).min() > 0.01
        assert strain.min() < 0 < strain.max()


@pytest.mark.parametrize("scene", SCENES)
def test_it_starts_at_rest_and_unstretched(scene):
    system, state = scene()
    assert (state.velocities == 0).all()
    np.testing.assert_array_equal(lengths(system, state.positions), system.rest_lengths)
