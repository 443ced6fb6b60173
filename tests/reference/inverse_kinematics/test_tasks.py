"""Tasks: their derivatives, what is exact, and what is approached as far as that allows."""

import dataclasses
import re

import mujoco
import numpy as np
import pytest
from task_samples import TASKS, Q, X, arm, pose_of, tree

from plumbob import (
    Articulation,
    Outcome,
    Skeleton,
    Target,
    all_solutions,
    rotation,
    solve_ik,
    solve_tasks,
    tasks,
)
from plumbob.reference.formats import mjcf
from plumbob.reference.jacobians import difference, integrate

STEP = 1e-6
# Central differences with that step are off by 1e-12 times third derivatives, and by rounding over
# the step, 1e-10.
DIFFERENCES = 1e-8


def at(model, q, task):
    """Return residual and derivative of a task."""
    return task.evaluate(tasks.configuration(model, q))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", TASKS)
def test_a_residual_changes_by_its_derivative(name, seed):
    model, task = tree(seed), TASKS[name]
    q = model.random(np.random.default_rng(2))
    if name == "posture":
        task = dataclasses.replace(task, coordinates=model.random(np.random.default_rng(3)))
    _, J = at(model, q, task)
    differences = np.empty_like(J)
    for k, v in enumerate(np.eye(model.freedom_count) * STEP):
        ends = [at(model, integrate(model, q, sign * v), task)[0] for sign in (1.0, -1.0)]
        differences[:, k] = (ends[0] - ends[1]) / (2.0 * STEP)
    assert np.abs(J).max() > 0.1
    np.testing.assert_allclose(J, differences, atol=DIFFERENCES)


def test_a_posture_is_approached_in_the_null_space_of_a_pose():
    model = arm()
    x, R = pose_of(model, 4)
    target, rest = Target(x, R, 7), model.neutral()
    start = model.random(np.random.default_rng(6))
    exact = solve_tasks(model, start, [target])
    near = solve_tasks(model, start, [target, tasks.Posture(rest)])
    assert exact.outcome == near.outcome == Outcome.CONVERGED
    assert max(exact.errors[0], near.errors[0]) <= 1e-4
    assert np.linalg.norm(near.coordinates) < 0.97 * np.linalg.norm(exact.coordinates)
    # at the minimum the displacement is orthogonal to what moves the hand not at all
    _, J = at(model, near.coordinates, tasks.FrameTask(7, x, R))
    motion = np.linalg.svd(J)[2][-1]
    assert abs(motion @ near.coordinates) < 1e-2 * np.linalg.norm(near.coordinates)


def test_a_free_axis_leaves_the_rotation_about_it():
    model = arm()
    x, R = pose_of(model, 8)
    task = tasks.FrameTask(7, x, R, axes=(1, 1, 1, 1, 1, 0))
    rest = tasks.Posture(model.neutral(), weight=0.1)
    solution = solve_tasks(model, model.neutral(), [task, rest])
    x_end, R_end = (part[7] for part in model.forward(solution.coordinates))
    axis, axis_end = (rotation.rotate(Q, (0.0, 0.0, 1.0)) for Q in (R, R_end))
    np.testing.assert_allclose(x_end, x, atol=2e-4)
    np.testing.assert_allclose(axis_end, axis, atol=2e-4)
    assert rotation.angle(R, R_end) > 0.1


def test_an_axis_points_at_a_point_and_the_centre_of_mass_is_in_its_place():
    model, point = arm(), np.array([0.5, 1.5, 0.2])
    masses, centres = np.ones(8), np.full((8, 3), 0.05)
    q = model.random(np.random.default_rng(9))
    x, R = model.forward(q)
    centre = (x + rotation.rotate(R, centres)).mean(axis=0)
    look, balance = tasks.LookAt(7, point), tasks.CentreOfMass(masses, centres, centre)
    solution = solve_tasks(model, model.neutral(), [look, balance])
    assert solution.outcome == Outcome.CONVERGED
    x, R = model.forward(solution.coordinates)
    offset = point - x[7]
    axis = rotation.rotate(R[7], (0.0, 0.0, 1.0))
    np.testing.assert_allclose(axis, offset / np.linalg.norm(offset), atol=2e-4)
    np.testing.assert_allclose((x + rotation.rotate(R, centres)).mean(0), centre, atol=2e-4)


def test_limits_are_kept_and_what_cannot_be_met_is_said():
    model = arm(limit=0.4)
    solution = solve_tasks(model, model.neutral(), [Target((0.0, 0.0, 5.0))], restarts=0)
    assert solution.outcome == Outcome.STALLED
    assert model.within_limits(solution.coordinates)
    assert solution.errors[0] == pytest.approx(5.0 - 2.4, abs=1e-3)


@pytest.mark.parametrize(("tolerance", "weight"), [(1e-3, 1.0), (1e-8, 0.01), (1e-8, 1.0)])
def test_a_posture_is_never_given_up(tolerance, weight):
    """No motion of the null space lowers its cost, unless a limit stops it.

    It was given up where it led away from the pose: in 4, 4 and 17 of 30.
    """
    model, slopes = arm(), []
    for seed in range(30):
        x, R = pose_of(model, seed)
        pose = tasks.FrameTask(7, x, R)
        rest = tasks.Posture(model.random(np.random.default_rng(seed + 100)), weight=weight)
        solution = solve_tasks(model, model.neutral(), [pose, rest], tolerance=tolerance)
        assert solution.outcome == Outcome.CONVERGED
        displacement = solution.coordinates - rest.coordinates
        motion = np.linalg.svd(at(model, solution.coordinates, pose)[1])[2][-1]
        if np.abs(solution.coordinates).max() < 2.999:
            slopes.append(abs(motion @ displacement) / np.linalg.norm(displacement))
    assert len(slopes) > 15
    assert max(slopes) < 0.1  # its square is the share of the cost that counts as nothing to gain


def test_of_attempts_that_all_miss_none_misses_less_than_the_answer():
    """The cost of the other tasks does not count where exact tasks are missed."""
    model = arm(limit=0.4)
    pose, rng, start = Target((1.0, 0.3, 1.9), Q, 7), np.random.default_rng(7), model.neutral()
    first = solve_tasks(model, start, [pose], restarts=0).coordinates
    parts = [pose, tasks.Posture(first)]
    starts = [start, *(model.random(rng) for _ in range(5))]
    misses = [solve_tasks(model, q, parts, restarts=0).errors[0] for q in starts]
    assert min(misses) > 1.0
    together = solve_tasks(model, start, parts, restarts=5, seed=7)
    assert together.outcome == Outcome.STALLED
    assert together.errors[0] <= min(misses) + 1e-6


def test_a_joint_without_a_leader_is_held_at_its_zero_and_the_constant():
    model = tree()
    task = tasks.Coupling("b", coefficients=(0.4, 7.0), zero=0.1)
    q = model.neutral()
    q[model.coordinates_of("b")] = 0.5
    np.testing.assert_allclose(at(model, q, task)[0], 0.0, atol=1e-15)


def test_a_task_that_nothing_moves_is_missed():
    gantry = Articulation(Skeleton([-1, 0], np.zeros((2, 3))), "slide", np.eye(3)[:2])
    for task in (tasks.FrameTask(1, rotation=Q), tasks.LookAt(1, (0, 0, 0), target_frame=1)):
        solution = solve_tasks(gantry, [0.1, 0.2], [task], restarts=1)
        assert solution.outcome == Outcome.STALLED
        assert gantry.within_limits(solution.coordinates)
    welded = Articulation(gantry.skeleton, "fixed", np.eye(3)[:2])
    assert solve_tasks(welded, [], [Target(X)]).outcome == Outcome.STALLED


@pytest.mark.parametrize("factor", [4.0**-66, 4.0**66])
def test_a_common_factor_of_all_weights_changes_nothing_but_the_cost(factor):
    model = arm()
    x, R = pose_of(model, 4)
    ends = [
        solve_tasks(
            model,
            model.neutral(),
            [Target(x, R, 7, weight=unit), tasks.Posture(model.neutral(), weight=0.1 * unit)],
        )
        for unit in (1.0, factor)
    ]
    np.testing.assert_array_equal(ends[1].coordinates, ends[0].coordinates)
    assert ends[1].cost == factor * ends[0].cost > 0.0


def test_tasks_that_are_not_exact_share_the_error_by_their_weights():
    slide = Articulation(Skeleton([-1], [[0.0, 0.0, 0.0]]), "slide", (1.0, 0.0, 0.0))
    places = [
        tasks.FrameTask(0, (x, 0.0, 0.0), weight=weight, exact=False)
        for x, weight in ((1.0, 3.0), (-1.0, 1.0))
    ]
    solution = solve_tasks(slide, [0.0], places)
    assert solution.coordinates[0] == pytest.approx(0.5, abs=1e-3)
    assert solution.cost == pytest.approx(3.0, abs=1e-3)


# A further solve ends within half a radian of the same minimum, else at another one. Of 700
# random problems none then lowers the cost by more, without exact tasks and along with them.
SAME_MINIMUM, LOWERED, LOWERED_BETWEEN = 0.5, 1e-4, 0.02


def assert_outcomes_tell_a_minimum(model, parts, rng):
    """Assert that more iterations lower no minimum; return the outcomes after 0, 8 and 200."""
    q, outcomes = model.random(rng), []
    exact = np.array([part.exact for part in parts])
    for limit in (0, 8, 200):
        options = {"max_iterations": limit, "restarts": 0}
        solution = solve_tasks(model, q, parts, **options)
        outcomes.append(solution.outcome)
        if solution.outcome == Outcome.CONVERGED:
            more = solve_tasks(model, solution.coordinates, parts, max_iterations=2000, restarts=0)
            v = difference(model, more.coordinates, solution.coordinates)
            assert (solution.errors[exact] <= 1e-4).all()
            if np.linalg.norm(v) < SAME_MINIMUM and (solution.errors > 1e-4).any():
                share = LOWERED_BETWEEN if exact.any() else LOWERED
                assert solution.cost - more.cost <= share * solution.cost
    return outcomes


@pytest.mark.sample(every=3)
@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("name", TASKS)
def test_outcomes_tell_a_minimum_from_a_stop(name, exact):
    """They said CONVERGED after no iteration, and where the limit cut a descent off."""
    model, rng, outcomes = tree(), np.random.default_rng(7), []
    for _ in range(6):
        rest = tasks.Posture(model.random(rng), weight=10.0 ** rng.uniform(-2.0, 1.0))
        task = dataclasses.replace(TASKS[name], exact=exact, weight=10.0 ** rng.uniform(-1.0, 1.0))
        outcomes.append(assert_outcomes_tell_a_minimum(model, [task, rest], rng))
    first, _, last = zip(*outcomes, strict=True)
    assert set(first) == {Outcome.ITERATION_LIMIT}
    is_out_of_reach = exact and name == "relative"
    assert (last.count(Outcome.CONVERGED) >= 4) != is_out_of_reach


LOOP = """
<mujoco><worldbody>
  <body name="crank"><joint name="a" axis="0 1 0"/><inertial pos=".1 0 0" mass="2"
    diaginertia="1 1 1"/><body name="rod" pos=".3 0 0"><joint name="b" axis="0 1 0"/>
    <inertial pos=".4 0 .1" mass="1" diaginertia="1 1 1"/></body></body>
  <body name="rocker" pos="1 0 0"><joint name="c" axis="0 1 0" ref="10"/><geom size=".1"/></body>
  <body name="gear" pos="0 2 0"><joint name="d" axis="0 1 0"/>
    <inertial pos="0 0 0" mass="3" diaginertia="1 1 1"/><body name="plate"/></body>
  <body name="twin" pos="0 3 0"><freejoint name="e"/><geom size=".1"/></body></worldbody>
<equality>
  <connect body1="rod" body2="rocker" anchor=".8 0 .2"/>
  <weld body1="gear" body2="twin" anchor=".1 .2 .3"/>
  <weld body1="gear" body2="twin" anchor=".1 .2 .3" relpose="1 2 3 .5 .5 .5 .5"/>
  <weld body1="rod" active="false"/>
  <joint joint1="d" joint2="c" polycoef="0.1 2 -3"/><joint joint1="a"/>
</equality></mujoco>"""


def assert_residuals_of_mujoco(text):
    robot, model = mjcf.parse(text), mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:] = q = robot.articulation.random(np.random.default_rng(0))
    mujoco.mj_forward(model, data)
    residuals = [at(robot.articulation, q, task)[0] for task in robot.equalities]
    assert [len(residual) for residual in residuals] == [3, 6, 6, 1, 1]
    assert data.ne == 17
    first, rows = 0, data.efc_pos[: data.ne]
    for residual in residuals:
        expected = rows[first : first + len(residual)]
        first += len(residual)
        lengths = [np.linalg.norm(part) for part in (expected[:3], np.sin(residual[3:] / 2.0))]
        assert np.linalg.norm(residual[:3]) == pytest.approx(lengths[0], abs=1e-12)
        if len(residual) == 6:  # MuJoCo takes the vector of the quaternion
            angle = np.linalg.norm(residual[3:])
            assert np.sin(angle / 2.0) == pytest.approx(np.linalg.norm(expected[3:]), abs=1e-12)


@pytest.mark.parametrize("turn", ["", ' euler="10 20 30"'])
def test_equalities_of_a_file_have_the_residuals_of_mujoco(turn):
    """Also of a weld of bodies that are rotated from each other at home."""
    twin = '<body name="twin" pos="0 3 0"{}>'
    assert LOOP.count(twin.format("")) == 1
    assert_residuals_of_mujoco(LOOP.replace(twin.format(""), twin.format(turn)))


def test_equalities_between_sites_have_the_residuals_of_mujoco():
    """Sites in frames, with the place of their class, and in the world."""
    text = re.sub(' (anchor|relpose)="[^"]*"', "", LOOP)
    for pattern, instead in {
        'body1="rod" body2="rocker"': 'site1="s" site2="t"',
        'body1="gear" body2="twin"': 'site1="t" site2="u"',
        '<body name="rod" pos=".3 0 0">': """<body name="rod" pos=".3 0 0">
            <frame pos="1 2 3" euler="10 20 30"><site name="s" pos=".1 .2 .3"/></frame>""",
        '<body name="twin" pos="0 3 0">': """<body name="twin" pos="0 3 0">
            <site name="u" class="c"/>""",
        "<worldbody>": """<default><default class="c"><site pos="3 2 1" euler="40 50 60"/></default>
            </default><worldbody><site name="t" pos="1 1 1" quat="1 2 3 4"/>""",
    }.items():
        assert pattern in text
        text = text.replace(pattern, instead)
    assert_residuals_of_mujoco(text)


SITES = """<mujoco><worldbody><site name="s"/>{}<body name="a"><joint/><geom size=".1"/></body>
</worldbody><equality><connect site1="s" site2="t"/></equality></mujoco>"""


def test_equalities_between_other_sites_are_refused():
    with pytest.raises(ValueError, match=r"<connect>: expected a site in the file for site2, got"):
        mjcf.parse(SITES.format(""))
    with pytest.raises(ValueError, match=r"<site name='t'>: expected pos of a site that an equal"):
        mjcf.parse(SITES.format('<site name="t" type="capsule" size="1" fromto="0 0 0 0 0 1"/>'))


def test_loop_closures_are_solved():
    robot = mjcf.parse(LOOP.replace('relpose="1 2 3 .5 .5 .5 .5"', 'active="false"'))
    q = robot.articulation.random(np.random.default_rng(3))
    solution = solve_tasks(robot, q, [*robot.equalities, tasks.Posture(robot.home)])
    assert solution.outcome == Outcome.CONVERGED
    assert solution.errors[:-1].max() <= 1e-4


def test_a_mass_that_a_file_leaves_to_a_mesh_is_refused():
    geom = '<geom size=".1"/>'
    robot = mjcf.parse(LOOP)
    tasks.CentreOfMass(robot.masses, robot.centres, (0.0, 0.0, 0.0))
    robot = mjcf.parse(LOOP.replace(geom, '<geom type="mesh" mesh="shell"/>', 1))
    assert np.isnan(robot.masses[robot.articulation.index("rocker")])
    with pytest.raises(ValueError, match="masses: expected that of joint 3, got NaN"):
        tasks.CentreOfMass(robot.masses, robot.centres, (0.0, 0.0, 0.0))


def six_hinges():
    """Return an arm with a spherical wrist, whose hinges make two revolutions."""
    offsets = [
        [0, 0, 0.3],
        [0.1, 0, 0],
        [0, 0, 0.5],
        [0, 0, 0.4],
        [0, 0, 0],
        [0, 0, 0],
        [0, 0, 0.1],
    ]
    axes = np.eye(3)[[2, 1, 1, 2, 1, 2, 0]]
    kinds = ["hinge"] * 6 + ["fixed"]
    return Articulation(Skeleton(range(-1, 6), offsets), kinds, axes, lower=-7.0, upper=7.0)


@pytest.mark.parametrize(("prefer", "order"), [("nearest", 2.0), ("nearest_linf", np.inf)])
def test_the_nearest_solution_is_no_further_than_any_other(prefer, order):
    model, rng = six_hinges(), np.random.default_rng(2)
    for _ in range(4):
        x, R = (part[6] for part in model.forward(model.random(rng)))
        start, target = model.random(rng), Target(x, R)
        nearest = solve_ik(model, start, target, prefer=prefer)
        assert nearest.outcome == Outcome.CONVERGED
        assert model.within_limits(nearest.coordinates)
        others = all_solutions(model, target).coordinates
        rounds = np.pi * 2.0 * np.round((start - others) / (2.0 * np.pi))
        others = others + rounds
        norms = np.linalg.norm(others - start, order, axis=1)[model.within_limits(others)]
        distance = np.linalg.norm(nearest.coordinates - start, order)
        assert len(norms) > 1
        assert distance <= norms.min() + 1e-6


@pytest.mark.parametrize("prefer", ["nearest", "nearest_linf"])
def test_joints_off_the_path_stay_whatever_is_preferred(prefer):
    """One solution in five took them from the random start that led to it."""
    arm, rng = six_hinges(), np.random.default_rng(0)
    branch = np.vstack([arm.skeleton.offsets, [[0.2, 0.0, 0.0], [0.1, 0.0, 0.0]]])
    kinds, axes = [*arm.kinds, "hinge", "slide"], np.vstack([arm.axes, np.eye(3)[:2]])
    parents = [*arm.skeleton.parents, 1, 7]
    model = Articulation(Skeleton(parents, branch), kinds, axes, lower=-3.0, upper=3.0)
    for oriented in [False, True] * 5:
        x, R = (part[6] for part in model.forward(model.random(rng)))
        start, target = model.random(rng), Target(x, R if oriented else None, 6)
        nearest = solve_ik(model, start, target, prefer=prefer)
        assert nearest.outcome == Outcome.CONVERGED
        np.testing.assert_array_equal(nearest.coordinates[6:], start[6:])
        assert np.abs(nearest.coordinates - start).max() > 0.1


def test_nothing_is_nearest_where_no_solution_is():
    model = six_hinges()
    far = solve_ik(model, model.neutral(), (9.0, 0.0, 0.0), prefer="nearest")
    assert far.outcome == solve_ik(model, model.neutral(), (9.0, 0.0, 0.0)).outcome
    with pytest.raises(ValueError, match="prefer: expected one of nearest, nearest_linf"):
        solve_ik(model, model.neutral(), X, prefer="near")
    with pytest.raises(ValueError, match="prefer: expected an Articulation"):
        solve_ik(Skeleton([-1, 0], [X, X]), rotation.identity(2), X, prefer="nearest")


class Constant:
    """A task with what it is made of."""

    weight, exact = 1.0, True

    def __init__(self, *parts, **members):
        self.parts = parts
        self.__dict__.update(members)

    def evaluate(self, _):
        return self.parts if len(self.parts) > 1 else self.parts[0]


ROW, FLAT = np.ones(1), np.zeros((1, 7))


@pytest.mark.parametrize(
    ("task", "message"),
    [
        (Constant(None), "evaluate: expected a residual and its derivative, got None"),
        (Constant(1.0, FLAT), "residual: expected shape"),
        (Constant(["a"], FLAT), "residual: expected an array of numbers"),
        (Constant([np.nan], FLAT), "residual: expected finite numbers, got nan"),
        (Constant(ROW, FLAT[:, :3]), r"derivative: expected shape \(1, 7\), got \(1, 3\)"),
        (Constant(ROW, np.inf + FLAT), "derivative: expected finite numbers, got inf"),
        (Constant(ROW, FLAT, weight=-1.0), "weight: expected a number greater than 0"),
        (Constant(ROW, FLAT, weight=None), "weight: expected"),
        (Constant(ROW, FLAT, exact=2), "exact: expected True or False"),
        (tasks.FrameTask, "tasks: expected tasks and Targets"),
    ],
)
def test_wrong_tasks_of_a_user_are_named(task, message):
    with pytest.raises(ValueError, match=message):
        solve_tasks(arm(), np.zeros(7), [task], restarts=0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: tasks.FrameTask(0), "position: expected a position or a rotation, got neither"),
        (lambda: tasks.Coupling(0, coefficients=[]), "coefficients: expected at least one"),
        (lambda: tasks.LookAt(0, X, (0.0, 0.0, 0.0)), "axis: expected a direction"),
        (lambda: tasks.CentreOfMass([0.0], [X], X), "masses: expected a positive sum"),
        (lambda: solve_tasks(arm(), np.zeros(7), []), "tasks: expected a list"),
        (lambda: solve_tasks(arm(), np.zeros(7), [X]), "tasks: expected tasks and Targets"),
        (lambda: solve_tasks(arm(), np.zeros(7), [tasks.Coupling(7)]), "joint: expected a hinge"),
        (lambda: solve_tasks(Skeleton([-1], [X]), [X], []), "model: expected an Articulation"),
    ],
)
def test_wrong_tasks_are_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()
