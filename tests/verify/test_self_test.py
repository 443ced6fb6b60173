"""Every fault of the self-test is caught and named; steps and forces mostly in the slow sweep."""

from functools import partial

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


SUBJECTS = [*subjects(), *engines()]
FAULTY = [subject for subject in SUBJECTS if subject.fault]
RIGHT = [subject for subject in SUBJECTS if not subject.fault]
QUICK = ("forward kinematics", "CCD", "FABRIK")


def parameters():
    for i, subject in enumerate(SUBJECTS):
        is_short = subject.family in QUICK and "Euler" not in subject.name and i % 24 == 0
        is_honest_forward = not subject.fault and subject.task == "forward_kinematics"
        is_quick = is_short or is_honest_forward or i % 120 == 0
        marks = () if is_quick else pytest.mark.slow
        yield pytest.param(subject, id=f"{subject.family}, {subject.name}", marks=marks)


@pytest.mark.parametrize("subject", list(parameters()))
def test_fault_is_caught_and_named_and_honest_solver_is_right(subject):
    trial = attempt(subject)
    assert trial.passed, (trial.verdict, trial.laws, trial.named)


def test_every_family_has_subjects_with_names_of_their_own():
    assert len({(one.family, one.name, one.task) for one in SUBJECTS}) == len(SUBJECTS)
    assert {one.family for one in RIGHT} == {HONEST}
    assert len(FAULTY) >= 1227
    assert {one.family for one in FAULTY} == {
        "robots",
        "steps",
        "forces",
        "limits",
        *QUICK,
    }


def test_judge_that_misses_a_fault_or_accuses_an_honest_solver_does_not_pass():
    fault, honest = FAULTY[0], RIGHT[0]
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
