"""Levenberg-Marquardt, the same on everyone's kinematics."""

from dataclasses import replace

import numpy as np
import pytest

from plumbob.bench.experiments.chain import CHAIN, beyond_reach
from plumbob.bench.measure.chain_targets import (
    SolverLimits,
    job_of,
    solve_one_by_one,
    solve_targets,
)
from plumbob.bench.measure.record import Record
from plumbob.bench.peers import chain_loops
from plumbob.bench.peers.levenberg_marquardt import (
    ReferenceKinematics,
    levenberg_marquardt,
    within_reach,
)
from plumbob.bench.problems.chains import BEYOND, chain_targets
from plumbob.bench.tables.results import Results
from plumbob.crosscheck.engines import SKELETON_ENGINES
from plumbob.crosscheck.engines.skeleton_engine import coordinates
from plumbob.reference import forward_kinematics, solve_ik

KINEMATICS = {"Plumbob": ReferenceKinematics, **SKELETON_ENGINES}


def solved(kind, problem, **limits):
    """The answers of the loop to some targets, and where they put the effector."""
    kinematics, effector = kind(problem.skeleton), problem.skeleton.joint_count - 1
    answers = [
        levenberg_marquardt(kinematics, q, target, effector, **limits)
        for q, target in zip(coordinates(kinematics, problem.starts), problem.targets, strict=True)
    ]
    rotations = np.array([answer.q[kinematics.columns] for answer in answers])
    return answers, forward_kinematics(problem.skeleton, rotations).positions[:, -1]


@pytest.mark.parametrize("name", KINEMATICS)
def test_every_kinematics_takes_the_same_way_to_the_target(name):
    problem, iterations = chain_targets("far", 3), []
    for kind in (ReferenceKinematics, KINEMATICS[name]):
        answers, effectors = solved(kind, problem, tolerance=1e-9, max_iterations=100)
        assert np.linalg.norm(effectors - problem.targets, axis=-1).max() < 1.1e-9
        iterations.append([answer.iterations for answer in answers])
    assert iterations[0] == iterations[1]
    assert min(iterations[0]) > 1


def test_a_start_at_the_target_takes_no_iteration_and_what_is_out_of_reach_takes_all():
    problem = chain_targets("far", 1)
    start = forward_kinematics(problem.skeleton, problem.starts).positions[:, -1]
    for targets, iterations in ((start, 0), (9.0 * problem.targets, 3)):
        moved = replace(problem, targets=targets)
        (answer,), _ = solved(ReferenceKinematics, moved, tolerance=1e-6, max_iterations=3)
        assert answer.iterations == iterations
        assert (
            (answer.q == problem.starts.ravel()).all()
            == (answer.residual < 1e-6)
            == (not iterations)
        )


@pytest.mark.parametrize("engine", SKELETON_ENGINES)
def test_beyond_reach_the_loop_on_an_engine_does_as_the_reference_does(engine):
    """Towards the far target itself it swung for all iterations: 22 of 60 straight, not 60."""
    problem, limits = chain_targets("beyond", 20), SolverLimits(1e-6, 1000)
    ours = solve_targets(problem, "levenberg_marquardt", limits)
    job = job_of(problem, limits, chain_loops.__name__, {"engine": engine})
    theirs = solve_one_by_one(problem, job, limits)
    np.testing.assert_array_equal(theirs["iterations"], ours["iterations"])
    np.testing.assert_allclose(theirs["excess"], ours["excess"], atol=1e-7)  # a tenth of 1e-6
    settings = {"tolerance": 1e-6, "max_iterations": 1000}
    facts = {"task": CHAIN, "stratum": BEYOND}
    record = Record("ik", "chain/beyond", f"lm/{engine}", settings, {**facts, **theirs}, 20)
    (sentence,) = beyond_reach(Results([record])).summary.points
    assert sentence.startswith(f"LM, our loop on {engine}: 20/20 = 100 %")


def test_targets_within_reach_stay_where_they_are(rng):
    root, targets = rng.standard_normal(3), rng.standard_normal((50, 3))
    distances = np.linalg.norm(targets - root, axis=-1)
    near = within_reach(targets, root, 2.0)
    np.testing.assert_array_equal(near[distances <= 2.0], targets[distances <= 2.0])
    drawn = np.linalg.norm(near - root, axis=-1)
    np.testing.assert_allclose(drawn, np.minimum(distances, 2.0))
    assert 0 < np.sum(distances > 2.0) < 50


def test_the_loop_and_the_reference_s_solver_are_one_method():
    """Rotations in the world from the left are tangents in the joints' frames from the right."""
    problem, limits = chain_targets("far", 20), {"tolerance": 1e-6, "max_iterations": 100}
    asked = (problem.skeleton, problem.starts, problem.targets, "levenberg_marquardt")
    ours, (answers, _) = solve_ik(*asked, **limits), solved(ReferenceKinematics, problem, **limits)
    assert [answer.iterations for answer in answers] == ours.iterations.tolist()
    np.testing.assert_allclose([answer.residual for answer in answers], ours.residual, atol=1e-12)
