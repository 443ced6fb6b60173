"""The result of `verify` as JUnit XML: a test suite a task, a test case a case."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

from ..contestant import Answer
from ..judgement import CaseJudgement, Report, TaskReport, Verdict
from .words import Say, complaints, explanations, title

# What a verdict other than RIGHT is in JUnit's words.
_ELEMENTS = {
    Verdict.UNDECIDED: "skipped",
    Verdict.WRONG: "failure",
    Verdict.BROKEN: "error",
}


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
    for one in task.judgements:
        suite.append(_case(one, title(task), say))
    if told := "\n".join(map(say, filter(None, (task.precision, *explanations(task))))):
        ElementTree.SubElement(suite, "system-out").text = told
    return suite


def _count(element: ElementTree.Element, cases: Sequence[CaseJudgement]) -> None:
    verdicts = [one.verdict for one in cases]
    element.set("tests", str(len(cases)))
    for name, verdict in (
        ("failures", Verdict.WRONG), ("errors", Verdict.BROKEN), ("skipped", Verdict.UNDECIDED),
    ):  # fmt: skip
        element.set(name, str(verdicts.count(verdict)))
    element.set("time", f"{sum(map(_seconds, cases)):.6f}")


def _seconds(one: CaseJudgement) -> float:
    return one.answer.seconds if isinstance(one.answer, Answer) else 0.0


def _case(one: CaseJudgement, suite: str, say: Say) -> ElementTree.Element:
    names = {"name": one.case.name, "classname": suite, "time": f"{_seconds(one):.6f}"}
    element = ElementTree.Element("testcase", names)
    told = list(map(say, complaints(one)))
    if tag := _ELEMENTS.get(one.verdict, "system-out" if told else None):
        found = ElementTree.SubElement(element, tag)
        if one.verdict in _ELEMENTS:
            found.set("message", told[0] if told else "")
        if one.verdict >= Verdict.WRONG:
            found.set("type", one.verdict.name)
        found.text = "\n".join(told)
    return element
