"""Levenberg-Marquardt, the same on everyone's kinematics."""

import numpy as np
import pytest

from plumbob.bench.experiments.chain import BEYOND, CHAIN
from plumbob.bench.experiments.chain.measurement import Limits, solve_targets, solve_with_engine
from plumbob.bench.experiments.chain.problem import chain_targets
from plumbob.bench.experiments.chain.tables import beyond_reach
from plumbob.bench.harness.record import Record
from plumbob.bench.harness.results import Results
from plumbob.bench.peers.ik.levenberg_marquardt import levenberg_marquardt, within_reach
from plumbob.bench.peers.ik.reference_kinematics import ReferenceKinematics
from plumbob.crosscheck.engines import SKELETON_ENGINES
from plumbob.crosscheck.engines.skeleton_engine import coordinates
from plumbob.reference import Skeleton, forward_kinematics, rotation, solve_ik

KINEMATICS = {"Plumbob": ReferenceKinematics, **SKELETON_ENGINES}


@pytest.fixture
def tree(rng):
    """Two branches of three joints, in a random pose."""
    skeleton = Skeleton([-1, 0, 1, 2, 1, 4, 5], rng.standard_normal((7, 3)))
    return skeleton, rotation.random(rng, 7)


def test_the_jacobian_is_the_derivative_of_the_position(tree, rng):
    """Central differences at 1e-6 err by about 1e-10: their step squared, and rounding over it."""
    skeleton, local = tree
    kinematics = ReferenceKinematics(skeleton)
    q, h = local.ravel(), 1e-6
    J = kinematics.jacobian(q, 6)
    for i in range(J.shape[1]):
        v = np.zeros(J.shape[1])
        v[i] = h
        ends = [forward_kinematics(skeleton, kinematics.integrate(q, s * v).reshape(-1, 4))
                for s in (1, -1)]  # fmt: skip
        slope = (ends[0].positions[6] - ends[1].positions[6]) / (2 * h)
        np.testing.assert_allclose(J[:, i], slope, atol=1e-9)
    assert np.abs(J).max() > 0.1


@pytest.mark.parametrize("name", KINEMATICS)
def test_every_kinematics_takes_the_same_way_to_the_target(name):
    problem = chain_targets("far", 3)
    effector = problem.skeleton.joint_count - 1
    outcomes = []
    for kind in (ReferenceKinematics, KINEMATICS[name]):
        kinematics = kind(problem.skeleton)
        starts = coordinates(kinematics, problem.starts)
        answers = [
            levenberg_marquardt(kinematics, q, target, effector, tolerance=1e-9, max_iterations=100)
            for q, target in zip(starts, problem.targets, strict=True)
        ]
        found = np.array([answer.q[kinematics.columns] for answer in answers])
        effectors = forward_kinematics(problem.skeleton, found).positions[:, -1]
        assert np.linalg.norm(effectors - problem.targets, axis=-1).max() < 1.1e-9
        outcomes.append(([answer.iterations for answer in answers], effectors))
    assert outcomes[0][0] == outcomes[1][0]
    assert min(outcomes[0][0]) > 1


def test_a_start_at_the_target_takes_no_iteration():
    problem = chain_targets("far", 1)
    kinematics = ReferenceKinematics(problem.skeleton)
    q = coordinates(kinematics, problem.starts)[0]
    effector = problem.skeleton.joint_count - 1
    target = forward_kinematics(problem.skeleton, problem.starts[0]).positions[effector]
    answer = levenberg_marquardt(kinematics, q, target, effector, tolerance=1e-6, max_iterations=9)
    assert answer.iterations == 0
    np.testing.assert_array_equal(answer.q, q)


def test_what_cannot_be_reached_takes_all_iterations():
    problem = chain_targets("far", 1)
    kinematics = ReferenceKinematics(problem.skeleton)
    q = coordinates(kinematics, problem.starts)[0]
    effector, target = problem.skeleton.joint_count - 1, 9.0 * problem.targets[0]
    answer = levenberg_marquardt(kinematics, q, target, effector, tolerance=1e-6, max_iterations=3)
    assert answer.iterations == 3
    assert answer.residual > 0


@pytest.mark.parametrize("engine", SKELETON_ENGINES)
def test_beyond_reach_the_loop_on_an_engine_does_as_the_reference_does(engine):
    """Towards the far target itself it swung for all iterations: 22 of 60 straight, not 60."""
    problem, limits = chain_targets("beyond", 60), Limits(1e-6, 1000)
    ours = solve_targets(problem, "levenberg_marquardt", limits).arrays
    theirs = solve_with_engine(problem, engine, limits).arrays
    np.testing.assert_array_equal(theirs["iterations"], ours["iterations"])
    np.testing.assert_allclose(theirs["excess"], ours["excess"], atol=1e-7)  # a tenth of 1e-6
    settings = {"tolerance": 1e-6, "max_iterations": 1000}
    facts = {"task": CHAIN, "stratum": BEYOND}
    record = Record("ik", "chain/beyond", f"lm/{engine}", settings, 60, theirs, facts=facts)
    (sentence,) = beyond_reach(Results([record])).summary.points
    assert sentence.startswith(f"LM, {engine}: 60/60 = 100 %")


def test_targets_within_reach_stay_where_they_are(rng):
    root, targets = rng.standard_normal(3), rng.standard_normal((50, 3))
    distances = np.linalg.norm(targets - root, axis=-1)
    near = within_reach(targets, root, 2.0)
    np.testing.assert_array_equal(near[distances <= 2.0], targets[distances <= 2.0])
    drawn = np.linalg.norm(near - root, axis=-1)
    np.testing.assert_allclose(drawn, np.minimum(distances, 2.0))
    assert 0 < np.sum(distances > 2.0) < 50


def test_the_loop_and_the_reference_s_solver_are_one_method():
    """Rotations in the world from the left are tangents in the joints' frames from the right."""
    problem = chain_targets("far", 20)
    kinematics = ReferenceKinematics(problem.skeleton)
    effector = problem.skeleton.joint_count - 1
    limits = {"tolerance": 1e-6, "max_iterations": 100}
    ours = solve_ik(
        problem.skeleton, problem.starts, problem.targets, "levenberg_marquardt", **limits
    )
    starts = coordinates(kinematics, problem.starts)
    answers = [
        levenberg_marquardt(kinematics, q, target, effector, **limits)
        for q, target in zip(starts, problem.targets, strict=True)
    ]
    assert [answer.iterations for answer in answers] == ours.iterations.tolist()
    np.testing.assert_allclose([answer.residual for answer in answers], ours.residual, atol=1e-12)
