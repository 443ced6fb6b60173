"""The laws of forces, energies, curves and robots at the edges of their tolerances.

The faults of the other files are gross, and most are in every frame and at every joint.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.exchange import Answer, Exchange
from plumbob.verify.explain import Match, Variant, _telling, explain
from plumbob.verify.greeting import Greeting
from plumbob.verify.judgement import (
    CaseJudgement,
    Diagnosis,
    Finding,
    TaskReport,
    Verdict,
)
from plumbob.verify.kinematics import (
    claims,
    resample,
    robot_inverse_kinematics,
    robot_targets,
    sweeps,
    track,
)
from plumbob.verify.kinematics.polylines import Polyline
from plumbob.verify.kinematics.predictions import predict_track
from plumbob.verify.kinematics.trajectories import trajectory_of
from plumbob.verify.laws import HOLDS, equal_answers
from plumbob.verify.mass_spring import energy, forces
from plumbob.verify.mass_spring.problem import all_forces, problem_of
from plumbob.verify.take.precision import AS_SINGLE, are_off_by_single, judging_greeting

EPSILON = 2.0**-52
RIGHT, RIGHT_EXCEPT, WRONG = Verdict.RIGHT, Verdict.RIGHT_EXCEPT, Verdict.WRONG
EDGES = [(0.5, RIGHT), (2.0, WRONG)]


def by_law(findings):
    return {finding.law: finding for finding in findings}


# ---- forces and energies


@pytest.fixture
def spring():
    """A stretched spring, one kilogram at each end, one of them moving."""
    return problem_of(
        {
            "masses": [1.0, 1.0],
            "springs": [[0, 1]],
            "rest_lengths": [1.0],
            "stiffnesses": [100.0],
            "dampings": [2.0],
            "gravity": [0.0, -10.0, 0.0],
            "positions": [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]],
            "velocities": [[0.0, 0.0, 0.0], [0.0, 3.0, 0.0]],
        }
    )


@pytest.mark.parametrize(("share", "verdict"), EDGES)
def test_forces_are_those_of_the_formula_and_add_up_to_the_weight_to_rounding(
    spring, share, verdict
):
    """The sum to twice the rounding of one, times the root of the number of particles."""
    expected, allowed = all_forces(spring), forces.tolerance(spring, EPSILON)
    given = expected.copy()
    given[1, 2] += share * allowed
    found = forces._formula(given, expected, allowed)
    assert (found.verdict, found.index) == (verdict, 1)
    given = expected.copy()
    given[:, 1] += share * allowed * np.sqrt(2.0)
    assert forces._balance(spring, given, allowed).verdict is verdict


@pytest.mark.parametrize(("share", "verdict"), EDGES)
@pytest.mark.parametrize("shifted", [["total"], ["potential", "total"]])
def test_parts_of_the_energy_add_up_to_rounding(shifted, share, verdict):
    """Four times the rounding of one part."""
    greeting = Greeting(1, ("energy",))
    case = energy.cases(greeting, "", 0, False)[0]
    p = problem_of(case.inputs)
    answered = energy.predict(p)
    for name in shifted:
        answered[name] += share * 4.0 * energy.tolerance(p, EPSILON)
    answer = Answer(answered, 0.0)
    (judgement,) = energy.judge([Exchange(case, answer, answer)], greeting, "").judgements
    found = [one.verdict for one in judgement.findings if one.law == "sum of energies"]
    assert sorted(found) == [RIGHT, verdict]


# ---- resampled polylines


GREETING = Greeting(1, ("resample",))


@pytest.fixture
def segments():
    """A request for eleven points on a line of five metres with a corner."""
    curve = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 2.0, 0.0]])
    line = Polyline(curve, (0,), False)
    inputs = {"curve": curve, "strokes": np.array([0]), "closed": False, "count": 11}
    case = Case("", "resample", inputs, "", HOLDS, facts={"line": line, "size": 3.0})
    return case, line.even_points(11, False)


# Sixteen epsilons of three points of three metres and of the line's length.
ON_LINE = 16 * EPSILON * (3 * 3.0 + 5.0)


@pytest.mark.parametrize(("share", "verdict"), EDGES)
@pytest.mark.parametrize(
    ("law", "point", "direction"),
    [("ends", 0, [1, 0, 0]), ("ends", -1, [0, -1, 0])]
    + [("on the line", point, [0, 0, 1]) for point in (2, 8)],
)
def test_points_and_ends_are_kept_to_rounding(segments, law, point, direction, share, verdict):
    case, points = segments
    points[point] += share * ON_LINE * np.array(direction)
    found = by_law(resample.point_laws(points, case, GREETING))
    assert found[law].verdict is verdict
    assert {found[other].verdict for other in {"ends", "on the line"} - {law}} == {RIGHT}


@pytest.mark.parametrize(("share", "verdict"), [(0.015, RIGHT), (0.025, WRONG)])
def test_gaps_differ_from_the_mean_by_a_fiftieth_at_most(segments, share, verdict):
    case, points = segments
    points[2, 0] += share * 0.5  # a gap is half a metre long
    found = by_law(resample.point_laws(points, case, GREETING))
    assert found["spacing"].verdict is verdict
    assert found["spacing"].error == pytest.approx(share)


def test_the_last_side_of_a_closed_curve_counts():
    """It may be a fiftieth longer than the others, and is not if the start comes again."""
    curve = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    line = Polyline(curve, (0,), True)
    inputs = {"curve": curve, "strokes": np.array([0]), "closed": True, "count": 8}
    case = Case("", "resample", inputs, "", HOLDS, facts={"line": line, "size": 1.0})
    points = line.even_points(8, True)
    for shortened, verdict in ((0.0, RIGHT), (0.001, RIGHT), (0.005, WRONG)):
        uneven = line.point_at(np.arange(8) * (0.5 - shortened))
        found = by_law(resample.point_laws(uneven, case, GREETING))
        assert found["closing side"].verdict is verdict
    found = by_law(resample.point_laws(np.concatenate([points, points[:1]]), case, GREETING))
    assert found["closing side"].verdict is RIGHT
    for other, verdict in ((np.roll(points[::-1], 1, axis=0), RIGHT), (points[::-1], WRONG)):
        findings = resample.point_laws(other, case, GREETING)  # either way round, from the start
        assert max(found.verdict for found in findings) is verdict


# ---- motions


@pytest.fixture(scope="module")
def motion():
    """The request for a chain's small circle, and the textbook's answer by FABRIK."""
    case = track.cases(Greeting(1, ("track",)), "fabrik", 0, False)[0]
    found = predict_track("fabrik", case)
    return case, np.array(found["path_positions"])


def test_only_frames_that_start_anew_do_not_continue(motion):
    """Those of another solver are neither the textbook's nor the textbook's from the start."""
    case, _ = motion
    outputs = {start: predict_track("fabrik", case, start) for start in (False, True)}
    answers = {
        "warm": outputs[0],
        "anew": outputs[1],
        "another": {name: value + 1e-3 for name, value in outputs[0].items()},
    }
    greeting, verdicts = Greeting(1, ("track",)), {}
    for name, values in answers.items():
        answer = Answer({"positions": values["path_positions"]}, 0.0)
        verdicts[name] = track._continues(Exchange(case, answer, None), "fabrik", greeting).verdict
    assert verdicts["warm"] is verdicts["another"] is RIGHT
    assert verdicts["anew"] > RIGHT


@pytest.mark.parametrize(("distance", "verdict"), [(0.99, RIGHT), (1.01, RIGHT_EXCEPT)])
def test_a_joint_that_moves_more_than_a_metre_in_a_frame_has_jumped(motion, distance, verdict):
    case, positions = motion
    moved = np.repeat(positions[:1], len(positions), axis=0)
    moved[5:, 2, 1] += distance
    asked = Exchange(case, Answer({"positions": moved}, 0.0), None)
    poses = [posed for _, posed in track.frames_of(asked)]
    (found,) = track._continuity(poses)
    assert (found.verdict, found.index) == (verdict, 2)
    assert found.error == pytest.approx(distance)


@pytest.mark.parametrize(("hits", "method"), [(4, "ccd"), (3, "")])
def test_the_method_is_that_of_half_of_the_right_sweeps(hits, method, monkeypatch):
    """CCD gives so many of eight sweeps, FABRIK none."""
    errors = {"ccd": lambda i: (float(i >= hits), 0.5), "fabrik": lambda i: (1.0, 0.5)}
    monkeypatch.setattr(sweeps, "_error", lambda trial, name, greeting: errors[name](trial))
    monkeypatch.setattr(sweeps, "is_other_solver", lambda *arguments: True)
    assert sweeps.recognise_method(range(8), GREETING) == method


@pytest.mark.parametrize(("hits", "is_named"), [(9, True), (8, False)])
def test_a_formula_has_to_give_nine_of_ten_residuals(hits, is_named):
    answers = [
        {"distance": d, "residual": d**2 if i < hits else d + 0.3, "tolerance": 1e-4, "same": 1e-9}
        for i, d in enumerate(np.linspace(0.1, 0.8, 10))
    ]
    named = [one.faults for one in claims.explanations(answers)]
    assert named == [("residual squared",)] * is_named


# ---- robots


ROBOTS = Greeting(1, (robot_inverse_kinematics.TASK,))


@pytest.fixture(scope="module")
def robot():
    """A request for a robot of seven hinges, from where its target is."""
    cases = robot_targets.cases(ROBOTS, "", 0, False)
    return next(c for c in cases if c.name.startswith("seven") and c.family == robot_targets.AT)


@pytest.mark.parametrize(("share", "verdict"), EDGES)
@pytest.mark.parametrize(("side", "sign"), [("lower", -1.0), ("upper", 1.0)])
def test_coordinates_keep_both_limits_to_rounding(robot, side, sign, share, verdict):
    """Sixteen epsilons of the largest limit, 2.4 rad."""
    q = robot.inputs["start"].copy()
    q[3] = robot.inputs[side][3] + sign * share * 16 * EPSILON * 2.4
    motions = {robot.name: trajectory_of(robot, {"q": q})}
    laws = robot_inverse_kinematics.PoseLaws(motions, ROBOTS, False)
    (found, *_) = laws.findings(robot, {"q": q})
    assert (found.law, found.verdict, found.index) == ("limits kept", verdict, 3)


@pytest.mark.parametrize(
    ("distance", "angle", "claim", "verdicts"),
    [
        (0.9, 0.9, True, []),
        (1.1, 0.9, True, [WRONG]),
        (0.9, 1.1, True, [WRONG]),
        (0.9, 0.9, False, [RIGHT_EXCEPT]),
        (1.1, 0.9, False, []),
        (0.9, 1.1, False, []),
    ],
)
def test_a_claim_is_about_the_position_and_the_rotation(robot, distance, angle, claim, verdicts):
    pose = SimpleNamespace(distance=distance, angle=angle, tolerance=1.0, tolerance_rotation=1.0)
    laws = robot_inverse_kinematics.PoseLaws({}, ROBOTS, False)
    found = laws._target_laws(pose, {"converged": claim}, robot)
    assert [finding.verdict for finding in found if finding.law == "claims"] == verdicts


# ---- reports


def judgement(size, verdict, digits=None):
    """Return a judgement of a case of so many numbers."""
    case = Case(str(size), "", {"x": np.zeros(size)}, "", sentence(""))
    finding = Finding("a law", verdict, 1.0, 0.0, "", sentence(""))
    return CaseJudgement(case, Answer({}, 0.0), (finding,), {}, digits)


@pytest.mark.parametrize(
    ("worst", "assumed", "asked"),
    [(RIGHT, RIGHT_EXCEPT, Verdict.UNDECIDED), (WRONG, WRONG, WRONG)],
)
def test_what_is_assumed_is_a_reservation_and_what_is_asked_is_undecided(worst, assumed, asked):
    report = TaskReport("", "", [judgement(1, RIGHT), judgement(1, worst)], Diagnosis())
    assumptions = (sentence("Something."),)
    assert report.verdict is worst
    assert replace(report, assumptions=assumptions).verdict is assumed
    assert replace(report, assumptions=assumptions, needs_declaration=True).verdict is asked


@pytest.mark.parametrize(
    ("digits", "is_single"),
    [([5.1, 8.9, 8.9], True), ([4.9, 8.0, 8.0], False), ([5.1, 9.1, 9.1], False), ([], False)],
)
def test_errors_of_five_to_nine_digits_are_those_of_single_precision(digits, is_single):
    """The least decides where a fault is small in most cases, the median where it is in few."""
    judgements = [judgement(1, WRONG, count) for count in (*digits, None)]
    report = TaskReport("", "", judgements, Diagnosis())
    assert are_off_by_single(report.judgements) is is_single
    assert report.digits == min(digits, default=None)


@pytest.mark.parametrize(("whole", "is_single"), [(5, False), (6, True)])
def test_a_request_tells_the_precision_if_a_quarter_of_its_numbers_are_whole_doubles(
    whole, is_single, rng
):
    """Of 20 numbers; answers to requests of few digits may have few digits themselves."""
    roots, tenths = np.sqrt([2.0, 3.0, 5.0, 6.0, 7.0, 8.0]), 0.13 + 0.1 * np.arange(20 - whole)
    numbers = np.concatenate([roots[:whole], np.round(tenths, 2)])
    case = Case("", "mass_spring_step", {"positions": numbers}, "", sentence(""))
    output = rng.standard_normal(30).astype(np.float32).astype(float)
    greeting = Greeting(1, ("mass_spring_step",))
    exchange = Exchange(case, Answer({"positions": output}, 0.0), None)
    assert (judging_greeting([exchange], greeting)[1] is AS_SINGLE) == is_single


def test_faults_are_named_only_if_they_explain_more_than_a_part_of_them():
    def match(share, *faults):
        return Match(Variant(faults, lambda case: {}), share, 0.0, [])

    right, as_good, better, whole = match(0.6), match(0.6, "a"), match(0.7, "b"), match(1.0, "c")
    assert _telling([right, as_good, better]) == [better]
    assert _telling([right, as_good, better, whole]) == [whole]
    perfect, pair = match(1.0), match(0.95, "b", "e")
    assert _telling([perfect, whole]) == [perfect]
    # A combination that explains few answers, or hardly more than its parts, may be chance.
    needless = [match(0.7, "b", "d"), match(0.85, "b", "f"), match(0.65, "g", "h")]
    assert _telling([better, *needless, pair]) == [better, pair]


@pytest.mark.parametrize(("again", "verdict"), [(np.nan, Verdict.RIGHT), (0.0, Verdict.WRONG)])
def test_equal_answers_without_numbers_are_equal(again, verdict):
    """What rounding allows of them is no number either."""
    answers = [Answer({"positions": np.full((2, 3), x)}, 1e-3) for x in (np.nan, again)]
    one = Exchange(Case("one", "mass_spring_step", {}, "x", sentence("It is all.")), *answers)
    assert equal_answers(one, np.nan).verdict is verdict


def test_a_fault_is_named_once_for_all_programs_that_it_may_be_in():
    numbers = [{"energy": float(i)} for i in range(1, 5)]
    cases = [Case(str(i), "energy", {"i": i}, "", sentence("")) for i in range(4)]
    asked = [Exchange(case, Answer(x, 0.0), None) for case, x in zip(cases, numbers, strict=True)]

    def variant(last, *faults):
        right = {case.inputs["i"]: x for case, x in zip(cases, numbers, strict=True)}
        return Variant(faults, lambda case: right[min(case.inputs["i"], last)])

    variants = [variant(2, "a"), variant(1, "a"), variant(1, "b")]
    told = explain(variants, asked, 1e-9, lambda keys: sentence("It is wrong."))
    assert [(one.faults, one.share) for one in told] == [(("a",), 0.75), (("b",), 0.5)]
