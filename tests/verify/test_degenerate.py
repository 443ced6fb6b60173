"""Degenerate cases: a solver without guards is RIGHT EXCEPT there, with the missing guard."""

import math
import re

import conformance_students as students
import numpy as np
import pytest
from kinematics_solvers import INVERSE, judged, reference

from plumbob.verify.exchange import Failure
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Greeting
from plumbob.verify.judgement import Verdict
from plumbob.verify.screen.words import passed
from plumbob.verify.verify import DISCIPLINES, judge_cases

RIGHT_EXCEPT, BROKEN = Verdict.RIGHT_EXCEPT, Verdict.BROKEN


def divide_as_c(a, b):
    """Divide floats as C does: 0 / 0 is NaN."""
    with np.errstate(all="ignore"):
        return float(np.float64(a) / np.float64(b))


def acos_as_c(c):
    return math.acos(c) if abs(c) <= 1.0 else math.nan


def divide_by_nearly_zero(a, b):
    return a / (b + 1e-30)


# How a language divides by zero, and the arc cosine of a number beyond 1.
ARITHMETIC = {
    "exceptions": (lambda a, b: a / b, math.acos),
    "NaN": (divide_as_c, acos_as_c),
    "huge": (divide_by_nearly_zero, acos_as_c),
}


def textbook(method, arithmetic="NaN", kind=np.float64, clamp=1.0):
    """Return a solver whose divisions have no guards; a cosine is clamped to +-`clamp`."""
    divide, acos = ARITHMETIC[arithmetic]

    def unit(v):
        length = math.sqrt(sum(float(c) ** 2 for c in v))
        return np.array([divide(float(c), length) for c in v], dtype=kind)

    def arc(a, b, **options):
        a, b = unit(a), unit(b)
        axis, angle = unit(np.cross(a, b)), acos(min(max(float(a @ b), -clamp), clamp))
        return np.array([math.cos(angle / 2), *(math.sin(angle / 2) * axis)], dtype=kind)

    def function(parents, offsets, local_rotations, target, method, **limits):
        with pytest.MonkeyPatch.context() as patch, np.errstate(all="ignore"):
            patch.setattr(students, "arc", arc)
            patch.setattr(students, "towards", lambda a, b: unit(b - a))
            arrays = (offsets.astype(kind), local_rotations.astype(kind), target.astype(kind))
            Q, x = getattr(students, method)(parents, *arrays, **limits)
        return {"local_rotations": Q, "positions": x}

    return function


def complaints(report):
    """Return what is said of each family of cases that is not right."""
    return {
        judgement.case.family: str(judgement.complaints[0])
        for judgement in report.judgements
        if judgement.complaints
    }


# What is said of CCD's divisions in each family, in part.
CCD = {
    "at the root": "The target is at joint 0,",
    "at a joint": "The target is at joint 2,",
    "at the effector's parent": "The target is at joint 3,",
    "last link of no length": "The effector is at joint 2,",
    "opposite direction": "From joint 3, the effector and the target are in opposite directions:",
    "opposite": "in opposite directions:",
    "collinear": "in opposite directions:",
    "straight beyond": "in the same direction:",
}
FABRIK = {
    "arrived": "The link from joint 0 to joint 1 keeps its line,",
    "at the effector's parent": "In FABRIK's backward pass joint 4 comes to where joint 3 is,",
    "last link of no length": "The link from joint 2 to joint 3 has the length 0,",
    "straight beyond": "keeps its line,",
}


@pytest.mark.sample("fabrik-causes1-NaN-float64")
@pytest.mark.parametrize("kind", [np.float64, np.float32])
@pytest.mark.parametrize("arithmetic", ["NaN", "exceptions"])
@pytest.mark.parametrize(("method", "causes"), [("ccd", CCD), ("fabrik", FABRIK)])
@pytest.mark.usefixtures("verdict_alone")
def test_solver_without_guards_is_right_except_in_degenerate_cases(
    method, causes, arithmetic, kind
):
    report = judged(INVERSE, textbook(method, arithmetic, kind), method)
    assert report.verdict is RIGHT_EXCEPT
    said = complaints(report)
    for family, cause in causes.items():
        assert cause in said[family]
        assert re.search("[Ii]f (length|sine) < eps", said[family])
        assert ("ZeroDivisionError" in said[family]) is (arithmetic == "exceptions")
    assert any(isinstance(judgement.answer, Failure) for judgement in report.judgements) is (
        arithmetic == "exceptions"
    )


@pytest.mark.sample("fabrik")
@pytest.mark.parametrize("method", ["ccd", "fabrik"])
@pytest.mark.usefixtures("verdict_alone")
def test_huge_numbers_are_a_reservation_in_degenerate_cases_only(method):
    report = judged(INVERSE, textbook(method, "huge"), method)
    assert report.verdict is RIGHT_EXCEPT


@pytest.mark.sample("exceptions")
@pytest.mark.parametrize(("arithmetic", "hinted"), [("NaN", True), ("exceptions", False)])
def test_cosine_beyond_one_in_an_ordinary_case_is_broken(arithmetic, hinted):
    report = judged(INVERSE, textbook("ccd", arithmetic, clamp=2.0), "ccd")
    assert report.verdict is BROKEN
    assert report.smallest_failure.case.requirement == "must"
    assert any("acos" in str(hint) for hint in report.diagnosis.hints) is hinted


def raises(**_):
    raise RuntimeError("not today")


def without_numbers(local_rotations, **_):
    return {"local_rotations": np.full_like(local_rotations, np.nan), "iterations": 3}


@pytest.mark.parametrize("method", ["", "ccd"])
@pytest.mark.parametrize("solve", [raises, without_numbers])
@pytest.mark.usefixtures("verdict_alone")
def test_a_solver_that_never_answers_with_a_number_passes_no_case(solve, method):
    greeting = Greeting(1, (INVERSE,), methods=(method,))
    every = DISCIPLINES[INVERSE].cases(greeting, method, 0, False)
    cases = [case for case in every if case.requirement != "must"][:4] + every[:2]
    connection = FunctionConnection({INVERSE: solve}, greeting)
    report = judge_cases(connection, INVERSE, method, cases)
    assert {judgement.verdict for judgement in report.judgements} == {BROKEN}
    assert passed(report) == f"0/{len(cases)}"
    assert all(judgement.complaints for judgement in report.judgements)


@pytest.mark.sample("True")
@pytest.mark.parametrize("raises", [False, True])
@pytest.mark.usefixtures("verdict_alone")
def test_failure_in_an_ordinary_case_is_broken(raises):
    solve = textbook("fabrik")

    def function(**inputs):
        answer = solve(**inputs)
        if inputs["max_iterations"] == 25 and raises:
            raise ZeroDivisionError
        share = np.nan if inputs["max_iterations"] == 25 else 1.0
        return {name: share * numbers for name, numbers in answer.items()}

    assert judged(INVERSE, function, "fabrik").verdict is BROKEN


@pytest.mark.sample("levenberg")
@pytest.mark.parametrize("method", ["", "levenberg_marquardt"])
@pytest.mark.usefixtures("verdict_alone")
def test_guard_is_named_for_unknown_methods_too(method):
    solve = reference(INVERSE, "levenberg_marquardt")

    def function(**inputs):
        answer = solve(**inputs)
        is_at_root = np.array_equal(inputs["target"], inputs["offsets"][0])
        return {"positions": answer["positions"] * (np.nan if is_at_root else 1.0)}

    report = judged(INVERSE, function, method)
    assert report.verdict is RIGHT_EXCEPT
    assert "The case is: A target at the root itself." in complaints(report)["at the root"]
