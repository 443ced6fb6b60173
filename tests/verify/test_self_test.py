"""Every fault of the self-test is caught and named, most of them in the slow sweep."""

from functools import cache, partial

import pytest

from plumbob.crosscheck.engines import SKELETON_ENGINES, forward_kinematics_by
from plumbob.crosscheck.engines.mujoco_mass_spring import MujocoMassSpring
from plumbob.reference import Skeleton
from plumbob.verify.greeting import PROTOCOL, Greeting, Step
from plumbob.verify.judgement import Verdict
from plumbob.verify.screen.listings import self_test as lines
from plumbob.verify.self_test import FK, HONEST, STEP, Subject, Trial, attempt, stepped, subjects


def placed_by(engine, parents, offsets, local_rotations):
    skeleton = SKELETON_ENGINES[engine](Skeleton(parents, offsets))
    return tuple(forward_kinematics_by(skeleton, local_rotations))


def mujoco(integrator):
    """A step by MuJoCo, whose discrete one has dampers in the energy, see docs/verify.md."""
    return partial(stepped, lambda s, state, h: MujocoMassSpring(s, h, integrator).step(state))


def engines():
    for engine in SKELETON_ENGINES:
        greeting = Greeting(PROTOCOL, (FK,))
        yield Subject(engine, HONEST, FK, partial(placed_by, engine), greeting)
    for integrator, method in (("Euler", "symplectic"), ("discrete", "linearised")):
        greeting = Greeting(PROTOCOL, (STEP,), step=Step(method))
        yield Subject(f"MuJoCo {integrator}", HONEST, STEP, mujoco(integrator), greeting)


@cache
def by_name():
    """Return all subjects by their names, family after family."""
    return {f"{one.family}, {one.name}, {one.task}": one for one in (*subjects(), *engines())}


@pytest.mark.sweep(
    "name", by_name, without=["robot", "steps, ", "CCD", "FABRIK", "limits"], every=200
)
def test_fault_is_caught_and_named_and_honest_solver_is_right(name):
    trial = attempt(by_name()[name])
    assert trial.verdict is trial.first_verdict  # the search for the cause has not changed it
    assert trial.passed, (trial.verdict, trial.laws, trial.named)


def test_every_family_has_subjects_with_names_of_their_own():
    assert len(by_name()) == len([*subjects(), *engines()])
    assert {one.family for one in by_name().values() if not one.fault} == {HONEST}
    faulty = [subject for subject in by_name().values() if subject.fault]
    assert len(faulty) >= 200
    families = (
        "robots", "steps", "forces", "energies", "limits", "forward kinematics", "quaternions",
        "CCD", "FABRIK",
    )  # fmt: skip
    assert {one.family for one in faulty} == set(families)


def test_judge_that_misses_a_fault_or_accuses_an_honest_solver_does_not_pass():
    fault = next(subject for subject in by_name().values() if subject.fault)
    honest = next(subject for subject in by_name().values() if not subject.fault)
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
