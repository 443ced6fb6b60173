"""Restarts never make an answer worse, and the best of the attempts is the one returned."""

import numpy as np
import pytest

from plumbob.reference import (
    IK_SOLVERS,
    Articulation,
    Mimic,
    Outcome,
    Skeleton,
    Target,
    forward_kinematics,
    rotation,
    scenes,
    solve_ik,
)
from plumbob.reference.inverse_kinematics.mechanism import LEVER
from plumbob.reference.inverse_kinematics.reduce import prepare

COUNTS = range(13)
# Merits come from positions recomputed: some roundings of a few metres.
ROUNDING = 1e-12


def readme_robot():
    links = Skeleton([-1, 0, 1, 2], [[0, 0, 0.3], [0, 0, 0.4], [0.4, 0, 0], [0.3, 0, 0]])
    axes = [[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0]]
    return Articulation(links, "hinge", axes, lower=-2.5, upper=2.5), [3], 0.0


def seven_hinges():
    rng = np.random.default_rng(7)
    axes = rotation.rotate(rotation.random(rng, 8), [0.0, 0.0, 1.0])
    links = Skeleton(range(-1, 7), 0.4 * rng.standard_normal((8, 3)))
    return Articulation(links, "hinge", axes, lower=-1.8, upper=1.8), [7], 1.0


def two_hands(kind, **limits):
    offsets = [[0, 0, 0], [0, 0.4, 0], [0, 0.4, 0], [0.2, 0.1, 0], [0.4, 0, 0], [0.3, 0, 0]]
    offsets += [[-0.2, 0.1, 0], [-0.4, 0, 0], [-0.3, 0, 0]]
    axes = np.array([[1, 0, 0.2], [0, 0.3, 1], [0, 1, 0]])[np.arange(9) % 3]
    tree = Skeleton([-1, 0, 1, 2, 3, 4, 2, 6, 7], offsets)
    return Articulation(tree, kind, axes, **limits), [5, 8], 0.5


def crane():
    """Return slides and hinges with limits."""
    links = Skeleton(range(-1, 5), [[0, 0, 0], *np.tile([[0.3, 0, 0.1], [0, 0.3, 0]], (3, 1))[:5]])
    kinds = ["slide", "hinge", "slide", "hinge", "hinge", "fixed"]
    axes = np.eye(3)[[0, 2, 1, 0, 2, 0]]
    return Articulation(links, kinds, axes, lower=-0.7, upper=0.9), [5], 0.0


def gripper():
    """Return a finger whose hinges follow one another, once backwards."""
    links = Skeleton(range(-1, 5), [[0, 0, 0], *np.tile([[0.3, 0, 0]], (5, 1))])
    mimics = {2: Mimic(1, 0.5, 0.1), 4: Mimic(3, -1.5)}
    axes = [[0, 0, 1], [0, 1, 0], [0, 1, 0], [0, 0, 1], [0, 1, 1], [1, 0, 0]]
    return Articulation(links, "hinge", axes, lower=-2.0, upper=2.0, mimics=mimics), [5], 0.0


def limited_balls():
    rng = np.random.default_rng(3)
    links = Skeleton(range(-1, 4), 0.4 * rng.standard_normal((5, 3)))
    return Articulation(links, "ball", lower=-0.6, upper=0.6, cones=0.8), [4], 1.0


def floating():
    tree, effectors, oriented = two_hands("ball", cones=1.0)
    kinds = ["free", *["ball"] * 8]
    return Articulation(tree.skeleton, kinds, cones=tree.cones), effectors, oriented


MODELS = {
    "readme": readme_robot,
    "seven hinges": seven_hinges,
    "two hands of hinges": lambda: two_hands("hinge", lower=-1.5, upper=1.5),
    "two hands of balls": lambda: two_hands("ball"),
    "crane": crane,
    "gripper": gripper,
    "limited balls": limited_balls,
    "floating": floating,
    "arm": lambda: (scenes.lab_arm()[0], [4], 0.0),
    "ten links": lambda: (scenes.ball_chain(links=10)[0], [10], 0.0),
}


def problem(name, seed):
    """Return a model, a start and targets: a third in reach, near the rim or beyond, beyond all."""
    model, effectors, oriented = MODELS[name]()
    rng = np.random.default_rng([seed, len(name)])
    if isinstance(model, Skeleton):
        q, other = rotation.random(rng, 2, model.joint_count)
    else:
        q, other = model.random(rng, 2)
    pose, stretch = forward_kinematics(model, other), [1.0, 1.6, 4.0][seed % 3]
    targets = [
        Target(
            stretch * pose.positions[j],
            pose.rotations[j] if rng.random() < oriented else None,
            j,
            10.0 ** rng.uniform(-1.0, 1.0),
        )
        for j in effectors
    ]
    return model, q, targets


def badness(solution, settings):
    """Return what restarts may not increase: the merit, 0 where the target is reached.

    Of a position out of reach, reached is the nearest point, to the tolerance.
    """
    nearest = solution.outcome is Outcome.UNREACHABLE and solution.excess <= settings["tolerance"]
    return 0.0 if solution.outcome is Outcome.CONVERGED or nearest else solution.merit


def rises(name, solver, seed, counts, settings):
    """Return how many answers are worse with more restarts, or than from one start."""
    model, q, targets = problem(name, seed)
    found, worse = np.inf, []
    for restarts in counts:
        answer = solve_ik(model, q, targets, solver, restarts=restarts, seed=seed, **settings)
        last = badness(answer, settings)
        longer = dict(settings)
        if solver != "levenberg_marquardt":  # whose phases make the iterations of one attempt
            longer["max_iterations"] *= restarts + 1
        once = badness(solve_ik(model, q, targets, solver, **longer), settings)
        limit = min(found, once)
        if last > limit + ROUNDING:
            worse.append((name, solver, seed, restarts, last, limit))
        found = last
        most = 2 + 3 * restarts if isinstance(model, Skeleton) else 1 + 2 * restarts
        assert answer.iterations <= most * settings["max_iterations"]
    return worse


@pytest.mark.sample(without=["damped_least_squares", "jacobian_transpose", "anderson_ccd"], every=3)
@pytest.mark.parametrize("solver", IK_SOLVERS)
@pytest.mark.parametrize("name", MODELS)
def test_restarts_never_make_an_answer_worse(name, solver):
    settings = {"tolerance": 1e-4, "max_iterations": 15}
    for seed in range(3):
        assert rises(name, solver, seed, (0, 1, 2, 5), settings) == []


@pytest.mark.slow
@pytest.mark.parametrize("solver", IK_SOLVERS)
@pytest.mark.parametrize("name", MODELS)
def test_restarts_never_make_an_answer_worse_for_every_count(name, solver):
    for seed in range(12):
        for most in (3, 40):
            settings = {"tolerance": 1e-4, "max_iterations": most}
            assert rises(name, solver, seed, COUNTS, settings) == []


def test_random_poses_of_fewer_restarts_are_the_first_of_more():
    model, effectors, _ = seven_hinges()
    many = prepare(model, tuple(effectors), (True,), 40, 3).restarts
    for count in (1, 15, 16, 17, 33):
        few = prepare(model, tuple(effectors), (True,), count, 3).restarts
        assert (few == many[:count]).all()


def merits(model, pose, targets, reach):
    """Return the documented merit of each of several poses."""
    heaviest = max(t.weight for t in targets)
    total = 0.0
    for t in targets:
        off = np.linalg.norm(pose.positions[..., t.effector, :] - t.position, axis=-1)
        turned = (
            0.0
            if t.rotation is None
            else rotation.angle(pose.rotations[..., t.effector, :], t.rotation)
        )
        total = total + t.weight / heaviest * (off**2 + (LEVER * reach * turned) ** 2)
    return np.sqrt(total)


@pytest.mark.parametrize("name", [name for name in MODELS if name not in ("arm", "ten links")])
def test_the_chosen_attempt_is_that_of_least_merit(name, backend):
    """With no iterations the attempts are the start and the random poses as they are."""
    for seed in range(5):
        model, q, targets = problem(name, 3 * seed + 1)
        joints = tuple(t.effector for t in targets)
        oriented = tuple(t.rotation is not None for t in targets)
        prepared = prepare(model, joints, oriented, 12, seed)
        solution = solve_ik(
            model, q, targets, "ccd", restarts=12, seed=seed, max_iterations=0, tolerance=0.0
        )
        poses = np.vstack([q, model.random(np.random.default_rng(seed), 16)[:12]])
        reach = prepared.mechanism.reach
        expected = merits(model, forward_kinematics(model, poses), targets, reach)
        assert solution.merit == pytest.approx(expected.min(), rel=1e-12)
        own = forward_kinematics(model, solution.coordinates)
        assert solution.merit == pytest.approx(merits(model, own, targets, reach), rel=1e-12)
