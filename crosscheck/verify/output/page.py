"""The result of `verify` as one page that needs nothing else, with the failing cases drawn."""

from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from ..judgement import Report, TaskReport
from ..sentence import Sentence, sentence
from ..task import TASKS
from . import BASE_STYLE, comparison, drawing, words
from .geometry import scene
from .words import Presentation, Say

_HERE = Path(__file__).parent
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


def render(report: Report, context: Presentation) -> str:
    """Return the page; nothing that a solver says stands in it unescaped."""
    return _environment(context.say).get_template("page.html").render(
        style=Markup(BASE_STYLE + (_HERE / "page.css").read_text(encoding="utf-8")),
        language={"zh": "zh-CN"}.get(context.language, context.language),
        words=WORDS,
        verdicts=words.VERDICTS,
        introduction=words.introduction(report),
        advice=words.advice(report.tasks),
        remarks=list(words.remarks(report)),
        tasks=[_task(task, context) for task in report.tasks],
    )  # fmt: skip


def _environment(say: Say) -> Environment:
    environment = Environment(
        loader=FileSystemLoader(_HERE), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= {"say": say, "numbers": comparison.written, "digits": words.digits,
                            "complaints": words.complaints}  # fmt: skip
    return environment


def _task(task: TaskReport, context: Presentation) -> dict[str, Any]:
    """Return a task's report and all that the page says of it."""
    failure = task.smallest_failure
    drawn = scene(failure) if failure else None
    larger, factor = drawing.magnified(drawn) if drawn else (None, 1.0)
    in_metres = task.task != "mass_spring_forces"
    return {
        "report": task,
        "title": words.title(task),
        "about": Sentence(TASKS[task.task].about, {}),
        "passed": words.passed(task),
        "speed": words.speed(task, context.say),
        "explanations": list(words.explanations(task)),
        "failure": failure,
        "drawing": drawing.svg(larger, words.title(task)) if larger else None,
        "apart": _apart(drawing.apart(drawn), factor) if drawn and in_metres else None,
        "rows": comparison.rows(failure, _ROWS) if failure else [],
        "command": context.command(task),
    }


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
