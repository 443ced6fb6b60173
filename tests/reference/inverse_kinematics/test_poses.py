"""Targets of position and rotation."""

import pickle

import numpy as np
import pytest

from plumbob.reference import (
    Articulation,
    Outcome,
    Skeleton,
    Target,
    forward_kinematics,
    rotation,
    solve_ik,
)

# Of 20 targets that a pose reaches, from one start and then up to five more; limits as the models'.
REACHED = {
    ("levenberg_marquardt", "ball", "one"): 20,
    ("levenberg_marquardt", "hinge", "one"): 6,
    ("levenberg_marquardt", "hinge", "more"): 15,
    ("damped_least_squares", "ball", "one"): 18,
    ("ccd", "ball", "one"): 10,
    ("fabrik", "ball", "one"): 3,
}


@pytest.mark.sample(without=["damped_least_squares"])
@pytest.mark.parametrize(("solver", "kind", "starts"), REACHED)
def test_poses_that_can_be_reached_are(solver, kind, starts, chain_of_joints, rng):
    links = {"ball": 4, "hinge": 7}[kind]
    model, reached = chain_of_joints(kind, rng, links), 0
    for _ in range(20):
        there = forward_kinematics(model, model.random(rng))
        target = Target(there.positions[-1], there.rotations[-1])
        solution = solve_ik(
            model, model.random(rng), target, solver, max_iterations=500,
            tolerance=1e-3, tolerance_rotation=2e-3, restarts=5 if starts == "more" else 0,
        )  # fmt: skip
        pose = forward_kinematics(model, solution.coordinates)
        angle = rotation.angle(pose.rotations[-1], target.rotation)
        assert solution.residual_rotation == pytest.approx(angle, abs=1e-13)
        here = np.linalg.norm(pose.positions[-1] - target.position) <= 1e-3 and angle <= 2e-3
        assert (solution.outcome is Outcome.CONVERGED) == here
        reached += here
    assert reached >= REACHED[solver, kind, starts]


def test_a_skeleton_s_effector_rotates_where_its_rotation_is_asked_for(
    skeleton, local, solver, rng, backend
):
    there = forward_kinematics(skeleton, rotation.random(rng, 6))
    single = solve_ik(skeleton, local, Target(there.positions[-1]), solver, max_iterations=3)
    posed = solve_ik(
        skeleton, local, Target(there.positions[-1], there.rotations[-1]), solver, max_iterations=3
    )
    np.testing.assert_allclose(single.local_rotations[-1], local[-1], rtol=0, atol=1e-15)
    assert rotation.angle(posed.local_rotations[-1], local[-1]) > 1e-3
    before = rotation.angle(forward_kinematics(skeleton, local).rotations[-1], there.rotations[-1])
    assert posed.residual_rotation < before
    assert single.residual_rotation == 0.0


def test_the_sign_of_the_target_s_quaternion_does_not_matter(solver, backend, articulated, rng):
    model = articulated(["ball", "hinge", "ball", "slide", "hinge", "ball"], 5)
    there, q = forward_kinematics(model, model.random(rng)), model.random(rng)
    target = Target(there.positions[-1], there.rotations[-1], -1)
    here = solve_ik(model, q, target, solver, max_iterations=5)
    there = solve_ik(model, q, target._replace(rotation=-target.rotation), solver, max_iterations=5)
    assert (there.coordinates == here.coordinates).all()
    assert there.residual_rotation == here.residual_rotation


@pytest.mark.parametrize("angle", [np.pi, np.pi - 1e-9, 3.0])
def test_a_rotation_by_pi_is_made_good(solver, angle, backend):
    """Where both directions are as long, one is taken."""
    joint = Articulation(Skeleton([-1, 0], [[0, 0, 0], [0.5, 0, 0]]), ["ball", "fixed"])
    Q = rotation.exponential([0.0, 0.0, angle])
    target = Target(rotation.rotate(Q, [0.5, 0, 0]), Q)
    solution = solve_ik(joint, joint.zero(), target, solver, max_iterations=300)
    assert solution.outcome is Outcome.CONVERGED
    assert solution.residual_rotation <= 1e-4


def test_both_tolerances_must_be_kept(solver, backend):
    """A hinge far off the axis: position and rotation are met together, at different pace."""
    arm = Articulation(Skeleton([-1, 0], [[0, 0, 0], [1.0, 0, 0]]), ["hinge", "fixed"])
    Q = rotation.exponential([0.0, 0.0, 1e-3])
    near = Target([np.cos(1e-3), np.sin(1e-3), 0.0], Q)
    for tolerances, iterations in (((1e-2, 1e-2), 0), ((1e-2, 1e-4), 1), ((1e-4, 1e-2), 1)):
        solution = solve_ik(
            arm, [0.0], near, solver, tolerance=tolerances[0], tolerance_rotation=tolerances[1]
        )
        assert min(solution.iterations, 1) == iterations
        assert solution.outcome is Outcome.CONVERGED


@pytest.mark.parametrize("change", [lambda x: x, np.array, lambda x: pickle.loads(pickle.dumps(x))])
def test_a_solve_is_the_same_wherever_its_arrays_come_from(change, articulated):
    """A pickled array has a type of its own, equal to that of others."""
    arm = articulated(["hinge"] * 6, 3)
    pose = forward_kinematics(arm, arm.random(np.random.default_rng(5)))
    target = Target(change(pose.positions[-1]), change(pose.rotations[-1]), arm.names[-1])
    expected = solve_ik(arm, arm.neutral().tolist(), target, "levenberg_marquardt", restarts=3)
    for one in (target, [target], target._replace(effector=5)):
        found = solve_ik(arm, change(arm.neutral()), one, "levenberg_marquardt", restarts=3)
        np.testing.assert_array_equal(found.coordinates, expected.coordinates)
