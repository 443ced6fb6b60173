"""The result of `verify` as JUnit XML: a test suite a task, a test case a case."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

from plumbob.text.sentence import Say

from ..exchange import Answer
from ..judgement import CaseJudgement, Report, TaskReport, Verdict
from .words import explanations, title

# JUnit's element for a bad verdict.
_ELEMENTS = {Verdict.UNDECIDED: "skipped", Verdict.WRONG: "failure", Verdict.BROKEN: "error"}


def text(report: Report, say: Say) -> str:
    """Return the file's text."""
    root = ElementTree.Element("testsuites", name="plumbob verify")
    for task in report.tasks:
        root.append(_suite(task, say))
    _count(root, [case for task in report.tasks for case in task.judgements])
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _suite(task: TaskReport, say: Say) -> ElementTree.Element:
    suite = ElementTree.Element("testsuite", name=title(task))
    _count(suite, task.judgements)
    for judgement in task.judgements:
        suite.append(_case(judgement, title(task), say))
    if lines := list(map(say, (*task.assumptions, *explanations(task)))):
        ElementTree.SubElement(suite, "system-out").text = "\n".join(lines)
    return suite


def _count(element: ElementTree.Element, judgements: Sequence[CaseJudgement]) -> None:
    verdicts = [judgement.verdict for judgement in judgements]
    element.set("tests", str(len(judgements)))
    element.set("failures", str(verdicts.count(Verdict.WRONG)))
    element.set("errors", str(verdicts.count(Verdict.BROKEN)))
    element.set("skipped", str(verdicts.count(Verdict.UNDECIDED)))
    element.set("time", f"{sum(map(_seconds, judgements)):.6f}")


def _seconds(judgement: CaseJudgement) -> float:
    return judgement.answer.seconds if isinstance(judgement.answer, Answer) else 0.0


def _case(judgement: CaseJudgement, suite: str, say: Say) -> ElementTree.Element:
    names = {"name": judgement.case.name, "classname": suite, "time": f"{_seconds(judgement):.6f}"}
    element = ElementTree.Element("testcase", names)
    lines = list(map(say, judgement.complaints))
    if tag := _ELEMENTS.get(judgement.verdict, "system-out" if lines else None):
        outcome = ElementTree.SubElement(element, tag)
        if judgement.verdict in _ELEMENTS:
            outcome.set("message", lines[0] if lines else "")
        if judgement.verdict >= Verdict.WRONG:
            outcome.set("type", judgement.verdict.name)
        outcome.text = "\n".join(lines)
    return element
