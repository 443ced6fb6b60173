"""The result of `verify` as one page that needs nothing else, with the failing cases drawn."""

from pathlib import Path
from typing import NamedTuple

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from ..judgement import CaseJudgement, Report, TaskReport
from ..sentence import Sentence, sentence
from ..task import TASKS
from . import comparison, drawing, saved
from .geometry import scene
from .words import (
    VERDICTS,
    Presentation,
    Say,
    advice,
    complaints,
    explanations,
    introduction,
    passed,
    remarks,
    speed,
    title,
)

_HERE = Path(__file__).parent
_STYLES = (_HERE.parent / "presentation" / "page" / "page.css", _HERE / "page.css")
_ROWS = 8
WORDS = {
    "heading": sentence("Verdict on your solver"),
    "task": sentence("task"),
    "verdict": sentence("verdict"),
    "digits": sentence("digits"),
    "passed": sentence("cases passed"),
    "speed": sentence("beside the reference"),
    "smallest": sentence("Smallest failing case"),
    "theirs": sentence("yours"),
    "ours": sentence("expected"),
    "numbers": sentence("Numbers side by side"),
    "again": sentence("It is saved; ask it again:"),
    "cases": sentence("All cases"),
    "case": sentence("case"),
    "found": sentence("what was found"),
}


class _Task(NamedTuple):
    """A task's report and all that the page says of it."""

    report: TaskReport
    title: str
    about: Sentence
    passed: int
    speed: Sentence | None
    explanations: list[Sentence]
    failure: CaseJudgement | None
    complaints: list[Sentence]
    drawing: Markup | None
    apart: Sentence | None
    rows: list[comparison.Row]
    command: Sentence | None


def render(report: Report, context: Presentation) -> str:
    """Return the page; nothing that a solver says stands in it unescaped."""
    return _environment(context.say).get_template("page.html").render(
        style=Markup("\n".join(path.read_text(encoding="utf-8") for path in _STYLES)),
        language={"zh": "zh-CN"}.get(context.language, context.language),
        words=WORDS,
        verdicts=VERDICTS,
        introduction=introduction(report),
        advice=advice(report.tasks),
        remarks=list(remarks(report)),
        tasks=[_task(task, context) for task in report.tasks],
    )  # fmt: skip


def _environment(say: Say) -> Environment:
    environment = Environment(
        loader=FileSystemLoader(_HERE), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= {"say": say, "numbers": comparison.written, "complaints": complaints}
    return environment


def _task(task: TaskReport, context: Presentation) -> _Task:
    path = context.files.get((task.task, task.method))
    failure = task.smallest_failure
    drawn = scene(failure) if failure else None
    larger, factor = drawing.magnified(drawn) if drawn else (None, 1.0)
    return _Task(
        task, title(task), Sentence(TASKS[task.task].about, {}), passed(task), speed(task),
        list(explanations(task)), failure, complaints(failure) if failure else [],
        drawing.svg(larger, title(task)) if larger else None,
        _apart(drawing.apart(drawn), factor) if drawn and _in_metres(task) else None,
        comparison.rows(failure, _ROWS) if failure else [],
        saved.command(context.solver, path) if path else None,
    )  # fmt: skip


def _in_metres(task: TaskReport) -> bool:
    return task.task != "mass_spring_forces"


def _apart(distance: float | None, factor: float) -> Sentence | None:
    if distance is None:
        return None
    if factor == 1.0:
        return sentence("They are {distance:.2g} m apart at most.", distance=distance)
    return sentence(
        "They are {distance:.2g} m apart at most, drawn {factor:,.0f} times larger.",
        distance=distance,
        factor=factor,
    )
