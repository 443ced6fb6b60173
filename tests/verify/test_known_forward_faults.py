"""Tasks that build upon a wrong one point to it."""

import pytest
from kinematics_solvers import FORWARD, INVERSE, METHODS, faulty

from plumbob.text.sentence import Sentence, sentence
from plumbob.verify.case import Case
from plumbob.verify.exchange import Answer
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Greeting
from plumbob.verify.judgement import (
    CaseJudgement,
    Diagnosis,
    Explanation,
    TaskReport,
)
from plumbob.verify.laws import finding
from plumbob.verify.verify import _with_cause, verify


@pytest.mark.sample("fabrik")
@pytest.mark.parametrize("method", METHODS)
def test_a_solver_that_stands_on_wrong_forward_kinematics_is_told_its_mistake(method):
    code = "PB-FK-003"
    functions = {FORWARD: faulty(FORWARD, code), INVERSE: faulty(INVERSE, code, method=method)}
    greeting = Greeting(1, (FORWARD, INVERSE), methods=(method,))
    forward, inverse = verify(FunctionConnection(functions, greeting)).tasks
    assert forward.diagnosis.explanations[0].codes == (code,)
    (hint, *_) = inverse.diagnosis.hints
    assert f"Its forward_kinematics is wrong as well ({code})" in str(hint)


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
