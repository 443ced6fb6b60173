"""Kinematics: honest solvers are right, lies break laws, and some faults are named.

`test_self_test.py` plants every fault on its own.
"""

import itertools

import conformance_students as students
import numpy as np
import pytest
from kinematics_solvers import (
    FORWARD,
    HONEST,
    INVERSE,
    METHODS,
    RESAMPLE,
    TRACK,
    broken,
    case_of,
    faulty,
    judged,
    judged_some,
    reference,
    textbook,
    told,
)

from plumbob.reference import IK_SOLVERS, resample, rotation
from plumbob.text.sentence import codes_in
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Fixed, Greeting
from plumbob.verify.judgement import Verdict
from plumbob.verify.kinematics import honest, sweeps
from plumbob.verify.kinematics.polylines import Polyline
from plumbob.verify.kinematics.predictions import solve
from plumbob.verify.kinematics.textbook import Choices
from plumbob.verify.verify import DISCIPLINES, judge_cases

ONE_METHOD = Greeting(1, (INVERSE,), methods=("ccd",))
RIGHT, RIGHT_EXCEPT, WRONG = Verdict.RIGHT, Verdict.RIGHT_EXCEPT, Verdict.WRONG
HONEST_CHOICES = [(m, choice) for m in METHODS for choice in honest.HONEST[m]]


# ---- faults


@pytest.mark.parametrize(("method", "choice"), HONEST_CHOICES)
def test_honest_choice_is_told_and_right(method, choice):
    report = judged(INVERSE, textbook(INVERSE, method, choice.choices), method)
    assert report.verdict is RIGHT_EXCEPT
    assert broken(report, RIGHT_EXCEPT) - {"target reached"}
    assert any(str(choice.sentence) in words for words in told(report))
    codes = {code for one in report.diagnosis.explanations for code in one.codes}
    assert codes <= {*codes_in(choice.sentence)}


@pytest.mark.parametrize(
    ("code", "law"), [("PB-CCD-021", "equal worlds"), ("PB-CCD-002", "distance does not grow")]
)
@pytest.mark.usefixtures("verdict_alone")
def test_fault_breaks_a_law_of_its_own(code, law):
    connection = FunctionConnection({INVERSE: faulty(INVERSE, code)}, ONE_METHOD)
    cases = DISCIPLINES[INVERSE].cases(ONE_METHOD, "ccd", 0, False)
    cases = [case for case in cases if case.name.startswith("one sweep")]
    assert law in broken(judge_cases(connection, INVERSE, "ccd", cases))


@pytest.mark.usefixtures("verdict_alone")
def test_one_iteration_too_many_that_is_reported_is_wrong():
    solve = textbook(INVERSE, "ccd", Choices(more_sweeps=1))

    def ccd(max_iterations, **inputs):
        answer = solve(max_iterations=max_iterations, **inputs)
        return {**answer, "iterations": max_iterations + 1}

    assert "claims" in broken(judged_some(INVERSE, ccd, "ccd"))


@pytest.mark.parametrize(("made", "is_told"), [(1, True), (10, False)])
@pytest.mark.usefixtures("without_changed_lines")
def test_another_number_of_sweeps_than_the_declared_one_is_told(made, is_told):
    solver = textbook(INVERSE, "fabrik")
    fixed = Fixed(max_iterations=10, tolerance=0.0)
    report = judged(
        INVERSE,
        lambda **inputs: solver(**{**inputs, "max_iterations": made}),
        "fabrik",
        fixed=fixed,
    )
    words = "Each answer is that after sweep 1 of FABRIK"
    assert any(words in str(hint) for hint in report.diagnosis.hints) is is_told
    assert (report.verdict >= WRONG) is is_told


# ---- honest solvers


def test_students_forward_kinematics_is_right():
    report = judged(FORWARD, students.forward_kinematics)
    assert report.verdict is RIGHT
    assert report.digits > 13
    single = students.in_single(students.forward_kinematics)
    assert judged(FORWARD, single, precision="single").verdict is RIGHT
    assert judged(FORWARD, single).verdict is RIGHT_EXCEPT


@pytest.mark.sample("ccd-inverse", "ccd-track", without=["anderson"])
@pytest.mark.parametrize(
    ("task", "is_declared"), [(INVERSE, True), (INVERSE, False), (TRACK, True)]
)
@pytest.mark.parametrize("solver", IK_SOLVERS)
def test_reference_is_not_accused(task, is_declared, solver):
    report = judged(task, reference(task, solver), solver if is_declared else "")
    is_exact = (task, solver, is_declared) == (INVERSE, "ccd", True)
    assert report.verdict <= (RIGHT if is_exact else RIGHT_EXCEPT)
    assert not report.diagnosis.explanations
    if solver in METHODS and not is_declared:
        assert "sweeps are those of" in str(report.diagnosis.behaviour)


@pytest.mark.sample("FABRIK")
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", HONEST)
def test_honest_variant_is_not_accused(name):
    method, function, options = HONEST[name]
    report = judged(INVERSE, students.with_options(function, **options), method)
    assert report.verdict is RIGHT_EXCEPT  # it is stuck at least on collinear targets
    assert all(e.faults == ("root to tip",) for e in report.diagnosis.explanations)


def test_a_sweep_that_ends_within_its_tolerance_names_no_mistake(monkeypatch):
    early = students.with_options(students.ccd, tests_each=True)
    report = judged(INVERSE, early, "ccd")
    assert any("ends a sweep as soon as" in words for words in told(report))
    monkeypatch.setattr(sweeps, "honest_variant", lambda *arguments: None)
    report = judged(INVERSE, early, "ccd")
    assert report.verdict is RIGHT_EXCEPT
    assert not report.diagnosis.explanations


@pytest.mark.slow
def test_solver_that_continues_to_the_target_has_a_reservation():
    def function(**inputs):
        return {
            "positions": solve("fabrik", inputs | {"max_iterations": 500, "tolerance": 1e-9})[1]
        }

    report = judged(INVERSE, function, "fabrik")
    assert report.verdict is RIGHT_EXCEPT
    assert any("goes on to the target" in words for words in told(report))


@pytest.mark.sample("fabrik-1")
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("method", METHODS)
def test_right_solvers_are_right_with_any_seed(seed, method):
    assert judged(INVERSE, textbook(INVERSE, method), method, seed).verdict <= RIGHT_EXCEPT


@pytest.mark.usefixtures("verdict_alone")
def test_a_method_of_its_own_may_be_slow_but_not_away_from_a_target():
    slow = textbook(INVERSE, "ccd", Choices(root_first=True))
    assert judged(INVERSE, slow, "mine").verdict is RIGHT_EXCEPT

    def away(**inputs):
        sign = -1.0 if inputs["max_iterations"] == 60 else 1.0
        return slow(**{**inputs, "target": sign * inputs["target"]})

    assert judged(INVERSE, away, "mine").verdict is WRONG


# ---- lies


def bent(x, R):
    x[1:] += 0.01 * np.sin(x[1:])
    return x, R


def nan_at_the_end(x, R):
    R[-1] = np.nan
    return x, R


def rotated_at_the_end(x, R):
    R[-1] = rotation.multiply(R[-1], rotation.exponential([0.2, 0.0, 0.0]))
    return x, R


CALLS = itertools.count()
FORWARD_LIES = {
    "a rotation that is NaN": (nan_at_the_end, WRONG, {"rotations"}),
    "positions that are NaN": (lambda x, R: x * np.nan, Verdict.BROKEN, {"positions"}),
    "long quaternions": (lambda x, R: (x, 1.001 * R), RIGHT_EXCEPT, {"unit quaternions"}),
    "state left over": (
        lambda x, R: (x + 1e-3 * next(CALLS), R), WRONG, {"equal answers", "positions"}
    ),
    "unknown fault": (bent, WRONG, {"positions"}),
}  # fmt: skip


def changed_forward(change):
    return lambda parents, offsets, local_rotations: change(
        *students.forward_kinematics(parents, offsets, local_rotations)
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda x, R: (0.0 * x, R), "are zero"),
        (lambda x, R: (0.01 * x, R), "0.01 times the right"),
        (lambda x, R: (x[:, [0, 2, 1]] * [1.0, -1.0, 1.0], R), "written as (x, -z, y)"),
        (lambda x, R: (np.round(x, 2), R), "at most 2 decimals"),
        (lambda x, R: (x, np.vstack([R[:1], 0.0 * R[1:] + R[-1]])), "do they share one array"),
    ],
    ids=["zero", "factor", "axes", "decimals", "shared"],
)
@pytest.mark.usefixtures("without_changed_lines")
def test_a_relation_to_the_right_answers_is_reported(change, words):
    report = judged_some(FORWARD, changed_forward(change), every=4)
    assert [words in str(hint) for hint in report.diagnosis.hints] == [True]


def test_a_rotation_without_w_is_not_a_number_at_half_a_turn_only():
    def divided_by_w(x, R):
        R[np.abs(R[:, 0]) < 1e-9] = np.nan
        return x, R

    report = judged_some(FORWARD, changed_forward(divided_by_w), every=11)
    assert report.verdict is WRONG
    assert "half a turn" in str(report.diagnosis.first_broken)


@pytest.mark.parametrize("name", FORWARD_LIES)
def test_law_of_forward_kinematics_catches_a_lie(name):
    change, verdict, laws = FORWARD_LIES[name]
    report = judged_some(FORWARD, changed_forward(change), every=4)
    diagnosis = report.diagnosis
    assert report.verdict is verdict
    assert broken(report, RIGHT_EXCEPT) == laws
    if name == "state left over":
        assert "sanitizer" in str(diagnosis.hints[0])
        assert diagnosis.first_broken is not None
    if name == "unknown fault":
        assert not diagnosis.explanations
        assert "Joint 1 is" in str(diagnosis.first_broken)


@pytest.mark.usefixtures("verdict_alone")
def test_digits_count_rotations_too():
    assert judged(FORWARD, changed_forward(rotated_at_the_end)).digits == pytest.approx(1, abs=0.5)
    assert judged(FORWARD, changed_forward(lambda x, R: (x, -2.0 * R))).digits > 14.0


@pytest.mark.usefixtures("verdict_alone")
def test_changed_offsets_are_wrong():
    def function(parents, offsets, local_rotations):
        answer = students.forward_kinematics(parents, offsets, local_rotations)
        offsets *= 2.0
        return answer

    assert broken(judged(FORWARD, function)) == {"untouched inputs"}


def changed_inverse(**changes):
    """Return a right solver with outputs changed by functions of answer and inputs."""

    def function(**inputs):
        local, positions, _ = solve("ccd", inputs)
        answer = {"local_rotations": local, "positions": positions}
        return answer | {name: change(answer, inputs) for name, change in changes.items()}

    return function


NOISE = np.random.default_rng(0)
INVERSE_LIES = {
    "link lengths": {"positions": lambda a, i: 1.001 * a["positions"]},
    "numbers": {"positions": lambda a, i: a["positions"] * np.nan},
    "claims": {"converged": lambda a, i: True},
    "equal answers": {"positions": lambda a, i: a["positions"] + 1e-6 * NOISE.uniform()},
}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("law", INVERSE_LIES)
@pytest.mark.usefixtures("verdict_alone")
def test_law_of_inverse_kinematics_catches_a_lie(law):
    report = judged_some(INVERSE, changed_inverse(**INVERSE_LIES[law]), "ccd")
    assert law in broken(report)
    assert report.verdict >= WRONG


def nan_effector(answer, inputs):
    local, effector = answer["local_rotations"], inputs["effector"]
    if not (inputs["parents"] == effector).any():
        local[effector] = np.nan
    return local


def nan_at_the_root(answer, inputs):
    is_at_root = np.allclose(inputs["target"], inputs["offsets"][0])
    return answer["local_rotations"] * (np.nan if is_at_root else 1.0)


@pytest.mark.parametrize(
    ("changes", "verdict", "law"),
    [
        ({"local_rotations": nan_effector}, RIGHT_EXCEPT, "numbers"),
        ({"local_rotations": nan_at_the_root}, RIGHT_EXCEPT, "numbers"),
        ({"local_rotations": lambda a, i: a["local_rotations"], "converged": lambda a, i: False},
         RIGHT_EXCEPT, "claims"),
    ],
)  # fmt: skip
@pytest.mark.usefixtures("verdict_alone")
def test_nan_of_the_effector_and_denied_arrival_void_nothing(changes, verdict, law):
    def function(**inputs):
        answer = changed_inverse(**changes)(**inputs)
        return {name: answer[name] for name in changes}

    report = judged_some(INVERSE, function, "ccd", every=4)
    assert report.verdict is verdict
    assert law in broken(report, RIGHT_EXCEPT)


# ---- cases


@pytest.mark.parametrize("task", [FORWARD, INVERSE])
def test_cases_suit_the_greeting_and_are_the_same_in_every_run(task):
    greeting = Greeting(1, (task,), chains_only=True, max_joints=5)
    first, second = (DISCIPLINES[task].cases(greeting, "", 7, False) for _ in range(2))
    assert len({case.name for case in first}) == len(first) > 10
    for a, b in zip(first, second, strict=True):
        parents = a.inputs["parents"]
        assert len(parents) <= 5
        assert (parents == np.arange(-1, len(parents) - 1)).all()
        assert a.name == b.name
        assert all(np.array_equal(a.inputs[key], b.inputs[key]) for key in a.inputs)


@pytest.mark.parametrize("method", ["ccd", "fabrik"])
@pytest.mark.parametrize("planar", [False, True])
def test_one_sweep_ends_where_a_false_claim_of_success_shows(method, planar):
    """Within the tolerance, or at so many tolerances that ten of them or a square root pass."""
    greeting = Greeting(1, (INVERSE,), planar=planar)
    for case in DISCIPLINES[INVERSE].cases(greeting, method, 0, False):
        if case.family in ("last sweep", "near miss", "miss"):
            _, x, _ = solve(method, case.inputs)
            tolerance = case.inputs["tolerance"]
            distance = np.linalg.norm(x[case.inputs["effector"]] - case.inputs["target"])
            assert (distance <= tolerance) == (case.family == "last sweep")
            assert distance <= 10.0 * tolerance
            if case.family != "last sweep":
                assert (distance**2 <= tolerance) == (case.family == "near miss")


# ---- resampling


def resampler(make):
    def function(curve, strokes, closed, count=None, spacing=None):
        inputs = {"curve": curve, "strokes": strokes, "closed": closed}
        inputs |= {"count": count} if count is not None else {"spacing": spacing}
        line = Polyline(curve, tuple(int(i) for i in strokes), closed)
        return make(case_of(RESAMPLE, inputs, line=line))

    return function


def even(line, inputs, closed):
    count = inputs["count"] if "count" in inputs else line.count(inputs["spacing"], closed)
    return line.even_points(count, closed)


def bridged(case):
    return even(case.facts["line"], case.inputs, case.inputs["closed"])


def kept(case):
    """Return even points within each stroke, with both ends of each and none between strokes."""
    curve, strokes = case.inputs["curve"], [*case.inputs["strokes"], len(case.inputs["curve"])]
    if len(strokes) == 2:
        return bridged(case)
    lines = [Polyline(curve[a:b], (0,), False) for a, b in itertools.pairwise(strokes)]
    if "spacing" in case.inputs:
        return np.concatenate([even(line, case.inputs, False) for line in lines])
    total, count = sum(line.length for line in lines), case.inputs["count"]
    shares = np.maximum(2, np.round([count * line.length / total for line in lines]).astype(int))
    shares[np.argmax(shares)] += count - shares.sum()
    parts = zip(lines, shares, strict=True)
    return np.concatenate([line.even_points(n, False) for line, n in parts])


def by_reference_spacing(case):
    if "count" in case.inputs:
        return bridged(case)
    spacing, closed = case.inputs["spacing"], bool(case.inputs["closed"])
    return resample(
        case.inputs["curve"], min_spacing=0.5 * spacing, max_spacing=spacing, closed=closed
    )


def start_repeated(case):
    points = bridged(case)
    return np.concatenate([points, points[:1]]) if case.inputs["closed"] else points


@pytest.mark.sample("kept", "bridged")
@pytest.mark.parametrize("make", [bridged, kept, by_reference_spacing, start_repeated])
def test_honest_rule_is_not_accused(make):
    report = judged(RESAMPLE, resampler(make))
    assert report.verdict <= (RIGHT if make is bridged else RIGHT_EXCEPT)


RESAMPLE_LIES = {
    "on the line": lambda x: x + np.array([0.0, 1e-6, 0.0]),
    "ends": lambda x: x[1:],
    "order": lambda x: np.concatenate([x[:1], x[2:0:-1], x[3:]]),
    "count": lambda x: x[[0, *range(len(x))]],
    "spacing": lambda x: np.delete(x, 1, axis=0),
    "numbers": lambda x: x * np.nan,
}


@pytest.mark.parametrize("law", RESAMPLE_LIES)
@pytest.mark.usefixtures("verdict_alone")
def test_law_of_resampling_catches_a_lie(law):
    report = judged(RESAMPLE, resampler(lambda case: RESAMPLE_LIES[law](bridged(case))))
    assert law in broken(report)


@pytest.mark.usefixtures("verdict_alone")
def test_a_single_point_is_wrong_and_not_an_error_of_the_judge():
    assert judged(RESAMPLE, resampler(lambda case: bridged(case)[:1])).verdict is WRONG
