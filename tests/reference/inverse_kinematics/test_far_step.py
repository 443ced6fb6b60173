"""Newton's steps out of reach: their Hessian, few iterations, and the nearest pose."""

import numpy as np
import pytest

from plumbob import Articulation, Outcome, Skeleton, Target, rotation, solve_ik
from plumbob.reference.inverse_kinematics.box_step import fill_errors, linearise_task, new_system
from plumbob.reference.inverse_kinematics.far_step import fill_hessian
from plumbob.reference.inverse_kinematics.mechanism import (
    TARGET,
    new_data,
    update_forward_kinematics,
)
from plumbob.reference.inverse_kinematics.reduce import prepare
from plumbob.reference.jacobians import integrate

# Second differences with this step are off by its square and by rounding over its square, 1e-8.
STEP, DIFFERENCES = 1e-4, 2e-6
KINDS = ["hinge", "ball", "hinge", "slide", "hinge", "hinge", "fixed"]


def limb(limit=np.inf):
    rng = np.random.default_rng(3)
    skeleton = Skeleton(range(-1, 6), rng.normal(size=(7, 3)) * 0.4, list("abcdefg"))
    axes = rng.normal(size=(7, 3))
    bounds = {"hinge": limit, "slide": 0.3, "ball": np.inf, "fixed": 0.0}
    upper = np.array([bounds[kind] for kind in KINDS])
    return Articulation(skeleton, KINDS, axes, lower=-upper, upper=upper, mimics={"f": ("c", -0.7)})


@pytest.mark.parametrize("oriented", [False, True])
def test_the_hessian_is_that_of_the_cost(oriented):
    model, rng = limb(), np.random.default_rng(1)
    mechanism = prepare(model, (6,), (oriented,)).mechanism
    target = np.zeros(1, TARGET)
    target["position"], target["rotation"] = rng.normal(size=3), rotation.random(rng)
    target["weight"] = 0.7
    data, system = new_data(mechanism), new_system(mechanism.equations, mechanism.freedoms)
    q = model.random(rng)
    units = np.ones(model.freedom_count)
    units[model.freedoms_of("d")] = mechanism.reach

    def cost(step):
        data.q[:] = integrate(model, q, units * step)
        update_forward_kinematics(mechanism, data)
        fill_errors(mechanism, target, data, system.e)
        return 0.5 * system.e @ system.e

    n = model.freedom_count
    steps, differences = STEP * np.eye(n), np.empty((n, n))
    for i in range(n):
        for k in range(n):
            ends = [cost(s * steps[i] + t * steps[k]) * s * t for s in (1, -1) for t in (1, -1)]
            differences[i, k] = sum(ends) / (4.0 * STEP * STEP)
    cost(np.zeros(n))
    linearise_task(mechanism, target, data, system)
    gauss_newton = system.J @ system.J.T
    fill_hessian(mechanism, target, data, system)
    np.testing.assert_allclose(system.H, differences, atol=DIFFERENCES)
    assert np.abs(system.H - gauss_newton).max() > 0.1


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
