"""Robots as problems: the same text for everyone, true strata, a fair evaluation."""

import importlib.util
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from plumbob.bench.experiments import SCALES
from plumbob.bench.experiments import robots as measurement
from plumbob.bench.peers import catalogue
from plumbob.bench.problems.evaluate import (
    AGREEMENT,
    MUJOCO,
    PINOCCHIO,
    Evaluator,
    Targets,
    Tolerance,
    angle_between,
    arbiter_of,
    evaluator_of,
)
from plumbob.bench.problems.robot_targets import (
    STRATA,
    farthest,
    least_distances,
    least_singular_values,
    robot_targets,
    seed_indices,
    spread,
    stratum_poses,
    uniform_targets,
    unreachable_targets,
)
from plumbob.bench.problems.robots import (
    CHARACTER,
    LIMIT_TOLERANCE,
    ROBOTS,
    UNREACHABLE,
    AbsentError,
    group_of,
    is_installed,
    links,
    robot,
)
from plumbob.reference import rotation

COUNT = 8
TOLERANCE = Tolerance(1e-3, 1e-3)


@pytest.fixture(params=ROBOTS)
def name(request):
    """Every robot that is installed."""
    if not is_installed(request.param):
        pytest.skip("example-robot-data, the extra `robots`, is not installed")
    return request.param


def test_targets_of_several_seeds_are_those_of_each_seed_in_turns():
    together = robot_targets(CHARACTER, 2, 5, 3)
    assert together.shape[0] == 2 * 3 * len(STRATA)
    indices = seed_indices(together.shape[0], 3)
    for k in range(3):
        alone = robot_targets(CHARACTER, 2, 5 + k)
        for part, expected in zip(together, alone, strict=True):
            np.testing.assert_array_equal(part[indices == k], expected)


def test_the_limits_and_joints_are_those_of_the_evaluator(name):
    known, model = robot(name), evaluator_of(name).model
    hinges = model.jnt_type == int(mujoco.mjtJoint.mjJNT_HINGE)
    finite = np.isfinite(known.lower)
    np.testing.assert_array_equal(known.lower[finite], model.jnt_range[hinges, 0])
    np.testing.assert_array_equal(known.upper[finite], model.jnt_range[hinges, 1])
    assert len(known.lower) == model.nq
    assert known.joints == tuple(model.joint(i).name for i in range(model.njnt))
    assert list(known.balls) == model.jnt_qposadr[~hinges].tolist()
    assert (known.lower < known.upper).all()


def test_the_chain_of_links_has_the_evaluators_kinematics(name, rng):
    """Some ten products of rotations, lengths of a metre: rounding is below 1e-14."""
    known = robot(name)
    if not known.is_chain:
        pytest.skip("a tree has no chain of links")
    q = known.draw(rng, 1)[0]
    T, joint = np.eye(4), 0
    for transform, axis in links(known):
        T = T @ transform
        if axis is not None:
            T[:3, :3] = T[:3, :3] @ rotation.to_matrix(rotation.exponential(q[joint] * axis))
            joint += 1
    positions, rotations = evaluator_of(name).forward(q)
    np.testing.assert_allclose(T[:3, 3], positions[0], atol=1e-14)
    np.testing.assert_allclose(T[:3, :3], rotations[0], atol=1e-14)


def test_the_character_has_twenty_joints_and_two_hands():
    known = robot(CHARACTER)
    assert len(known.joints) == 20
    assert 0 < len(known.balls) < 20
    assert known.effectors == ("left_hand", "right_hand")
    assert not known.oriented


def test_a_missing_package_of_robots_is_reported(monkeypatch):
    import importlib.metadata

    def missing(name):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "distribution", missing)
    assert not is_installed("panda")
    assert is_installed(CHARACTER)
    robot.cache_clear()
    with pytest.raises(AbsentError, match="example-robot-data is not installed"):
        robot("panda")


def test_targets_are_the_same_every_time_and_every_stratum_has_as_many(name):
    targets = robot_targets(name, COUNT)
    robot_targets.cache_clear()
    for a, b in zip(targets, robot_targets(name, COUNT), strict=True):
        np.testing.assert_array_equal(a, b)
    assert np.bincount(targets.strata).tolist() == [COUNT] * len(STRATA)
    assert targets.strata[: len(STRATA)].tolist() == list(range(len(STRATA)))


def test_starts_are_within_the_limits_and_not_at_the_target(name):
    evaluator = evaluator_of(name)
    for targets in (robot_targets(name, COUNT), unreachable_targets(name, COUNT)):
        assert (targets.starts >= evaluator.robot.lower).all()
        assert (targets.starts <= evaluator.robot.upper).all()
        assert not evaluator.evaluate(targets, targets.starts, TOLERANCE).solved.any()
        for at in evaluator.robot.balls:
            lengths = np.linalg.norm(targets.starts[:, at : at + 4], axis=-1)
            np.testing.assert_allclose(lengths, 1.0, atol=1e-14)


@pytest.fixture
def poses(name):
    """The evaluator, and sixty poses in each stratum."""
    return evaluator_of(name), stratum_poses(evaluator_of(name), np.random.default_rng(4), 60)


def test_extreme_strata_are_extreme(poses):
    """Their medians are beyond the last or the first fifth of the uniform poses."""
    evaluator, q = poses

    def distance(stratum):
        effectors, _ = evaluator.forward(q[stratum])
        return np.linalg.norm(effectors - evaluator.first_joint, axis=-1).max(axis=-1)

    near, far = np.quantile(distance("joint space"), [0.2, 0.8])
    assert np.median(distance("outer shell")) > far
    assert np.median(distance("near the root")) < near
    usual, near = (least_singular_values(evaluator, q[s]) for s in ("joint space", "near singular"))
    assert np.median(near) < np.quantile(usual, 0.2)
    assert near.min() >= 0


def test_at_a_limit_one_joint_is_at_it_and_no_pose_is_beyond(poses):
    evaluator, q = poses
    at = (q["at a limit"] == evaluator.robot.lower) | (q["at a limit"] == evaluator.robot.upper)
    assert (at.sum(axis=-1) == 1).all()
    assert at.any(axis=0).sum() > 1
    for stratum in STRATA:
        assert (q[stratum] >= evaluator.robot.lower).all()
        assert (q[stratum] <= evaluator.robot.upper).all()


def test_a_crowd_of_effectors_is_thinned_out(rng):
    """Nine tenths of the effectors are within one cell; of those spread out, hardly any are."""
    crowd, others = 0.05 * rng.random((900, 1, 3)), rng.random((100, 1, 3))
    effectors = np.concatenate([crowd, others])
    drawn = spread(rng, effectors, 200)
    assert (drawn < 900).mean() < 0.1
    assert len(np.unique(drawn)) > 60


def test_the_sum_of_link_lengths_bounds_the_reach(name, rng):
    evaluator = evaluator_of(name)
    effectors, _ = evaluator.forward(evaluator.robot.draw(rng, 300))
    assert np.linalg.norm(effectors - evaluator.first_joint, axis=-1).max() <= farthest(
        evaluator
    ) * (1 + 1e-12)
    distance = np.linalg.norm(
        unreachable_targets(name, COUNT).positions - evaluator.first_joint, axis=-1
    )
    assert (distance >= 1.05 * farthest(evaluator) * (1 - 1e-12)).all()


def test_starts_in_the_middle_of_the_limits():
    targets = uniform_targets("iiwa14", 3, True)
    np.testing.assert_allclose(targets.starts, 0.0, atol=1e-15)
    assert not np.allclose(uniform_targets("iiwa14", 3, False).starts, 0.0)


@pytest.fixture
def asked(rng):
    """The iiwa's evaluator, and targets whose solutions are known."""
    evaluator = evaluator_of("iiwa14")
    q = 0.9 * evaluator.robot.draw(rng, 5)
    starts = evaluator.robot.draw(rng, 5)
    return evaluator, q, Targets(*evaluator.forward(q), starts, np.zeros(5, dtype=int))


def test_both_engines_place_every_robot_alike(name, rng):
    evaluator, targets = evaluator_of(name), robot_targets(name, 2)
    evaluation = evaluator.evaluate(targets, evaluator.robot.draw(rng, 12), TOLERANCE)
    assert evaluation.difference.max() <= AGREEMENT


def test_a_wrong_arbiter_is_noticed_and_judges_only_its_own_solvers(asked, monkeypatch):
    """Answers that the engines place differently are known, whoever evaluates them."""
    evaluator, q, targets = asked
    exact, right = Tolerance(1e-10, 1e-7), Evaluator.forward_by_pinocchio
    assert evaluator.evaluate(targets, q, exact).difference.max() <= AGREEMENT

    def wrong(self, q):
        positions, rotations = right(self, q)
        return positions + 1e-9, rotations

    monkeypatch.setattr(Evaluator, "forward_by_pinocchio", wrong)
    for engine, is_solved in ((PINOCCHIO, False), (MUJOCO, True)):
        evaluation = evaluator.evaluate(targets, q, exact, engine)
        assert (evaluation.solved == is_solved).all()
        assert (evaluation.difference > AGREEMENT).all()


def test_no_solver_is_evaluated_by_the_engine_that_it_is_built_on():
    on_pinocchio = r"^(?:import|from) (?:pink|pinocchio|roboplan|\.closed_loop|\.placo)"
    for peer in catalogue.PEERS:
        source = Path(importlib.util.find_spec(peer.module).origin).read_text("utf-8")
        is_on_pinocchio = bool(re.search(on_pinocchio, source, re.MULTILINE))
        assert arbiter_of(peer.built_on) == MUJOCO or not is_on_pinocchio, peer.title
        assert arbiter_of(peer.built_on) != peer.built_on
    assert arbiter_of(catalogue.PLUMBOB) == PINOCCHIO


def test_every_robot_is_in_one_list():
    """No setting has seen a robot held out; a user's robot is in a list of its own."""
    groups = {name: group_of(name) for name in ROBOTS}
    assert [groups[name] for name in ("fetch", "z1", CHARACTER)] == [
        "tuning",
        "held out",
        CHARACTER,
    ]
    assert list(groups.values()).count("tuning") == 6
    assert list(groups.values()).count("held out") == 10
    assert group_of("a robot of mine") == "yours"


def test_an_evaluation_needs_position_rotation_and_limits(asked):
    """Whole revolutions are beyond the limits; the last hinge rotates about the flange's axis."""
    evaluator, q, targets = asked
    exact = evaluator.evaluate(targets, q, Tolerance(1e-12, 1e-7))
    assert exact.solved.all()
    assert not exact.beyond.any()
    beyond = evaluator.evaluate(targets, q + 2.0 * np.pi, TOLERANCE)
    assert (beyond.beyond > 1.0).all()
    rotated = evaluator.evaluate(targets, q + 0.01 * np.eye(7)[6], TOLERANCE)
    np.testing.assert_allclose(rotated.rotation, 0.01, rtol=1e-9)
    for evaluation in (beyond, rotated):
        assert evaluation.position.max() < 1e-12
        assert not evaluation.solved.any()


@pytest.mark.parametrize(("over", "kept"), [(0.5, True), (2.0, False)])
def test_a_limit_may_be_exceeded_by_its_tolerance_only(asked, over, kept):
    evaluator, q, targets = asked
    q[:, 3] = evaluator.robot.upper[3] + over * LIMIT_TOLERANCE
    targets = Targets(*evaluator.forward(q), *targets[2:])
    assert evaluator.evaluate(targets, q, TOLERANCE).solved.all() == kept


def test_a_missing_answer_costs_no_other_and_the_last_may_be_missing(asked):
    evaluator, q, targets = asked
    q[1] = np.nan
    evaluation = evaluator.evaluate(targets, q, TOLERANCE)
    assert evaluation.solved.tolist() == [True, False, True, True, True]
    assert np.isnan(evaluation.position[1])
    assert evaluator.evaluate(targets, q[:1], TOLERANCE).solved.tolist() == [True]


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 0.1, 3.0, np.pi])
def test_the_angle_between_rotations_is_exact_where_it_is_tiny(angle, rng):
    """An arc cosine would return 0 or 1.5e-8 for 1e-12."""
    A = rotation.to_matrix(rotation.random(rng))
    R = rotation.to_matrix(rotation.exponential([0.0, angle, 0.0]))
    assert angle_between(A, A @ R) == pytest.approx(angle, rel=1e-7, abs=1e-15)


def test_the_bound_of_unreachable_targets_is_a_bound(name, rng):
    targets, evaluator = unreachable_targets(name, 50), evaluator_of(name)
    bounds = least_distances(name, targets)
    assert (bounds >= 0.05 * farthest(evaluator) * (1 - 1e-12)).all()
    for q in evaluator.robot.draw(rng, 20):
        found = evaluator.evaluate(targets, np.tile(q, (50, 1)), TOLERANCE)
        assert (found.position >= bounds).all()


@pytest.mark.parametrize("scale", SCALES.values())
def test_at_least_forty_targets_are_out_of_reach_at_every_scale(scale):
    beyond = [block for block in measurement.blocks(scale) if block.facts["task"] == UNREACHABLE]
    sizes = {block.problem: block.size for block in beyond}
    assert f"unreachable/{CHARACTER}" in sizes
    assert sum(sizes.values()) >= 40


def test_the_solvers_of_a_robot_are_in_random_order(monkeypatch):
    def order():
        blocks = [b for b in measurement.blocks(SCALES["quick"]) if b.settings["kind"] != "any"]
        problems = [block.problem for block in blocks]
        assert problems == sorted(problems, key=problems.index)  # robot by robot
        return {
            name: [b.solver for b in blocks if b.problem == name]
            for name in problems if name != "robots/all"
        }  # fmt: skip

    orders = order()
    assert len({tuple(solvers) for solvers in orders.values()}) > 1
    monkeypatch.setattr(catalogue, "PEERS", catalogue.PEERS[1:])
    for name, solvers in order().items():
        assert [solver for solver in orders[name] if solver in solvers] == solvers
