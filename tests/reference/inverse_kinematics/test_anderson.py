"""Anderson acceleration: exact where the iteration is linear, and never further off than CCD."""

import numpy as np
import pytest

from plumbob import Articulation, Skeleton, rotation, set_backend, solve_ik
from plumbob.reference.inverse_kinematics.anderson import (
    DEPTH,
    mix,
    mixing_on,
    mixing_size,
)


def mixed(B, c, x, count, scale=1.0):
    """Return x after mixed sweeps x -> B x + c."""
    n = len(x)
    mixing, x = mixing_on(np.empty(mixing_size(n, DEPTH)), n, DEPTH), x.copy()
    mixing.scale[:] = scale
    for _ in range(count):
        mixing.start[:] = x
        x[:] = B @ x + c
        mix(mixing, x)
    return x


@pytest.mark.parametrize("n", [1, 3, DEPTH])
def test_a_linear_iteration_ends_after_as_many_sweeps_as_it_has_numbers(n, rng):
    """Mixing minimises over the Krylov space, as GMRES does (Walker & Ni 2011)."""
    V = np.linalg.qr(rng.standard_normal((n, n)))[0]
    B, c = V * np.linspace(0.2, 0.95, n) @ V.T, rng.standard_normal(n)
    exact = np.linalg.solve(np.eye(n) - B, c)
    start = rng.standard_normal(n)
    assert np.linalg.norm(mixed(B, c, start, n + 2) - exact) < 1e-7 * np.linalg.norm(exact)
    assert np.linalg.norm(mixed(B, c, start, n) - exact) > 1e-7 * np.linalg.norm(exact)


@pytest.mark.parametrize(("distance", "share"), [(0.99, 0.05), (1.02, 0.1), (1.5, 0.5)])
def test_long_chains_need_a_fraction_of_the_sweeps(distance, share, rng):
    n = 20
    chain = Skeleton(range(-1, n), [[0.0, 0.0, 0.0], *[[0.0, 0.0, 1.0 / n]] * n])
    starts = rotation.random(rng, 3, n + 1)
    target = (0.0, distance, 0.0)
    plain, accelerated = (
        solve_ik(chain, starts, target, name, max_iterations=20_000)
        for name in ("ccd", "anderson_ccd")
    )
    assert (plain.outcome == accelerated.outcome).all()
    assert (accelerated.iterations < share * plain.iterations).all()


@pytest.mark.sample("chain")
@pytest.mark.parametrize("backend", ["numba", "python"])
@pytest.mark.parametrize("model", ["chain", "balls", "hinges"])
def test_no_sweep_raises_the_error(model, backend, rng):
    chain = Skeleton(range(-1, 6), [[0.0, 0.0, 0.0], *rng.standard_normal((6, 3))])
    robot = chain if model == "chain" else Articulation(chain)
    if model == "hinges":
        axes = rng.standard_normal((7, 3))
        robot = Articulation(chain, ["hinge"] * 7, axes, lower=-1.0, upper=1.0)
    for scale in (1.0, 4.0):
        start = rotation.random(rng, 7) if model == "chain" else robot.random(rng)
        target = scale * rng.standard_normal(3)
        with set_backend(backend):
            solution = solve_ik(
                robot, start, target, "anderson_ccd", -1, record=True, max_iterations=20
            )
        rises = np.diff(solution.history)
        assert rises.max() <= 1e-13 * (1.0 + solution.history[0])
        assert rises.min() < 0.0


def test_a_batch_remembers_nothing_of_the_target_before(rng):
    chain = Skeleton(range(-1, 5), [[0.0, 0.0, 0.0], *rng.standard_normal((5, 3))])
    target, start = 3.0 * rng.standard_normal(3), rotation.random(rng, 6)
    for model, q in ((chain, start), (Articulation(chain), start.ravel())):
        with set_backend("python"):
            first = solve_ik(model, q, target, "anderson_ccd", -1, max_iterations=7)
            starts = np.stack([q, first.coordinates])
            batch = solve_ik(model, starts, target, "anderson_ccd", -1, max_iterations=7)
            alone = solve_ik(model, first.coordinates, target, "anderson_ccd", -1, max_iterations=7)
        np.testing.assert_array_equal(batch.coordinates[1], alone.coordinates)
        assert batch.iterations[1] > 0
