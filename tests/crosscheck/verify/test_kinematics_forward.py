"""Judging forward kinematics: every fault is caught by a law and named, and nobody else accused."""

import itertools

import conformance_students as students
import numpy as np
import pytest

from plumbob.crosscheck.engines import SKELETON_ENGINES, forward_kinematics_by
from plumbob.crosscheck.verify.functions import FunctionContestant
from plumbob.crosscheck.verify.greeting import Greeting
from plumbob.crosscheck.verify.judgement import Verdict
from plumbob.crosscheck.verify.kinematics import forward_kinematics as discipline
from plumbob.crosscheck.verify.kinematics.faults import FAULTS, combinations, switches
from plumbob.crosscheck.verify.kinematics.predictions import forward, predict_forward
from plumbob.crosscheck.verify.verify import verify
from plumbob.reference import Skeleton, rotation
from plumbob.reference import forward_kinematics as reference_forward

TASK = "forward_kinematics"


def judged(function, **greeting):
    said = Greeting(1, (TASK,), **greeting)
    return verify(FunctionContestant({TASK: function}, said)).tasks[0]


def faulty(faults, outputs=("positions", "rotations")):
    switched = switches(faults)

    def function(**inputs):
        case = discipline.Case("", TASK, inputs, "", discipline.laws.HOLDS)
        answer = predict_forward(switched, case)
        return {name: answer[name] for name in outputs}

    return function


def by_reference(parents, offsets, local_rotations):
    return tuple(reference_forward(Skeleton(parents, offsets), local_rotations))


def by_engine(name):
    def function(parents, offsets, local_rotations):
        skeleton = Skeleton(parents, offsets)
        return tuple(forward_kinematics_by(SKELETON_ENGINES[name](skeleton), local_rotations))

    return function


def laws_broken(report, least=Verdict.WRONG):
    return {
        finding.law
        for told in report.judgements
        for finding in told.findings
        if finding.verdict >= least
    }


def named(report):
    return [one.faults for one in report.diagnosis.explanations]


@pytest.mark.parametrize("fault", FAULTS["forward"], ids=lambda fault: fault.key)
def test_fault_is_caught_and_named(fault):
    report = judged(faulty([fault]))
    assert report.verdict is Verdict.WRONG
    assert laws_broken(report) & {"positions", "rotations"}
    assert named(report) == [(fault.key,)]
    assert report.diagnosis.explanations[0].share == 1.0
    assert report.smallest_failure is not None


def test_digits_are_those_of_the_rotations_too():
    def turned_at_the_end(**inputs):
        positions, rotations = map(np.copy, by_reference(**inputs))
        rotations[-1] = rotation.multiply(rotations[-1], rotation.exponential([0.2, 0.0, 0.0]))
        return positions, rotations

    def scaled(**inputs):
        positions, rotations = by_reference(**inputs)
        return positions, -2.0 * rotations

    assert judged(turned_at_the_end).digits == pytest.approx(1.0, abs=0.5)
    assert judged(scaled).digits > 14.0


def pairs():
    return [faults for faults in combinations("forward") if len(faults) == 2]


def is_named(report, faults):
    """Whether a pair is named, or fewer faults that no answer tells from it."""
    found = report.diagnosis.explanations
    keys = " + ".join(fault.key for fault in faults)
    return bool(found) and found[0].share == 1.0 and (
        keys in found[0].faults or len(found[0].faults[0].split(" + ")) < 2
    )  # fmt: skip


@pytest.mark.parametrize("faults", pairs()[::12], ids=lambda two: " + ".join(f.key for f in two))
def test_pair_is_named(faults):
    report = judged(faulty(faults))
    assert report.verdict is Verdict.WRONG
    assert is_named(report, faults)


@pytest.mark.slow
def test_every_pair_is_named():
    missed = [faults for faults in pairs() if not is_named(judged(faulty(faults)), faults)]
    assert not missed


def test_positions_only_name_what_they_show():
    twins = {"own rotation missing"}
    for fault in FAULTS["forward"]:
        report = judged(faulty([fault], ("positions",)))
        if report.verdict is Verdict.RIGHT:
            assert fault.key == "xyzw written"
        else:
            assert fault.key in named(report)[0] or fault.key in twins


@pytest.mark.parametrize("engine", SKELETON_ENGINES)
def test_engine_is_right(engine):
    assert judged(by_engine(engine)).verdict is Verdict.RIGHT


def test_reference_is_right():
    report = judged(by_reference)
    assert report.verdict is Verdict.RIGHT
    assert report.digits > 13
    assert report.slowdown > 0.0
    assert report.diagnosis.explanations == ()


def test_single_precision_is_right_where_declared():
    single = students.in_single(students.forward_kinematics)
    assert judged(single, precision="single").verdict is Verdict.RIGHT
    assert judged(single).verdict is Verdict.RIGHT_BUT


def test_student_is_right():
    assert judged(students.forward_kinematics).verdict is Verdict.RIGHT


def test_nan_rotation_does_not_void_positions():
    def function(parents, offsets, local_rotations):
        x, R = students.forward_kinematics(parents, offsets, local_rotations)
        R[-1] = np.nan
        return x, R

    report = judged(function)
    assert report.verdict is Verdict.WRONG
    assert laws_broken(report) == {"rotations"}


def test_nan_positions_are_broken():
    report = judged(lambda offsets: offsets * np.nan)
    assert report.verdict is Verdict.BROKEN


def test_lengths_are_told_and_then_normalised():
    def function(parents, offsets, local_rotations):
        x, R = students.forward_kinematics(parents, offsets, local_rotations)
        return x, 1.001 * R

    report = judged(function)
    assert report.verdict is Verdict.RIGHT_BUT
    assert laws_broken(report, Verdict.RIGHT_BUT) == {"unit quaternions"}


def test_state_left_over_is_told():
    calls = itertools.count()

    def function(parents, offsets, local_rotations):
        x, R = students.forward_kinematics(parents, offsets, local_rotations)
        return x + 1e-3 * next(calls), R

    report = judged(function)
    assert "equal answers" in laws_broken(report)
    assert "sanitizer" in str(report.diagnosis.hints[0])
    assert report.diagnosis.first_broken is not None


def test_changed_offsets_are_wrong():
    def function(parents, offsets, local_rotations):
        answer = students.forward_kinematics(parents, offsets, local_rotations)
        offsets *= 2.0
        return answer

    report = judged(function)
    assert laws_broken(report) == {"untouched inputs"}


def test_first_broken_law_names_the_joint():
    def function(parents, offsets, local_rotations):
        x, R = students.forward_kinematics(parents, offsets, local_rotations)
        x[1:] += 0.01 * np.sin(x[1:])
        return x, R

    report = judged(function)
    assert not report.diagnosis.explanations
    assert "joint 1" in str(report.diagnosis.first_broken)
    assert report.diagnosis.tried > 150


def test_quarter_turns_are_seen_at_a_glance():
    half = np.sqrt(0.5)
    inputs = {
        "parents": np.array([-1, 0]),
        "offsets": np.array([[1.0, 2.0, 3.0], [0.5, 0.0, 0.0]]),
        "local_rotations": np.array([[half, 0, 0, half], [half, 0, 0, half]]),
    }
    x, R = forward(inputs)
    assert x == pytest.approx(np.array([[1.0, 2.0, 3.0], [1.0, 2.5, 3.0]]))
    assert rotation.angle(R[1], [0, 0, 0, 1]) == pytest.approx(0.0, abs=1e-12)


def test_cases_suit_the_greeting():
    said = Greeting(1, (TASK,), chains_only=True, max_joints=5)
    cases = discipline.cases(said, "", 0, False)
    assert len(cases) > 10
    for case in cases:
        parents = case.inputs["parents"]
        assert len(parents) <= 5
        assert (parents == np.arange(-1, len(parents) - 1)).all()


def test_cases_are_the_same_in_every_run():
    said = Greeting(1, (TASK,))
    one, other = (discipline.cases(said, "", 7, False) for _ in range(2))
    assert [case.name for case in one] == [case.name for case in other]
    assert len({case.name for case in one}) == len(one)
    for a, b in zip(one, other, strict=True):
        assert all(np.array_equal(a.inputs[key], b.inputs[key]) for key in a.inputs)
