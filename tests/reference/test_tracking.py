import numpy as np
import pytest

from reference import IK_SOLVERS, Outcome, curves, rotation, scenes, solve_ik, track


@pytest.fixture
def arm():
    return scenes.lab_arm()[0]


@pytest.mark.parametrize("solver", IK_SOLVERS)
@pytest.mark.parametrize("name", curves)
@pytest.mark.parametrize("warm", [True, False])
def test_the_arm_draws_every_curve_to_a_tenth_of_a_millimetre(arm, name, solver, warm):
    curve = curves[name]()
    motion = track(arm, curve, solver, warm=warm)
    assert (motion.outcome == Outcome.CONVERGED).all()
    assert np.linalg.norm(motion.positions[:, -1] - curve, axis=-1).max() <= 1e-4
    assert np.ptp(motion.positions[:, -1], axis=0).max() > 0.1


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


@pytest.mark.parametrize("solver", IK_SOLVERS)
def test_a_cold_frame_starts_from_the_given_pose(arm, solver, rng, backend):
    curve, start = curves["circle"](5), rotation.random(rng, 5)
    motion = track(arm, curve, solver, start, warm=False)
    assert (motion.local_rotations == solve_ik(arm, start, curve, solver).local_rotations).all()


@pytest.mark.parametrize(
    "options",
    [{"effector": "palm"}, {"tolerance": 1e-9}, {"max_iterations": 1}, {"record": True}],
    ids=lambda options: next(iter(options)),
)
def test_a_cold_motion_is_a_batch_solved_with_the_same_options(arm, options, rng, backend):
    curve, start = curves["circle"](5), rotation.random(rng, 5)
    motion = track(arm, curve, "fabrik", start, warm=False, **options)
    batch = solve_ik(arm, start, curve, "fabrik", **options)
    for tracked, solved in zip(motion, batch, strict=True):
        np.testing.assert_array_equal(tracked, solved)


@pytest.mark.parametrize("solver", ["ccd", "fabrik"])
def test_warm_starts_keep_neighbouring_frames_alike(arm, solver):
    """The triangle's corner lies on the straight arm's line: solved from rest, the arm jumps."""

    def largest_jump(warm):
        q = track(arm, curves["triangle"](), solver, warm=warm).local_rotations
        return rotation.angle(q[1:], q[:-1]).max()

    assert largest_jump(warm=True) < 0.1 < 1.0 < largest_jump(warm=False)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"curve": np.zeros((0, 3))}, "curve: expected at least one point"),
        ({"curve": np.zeros((4, 2))}, "curve: expected shape"),
        ({"start": np.zeros((5, 4))}, "start: expected unit quaternions"),
        ({"start": np.zeros((2, 5, 4))}, r"start: expected shape \(5, 4\)"),
        ({"solver": "pid"}, "solver: expected one of ccd, fabrik"),
    ],
)
def test_bad_input_is_named(arm, change, message):
    with pytest.raises(ValueError, match=message):
        track(arm, **({"curve": curves["circle"](3)} | change))
