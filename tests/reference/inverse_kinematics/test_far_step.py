"""Newton's steps out of reach: their Hessian, few iterations, and the nearest pose."""

import numpy as np
import pytest

from plumbob import Articulation, Outcome, Skeleton, Target, rotation, solve_ik
from plumbob.reference.jacobians import integrate

KINDS = ["hinge", "ball", "hinge", "slide", "hinge", "hinge", "fixed"]


def limb(limit=np.inf):
    rng = np.random.default_rng(3)
    skeleton = Skeleton(range(-1, 6), rng.normal(size=(7, 3)) * 0.4, list("abcdefg"))
    axes = rng.normal(size=(7, 3))
    bounds = {"hinge": limit, "slide": 0.3, "ball": np.inf, "fixed": 0.0}
    upper = np.array([bounds[kind] for kind in KINDS])
    return Articulation(skeleton, KINDS, axes, lower=-upper, upper=upper, mimics={"f": ("c", -0.7)})


@pytest.mark.sample(without=["damped_least_squares"])
@pytest.mark.parametrize("solver", ["levenberg_marquardt", "damped_least_squares"])
@pytest.mark.parametrize("oriented", [False, True])
def test_few_iterations_find_where_no_small_step_comes_nearer(solver, oriented):
    model, rng = limb(2.0), np.random.default_rng(4)
    counts = []
    for _ in range(10):
        x = rng.normal(size=3)
        x, R = 9.0 * x / np.linalg.norm(x), rotation.random(rng) if oriented else None
        target, start = Target(x, R), model.random(rng)
        solution = solve_ik(model, start, target, solver)
        assert solution.outcome == Outcome.UNREACHABLE
        counts.append(solution.iterations)
        steps = [0.01 * rng.normal(size=model.freedom_count) for _ in range(20)]
        for step in steps:
            q = model.clamp(integrate(model, solution.coordinates, step))
            near = solve_ik(model, q, target, solver, restarts=0, max_iterations=0)
            assert near.merit >= solution.merit - 1e-9
    assert np.median(counts) <= 20
