from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plumbob.reference import (
    IK_SOLVERS,
    Outcome,
    Skeleton,
    forward_kinematics,
    local_from_global,
    rotation,
    scenes,
    solve_ik,
)

# Distances of order one after a sweep over six joints, positions recomputed from rotations.
ROUNDING = 1e-14


@pytest.fixture
def target(rng, skeleton):
    """Return a point that the last joint reaches in some pose."""
    pose = forward_kinematics(skeleton, rotation.random(rng, skeleton.joint_count))
    return pose.positions[-1]


# ---- what every solver promises


def test_joints_off_the_path_and_the_effector_keep_their_local_rotations(
    skeleton, local, solver, backend
):
    effector = 4
    point = forward_kinematics(skeleton, local[::-1]).positions[effector]
    solution = solve_ik(skeleton, local, point, solver, effector)
    off = np.setdiff1d(np.arange(6), skeleton.path(effector)[:-1])
    np.testing.assert_allclose(solution.local_rotations[off], local[off], rtol=0, atol=ROUNDING)
    assert not np.allclose(solution.local_rotations, local)


def test_a_target_already_reached_takes_no_iteration(skeleton, local, solver, backend):
    tip = forward_kinematics(skeleton, local).positions[-1]
    solution = solve_ik(skeleton, local, tip, solver)
    assert (solution.iterations, solution.outcome) == (0, Outcome.CONVERGED)
    np.testing.assert_allclose(solution.local_rotations, local, rtol=0, atol=ROUNDING)
    arm, rest = scenes.lab_arm()
    tip = forward_kinematics(arm, rest).positions[-1]
    assert solve_ik(arm, rest, tip, solver, tolerance=0.0).iterations == 0


def test_the_iteration_limit_is_said_only_when_all_are_used(skeleton, rng):
    """Recomputing the residual from the rotations must not push it over the tolerance again."""
    local, poses = rotation.random(rng, 6), rotation.random(rng, 2000, 6)
    targets = forward_kinematics(skeleton, poses).positions[:, -1]
    many = solve_ik(skeleton, local, targets, "fabrik", tolerance=1e-13, max_iterations=1000)
    assert (many.iterations[many.outcome == Outcome.ITERATION_LIMIT] == 1000).all()
    assert (many.outcome == Outcome.CONVERGED).mean() > 0.5


# ---- targets out of reach


@pytest.mark.parametrize("distance", [1.0, 1.5, 100.0])
def test_fabrik_lays_the_chain_straight_to_a_target_beyond_reach_at_once(
    skeleton, local, distance, rng, backend
):
    root, reach = skeleton.offsets[0], skeleton.reach()
    direction = np.array([0.6, 0.0, -0.8])
    solution = solve_ik(skeleton, local, root + distance * reach * direction, "fabrik")
    along = (solution.positions[skeleton.path()] - root) @ direction
    straight = np.cumsum(skeleton.link_lengths[skeleton.path()])
    np.testing.assert_allclose(along, straight, rtol=0, atol=ROUNDING)
    assert solution.iterations == 1
    expected = Outcome.CONVERGED if distance == 1.0 else Outcome.UNREACHABLE
    assert solution.outcome is expected
    assert solution.residual == pytest.approx((distance - 1.0) * reach, abs=1e-13 * distance)


@pytest.mark.parametrize("solver", ["fabrik", "levenberg_marquardt"], indirect=True)
def test_a_target_just_within_reach_is_reached(skeleton, local, solver, backend):
    root, reach = skeleton.offsets[0], skeleton.reach()
    target = root + 0.995 * reach * np.array([0.6, 0.0, -0.8])
    solution = solve_ik(skeleton, local, target, solver, max_iterations=1000)
    assert solution.outcome is Outcome.CONVERGED


@pytest.mark.parametrize("depth", [0.3, 0.9])
def test_fabrik_folds_the_chain_back_from_a_target_in_the_hole_at_once(depth, rng, backend):
    claw = Skeleton([-1, 0, 1, 2], [[0, 0, 0], [0.5, 0, 0], [0, 3.0, 0], [0, 0, 0.5]])
    target = [0.0, 0.0, 2.0 * (1.0 - depth)]
    solution = solve_ik(claw, rotation.random(rng, 4), target, "fabrik")
    np.testing.assert_allclose(
        solution.positions[:, 2], [0.0, -0.5, 2.5, 2.0], rtol=0, atol=ROUNDING
    )
    assert (solution.iterations, solution.outcome) == (1, Outcome.UNREACHABLE)


# ---- degenerate places


ODD_CHAINS = {
    "two links, at the middle joint": ([[1, 0, 0], [1, 0, 0]], [1, 0, 0], Outcome.CONVERGED),
    "links of no length": (
        [[0, 0, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0], [0, 0, 0]], [0.5, 0.9, 0], Outcome.CONVERGED,
    ),
    "a point": ([[0, 0, 0]], [1, 0, 0], Outcome.UNREACHABLE),
}  # fmt: skip


@pytest.mark.parametrize("name", ODD_CHAINS)
def test_odd_chains_are_answered(name, solver, backend):
    links, target, outcome = ODD_CHAINS[name]
    chain = Skeleton(range(-1, len(links)), [[0, 0, 0], *links])
    solution = solve_ik(chain, rotation.identity(len(links) + 1), target, solver)
    assert solution.outcome is outcome


@pytest.mark.parametrize("links", [1, 2, 5])
def test_a_hair_from_a_straight_chain_s_tip_the_answer_is_finite(links, solver, rng):
    """J J^T is singular there, and the damping of Levenberg-Marquardt is below rounding."""
    for direction in rotation.rotate(rotation.random(rng, 50), [1.0, 0.0, 0.0]):
        chain = Skeleton(range(-1, links), np.outer([0.0] + [1.0] * links, direction))
        hair = 10.0 ** rng.uniform(-16.0, -6.0) * rng.standard_normal(3)
        target = links * direction + hair
        solution = solve_ik(
            chain, rotation.identity(links + 1), target, solver, tolerance=0.0, max_iterations=20
        )
        assert np.isfinite(solution.local_rotations).all()
        assert np.isfinite(solution.residual)
        assert solution.residual < 2.0


# Lengths below 1e-75 but 0 are refused.
coordinates = st.floats(-3.0, 3.0).map(lambda x: x if abs(x) > 1e-70 else 0.0)
points = st.lists(coordinates, min_size=3, max_size=3)


@given(
    links=st.lists(points, min_size=1, max_size=5),
    target=points,
    solver=st.sampled_from(["ccd", "fabrik", "levenberg_marquardt"]),
)
def test_there_is_always_an_answer_and_it_is_true(links, target, solver):
    chain = Skeleton(range(-1, len(links)), [[0.0, 0.0, 0.0], *links])
    solution = solve_ik(chain, rotation.identity(len(links) + 1), target, solver)
    pose = forward_kinematics(chain, solution.local_rotations)
    distance = np.linalg.norm(pose.positions[-1] - target)
    assert solution.residual == pytest.approx(distance, abs=1e-13)
    assert (solution.outcome is Outcome.CONVERGED) == (solution.residual <= 1e-4)
    if solution.outcome is Outcome.UNREACHABLE:
        lengths = chain.link_lengths
        d = np.linalg.norm(target)
        least = max(d - lengths.sum(), 2 * lengths.max() - lengths.sum() - d)
        assert solution.residual >= least - 1e-13 > 0


# ---- CCD, as the textbook has it


def textbook_sweep(skeleton, local, target):
    """Rotate the joints one after another, all positions recomputed after each, in matrices."""
    for j in skeleton.path()[-2::-1]:
        pose = forward_kinematics(skeleton, local)
        to_tip, to_target = pose.positions[-1] - pose.positions[j], target - pose.positions[j]
        rotations = np.array(pose.rotations)
        Q = rotation.between(to_tip, to_target)
        below = [k for k in range(skeleton.joint_count) if j in skeleton.path(k)]
        rotations[below] = rotation.multiply(Q, rotations[below])
        local = local_from_global(skeleton, rotations)
    return local


def test_one_ccd_iteration_is_the_textbook_s(skeleton, local, target, backend):
    expected = textbook_sweep(skeleton, local, target)
    solution = solve_ik(skeleton, local, target, "ccd", tolerance=0.0, max_iterations=1)
    np.testing.assert_allclose(
        np.abs(np.vecdot(solution.local_rotations, expected)), np.ones(6), rtol=0, atol=ROUNDING
    )


@pytest.mark.parametrize("angle", [1.0, 1e-4])
def test_a_chain_off_its_target_s_line_in_only_the_last_link_is_not_bent(angle, backend):
    arm, local = scenes.lab_arm()
    local[-2] = rotation.exponential([angle, 0.0, 0.0])
    target = np.array([0.0, 0.0, 0.0])
    expected = textbook_sweep(arm, local, target)
    solution = solve_ik(arm, local, target, "ccd", tolerance=0.0, max_iterations=1)
    # The rotations' axes are quotients of numbers as small as the angle.
    np.testing.assert_allclose(
        np.abs(np.vecdot(solution.local_rotations, expected)), np.ones(5), rtol=0, atol=1e-9
    )


# ---- FABRIK, as the paper has it


def textbook_fabrik(positions, lengths, target):
    """One backward and one forward pass of Algorithm 1, in the paper's own form."""
    p, n = np.array(positions), len(positions)
    root = p[0].copy()
    p[-1] = target
    for i in range(n - 2, -1, -1):
        lam = lengths[i] / np.linalg.norm(p[i + 1] - p[i])
        p[i] = (1 - lam) * p[i + 1] + lam * p[i]
    p[0] = root
    for i in range(n - 1):
        lam = lengths[i] / np.linalg.norm(p[i + 1] - p[i])
        p[i + 1] = (1 - lam) * p[i] + lam * p[i + 1]
    return p


def test_one_fabrik_iteration_is_the_paper_s(skeleton, local, target, backend):
    path = skeleton.path()
    start = forward_kinematics(skeleton, local).positions[path]
    expected = textbook_fabrik(start, skeleton.link_lengths[path[1:]], target)
    solution = solve_ik(skeleton, local, target, "fabrik", tolerance=0.0, max_iterations=1)
    np.testing.assert_allclose(solution.positions[path], expected, rtol=0, atol=ROUNDING)


def test_fabrik_rotates_links_by_the_shortest_arc_so_that_twist_is_kept(
    skeleton, local, target, backend
):
    solution = solve_ik(skeleton, local, target, "fabrik")
    before = forward_kinematics(skeleton, local)
    after = forward_kinematics(skeleton, solution.local_rotations)
    path = skeleton.path()
    for j, child in pairwise(path):
        link = before.positions[child] - before.positions[j]
        Q = rotation.multiply(after.rotations[j], rotation.conjugate(before.rotations[j]))
        assert Q[1:] @ link == pytest.approx(0.0, abs=1e-13)


# ---- inputs


def test_whatever_comes_in_the_kernel_is_compiled_once(skeleton, local, target, solver):
    """Read-only, strided and single-precision input would each compile another version."""
    wide = np.repeat(local, 2, axis=-1)[:, ::2]
    for start in (local, local.tolist(), wide, np.stack([local, local])[:, None]):
        for point in (target, target.tolist(), np.stack([target] * 3), np.float32(target)):
            first = solve_ik(skeleton, start, point, solver)
            solve_ik(skeleton, first.local_rotations, point, solver)
    assert len(IK_SOLVERS[solver].chain.compiled.signatures) == 1
