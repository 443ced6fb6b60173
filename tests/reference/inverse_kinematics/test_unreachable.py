"""Out of reach: what is proven, whether the iterations settled, and how much is left to gain."""

import numpy as np
import pytest

from plumbob import prepare_ik
from plumbob.reference import (
    Articulation,
    Outcome,
    Skeleton,
    Target,
    rotation,
    scenes,
    solve_ik,
    track,
)

CLAW = Skeleton([-1, 0, 1, 2], [[0, 0, 0], [0.5, 0, 0], [0, 3.0, 0], [0, 0, 0.5]])


def nearest(chain, target):
    """Return the least distance from the last joint of a chain to a target."""
    lengths, d = chain.link_lengths, np.linalg.norm(np.asarray(target) - chain.offsets[0])
    return max(0.0, d - lengths.sum(), 2.0 * lengths.max() - lengths.sum() - d)


PLACES = [[3.0, 0.0, 4.0], [0.0, 5.0, 0.0], [2.9, 0.3, 0.2], [50.0, 0.0, 0.0], [0.0, -300.0, 40.0]]


@pytest.mark.parametrize("target", PLACES)
def test_by_default_a_chain_settles_at_the_nearest_point(target, solver):
    """Levenberg-Marquardt left the arm 0.1 m from it; steps of two others swung by metres."""
    arm, rest = scenes.lab_arm()
    solution = solve_ik(arm, rest, target, solver)
    assert solution.outcome is Outcome.UNREACHABLE
    assert solution.residual <= nearest(arm, target) + 1e-4
    assert solution.excess == pytest.approx(solution.residual - nearest(arm, target), abs=1e-12)


@pytest.mark.parametrize("depth", [0.1, 0.9, 1.0])
def test_by_default_a_chain_settles_at_the_rim_of_its_hole(depth, solver):
    solution = solve_ik(CLAW, rotation.identity(4), [0.0, 0.0, 2.0 * (1.0 - depth)], solver)
    assert solution.outcome is Outcome.UNREACHABLE
    assert solution.excess == pytest.approx(solution.residual - 2.0 * depth, abs=1e-12)
    assert solution.excess <= 1e-4


@pytest.mark.parametrize("restarts", [0, 1])
@pytest.mark.parametrize("articulated", [False, True])
def test_iterations_given_are_kept_and_an_unfinished_solve_says_so(articulated, restarts, solver):
    arm, rest = scenes.lab_arm()
    model, q = (Articulation(arm), rest.ravel()) if articulated else (arm, rest)
    options = {"max_iterations": 1, "restarts": restarts}
    solution = solve_ik(model, q, [3.0, 0.5, 4.0], solver, **options)
    assert solution.iterations <= 2 + 3 * restarts
    assert solution.outcome.unreachable
    assert solution.excess == pytest.approx(solution.residual - nearest(arm, [3.0, 0.5, 4.0]))
    settled = solution.outcome is Outcome.UNREACHABLE
    assert settled == (solution.excess <= 1e-4)


@pytest.mark.parametrize("solver", ["levenberg_marquardt", "ccd", "fabrik"], indirect=True)
def test_by_default_a_robot_settles(solver, chain_of_joints, rng):
    """Where more iterations change nothing; what they have not reached is above the bound."""
    model = chain_of_joints("hinge", rng, links=5, lower=-1.8, upper=1.8)
    for _ in range(5):
        direction = rotation.rotate(rotation.random(rng), [0.0, 0.0, 1.0])
        target = model.skeleton.offsets[0] + 1.5 * model.skeleton.reach() * direction
        q = model.random(rng)
        solution = solve_ik(model, q, target, solver)
        assert solution.outcome is Outcome.UNREACHABLE
        more = solve_ik(model, q, target, solver, max_iterations=20000)
        assert more.residual == pytest.approx(solution.residual, abs=1e-9)
        assert 0.0 < solution.excess <= solution.residual
        assert solution.excess == pytest.approx(
            solution.residual - 0.5 * model.skeleton.reach(), abs=1e-12
        )


def arm_with_limits(rng):
    """Return seven hinges with limits, and a position beyond all of them."""
    axes = rotation.rotate(rotation.random(rng, 8), [0.0, 0.0, 1.0])
    skeleton = Skeleton(range(-1, 7), 0.4 * rng.standard_normal((8, 3)))
    direction = rotation.rotate(rotation.random(rng), [0.0, 0.0, 1.0])
    position = skeleton.offsets[0] + rng.uniform(1.05, 4.0) * skeleton.reach() * direction
    return Articulation(skeleton, "hinge", axes, lower=-1.8, upper=1.8), position


@pytest.mark.parametrize("oriented", [False, True])
@pytest.mark.sample(without=["damped_least_squares"])
@pytest.mark.parametrize("solver", ["levenberg_marquardt", "damped_least_squares"])
def test_no_damped_step_swings_about_the_nearest_pose_for_ever(solver, oriented, rng):
    """Where the damping does not follow the error, a tenth of the poses does, or most of them."""
    settled = 0
    for _ in range(20):
        model, position = arm_with_limits(rng)
        target = Target(position, rotation.random(rng) if oriented else None, model.joint_count - 1)
        solution = solve_ik(model, model.random(rng), target, solver)
        assert solution.outcome.unreachable
        settled += solution.outcome is Outcome.UNREACHABLE
    assert settled == 20


@pytest.mark.parametrize("oriented", [False, True])
def test_an_answer_as_near_as_geometry_allows_ends_all_attempts(oriented, backend):
    """The last ball rotates the effector on the spot: position and rotation are both at best."""
    arm, rest = scenes.lab_arm()
    model = Articulation(arm, "ball")
    R = rotation.random(np.random.default_rng(2))
    target = Target([3.0, 0.5, 4.0], R if oriented else None, arm.joint_count - 1)
    once, again = (
        solve_ik(model, rest.ravel(), target, "levenberg_marquardt", restarts=n) for n in (0, 20)
    )
    assert once.outcome is again.outcome is Outcome.UNREACHABLE
    assert again.iterations <= once.iterations
    assert max(once.excess, again.excess, again.residual_rotation) <= 1e-4


def elbow(low, high):
    """Return a shoulder without limits and an elbow with limits, links of 0.5 and 0.3 m."""
    links = Skeleton([-1, 0, 1, 2], [[0, 0, 0.2], [0, 0, 0], [0.5, 0, 0], [0.3, 0, 0]])
    kinds, axes = ["hinge", "hinge", "hinge", "fixed"], [[0, 0, 1], *[[0, 1, 0]] * 3]
    limits = {"lower": [-np.inf, -np.inf, low, 0], "upper": [np.inf, np.inf, high, 0]}
    return Articulation(links, kinds, axes, **limits)


def outcomes_of_all_routes(model, target, **options):
    """Return the outcomes of a single solve, of a batch, of one prepared, and of two effectors."""
    q, places = model.neutral(), np.tile(target, (2, 1))
    both = [Target(target, effector=3), Target(model.skeleton.offsets[0], effector=0)]
    prepared = prepare_ik(model, "levenberg_marquardt", **options)
    solver = "levenberg_marquardt"
    return [
        solve_ik(model, q, target, solver, **options).outcome,
        solve_ik(model, q.tolist(), target, solver, **options).outcome,
        *solve_ik(model, q, places, solver, **options).outcome,
        *track(model, places, solver, start=q, **options).outcome,
        prepared(q, target),
        solve_ik(model, q, both, solver, **options).outcome,
    ]


@pytest.mark.parametrize("bend", [0.4, 2.0])
def test_limits_that_forbid_a_distance_prove_it_unreachable(bend, backend):
    """By the law of cosines; every route said STALLED."""
    model, direction = elbow(0.4, 2.0), np.array([0.6, 0.48, 0.64])
    edge, side = np.sqrt(0.34 + 0.3 * np.cos(bend)), 1.0 if bend == 0.4 else -1.0
    for beyond in (-2e-3, 2e-3):  # shells are within 1e-3 of the links' length
        target = model.skeleton.offsets[0] + (edge + side * beyond) * direction
        outcomes = outcomes_of_all_routes(model, target)
        expected = {Outcome.UNREACHABLE} if beyond > 0.0 else {Outcome.CONVERGED}
        assert set(outcomes) == expected
        if beyond > 0.0:
            for limit in (0, 1):
                assert {
                    Outcome(outcome).unreachable
                    for outcome in outcomes_of_all_routes(model, target, max_iterations=limit)
                } == {True}
            near = solve_ik(model, model.neutral(), target, tolerance=3e-3)
            assert near.outcome is Outcome.CONVERGED


SEVERAL = ["hinge", "slide", "hinge", "ball", "hinge", "fixed", "hinge"]
KINDS = [["hinge"] * 6, SEVERAL, ["slide", "hinge", "hinge", "fixed"], ["ball", "hinge", "ball"]]


@pytest.mark.parametrize("kinds", KINDS)
def test_what_a_pose_nearly_reaches_is_not_unreachable(articulated, kinds):
    """Within both tolerances, which are large."""
    for seed in range(12):
        model, rng = articulated(kinds, seed), np.random.default_rng(seed)
        tip = model.joint_count - 1
        for _ in range(4):
            x, R = (part[tip] for part in model.forward(model.random(rng)))
            directions = rng.standard_normal((2, 3))
            v, turn = 0.1 * directions / np.linalg.norm(directions, axis=1)[:, None]
            Q = rotation.multiply(rotation.exponential(3.0 * turn), R)
            options = {"tolerance": 0.1 + 1e-9, "tolerance_rotation": 0.3 + 1e-9}
            options |= {"restarts": 0, "max_iterations": 0}
            target = Target(x + v, Q, tip)
            solution = solve_ik(model, model.random(rng), target, "ccd", **options)
            assert not solution.outcome.unreachable
