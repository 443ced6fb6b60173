"""Prepared solves: the bits of `solve_ik`, into the same arrays every time."""

import copy
import pickle

import numpy as np
import pytest

from plumbob import Articulation, Skeleton, Target, prepare_ik, rotation, solve_ik

OFFSETS = [[0.0, 0.0, 0.4]] * 7
SKELETON = Skeleton(range(-1, 6), OFFSETS)
ARM = Articulation(SKELETON, "hinge", np.eye(3)[[2, 1, 0, 1, 2, 1, 0]], lower=-2.5, upper=2.5)
FIGURES = ("residual", "residual_rotation", "iterations", "outcome", "merit", "excess")


@pytest.mark.parametrize("target_type", [np.array, list])
@pytest.mark.parametrize("oriented", [False, True])
@pytest.mark.parametrize("model", [SKELETON, ARM], ids=["skeleton", "arm"])
def test_prepared_solves_are_those_of_solve_ik(model, oriented, target_type):
    if model is SKELETON and oriented:
        with pytest.raises(ValueError, match="model: expected an Articulation"):
            prepare_ik(model, oriented=oriented)
        return
    rng, solve = np.random.default_rng(0), prepare_ik(model, oriented=oriented, tolerance=1e-6)
    assert np.isnan(solve.coordinates).all()
    for _ in range(3):
        start = rotation.random(rng, 7) if model is SKELETON else model.random(rng)
        x, R = rng.normal(size=3) * 0.6, rotation.random(rng)
        outcome = solve(start, target_type([*x, *R] if oriented else x))
        expected = solve_ik(model, start, Target(x, R if oriented else None, 6), tolerance=1e-6)
        np.testing.assert_array_equal(solve.coordinates, expected.coordinates)
        np.testing.assert_array_equal(solve.positions, expected.positions)
        assert solve.figures.tolist() == [getattr(expected, name) for name in FIGURES]
        assert outcome is expected.outcome
    assert not solve.coordinates.flags.writeable


@pytest.mark.parametrize(
    "duplicate", [copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))]
)
@pytest.mark.parametrize("model", [SKELETON, ARM], ids=["skeleton", "arm"])
def test_a_copy_of_prepared_solves_has_arrays_of_its_own(model, duplicate):
    rng, solve = np.random.default_rng(1), prepare_ik(model)
    start = rotation.random(rng, 7) if model is SKELETON else model.random(rng)
    targets = rng.normal(size=(2, 3)) * 0.6
    solve(start, targets[0])
    other = duplicate(solve)
    other(start, targets[1])
    for prepared, target in zip((solve, other), targets, strict=True):
        expected = solve_ik(model, start, target)
        np.testing.assert_array_equal(prepared.coordinates, expected.coordinates)
        assert prepared.figures[0] == expected.residual
