"""Several effectors at once: trees, weights, what reaches, what cannot."""

import numpy as np
import pytest
from drawn_trees import TREES, drawn
from hypothesis import given
from hypothesis import strategies as st

from plumbob.reference import (
    Articulation,
    Mimic,
    Outcome,
    Skeleton,
    Target,
    forward_kinematics,
    rotation,
    solve_ik,
)
from plumbob.reference.inverse_kinematics.mechanism import least_residual

shared = drawn()

# Both hands of a trunk of three joints, arms of three.
PARENTS = [-1, 0, 1, 2, 3, 4, 2, 6, 7]


def figure(kind="ball", **limits):
    """Return a trunk with two arms, the hands joints 5 and 8."""
    offsets = [[0, 0, 0], [0, 0.4, 0], [0, 0.4, 0], [0.2, 0.1, 0], [0.4, 0, 0], [0.3, 0, 0]]
    offsets += [[-0.2, 0.1, 0], [-0.4, 0, 0], [-0.3, 0, 0]]
    axes = np.array([[1, 0, 0.2], [0, 0.3, 1], [0, 1, 0]])[np.arange(9) % 3]
    return Articulation(Skeleton(PARENTS, offsets), kind, axes, **limits)


def hands(model, rng):
    """Return targets for both hands that one pose reaches."""
    positions = forward_kinematics(model, model.random(rng)).positions
    return [Target(positions[5], effector=5), Target(positions[8], effector=8)]


# Of 40 pairs; alternating projections need not converge, and limits stop single joints.
REACHED = {
    ("levenberg_marquardt", "ball", False): 40,
    ("damped_least_squares", "ball", False): 40,
    ("ccd", "ball", False): 30,
    ("fabrik", "ball", False): 30,
    ("jacobian_transpose", "ball", False): 30,
    ("levenberg_marquardt", "ball", True): 35,
    ("levenberg_marquardt", "hinge", False): 30,
    ("levenberg_marquardt", "hinge", True): 28,
}


@pytest.mark.sample(without=["damped_least_squares", "jacobian_transpose"])
@pytest.mark.parametrize(("solver", "kind", "limits"), REACHED)
def test_pairs_of_targets_that_a_pose_reaches_are_reached(solver, kind, limits, rng):
    bounds = {"lower": -1.5, "upper": 1.5, "cones": 1.5} if limits else {}
    model, reached = figure(kind, **bounds), 0
    for _ in range(40):
        targets = hands(model, rng)
        options = {"max_iterations": 1000, "restarts": 0 if kind == "ball" else 5}
        solution = solve_ik(model, model.random(rng), targets, solver, **options)
        reached += solution.outcome is Outcome.CONVERGED
        errors = [solution.positions[t.effector] - t.position for t in targets]
        assert solution.residual == pytest.approx(np.linalg.norm(errors, axis=1).max(), abs=1e-14)
    assert reached >= REACHED[solver, kind, limits]


def test_targets_in_another_order_give_the_same_answer(solver, backend, rng):
    model = figure("hinge", lower=-2.0, upper=2.0)
    targets, q = hands(model, rng), model.random(rng)
    targets[0] = targets[0]._replace(rotation=rotation.random(rng), weight=2.0)
    here = solve_ik(model, q, targets, solver, max_iterations=8, record=True)
    there = solve_ik(model, q, targets[::-1], solver, max_iterations=8, record=True)
    assert here.iterations == there.iterations
    np.testing.assert_allclose(there.history, here.history, rtol=0, atol=1e-9)
    np.testing.assert_allclose(there.coordinates, here.coordinates, rtol=0, atol=1e-9)


@pytest.mark.parametrize("solver", ["ccd", "fabrik", "levenberg_marquardt"], indirect=True)
def test_the_heavier_target_is_missed_by_less(solver, backend):
    """Both ends of a T are wanted up, where one rotation cannot bring both."""
    tee = Articulation(Skeleton([-1, 0, 0], [[0, 0, 0], [1.0, 0, 0], [-1.0, 0.5, 0]]))
    misses = []
    for weight in (0.1, 1.0, 10.0):
        targets = [Target([0, 1.0, 0], effector=1, weight=weight), Target([0, 1.2, 0], effector=2)]
        start = rotation.exponential([0.0, 0.0, 0.4])
        q = np.concatenate([start, rotation.identity(2).ravel()])
        x = solve_ik(tee, q, targets, solver, max_iterations=300).positions
        misses.append([np.linalg.norm(x[t.effector] - t.position) for t in targets])
    first, second = np.transpose(misses)
    assert first[0] > first[1] + 0.05 > first[2] + 0.1
    assert second[0] < second[1] - 0.05 < second[2] - 0.1


@pytest.mark.parametrize("solver", ["ccd", "fabrik"], indirect=True)
@pytest.mark.parametrize("order", [1, -1])
def test_a_target_out_of_reach_does_not_keep_another_arm_from_its_own(solver, order, backend):
    """The arms part at the root; the one that cannot arrive is soon as near as it can be."""
    parents = [-1, 0, 1, 2, 0, 4, 5]
    offsets = [[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 0, 0], [0, 1, 0], [0, 1, 0]]
    model = Articulation(Skeleton(parents, offsets), ["fixed"] + ["ball"] * 6)
    targets = [Target([9.0, 0, 0], effector=3), Target([0.5, 0.7, 0.6], effector=6)][::order]
    solution = solve_ik(model, model.zero(), targets, solver, max_iterations=300)
    assert solution.outcome is Outcome.UNREACHABLE
    assert solution.residual == pytest.approx(7.0, abs=1e-3)
    np.testing.assert_allclose(solution.positions[6], [0.5, 0.7, 0.6], rtol=0, atol=1e-4)


def test_targets_that_exclude_each_other_are_not_called_unreachable(solver, backend):
    """Each could be reached by itself: geometry proves nothing about one."""
    model = figure()
    targets = [Target([1.2, 0.8, 0.0], effector=5), Target([-1.2, 0.8, 0.0], effector=8)]
    singly = [solve_ik(model, model.zero(), t, solver, max_iterations=200) for t in targets]
    assert all(one.outcome is Outcome.CONVERGED for one in singly)
    solution = solve_ik(model, model.zero(), targets, solver, max_iterations=50)
    assert solution.outcome in (Outcome.STALLED, Outcome.ITERATION_LIMIT)
    assert solution.residual > 0.1


@shared
@given(**TREES, stretched=st.booleans())
def test_what_some_pose_reaches_is_never_called_too_far(
    articulated, machine, kinds, seed, stretched
):
    """By any margin but rounding; limits, slides at their ends and mimics regarded."""
    model, rng = articulated(kinds, seed), np.random.default_rng(seed)
    if stretched:
        straight = (0.1 + np.abs(model.skeleton.offsets)) * [1.0, 0.0, 0.0]
        model = Articulation(
            Skeleton(model.skeleton.parents, straight), model.kinds, [1, 0, 0],
            lower=model.lower, upper=model.upper, mimics=model.mimics,
        )  # fmt: skip
    q = model.random(rng)
    for j in set(range(len(kinds))) - set(model.mimics):
        if kinds[j] in ("hinge", "slide") and np.isfinite(model.upper[j]):
            q[model.coordinates_of(j)] = model.upper[j]
    pose = forward_kinematics(model, q)
    targets = [Target(x, None, j) for j, x in enumerate(pose.positions)]
    mechanism, target, _, _ = machine(model, q, targets)
    assert least_residual(mechanism, target) <= 0.0


@pytest.mark.parametrize(
    ("kinds", "limits", "sum_of_lengths", "reach"),
    [
        (["hinge", "hinge", "fixed"], {}, 3.0, 3.0),
        (["ball", "slide", "fixed"], {"lower": -0.5, "upper": 1.0}, 4.0, 10.0**0.5),
        (["slide", "hinge", "fixed"], {"lower": -2.0, "upper": 1.0}, 5.0, 3.0),
        (["hinge", "slide", "fixed"], {"mimics": {1: Mimic(0, 0.5, 0.25)}, "upper": 1.0,
                                       "lower": -2.0}, 4.25, 3.0),
        (["fixed", "fixed", "fixed"], {}, 0.0, 0.0),
    ],
)  # fmt: skip
def test_beyond_all_links_and_slides_a_target_is_unreachable(
    kinds, limits, sum_of_lengths, reach, solver, backend
):
    """Links of one and two metres along x from a root at (5, 0, 0), slides along z."""
    chain = Skeleton([-1, 0, 1], [[5.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]])
    model = Articulation(chain, kinds, [0.0, 0.0, 1.0], **limits)
    start = 8.0 if kinds[0] == "fixed" else 5.0
    for distance, unreachable in ((sum_of_lengths + 1e-3, True), (reach - 1e-3, False)):
        target = [start + distance, 0.0, 0.0]
        solution = solve_ik(model, model.neutral(), target, solver, max_iterations=5)
        if unreachable:
            assert solution.outcome.unreachable
        elif reach:
            assert not solution.outcome.unreachable
    near = solve_ik(model, model.neutral(), [start + reach + 1e-5, 0, 0], solver)
    assert not near.outcome.unreachable


def test_a_leader_beside_the_path_is_moved_and_all_above_it_is_not(solver, backend):
    """The finger's hinge follows a motor in another branch, below a joint that moves no effector.

    That joint mimics another one yet.
    """
    parents = [-1, 0, 0, 2, 0]
    offsets = [[0, 0, 0], [1.0, 0, 0], [0, 1.0, 0], [0, 1.0, 0], [0, 0, 1.0]]
    tip = Skeleton([*parents, 1], [*offsets, [1.0, 0, 0]])
    model = Articulation(
        tip, ["fixed", "hinge", "hinge", "hinge", "hinge", "fixed"],
        mimics={1: Mimic(3, 0.5, 0.1), 2: Mimic(4, 2.0)},
    )  # fmt: skip
    assert model.coordinate_count == 2
    target = [1.0 + np.cos(0.8), np.sin(0.8), 0.0]
    q = np.array([0.2, 0.3])
    solution = solve_ik(model, q, Target(target, effector=5), solver, restarts=1)
    assert solution.coordinates[1] == 0.3
    if (
        solver != "fabrik"
    ):  # which rotates joints to what is attached to them, and nothing is attached here
        assert solution.outcome is Outcome.CONVERGED
        assert solution.coordinates[0] == pytest.approx(1.4, abs=1e-3)


def star(root, links=3):
    """Return five arms of random links about a root of some kind, and their ends."""
    rng, parents, offsets, ends = np.random.default_rng(0), [-1], [[0.0, 0.0, 0.0]], []
    for _ in range(5):
        parent = 0
        for _ in range(links):
            offset = rotation.rotate(rotation.random(rng), [0.0, 0.0, rng.uniform(0.2, 0.5)])
            parents, offsets = [*parents, parent], [*offsets, offset]
            parent = len(parents) - 1
        ends.append(parent)
    return Articulation(Skeleton(parents, offsets), [root, *["ball"] * (len(parents) - 1)]), ends


def test_with_a_free_root_and_five_effectors_the_merit_does_not_grow():
    free, ends = star("free", 2)
    for seed in range(8):
        rng = np.random.default_rng(seed)
        there = forward_kinematics(free, free.random(rng)).positions + rng.normal(0, 0.1, (11, 3))
        targets = [Target(there[e], None, e) for e in ends]
        q = free.random(rng)
        merits = [
            solve_ik(free, q, targets, "fabrik", max_iterations=n).merit
            for n in (0, 1, 3, 10, 30, 100, 300, 1000, 3000)
        ]
        assert merits[-1] < 0.9 * merits[0]
        assert (np.diff(merits) <= 1e-12).all()  # some roundings of a metre
