"""Levenberg-Marquardt, the same on everyone's kinematics."""

import numpy as np
import pytest

from bench.experiments.chain.problem import chain_targets
from bench.peers.ik.levenberg_marquardt import levenberg_marquardt
from bench.peers.ik.reference_kinematics import ReferenceKinematics
from crosscheck.engines import SKELETON_ENGINES
from crosscheck.engines.skeleton_engine import coordinates
from reference import Skeleton, forward_kinematics, rotation, solve_ik

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


def test_out_of_reach_all_iterations_are_made():
    problem = chain_targets("beyond", 1)
    kinematics = ReferenceKinematics(problem.skeleton)
    q = coordinates(kinematics, problem.starts)[0]
    effector = problem.skeleton.joint_count - 1
    answer = levenberg_marquardt(
        kinematics, q, problem.targets[0], effector, tolerance=1e-6, max_iterations=3
    )
    assert answer.iterations == 3
    assert answer.residual > 0


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
