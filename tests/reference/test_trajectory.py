"""Smooth trajectories: on the path, within limits, of the least squared displacements nearby."""

import functools

import numpy as np
import pytest

from plumbob.reference import (
    IK_SOLVERS,
    Articulation,
    Mimic,
    Outcome,
    Skeleton,
    Target,
    curves,
    forward_kinematics,
    rotation,
    scenes,
    solve_ik,
    track,
    trajectory,
)
from plumbob.reference.articulation import BALL
from plumbob.reference.inverse_kinematics.mechanism import TARGET
from plumbob.reference.inverse_kinematics.problem import checked_targets
from plumbob.reference.inverse_kinematics.reduce import prepare
from plumbob.reference.inverse_kinematics.solve import balls, target_rows
from plumbob.reference.jacobians import difference, integrate, jacobian
from plumbob.reference.trajectory import riemannian_newton
from plumbob.reference.trajectory.augmented_lagrangian import joint_limits
from plumbob.reference.trajectory.problem import (
    errors_and_jacobians,
    near_singular,
    new_problem,
    project,
)
from plumbob.reference.trajectory.problem import integrate as integrate_step
from plumbob.reference.trajectory.riemannian_newton import (
    CyclicBandedSystem,
    add_limits,
    cost,
    project_derivatives,
    quadratic_model,
)

ARM = scenes.lab_arm()[0]
FRAMES = 60
LM = "levenberg_marquardt"
TOLERANCE = 1e-6


@functools.cache
def drawn(name="heart", solver=LM, coherent=True, closed=False, rounds=1):
    """The lab's arm drawing a curve."""
    curve = np.tile(curves[name](FRAMES), (rounds, 1))
    options = {"coherent": coherent, "closed": closed, "tolerance": TOLERANCE}
    return track(ARM, curve, solver, max_iterations=1000, **options)


def displacements(model, q, closed=False):
    """The change from frame to frame, (displacement, freedom)."""
    found = difference(model, np.roll(q, -1, axis=0), q)
    return found if closed else found[:-1]


def squares(model, q, closed=False):
    return 0.5 * (displacements(model, q, closed) ** 2).sum()


def largest(model, q, closed=False):
    return np.linalg.norm(displacements(model, q, closed), axis=-1).max()


def slides(count=2, **limits):
    """A gantry: slides along x on top of each other, and a tip a metre away, its reach."""
    offsets = np.zeros((count + 1, 3))
    offsets[-1] = 0.0, 0.0, 1.0
    kinds = ["slide"] * count + ["fixed"]
    return Articulation(Skeleton(np.arange(-1, count), offsets), kinds, (1, 0, 0), **limits)


def hinges(count=2, **limits):
    """A chain of hinges about z, links of a metre in the plane."""
    offsets = np.zeros((count + 1, 3))
    offsets[1:, 0] = 1.0
    kinds = ["hinge"] * count + ["fixed"]
    return Articulation(Skeleton(np.arange(-1, count), offsets), kinds, (0, 0, 1), **limits)


def line(start, end, frames=FRAMES):
    return np.linspace(start, end, frames)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("solver", IK_SOLVERS)
@pytest.mark.parametrize("name", ["heart", "triangle"])
def test_a_smooth_trajectory_is_on_its_path_and_its_displacements_are_smaller(name, solver, closed):
    warm, motion = drawn(name, solver, coherent=False), drawn(name, solver, closed=closed)
    assert (motion.outcome == Outcome.CONVERGED).all()
    off = np.linalg.norm(motion.positions[:, -1] - curves[name](FRAMES), axis=-1)
    assert off.max() <= TOLERANCE
    before, after = (squares(ARM, some.local_rotations, closed) for some in (warm, motion))
    assert after < before
    assert largest(ARM, motion.local_rotations, closed) < largest(ARM, warm.local_rotations, closed)


@pytest.mark.parametrize("name", ["circle", "heart", "star"])
def test_a_closed_trajectory_is_as_smooth_at_its_seam_as_elsewhere(name):
    """Solved frame by frame the arm comes back to another pose; the seam is where that shows."""
    for coherent in (False, True):
        motion = drawn(name, "ccd", coherent, closed=coherent)
        steps = np.linalg.norm(displacements(ARM, motion.local_rotations, closed=True), axis=-1)
        assert (steps[-1] <= 1.5 * np.median(steps)) == coherent


def tangents(q, rng, count):
    """Random changes of a motion that keep the tip on its path to first order, of norm 1."""
    J = jacobian(ARM, q)[:, :3]
    along = np.eye(15) - np.linalg.pinv(J) @ J
    for _ in range(count):
        v = (along @ rng.standard_normal((len(q), 15, 1)))[..., 0]
        v[:, 12:] = 0.0
        yield v / np.linalg.norm(v)


@pytest.mark.parametrize("closed", [False, True])
def test_no_small_change_makes_a_trajectory_smoother(closed, rng):
    """To first order the sum stays; a warm motion's does not. Further on it only grows."""
    slopes = {}
    for coherent in (False, True):
        q = drawn("heart", "ccd", coherent, closed=coherent and closed).local_rotations
        h, found = 1e-4, []
        for v in tangents(q, rng, 10):
            sums = [squares(ARM, integrate(ARM, q, s * h * v), closed) for s in (1, -1)]
            found.append(abs(sums[0] - sums[1]) / (2.0 * h))
        slopes[coherent] = max(found)
    assert slopes[True] < 1e-8 < 1e-3 < slopes[False]
    least = squares(ARM, q, closed)
    for v in tangents(q, rng, 5):
        other = integrate(ARM, q, 0.05 * v)
        back = solve_ik(ARM, other, curves["heart"](FRAMES), LM, tolerance=1e-12).local_rotations
        assert squares(ARM, back, closed) > least


def test_a_closed_motion_does_not_depend_on_where_it_begins():
    curve = np.roll(curves["heart"](FRAMES), -17, axis=0)
    later = track(ARM, curve, "fabrik", coherent=True, closed=True, tolerance=TOLERANCE)
    whole = drawn("heart", closed=True).positions
    np.testing.assert_allclose(later.positions, np.roll(whole, -17, axis=0), rtol=0, atol=1e-6)


@pytest.mark.parametrize("elbow", [1.0, -1.0])
def test_two_hinges_follow_a_line_as_trigonometry_says(elbow, backend):
    arm, curve = hinges(), line([0.5, -0.8, 0.0], [0.9, 0.9, 0.0], 9)
    motion = track(arm, curve, LM, [0.0, elbow], coherent=True, tolerance=1e-9)
    x, y = curve[:, 0], curve[:, 1]
    bend = elbow * np.arccos(0.5 * (x * x + y * y) - 1.0)
    expected = np.column_stack([np.arctan2(y, x) - 0.5 * bend, bend])
    np.testing.assert_allclose(motion.coordinates, expected, rtol=0, atol=1e-8)


def test_a_slide_with_limits_goes_as_far_as_they_let_it(backend):
    """Of 3 m the second slide may go 0.6: all of it, evenly, and the first one the rest."""
    gantry = slides(lower=[-9, -0.1, 0], upper=[9, 0.5, 0])
    motion = track(gantry, line([0, 0, 1], [3, 0, 1], 7), LM, coherent=True)
    assert gantry.within_limits(motion.coordinates, 0.0).all()
    np.testing.assert_allclose(motion.coordinates[:, 1], np.linspace(-0.1, 0.5, 7), atol=1e-9)
    assert (motion.outcome == Outcome.CONVERGED).all()


def test_a_continuous_hinge_goes_on_past_half_a_revolution():
    """About its own axis an arm goes round and round; at the seam it is back all the same."""
    circle = 2.0 * curves["circle"](FRAMES)[:, [0, 2, 1]]
    q = track(hinges(3), circle, LM, [0.0, 1.0, 1.0], coherent=True, closed=True).coordinates
    np.testing.assert_allclose(np.diff(q[:, 0]), 2 * np.pi / FRAMES, rtol=0, atol=1e-6)
    np.testing.assert_allclose(q[:, 1:], q[[0] * FRAMES, 1:], rtol=0, atol=1e-5)


@pytest.mark.parametrize("solver", ["ccd", "fabrik", LM])
def test_points_beyond_reach_are_reported_and_the_trajectory_stays_smooth(solver):
    curve = 2.2 * curves["heart"](FRAMES)
    far = np.linalg.norm(curve - ARM.offsets[0], axis=-1) > ARM.reach()
    motion = track(ARM, curve, solver, coherent=True, closed=True)
    assert 5 < far.sum() < FRAMES - 5
    assert (motion.outcome[far] == Outcome.UNREACHABLE).all()
    excess = motion.residual - np.linalg.norm(curve - ARM.offsets[0], axis=-1) + ARM.reach()
    assert excess[far].max() < 0.02
    steps = np.linalg.norm(displacements(ARM, motion.local_rotations, True), axis=-1)
    spacing = np.linalg.norm(np.roll(curve, -1, axis=0) - curve, axis=-1)
    assert (steps < 2.0 * spacing + 0.02).all()


def test_a_frame_that_limits_keep_from_its_point_says_what_its_solver_said():
    arm = hinges(3, lower=[-3, 0.1, 0.1, 0], upper=[3, 1.0, 1.0, 0])
    curve = line([1.0, 0.5, 0.0], [2.6, 0.5, 0.0])
    warm = track(arm, curve, LM, [0.0, 0.8, 0.8])
    motion = track(arm, curve, LM, [0.0, 0.8, 0.8], coherent=True)
    assert set(warm.outcome) == {Outcome.CONVERGED, Outcome.UNREACHABLE}
    np.testing.assert_array_equal(motion.outcome, warm.outcome)
    off = warm.outcome == Outcome.UNREACHABLE
    assert motion.residual[off].mean() < 1.1 * warm.residual[off].mean()
    assert largest(arm, motion.coordinates) < 0.2


def test_a_straight_arm_closes_its_round_too():
    """At exactly full reach no pose can move the tip outwards, and every ball may be twisted."""
    curve = curves["circle"](FRAMES) * np.sqrt(ARM.reach() ** 2 - 1.7**2) / 0.6
    motion = track(ARM, curve, "fabrik", coherent=True, closed=True)
    assert (motion.outcome == Outcome.CONVERGED).all()
    steps = np.linalg.norm(displacements(ARM, motion.local_rotations, True), axis=-1)
    assert steps[-1] < 1.5 * np.median(steps)


def test_a_rotation_is_followed_as_well():
    rotations = rotation.exponential(line([0, 0, 0], [0.3, 0.8, -0.2]))
    target = Target(curves["circle"](FRAMES), rotations)
    motion = track(ARM, target, LM, coherent=True, tolerance_rotation=1e-6)
    assert motion.residual_rotation.max() <= 1e-6
    pose = forward_kinematics(ARM, motion.local_rotations)
    assert rotation.angle(pose.rotations[:, -1], rotations).max() <= 1e-6
    warm = track(ARM, target, LM, tolerance_rotation=1e-6)
    assert squares(ARM, motion.local_rotations) < squares(ARM, warm.local_rotations)


def test_two_effectors_follow_their_curves_at_once():
    offsets = [[0, 0, 0], [0, 0.5, 0], [0.5, 0, 0], [0.5, 0, 0], [-0.5, 0, 0], [-0.5, 0, 0]]
    tree = Skeleton([-1, 0, 1, 2, 1, 4], offsets)
    circle = 0.3 * curves["circle"](FRAMES)[:, [0, 2, 1]] + [0, 0.4, 0]
    aside = np.array([0.6, 0, 0])
    targets = [Target(circle + aside, effector=3), Target(circle - aside, effector=5)]
    start = rotation.exponential(np.full((6, 3), 0.2))
    motion = track(tree, targets, LM, start, coherent=True, closed=True, tolerance=1e-8)
    assert motion.residual.max() <= 1e-8
    steps = np.linalg.norm(displacements(tree, motion.local_rotations, True), axis=-1)
    assert steps[-1] < 1.5 * np.median(steps)


def test_joints_that_do_not_move_the_effector_stay_as_they_are(rng):
    tree = Skeleton([-1, 0, 1, 0, 3], [[0, 1, 0]] * 5)
    start = rotation.random(rng, 5)
    curve = line([0.3, 1.0, 0.2], [0.2, 1.5, -0.9], 12)
    motion = track(tree, curve, "ccd", start, effector=2, coherent=True)
    np.testing.assert_allclose(motion.local_rotations[:, 2:], [start[2:]] * 12, atol=1e-15)


def test_a_long_trajectory_does_not_depend_on_the_coarsest_grid(monkeypatch):
    curve, found = curves["heart"](300), []
    for frames in (32, 10_000):
        monkeypatch.setattr(trajectory, "COARSEST_GRID", frames)
        found.append(track(ARM, curve, LM, coherent=True, tolerance=TOLERANCE).positions)
    np.testing.assert_allclose(found[0], found[1], rtol=0, atol=1e-6)


def test_a_trajectory_is_never_less_smooth_than_the_one_it_is_made_from(monkeypatch):
    """A result of the coarse grids that is less smooth than the start is discarded."""

    def shaken(problem, q):
        step = 0.1 * np.cos(np.arange(q.shape[0] * 12.0)).reshape(-1, 12)
        return project(problem, integrate_step(problem, q, step))[0], 1

    monkeypatch.setattr(trajectory, "minimise_from_coarse", shaken)
    motion = track(ARM, curves["heart"](FRAMES), LM, coherent=True, tolerance=TOLERANCE)
    smooth = squares(ARM, drawn("heart").local_rotations)
    assert squares(ARM, motion.local_rotations) == pytest.approx(smooth, rel=1e-9)


@pytest.mark.parametrize("frames", [1, 2, 3])
@pytest.mark.parametrize("closed", [False, True])
def test_few_frames_are_a_motion_too(frames, closed, backend):
    curve = curves["circle"](FRAMES)[:frames]
    motion = track(ARM, curve, "fabrik", coherent=True, closed=closed)
    assert (motion.outcome == Outcome.CONVERGED).all()


def test_a_point_that_stays_is_followed_by_an_arm_that_stays():
    """The tip is within the tolerance of the path at once, then on it: half of the tolerance."""
    motion = track(ARM, np.tile([0.6, 0.1, 0.2], (9, 1)), coherent=True, closed=True)
    np.testing.assert_allclose(motion.positions, motion.positions[[0] * 9], rtol=0, atol=1e-12)


def test_an_effector_that_nothing_moves_is_left_as_it_is():
    motion = track(ARM, line([0, 1.7, 0], [0, 1.7, 0], 3), effector=0, coherent=True)
    assert (motion.outcome == Outcome.CONVERGED).all()


def test_iterations_are_counted_and_residuals_are_those_before():
    warm, motion = (
        track(ARM, curves["circle"](9), coherent=coherent, record=True)
        for coherent in (False, True)
    )
    steps = motion.iterations - warm.iterations
    assert (steps == steps[0]).all()
    assert steps[0] > 0
    np.testing.assert_array_equal(motion.history, warm.history)


MODELS = {
    "balls": (ARM.joint_count * ["ball"], {}, [-1], False),
    "pose": (["hinge", "ball", "slide", "ball", "hinge"], {}, [-1], True),
    "free": (["free", "hinge", "ball", "hinge", "fixed"], {}, [-1], True),
    "mimic": (["hinge", "slide", "hinge", "ball", "hinge"], {2: Mimic(0, -0.7, 0.1),
              1: Mimic(4, 0.3)}, [-1], False),
    "hinge after slide": (["hinge", "slide", "hinge", "ball", "hinge"], {2: Mimic(1, -0.7, 0.1)},
                          [-1], False),
    "two": (["ball", "hinge", "slide", "ball", "ball"], {}, [2, 4], True),
}  # fmt: skip


def problem_of(name, closed, rng, drawn_to=()):
    """A random tree of joints, on a path that its poses are on, and these poses."""
    kinds, mimics, effectors, oriented = MODELS[name]
    parents = [-1, 0, 1, 1, 3] if len(effectors) > 1 else np.arange(-1, 4)
    axes, frames = rng.standard_normal((5, 3)), rotation.random(rng, 5)
    tree = Skeleton(parents, rng.standard_normal((5, 3)))
    model = Articulation(tree, kinds, axes, frames=frames, mimics=mimics, lower=-0.4, upper=0.4)
    prepared = prepare(model, tuple(e % 5 for e in effectors), (oriented,) * len(effectors))
    q0 = Articulation(tree, kinds, axes, frames=frames, mimics=mimics).random(rng)
    q = integrate(model, q0, 0.3 * rng.standard_normal((4, model.freedom_count)))
    pose = forward_kinematics(model, q)
    targets = [
        Target(pose.positions[:, e], pose.rotations[:, e] if oriented else None, e, 1.0 + k)
        for k, e in enumerate(effectors)
    ]
    rows = target_rows(checked_targets(model, targets, None), (4,))
    constrained = ~np.isin(np.arange(4), drawn_to)
    rows["position"][~constrained] += 0.1
    mechanism = prepared.mechanism
    return new_problem(mechanism, rows, constrained, closed), q[:, mechanism.columns].copy()


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("name", MODELS)
def test_the_second_order_model_is_that_of_the_cost_along_the_path(name, closed, rng, backend):
    """Balls are without limits here: the model leaves the curvature of those out."""
    problem, q = problem_of(name, closed, rng, drawn_to=[2])
    joints = problem.mechanism.joints
    for field, bound in (("lower", -np.inf), ("upper", np.inf), ("cone", np.inf)):
        joints[field][joints["kind"] == BALL] = bound
    problem = problem._replace(limits=joint_limits(joints))
    z = rng.uniform(0.0, 0.1, (4, len(problem.limits)))
    model = quadratic_model(problem, q, z)
    gradient, diagonal = derivatives(problem, q, z, model)
    assert model.cost == pytest.approx(cost(problem, q, z))
    v = rng.standard_normal(gradient.shape)
    v = np.einsum("fkl,fl->fk", null_spaces(problem, q), v)

    def along(h):
        there, on = project(problem, integrate_step(problem, q, h * v))
        assert on[problem.constrained].all()
        return cost(problem, there, z)

    h = 1e-4
    first = (along(h) - along(-h)) / (2 * h)
    assert first == pytest.approx((gradient * v).sum(), rel=1e-5, abs=1e-6)
    after = np.roll(v, -1, axis=0)[: len(model.coupling)]
    second = np.einsum("fk,fkl,fl", v, diagonal, v)
    second += 2.0 * np.einsum("fk,fkl,fl", after, model.coupling, v[: len(after)])
    coarse, fine = ((along(h) - 2.0 * model.cost + along(-h)) / h**2 for h in (1e-3, 5e-4))
    assert (4.0 * fine - coarse) / 3.0 == pytest.approx(second, rel=1e-5)


def derivatives(problem, q, z, model):
    """The gradient and the Hessian's blocks of the frames, with the limits active before a step."""
    gradient, diagonal, surplus, changed = add_limits(
        problem, q, z, model.gradient, model.diagonal, np.zeros_like(model.gradient)
    )
    assert (surplus, changed) == (0.0, len(problem.limits) > 0)
    return project_derivatives(model.P, gradient, diagonal)


@pytest.mark.parametrize("seed", [2, 9, 11])
def test_no_step_raises_the_cost(monkeypatch, seed):
    """Even from poses that have nothing to do with one another; whole Newton steps would here."""
    curve, frames = curves["heart"](5), 5
    mechanism = prepare(balls(ARM), (4,), (False,)).mechanism
    rows = target_rows(checked_targets(ARM, curve, -1), (frames,))
    problem = new_problem(mechanism, rows, np.ones(frames, dtype=bool), True)
    start = rotation.random(np.random.default_rng(seed), frames, 5)
    q = solve_ik(ARM, start, curve, LM).local_rotations
    q, on = project(problem, q[:, :4].reshape(frames, -1))
    assert on.all()
    z = np.zeros((frames, len(problem.limits)))
    costs = [cost(problem, q, z)]
    for steps in range(1, 14):
        monkeypatch.setattr(riemannian_newton, "MAX_STEPS", steps)
        costs.append(cost(problem, riemannian_newton.minimise(problem, q)[0], z))
    assert (np.diff(costs) <= 1e-12).all()
    assert costs[-1] < 0.5 * costs[0]


def null_spaces(problem, q):
    """Projections onto the changes that keep constrained frames on the path, by differences."""
    n, h = problem.mechanism.freedoms, 1e-6

    def errors(step):
        return errors_and_jacobians(problem, integrate_step(problem, q, step))[0]

    columns = [
        (errors(h * e) - errors(-h * e)) / (2 * h)
        for e in np.eye(n)[:, None, :] * np.ones((1, len(q), 1))
    ]
    J = np.stack(columns, axis=-1)
    P = np.eye(n) - np.linalg.pinv(J, rcond=1e-6) @ J
    P[~problem.constrained] = np.eye(n)
    return P


def test_the_limits_of_balls_push_as_the_cost_says(rng, backend):
    problem, q = problem_of("balls", False, rng)
    problem = problem._replace(constrained=np.zeros(4, dtype=bool))
    problem.mechanism.joints["cone"] = 0.2
    problem = problem._replace(limits=joint_limits(problem.mechanism.joints))
    z = rng.uniform(0.0, 0.1, (4, len(problem.limits)))
    gradient, _ = derivatives(problem, q, z, quadratic_model(problem, q, z))
    v, h = rng.standard_normal(gradient.shape), 1e-6
    after, before = (cost(problem, integrate_step(problem, q, s * h * v), z) for s in (1, -1))
    assert (after - before) / (2 * h) == pytest.approx((gradient * v).sum(), rel=1e-6)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("frames", [3, 4, 7, 8])
def test_a_cycle_of_frames_is_solved_like_a_dense_system(frames, closed, rng, backend):
    n = 2
    diagonal = np.eye(n) * 8.0 + np.ones((frames, n, n))
    coupling = rng.standard_normal((frames if closed else frames - 1, n, n))
    A = np.zeros((frames, n, frames, n))
    for f in range(frames):
        A[f, :, f] = diagonal[f] + 0.5 * np.eye(n)
    for f, block in enumerate(coupling):
        g = (f + 1) % frames
        A[g, :, f] += block
        A[f, :, g] += block.T
    b = rng.standard_normal((frames, n))
    system = CyclicBandedSystem(frames, n, closed)
    system.fill(diagonal, coupling)
    dense = np.linalg.solve(A.reshape(frames * n, -1), b.ravel()).reshape(b.shape)
    np.testing.assert_allclose(system.solve(b, 0.5), dense, rtol=0, atol=1e-13)
    assert system.solve(b, -100.0) is None


def test_a_straight_arm_is_near_singular():
    """Hinges in a plane can never leave it: that by itself is not singular."""
    q = np.array([[0.3, 0.0, 0.0], [0.3, 0.0, 0.5]])
    arm = hinges(3)
    mechanism = prepare(arm, (3,), (False,)).mechanism
    rows = np.zeros((2, 1), TARGET)
    rows["weight"] = 1.0
    problem = new_problem(mechanism, rows, np.ones(2, dtype=bool), False)
    assert near_singular(problem, q).tolist() == [True, False]
