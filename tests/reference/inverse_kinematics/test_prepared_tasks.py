"""Tasks in kernels: both backends, tasks of users in the same loop, prepared tasks."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest
from task_samples import TASKS, arm, pose_of, quaternion, tree

from plumbob import Outcome, Target, prepare_tasks, set_backend, solve_tasks, tasks

# The backends, and a task in Python and in a kernel, round differently. Steps of up to a hundred
# iterations carry this on.
ROUNDING = 1e-5


def problem(name, exact=True):
    """Return a model, a start and a task with a posture."""
    model, rng = tree(), np.random.default_rng(11)
    rest = tasks.Posture(model.random(rng), weight=0.1)
    return model, model.random(rng), [dataclasses.replace(TASKS[name], exact=exact), rest]


@pytest.mark.sample(every=3)
@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("name", TASKS)
def test_the_interpreter_makes_the_iterations_of_the_kernel(name, exact):
    model, q, parts = problem(name, exact)
    compiled = solve_tasks(model, q, parts, restarts=1)
    with set_backend("python"):
        interpreted = solve_tasks(model, q, parts, restarts=1)
    assert compiled.iterations > 1
    assert interpreted[3:] == compiled[3:]
    np.testing.assert_allclose(interpreted.coordinates, compiled.coordinates, atol=ROUNDING)
    np.testing.assert_allclose(interpreted.errors, compiled.errors, atol=ROUNDING)


class Own:
    """A task of a user with the residual of a task of Plumbob."""

    def __init__(self, task):
        self.task, self.weight, self.exact, self.calls = task, task.weight, task.exact, 0

    def evaluate(self, configuration):
        self.calls += 1
        return self.task.evaluate(configuration)


@pytest.mark.sample(every=3)
@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("name", TASKS)
def test_a_task_of_a_user_makes_the_iterations_of_the_kernel(name, exact):
    model, q, parts = problem(name, exact)
    weighted = dataclasses.replace(parts[0], weight=3.0)
    own = Own(weighted)
    expected = solve_tasks(model, q, [parts[1], weighted], restarts=1)
    solution = solve_tasks(model, q, [parts[1], own], restarts=1)
    assert own.calls > expected.iterations > 1
    assert solution.outcome == expected.outcome
    if solution.outcome == Outcome.CONVERGED:  # roundings add up in hundreds of iterations
        assert solution.iterations == expected.iterations
        np.testing.assert_allclose(solution.coordinates, expected.coordinates, atol=ROUNDING)
        np.testing.assert_allclose(solution.errors, expected.errors, atol=ROUNDING)


class Noted(tasks.FrameTask):
    """A task of Plumbob with an attribute more, and perhaps an `evaluate` of its own."""

    def __post_init__(self):
        super().__post_init__()
        self.__dict__["note"] = "mine"


class Lowered(Noted):
    def evaluate(self, configuration):
        r, J = super().evaluate(configuration)
        return r - (0.0, 0.0, 0.1), J


@pytest.mark.parametrize(("kind", "height"), [(Noted, 0.0), (Lowered, 0.1)])
def test_a_subclass_of_a_task_is_evaluated_by_its_own_method(kind, height):
    model, (x, _) = arm(), pose_of(arm(), 1)
    solution = solve_tasks(model, model.neutral(), [kind(7, 0.9 * x)])
    end = model.forward(solution.coordinates)[0][7]
    np.testing.assert_allclose(end, 0.9 * x + (0.0, 0.0, height), atol=2e-4)


def body(model):
    """Return a task of each kind with a target, and its arguments of another target."""
    masses, centres, q = np.ones(8), np.full((8, 3), 0.05), model.random(np.random.default_rng(3))
    (x, R), (other, turned) = pose_of(model, 1), pose_of(model, 2)
    return {
        "pose": (tasks.FrameTask(7, x, R), {"position": other, "rotation": turned}),
        "position": (Target(x, effector=7), {"position": other}),
        "rotation": (tasks.FrameTask(7, rotation=R, relative_to=2), {"rotation": turned}),
        "look at": (tasks.LookAt(7, x + 2.0), {"target": other + 3.0}),
        "centre of mass": (tasks.CentreOfMass(masses, centres, 0.5 * x), {"position": 0.5 * other}),
        "posture": (tasks.Posture(q, exact=True), {"coordinates": 0.9 * q}),
    }


@pytest.mark.parametrize("name", body(arm()))
def test_prepared_tasks_have_the_solutions_of_solve_tasks(name):
    model, rng = arm(limit=2.0), np.random.default_rng(0)
    (task, target), rest = body(model)[name], tasks.Posture(model.neutral(), weight=1e-3)
    solve, moved = prepare_tasks(model, [rest, task]), task
    assert np.isnan([*solve.coordinates, *solve.errors, solve.cost]).all()
    for k in range(4):
        if k == 2:
            rotated = target.get("rotation")
            first = next((x for key, x in target.items() if key != "rotation"), None)
            solve.set_target(1, first, rotated)
            moved = (
                task._replace(**target)
                if isinstance(task, Target)
                else dataclasses.replace(task, **target)
            )
        q = 1.5 * model.random(rng)
        outcome, expected = solve(q), solve_tasks(model, q, [rest, moved])
        np.testing.assert_allclose(solve.coordinates, expected.coordinates, atol=ROUNDING)
        np.testing.assert_allclose(solve.errors, expected.errors, atol=ROUNDING)
        assert solve.cost == pytest.approx(expected.cost)
        assert (solve.iterations, outcome) == expected[3:]
        assert outcome is Outcome.CONVERGED
    assert not solve.coordinates.flags.writeable


def test_restarts_of_prepared_tasks_are_the_same_in_every_call():
    model = arm(limit=0.4)
    solve, ends = prepare_tasks(model, [Target((1.0, 0.3, 1.9), quaternion(5), 7)], restarts=5), []
    for _ in range(2):
        solve(model.neutral())
        ends.append((solve.coordinates.tolist(), solve.iterations))
    assert ends[0] == ends[1]
    assert solve.errors[0] > 0.1


@pytest.mark.parametrize(
    "duplicate", [copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))]
)
def test_a_copy_of_prepared_tasks_has_targets_and_arrays_of_its_own(duplicate):
    model, (x, R) = arm(), pose_of(arm(), 1)
    solve, other_target = prepare_tasks(model, [tasks.FrameTask(7, x, R)]), 0.9 * x
    other = duplicate(solve)
    solve.set_target(0, other_target)
    assert solve(model.neutral()) is other(model.neutral()) is Outcome.CONVERGED
    for prepared, target in ((solve, other_target), (other, x)):
        end = model.forward(prepared.coordinates)[0][7]
        np.testing.assert_allclose(end, target, atol=2e-4)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda solve: solve([np.nan] * 7), "q: expected finite numbers, got nan"),
        (lambda solve: solve(np.zeros(6)), r"q: expected shape \(7,\), got \(6,\)"),
        (lambda solve: solve.set_target(3, None), "task: expected an integer of at least 0"),
        (lambda solve: solve.set_target(0, rotation=[1, 0, 0, 0]), "rotation: expected None for"),
        (lambda solve: solve.set_target(1, np.zeros(3)), "target: expected None for task 1"),
        (lambda solve: solve.set_target(1, rotation=[1, 1, 0, 0]), "rotation: expected unit"),
        (lambda solve: solve.set_target(2, 0.5), "target: expected None for task 2"),
        (lambda solve: solve.set_target(0, np.zeros(4)), r"target: expected shape \(3,\)"),
    ],
)
def test_wrong_starts_and_targets_are_named(call, message):
    place, turn = tasks.FrameTask(7, np.ones(3)), tasks.FrameTask(7, rotation=quaternion(1))
    with pytest.raises(ValueError, match=message):
        call(prepare_tasks(arm(), [place, turn, tasks.Coupling(1)]))
