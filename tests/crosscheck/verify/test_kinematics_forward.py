"""Judging forward kinematics: every fault is caught by a law and named, and nobody else accused."""

import itertools

import conformance_students as students
import numpy as np
import pytest
from kinematics_solvers import FORWARD, broken, judged, named, reference, textbook

from plumbob.crosscheck.engines import SKELETON_ENGINES, forward_kinematics_by
from plumbob.crosscheck.verify.greeting import Greeting
from plumbob.crosscheck.verify.judgement import Verdict
from plumbob.crosscheck.verify.kinematics import forward_kinematics as discipline
from plumbob.crosscheck.verify.kinematics.faults import FAULTS, combinations
from plumbob.crosscheck.verify.kinematics.predictions import forward
from plumbob.reference import Skeleton, rotation

FAULTS = FAULTS["forward"]
PAIRS = [faults for faults in combinations("forward") if len(faults) == 2]


def changed(change):
    """Return a student's solver whose answer is changed."""

    def function(parents, offsets, local_rotations):
        return change(*students.forward_kinematics(parents, offsets, local_rotations))

    return function


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.key)
def test_fault_is_caught_and_named(fault):
    report = judged(FORWARD, textbook(FORWARD, [fault]))
    assert report.verdict is Verdict.WRONG
    assert broken(report) & {"positions", "rotations"}
    assert named(report) == [{fault.key}]
    assert report.diagnosis.explanations[0].share == 1.0
    assert report.smallest_failure is not None


def is_named(report, faults):
    """Whether a pair is named, or fewer faults that no answer tells from it."""
    found = report.diagnosis.explanations
    keys = " + ".join(fault.key for fault in faults)
    return bool(found) and found[0].share == 1.0 and (
        keys in found[0].faults or len(found[0].faults[0].split(" + ")) < 2
    )  # fmt: skip


@pytest.mark.parametrize("every", [12, pytest.param(1, marks=pytest.mark.slow)])
def test_pairs_are_named(every):
    for faults in PAIRS[::every]:
        report = judged(FORWARD, textbook(FORWARD, faults))
        assert report.verdict is Verdict.WRONG
        assert is_named(report, faults), faults


def test_positions_only_name_what_they_show():
    twins = {"own rotation missing"}
    for fault in FAULTS:
        report = judged(FORWARD, textbook(FORWARD, [fault], outputs=["positions"]))
        if report.verdict is Verdict.RIGHT:
            assert fault.key == "xyzw written"
        else:
            assert fault.key in named(report)[0] | twins


def by_engine(name):
    def function(parents, offsets, local_rotations):
        engine = SKELETON_ENGINES[name](Skeleton(parents, offsets))
        return tuple(forward_kinematics_by(engine, local_rotations))

    return function


@pytest.mark.parametrize(
    "function",
    [*map(by_engine, SKELETON_ENGINES), reference(FORWARD), students.forward_kinematics],
    ids=[*SKELETON_ENGINES, "reference", "student"],
)
def test_who_is_right_is_right(function):
    report = judged(FORWARD, function)
    assert report.verdict is Verdict.RIGHT
    assert report.digits > 13
    assert report.slowdown > 0.0
    assert report.diagnosis.explanations == ()


def test_single_precision_is_right_where_declared():
    single = students.in_single(students.forward_kinematics)
    assert judged(FORWARD, single, precision="single").verdict is Verdict.RIGHT
    assert judged(FORWARD, single).verdict is Verdict.RIGHT_BUT


def rotated_at_the_end(x, R):
    R[-1] = rotation.multiply(R[-1], rotation.exponential([0.2, 0.0, 0.0]))
    return x, R


def test_digits_are_those_of_the_rotations_too():
    assert judged(FORWARD, changed(rotated_at_the_end)).digits == pytest.approx(1.0, abs=0.5)
    assert judged(FORWARD, changed(lambda x, R: (x, -2.0 * R))).digits > 14.0


def nan_at_the_end(x, R):
    R[-1] = np.nan
    return x, R


CALLS = itertools.count()
LIES = {
    "a rotation that is no number": (nan_at_the_end, Verdict.WRONG, {"rotations"}),
    "positions that are none": (lambda x, R: x * np.nan, Verdict.BROKEN, {"positions"}),
    "long quaternions": (lambda x, R: (x, 1.001 * R), Verdict.RIGHT_BUT, {"unit quaternions"}),
    "state left over": (
        lambda x, R: (x + 1e-3 * next(CALLS), R), Verdict.WRONG, {"equal answers", "positions"}
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", LIES)
def test_a_law_sees_the_lie(name):
    change, verdict, laws = LIES[name]
    report = judged(FORWARD, changed(change))
    assert report.verdict is verdict
    assert broken(report, Verdict.RIGHT_BUT) == laws
    if name == "state left over":
        assert "sanitizer" in str(report.diagnosis.hints[0])
        assert report.diagnosis.first_broken is not None


def test_changed_offsets_are_wrong():
    def function(parents, offsets, local_rotations):
        answer = students.forward_kinematics(parents, offsets, local_rotations)
        offsets *= 2.0
        return answer

    assert broken(judged(FORWARD, function)) == {"untouched inputs"}


def bent(x, R):
    x[1:] += 0.01 * np.sin(x[1:])
    return x, R


def test_first_broken_law_names_the_joint():
    report = judged(FORWARD, changed(bent))
    assert not report.diagnosis.explanations
    assert "joint 1" in str(report.diagnosis.first_broken)
    assert report.diagnosis.variant_count > 150


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
    said = Greeting(1, (FORWARD,), chains_only=True, max_joints=5)
    cases = discipline.cases(said, "", 0, False)
    assert len(cases) > 10
    for case in cases:
        parents = case.inputs["parents"]
        assert len(parents) <= 5
        assert (parents == np.arange(-1, len(parents) - 1)).all()


def test_cases_are_the_same_in_every_run():
    said = Greeting(1, (FORWARD,))
    first, second = (discipline.cases(said, "", 7, False) for _ in range(2))
    assert [case.name for case in first] == [case.name for case in second]
    assert len({case.name for case in first}) == len(first)
    for a, b in zip(first, second, strict=True):
        assert all(np.array_equal(a.inputs[key], b.inputs[key]) for key in a.inputs)
