"""Known faults of forward kinematics are applied where a solver's CCD and FABRIK are judged."""

import pytest
from kinematics_solvers import FORWARD, INVERSE, METHODS, named, textbook

from plumbob.text.sentence import Sentence, sentence
from plumbob.verify.case import Case
from plumbob.verify.contestant import Answer
from plumbob.verify.functions import FunctionContestant
from plumbob.verify.greeting import Greeting
from plumbob.verify.judgement import (
    CaseJudgement,
    Diagnosis,
    Explanation,
    TaskReport,
)
from plumbob.verify.kinematics.faults import by_key
from plumbob.verify.laws import finding
from plumbob.verify.verify import _with_cause, verify

# Faults of forward kinematics: one, two, and one that is never tried together with others.
BASES = [
    ["offset not rotated"],
    ["product reversed", "root rotation dropped"],
    ["offset rotated backwards", "positions from the root"],
    ["Euler angles XYZ as ZYX"],
]


def reports(base, method, declared):
    """Return the reports on a solver's forward kinematics and on its inverse kinematics."""
    faults = [by_key(method)[key] for key in base]
    functions = {
        FORWARD: textbook(FORWARD, faults),
        INVERSE: textbook(INVERSE, faults, method),
    }
    methods = (method if declared else "",)
    return verify(
        FunctionContestant(functions, Greeting(1, (FORWARD, INVERSE), methods=methods))
    ).tasks


@pytest.mark.sample("base0-fabrik-True")
@pytest.mark.parametrize("declared", [True, False])
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("base", BASES)
def test_solver_that_only_stands_on_wrong_forward_kinematics_is_said_to(base, method, declared):
    forward, inverse = reports(base, method, declared)
    assert set(base) <= set(" + ".join(named(forward)[0]).split(" + "))
    first = inverse.diagnosis.explanations[0]
    assert first.share == 1.0
    assert "Its own steps are right" in str(first.sentence)
    assert set(base) <= set(first.faults[0].split(" + "))


@pytest.mark.parametrize("codes", [("PB-FORCE-001",), ()])
def test_a_step_points_to_wrong_forces(codes):
    """With the code of their mistake, if that is known."""
    case = Case("one", "mass_spring_forces", {}, "x", sentence("It is all."))
    broken = finding("nearest point", 1.0)
    wrong = [CaseJudgement(case, Answer({}, 0.0), (broken,), {}, None, 0.0)]
    words = Sentence("[{code}] {what}", {"code": codes[0], "what": ""}) if codes else None
    known = (Explanation(("weight",), words, 1.0, 0.0),) if codes else ()
    forces = TaskReport("mass_spring_forces", "", wrong, Diagnosis(known))
    step = TaskReport("mass_spring_step", "", wrong, Diagnosis())
    (hint,) = map(str, _with_cause(step, [forces]).diagnosis.hints)
    assert "Its mass_spring_forces is wrong as well" in hint
    assert ("PB-FORCE-001" in hint) == bool(codes)


@pytest.mark.parametrize(("code", "is_kept"), [("PB-CLAIM-020", False), ("PB-CCD-016", True)])
def test_claims_of_wrong_poses_are_no_mistakes_beside_wrong_forward_kinematics(code, is_kept):
    case = Case("one", INVERSE, {}, "x", sentence("It is all."))
    wrong = [CaseJudgement(case, Answer({}, 0.0), (finding("nearest point", 1.0),), {}, None, 0.0)]
    words = Sentence("[{code}] {what}", {"code": code, "what": ""})
    known = Diagnosis((Explanation(("it",), words, 1.0, 0.0),), hints=(words,))
    forward, inverse = (TaskReport(task, "", wrong, known) for task in (FORWARD, INVERSE))
    diagnosis = _with_cause(inverse, [forward]).diagnosis
    assert (words in diagnosis.hints) is is_kept
    assert [one.sentence for one in diagnosis.explanations] == [words] * is_kept
