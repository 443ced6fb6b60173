"""Judging tracking and resampling: every fault is caught and named, and nobody else accused."""

import itertools

import conformance_students as students
import numpy as np
import pytest
from kinematics_solvers import (
    METHODS,
    RESAMPLE,
    TRACK,
    broken,
    case_of,
    judged,
    named,
    reference,
    textbook,
)

from plumbob.crosscheck.verify.judgement import Verdict
from plumbob.crosscheck.verify.kinematics.faults import FAULTS, by_key
from plumbob.crosscheck.verify.kinematics.polylines import Polyline
from plumbob.crosscheck.verify.kinematics.resample import FAULTS as RESAMPLE_FAULTS
from plumbob.reference import IK_SOLVERS, resample

FOLLOW = [fault for fault in FAULTS["track ccd"] if fault.part == "follow"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("fault", FOLLOW, ids=lambda fault: fault.key)
def test_fault_of_tracking_is_caught_and_named(method, fault):
    report = judged(TRACK, textbook(TRACK, [fault], method), method)
    rest = method == "fabrik" and fault.key == "frames start at rest"
    expected = Verdict.RIGHT_BUT if fault.honest or rest else Verdict.WRONG
    assert report.verdict is expected
    assert named(report)[0] == {fault.key}


@pytest.mark.parametrize("key", ["world rotation on the left", "offset not rotated"])
def test_fault_of_the_solver_is_named_in_tracking(key):
    report = judged(TRACK, textbook(TRACK, [by_key("ccd")[key]]), "ccd")
    if report.verdict is not Verdict.RIGHT:
        assert named(report)[0] == {key}


@pytest.mark.parametrize("solver", IK_SOLVERS)
def test_reference_tracks_rightly(solver):
    report = judged(TRACK, reference(TRACK, solver), solver)
    assert report.verdict <= Verdict.RIGHT_BUT
    assert not report.diagnosis.explanations


def test_jump_is_told():
    follow = textbook(TRACK, (), "fabrik")

    def jumping(**inputs):
        positions = follow(**inputs)["positions"]
        root, x = positions[4, 0], positions[4]
        axis = inputs["curve"][4] - root
        axis = axis / np.linalg.norm(axis)
        positions[4] = root + 2.0 * np.outer((x - root) @ axis, axis) - (x - root)
        return {"positions": positions}

    assert "continuity" not in broken(judged(TRACK, follow), Verdict.RIGHT_BUT)
    assert "continuity" in broken(judged(TRACK, jumping), Verdict.RIGHT_BUT)


def resampler(make):
    def function(curve, strokes, closed, count=None, spacing=None):
        inputs = {"curve": curve, "strokes": strokes, "closed": closed}
        inputs |= {"count": count} if count is not None else {"spacing": spacing}
        line = Polyline(curve, tuple(int(i) for i in strokes), closed)
        return make(case_of(RESAMPLE, inputs, line=line))

    return function


@pytest.mark.parametrize("key", RESAMPLE_FAULTS)
def test_fault_of_resampling_is_caught_and_named(key):
    report = judged(RESAMPLE, resampler(RESAMPLE_FAULTS[key][0]))
    assert report.verdict is Verdict.WRONG
    assert named(report)[0] == {key}


def bridged(case):
    line, closed = case.facts["line"], case.inputs["closed"]
    if "count" in case.inputs:
        return line.even_points(case.inputs["count"], closed)
    return line.even_points(line.count(case.inputs["spacing"], closed), closed)


def kept(case):
    """Even points within each stroke, none between them, both ends of each kept."""
    curve, strokes = case.inputs["curve"], [*case.inputs["strokes"], len(case.inputs["curve"])]
    if len(strokes) == 2:
        return bridged(case)
    lines = [Polyline(curve[a:b], (0,), False) for a, b in itertools.pairwise(strokes)]
    if "spacing" in case.inputs:
        return np.concatenate(
            [line.even_points(line.count(case.inputs["spacing"], False), False) for line in lines]
        )
    total, count = sum(line.length for line in lines), case.inputs["count"]
    shares = np.maximum(2, np.round([count * line.length / total for line in lines]).astype(int))
    shares[np.argmax(shares)] += count - shares.sum()
    return np.concatenate(
        [line.even_points(n, False) for line, n in zip(lines, shares, strict=True)]
    )


def by_reference_spacing(case):
    if "count" in case.inputs:
        return bridged(case)
    spacing = case.inputs["spacing"]
    return resample(
        case.inputs["curve"], min_spacing=0.5 * spacing, max_spacing=spacing,
        closed=bool(case.inputs["closed"]),
    )  # fmt: skip


def keeping_ends(case):
    """A closed curve whose first point comes again at the end."""
    points = bridged(case)
    return np.concatenate([points, points[:1]]) if case.inputs["closed"] else points


@pytest.mark.parametrize("make", [bridged, kept, by_reference_spacing, keeping_ends])
def test_honest_rule_is_not_accused(make):
    report = judged(RESAMPLE, resampler(make))
    assert report.verdict <= Verdict.RIGHT_BUT
    assert make is not bridged or report.verdict is Verdict.RIGHT


@pytest.mark.parametrize(("make", "word"), [(bridged, "bridges"), (kept, "keeps")])
def test_strokes_are_told(make, word):
    assert word in str(judged(RESAMPLE, resampler(make)).diagnosis.behaviour)


LIES = {
    "on the line": lambda x: x + np.array([0.0, 1e-6, 0.0]),
    "ends": lambda x: x[1:],
    "order": lambda x: np.concatenate([x[:1], x[2:0:-1], x[3:]]),
    "count": lambda x: x[[0, *range(len(x))]],
    "spacing": lambda x: np.delete(x, 1, axis=0),
    "numbers": lambda x: x * np.nan,
}


@pytest.mark.parametrize("law", LIES)
def test_law_of_resampling_sees_the_lie(law):
    report = judged(RESAMPLE, resampler(lambda case: LIES[law](bridged(case))))
    assert law in broken(report)


def test_single_precision_is_not_accused():
    def single(case):
        return bridged(case).astype(np.float32)

    assert judged(RESAMPLE, resampler(single), precision="single").verdict is Verdict.RIGHT


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_student_follows_curves():
    def function(parents, offsets, local_rotations, curve, **inputs):
        inputs.pop("method")
        local, found = local_rotations, []
        for target in curve:
            local, _ = students.ccd(parents, offsets, local, target, **inputs)
            found.append(local)
        return {"local_rotations": np.array(found)}

    assert judged(TRACK, function, "ccd").verdict is Verdict.RIGHT
