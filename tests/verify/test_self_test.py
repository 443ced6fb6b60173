"""Every fault of the self-test is caught and named, most of them in the slow sweep."""

from functools import cache, partial

import pytest

from plumbob.crosscheck.engines import SKELETON_ENGINES, forward_kinematics_by
from plumbob.crosscheck.engines.mujoco_mass_spring import MujocoMassSpring
from plumbob.reference import Skeleton
from plumbob.verify.fault_programs import PROGRAMS
from plumbob.verify.greeting import Step
from plumbob.verify.judgement import Verdict
from plumbob.verify.screen.listings import self_test as lines
from plumbob.verify.self_test import HONEST, Trial, attempt, subjects
from tests.honest_solvers import FK, STEP, honest_solvers, stepped, subject

# Right programs with a reservation: a start without a solution of a robot, one iteration in each
# frame, a link of no length.
RESERVED = {"robot", "robot_track", "fabrik by angles"}


def placed_by(engine, parents, offsets, local_rotations):
    skeleton = SKELETON_ENGINES[engine](Skeleton(parents, offsets))
    return tuple(forward_kinematics_by(skeleton, local_rotations))


def mujoco(integrator):
    """A step by MuJoCo, whose discrete one has dampers in the energy, see docs/verify.md."""
    return partial(stepped, lambda s, state, h: MujocoMassSpring(s, h, integrator).step(state))


def engines():
    for engine in SKELETON_ENGINES:
        yield subject(engine, FK, partial(placed_by, engine))
    for integrator, method in (("Euler", "symplectic"), ("discrete", "linearised")):
        yield subject(f"MuJoCo {integrator}", STEP, mujoco(integrator), step=Step(method))


@cache
def by_name():
    """Return all subjects by their names, family after family."""
    solvers = (*subjects(), *honest_solvers(), *engines())
    return {f"{one.family}, {one.name}, {one.task}": one for one in solvers}


@pytest.mark.sweep(
    "name",
    by_name,
    without=[
        "robot", "STEP", "CCD", "FABRIK", "LIMIT", "CLAIM", "JACOBIAN", "STOP", "TRACK", "track",
        "inverse", "motion",
    ],
    every=100,
)  # fmt: skip
def test_fault_is_caught_and_named_and_honest_solver_is_right(name):
    trial = attempt(by_name()[name])
    assert trial.verdict is trial.first_verdict  # the search for the cause has not changed it
    assert trial.passed, (trial.verdict, trial.laws, trial.is_named)
    if name.split(", ")[1] in set(PROGRAMS) - RESERVED:
        assert trial.verdict is Verdict.RIGHT


def test_every_family_has_subjects_with_names_of_their_own():
    honest = [one for one in by_name().values() if not one.code]
    assert len(by_name()) == len([*subjects(), *honest_solvers(), *engines()])
    assert {one.family for one in honest} == {HONEST}
    faulty = {one.code: one.family for one in by_name().values() if one.code}
    assert len(faulty) >= 250
    assert len(set(faulty.values())) == 15


def test_judge_that_misses_a_fault_or_accuses_an_honest_solver_does_not_pass():
    fault = next(one for one in by_name().values() if one.code)
    honest = next(one for one in by_name().values() if not one.code)
    positions = frozenset({"positions"})
    missed = Trial(fault, Verdict.RIGHT, frozenset(), True)
    accepted = Trial(honest, Verdict.RIGHT, frozenset(), True)
    failed = [
        missed,
        Trial(fault, Verdict.WRONG, positions, False),
        Trial(honest, Verdict.WRONG, positions, True),
        Trial(honest, Verdict.RIGHT, frozenset(), False),
    ]
    assert not any(trial.passed for trial in failed)
    listed = list(lines([missed, accepted], str))
    assert any(fault.name in line for line in listed)
    assert listed[-1].startswith("1 trials failed")
    assert "Every fault is caught" in list(lines([accepted], str))[-1]
