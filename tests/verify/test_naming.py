"""Programs that the catalogue never saw: their faults show in answers, are caught and named.

`python -m pytest tests/verify/test_naming.py -m slow -s` prints the matrix.
"""

import pytest
from planted_programs import FAULTS, IN

from plumbob.verify.door import open_contestant
from plumbob.verify.judgement import Verdict
from plumbob.verify.verify import verify

SOME = [
    ("cpp", "ccd_world_left"),
    ("cpp", "forces_damping_sign"),
    ("javascript", "fk_inverse_rotation"),
    ("javascript", "step_pins_overwritten"),
]


def judged(run, fault):
    """Return the report of the fault's task, of its method if it has one."""
    contestant = open_contestant([*run, "--fault", fault])
    try:
        report = verify(contestant, [FAULTS[fault]["task"]])
    finally:
        contestant.close()
    method = fault.partition("_")[0]
    return next(one for one in report.tasks if one.method in ("", method) or method == "track")


def first_names(report):
    explanations = report.diagnosis.explanations
    return explanations[0].faults if explanations else ()


def is_named(report, fault):
    if hint := FAULTS[fault].get("hint"):
        findings = [finding for one in report.judgements for finding in one.findings]
        sentences = [*report.diagnosis.hints, *(finding.sentence for finding in findings)]
        return any(hint in str(words) for words in sentences)
    return FAULTS[fault].get("name") in first_names(report)


@pytest.mark.sample("fk_inverse")
@pytest.mark.parametrize(("language", "fault"), SOME)
def test_a_planted_fault_is_named(language, fault, program):
    report = judged(program(language), fault)
    assert report.verdict > Verdict.RIGHT
    assert is_named(report, fault), first_names(report)


@pytest.mark.slow
@pytest.mark.parametrize("language", IN)
def test_every_planted_fault_is_named_but_for_known_ones(language, program):
    for fault in IN[language]:
        report = judged(program(language), fault)
        names = " | ".join(first_names(report)) or "(none)"
        print(f"{language:10} {fault:27} {report.verdict.name:9} {names}")
        known = FAULTS[fault]
        assert report.verdict > Verdict.RIGHT or known.get("missed")
        assert is_named(report, fault) or not {"name", "hint"} & known.keys()


@pytest.mark.slow
@pytest.mark.parametrize("language", ["cpp", "javascript", "single"])
def test_right_program_is_not_accused(language, program):
    contestant = open_contestant(program(language))
    try:
        report = verify(contestant)
    finally:
        contestant.close()
    verdicts = {one.task: one.verdict for one in report.tasks}
    assert set(verdicts.values()) == {Verdict.RIGHT}
    assert not [one for task in report.tasks for one in task.diagnosis.explanations]
