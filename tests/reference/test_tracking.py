import numpy as np
import pytest

from plumbob.reference import (
    IK_SOLVERS,
    Articulation,
    Outcome,
    Skeleton,
    curves,
    rotation,
    scenes,
    solve_ik,
    track,
)


@pytest.fixture
def arm():
    return scenes.lab_arm()[0]


@pytest.mark.sample(without=["damped_least_squares", "jacobian_transpose", "anderson_ccd"], every=4)
@pytest.mark.parametrize("solver", IK_SOLVERS)
@pytest.mark.parametrize("name", curves)
@pytest.mark.parametrize("warm", [True, False])
def test_the_arm_draws_every_curve_to_a_tenth_of_a_millimetre(arm, name, solver, warm):
    curve = curves[name]()
    motion = track(arm, curve, solver, warm=warm)
    assert (motion.outcome == Outcome.CONVERGED).all()
    assert np.linalg.norm(motion.positions[:, -1] - curve, axis=-1).max() <= 1e-4
    assert np.ptp(motion.positions[:, -1], axis=0).max() > 0.1


@pytest.mark.sample(without=["damped_least_squares", "jacobian_transpose", "anderson_ccd"])
@pytest.mark.parametrize("solver", IK_SOLVERS)
def test_a_warm_frame_starts_from_the_last_one_s_solution(arm, solver, backend):
    curve = curves["circle"](5)
    motion = track(arm, curve, solver, record=True)
    for i in range(1, 5):
        one = solve_ik(arm, motion.local_rotations[i - 1], curve[i], solver)
        np.testing.assert_allclose(
            motion.local_rotations[i], one.local_rotations, rtol=0, atol=1e-14
        )
        assert motion.iterations[i] == one.iterations


@pytest.mark.sample(without=["damped_least_squares", "jacobian_transpose", "anderson_ccd"])
@pytest.mark.parametrize(
    "options",
    [
        {"effector": "palm"},
        {"tolerance": 1e-9},
        {"max_iterations": 1},
        {"record": True},
        *({"solver": name} for name in IK_SOLVERS),
    ],
    ids=lambda options: "-".join(map(str, *options.items())),
)
def test_a_cold_motion_is_a_batch_solved_with_the_same_options(arm, options, rng, backend):
    curve, start = curves["circle"](5), rotation.random(rng, 5)
    options = {"solver": "fabrik"} | options
    motion = track(arm, curve, start=start, warm=False, **options)
    batch = solve_ik(arm, start, curve, **options)
    for tracked, solved in zip(motion, batch, strict=True):
        np.testing.assert_array_equal(tracked, solved)


def test_a_motion_that_leaves_the_range_of_numbers_is_an_error_of_its_own():
    """A free joint has to go beyond 1e75 to bring the effector back to the origin."""
    tree = Skeleton([-1, 0, 1, 2], [[0, 0, 0], [1e75, 0, 0], [0, 1e75, 0], [1e75, 0, 0]])
    robot = Articulation(tree, ["hinge", "slide", "ball", "free"])
    curve = np.random.default_rng(0).uniform(-1.0, 1.0, (5, 3))
    with pytest.raises(FloatingPointError, match=r"track: .* left the numbers up to 1e"):
        track(robot, curve, max_iterations=20)
