"""Objects that threads share answer each thread as they would answer it alone."""

import sys
import threading

import numpy as np
import pytest

from plumbob import (
    Articulation,
    ImplicitEuler,
    Skeleton,
    Target,
    all_solutions,
    forward_kinematics,
    prepare,
    prepare_all_solutions,
    prepare_ik,
    prepare_tasks,
    rotation,
    scenes,
    solve_ik,
    solve_tasks,
)
from plumbob.reference import STEP_SOLVERS

THREADS, CALLS = 4, 60
SKELETON = Skeleton(range(-1, 6), [[0.0, 0.0, 0.4]] * 7)
ARM = Articulation(SKELETON, "hinge", np.eye(3)[[2, 1, 0, 1, 2, 1, 0]], lower=-2.5, upper=2.5)
UR = Articulation(
    Skeleton(range(-1, 5), [[0, 0, 0.1], [0, 0.1, 0], [0.4, -0.1, 0], [0.4, 0, 0], [0, 0.1, 0],
                            [0, 0, -0.1]]),
    "hinge", np.eye(3)[[2, 1, 1, 1, 2, 1]], lower=-3.0, upper=3.0,
)  # fmt: skip


@pytest.fixture(autouse=True)
def hasty_switches():
    """Let the interpreter switch between threads as often as it can."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(interval)


def prepared_kinematics(model):
    forward = prepare(model)

    def answer(rng):
        rotations = rotation.random(rng, 7) if model is SKELETON else model.random(rng)
        return np.concatenate([x.ravel() for x in forward(rotations)])

    return answer


def prepared_solves(model):
    solve = prepare_ik(model)

    def answer(rng):
        start = rotation.random(rng, 7) if model is SKELETON else model.random(rng)
        outcome = solve(start, rng.normal(size=3) * 0.6)
        return np.concatenate([solve.coordinates.ravel(), solve.figures, [outcome]])

    return answer


def prepared_tasks():
    solve = prepare_tasks(ARM, [Target(np.zeros(3), rotation.identity())], restarts=1)

    def answer(rng):
        solve.set_target(0, rng.normal(size=3) * 0.6, rotation.random(rng))
        outcome = solve(ARM.random(rng))
        return np.concatenate([solve.coordinates, solve.errors, [outcome, solve.iterations]])

    return answer


def solves_of_many_seeds(rng):
    """Return solutions, each with restarts of its own, which the robot keeps for a while."""
    seed = int(rng.integers(400))
    target = Target(rng.normal(size=3) * 0.6, rotation.random(rng))
    return solve_ik(ARM, ARM.random(rng), target, restarts=4, seed=seed).coordinates


def tasks(rng):
    target = Target(rng.normal(size=3) * 0.6, rotation.random(rng))
    return solve_tasks(ARM, ARM.random(rng), [target], restarts=1).coordinates


def solutions(rng):
    pose = forward_kinematics(UR, UR.random(rng))
    return all_solutions(UR, Target(pose.positions[-1], pose.rotations[-1])).coordinates.ravel()


def prepared_solutions():
    solve = prepare_all_solutions(UR)

    def answer(rng):
        pose = forward_kinematics(UR, UR.random(rng))
        target = np.append(pose.positions[-1], pose.rotations[-1])
        return solve(target).coordinates.ravel().copy()

    return answer


def steps(solver):
    system, state = scenes.lab_cloth(size=5)
    integrator = ImplicitEuler(system, h=1 / 60, solver=solver)

    def answer(rng):
        moved = state.positions + 1e-3 * rng.standard_normal(state.positions.shape)
        moved[system.pinned] = state.positions[system.pinned]
        result = integrator.step(type(state)(moved, state.velocities))
        return np.append(result.state.positions.ravel(), result.residual)

    return answer


SHARED = {
    "prepare, skeleton": lambda: prepared_kinematics(SKELETON),
    "prepare, arm": lambda: prepared_kinematics(ARM),
    "prepare_ik, skeleton": lambda: prepared_solves(SKELETON),
    "prepare_ik, arm": lambda: prepared_solves(ARM),
    "solve_ik": lambda: solves_of_many_seeds,
    "solve_tasks": lambda: tasks,
    "prepare_tasks": prepared_tasks,
    "all_solutions": lambda: solutions,
    "prepare_all_solutions": prepared_solutions,
    **{f"ImplicitEuler, {solver}": lambda solver=solver: steps(solver) for solver in STEP_SOLVERS},
}


@pytest.mark.sample(every=4)
@pytest.mark.parametrize("name", SHARED)
def test_threads_that_share_an_object_get_the_answers_of_one_thread(name):
    answer, wrong = SHARED[name](), []
    expected = [
        [answer(np.random.default_rng([i, k])) for k in range(CALLS)] for i in range(THREADS)
    ]
    expected = [[np.array(values) for values in rows] for rows in expected]
    begin = threading.Barrier(THREADS)

    def work(thread):
        begin.wait()
        for k in range(CALLS):
            values = answer(np.random.default_rng([thread, k]))
            if not np.array_equal(values, expected[thread][k]):
                wrong.append((thread, k))

    threads = [threading.Thread(target=work, args=(i,)) for i in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_a_thread_finds_no_answer_of_another():
    solve, forward = prepare_ik(ARM), prepare(ARM)
    solve(ARM.neutral(), np.array([0.3, 0.2, 1.0]))
    forward(ARM.neutral())
    found = []

    def look():
        found.extend([solve.coordinates, solve.figures, forward.pose.positions])

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert len(found) == 3
    assert all(np.isnan(values).all() for values in found)
    assert not np.isnan(solve.figures).any()
