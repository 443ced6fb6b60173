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
    element = ElementTree.Element(
        "testcase", name=one.case.name, classname=suite, time=f"{_seconds(one):.6f}"
    )
    told = [say(words) for words in complaints(one)]
    if one.verdict in _ELEMENTS:
        found = ElementTree.SubElement(
            element, _ELEMENTS[one.verdict], message=told[0] if told else ""
        )
        if one.verdict is not Verdict.UNDECIDED:
            found.set("type", one.verdict.name)
        found.text = "\n".join(told)
    elif told:
        ElementTree.SubElement(element, "system-out").text = "\n".join(told)
    return element
