"""The result of `verify` as a self-contained page, with the failing cases drawn."""

from pathlib import Path
from typing import Any

from jinja2 import Template
from markupsafe import Markup

from plumbob.text import html
from plumbob.text.sentence import Sentence, sentence

from ..judgement import Report, TaskReport
from ..observe.spring_law import law_in
from ..task import TASKS
from . import comparison, drawing, words
from .words import Presentation

_FOLDER = Path(__file__).parent
_ROWS = 8
WORDS = {
    "heading": sentence("Verdict on your solver"),
    "task": sentence("task"),
    "verdict": sentence("verdict"),
    "digits": sentence("digits"),
    "passed": sentence("cases passed"),
    "speed": sentence("vs. reference"),
    "smallest": sentence("Smallest failing case"),
    "theirs": sentence("yours"),
    "ours": sentence("expected"),
    "numbers": sentence("Numbers side by side"),
    "law": sentence("Your springs (points) beside right ones (line), by the stretch l/r"),
    "again": sentence("The case is saved. To run it again:"),
    "cases": sentence("All cases"),
    "case": sentence("case"),
    "found": sentence("findings"),
}


def _template(context: Presentation) -> Template:
    """Return the template of the page, which escapes all texts of the solver."""
    templates = html.environment(_FOLDER)
    templates.globals |= {"words": WORDS, "verdicts": words.VERDICTS}
    filters = {"say": context.say, "numbers": comparison.texts, "digits": words.digits}
    templates.filters |= filters
    return templates.get_template("page.html")


def render(report: Report, context: Presentation) -> str:
    """Return the page."""
    return _template(context).render(
        style=Markup(html.BASE_STYLE + (_FOLDER / "page.css").read_text(encoding="utf-8")),
        language={"zh": "zh-CN"}.get(context.language, context.language),
        introduction=words.introduction(report),
        advice=words.advice(report.tasks),
        remarks=list(words.remarks(report)),
        tasks=[_task(task, context) for task in report.tasks],
    )


def _task(task: TaskReport, context: Presentation) -> dict[str, Any]:
    """Return the fields of a task's section."""
    failure, picture, caption = task.smallest_failure, None, None
    law = law_in(task.diagnosis.observations)
    if failure and (shapes := comparison.drawing_of(failure)):
        larger, factor = drawing.magnified(shapes)
        picture = drawing.svg(larger, words.title(task))
        gap = drawing.distance(shapes)
        if gap is not None and task.task != "mass_spring_forces":  # arrows have no lengths
            caption = sentence(
                "They differ by at most {distance:.2g} m."
                if factor == 1.0
                else "They differ by at most {distance:.2g} m; the difference is drawn "
                "{factor:,.0f} times larger.",
                distance=gap,
                factor=factor,
            )
    return {
        "report": task,
        "title": words.title(task),
        "about": Sentence(TASKS[task.task].about, {}),
        "passed": words.passed(task),
        "speed": words.speed(task, context.say),
        "explanations": list(words.explanations(task)) if failure else words.reservations(task),
        "failure": failure,
        "law": drawing.law_svg(law, context.say(WORDS["law"])) if law else None,
        "drawing": picture,
        "apart": caption,
        "rows": comparison.rows(failure, _ROWS) if failure else [],
        "command": context.command(task),
    }
