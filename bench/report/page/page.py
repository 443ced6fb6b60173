"""The page of the report, from a template that escapes whatever is put into it."""

import base64
import hashlib
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from plumbob.crosscheck.verify.output import BASE_STYLE

from ...figures import svg
from ...figures.sketch import Drawing
from ...harness.record import Record
from ...motion import motion
from ...tables.columns import words_in
from ...tables.layout import Figure, Layout
from ...tables.table import Table
from ..headlines import Answers
from ..sections import SECTIONS, Section, offered
from ..standings import Headline
from .shown_tables import ShownTable, rich, shown_table

_HERE = Path(__file__).parent
# Without indents and comments, which a page need not carry.
SCRIPT = motion.squeezed((_HERE / "page.js").read_text(encoding="utf-8"))
# So many columns of a chapter's main table are unfolded.
MOST_COLUMNS = 7
# Absent peers that the first screen names.
MOST_NAMED = 5


class Shown(NamedTuple):
    """All that a report shows: what is made of its records."""

    tables: Mapping[Layout, Table]
    drawings: Mapping[Figure, Drawing]
    answers: Answers
    scenes: Mapping[str, motion.Scene]


class Unmeasured(NamedTuple):
    """The questions of a chapter that have no answer yet, and the command that finds them."""

    questions: list[str]
    command: str


class Motion(NamedTuple):
    """What can be seen moving in a chapter."""

    title: str
    shows: str
    fragment: Markup


class Chapter(NamedTuple):
    """A chapter: its main figure and table, the others folded, and what was not measured."""

    name: str
    short: str
    title: str
    about: str
    headlines: list[Headline]
    figure: Drawing | None
    main: ShownTable | None
    folds: list[ShownTable]
    motion: Motion | None
    unmeasured: Unmeasured | None


def render(shown: Shown, newest: Record, missing: Sequence[str]) -> str:
    """Return the page, whose head is that of the newest record."""
    template = _environment().get_template("page.html")
    scripts = [SCRIPT, *([motion.SCRIPT] if shown.scenes else [])]
    return template.render(
        style=Markup(BASE_STYLE + (_HERE / "page.css").read_text(encoding="utf-8")),
        motion_style=Markup(motion.STYLE if shown.scenes else ""),
        scripts=list(map(Markup, scripts)),
        policy=policy(scripts),
        date=newest.when.replace("T", " ").replace("+00:00", " UTC"),
        day=newest.when[:10],
        machine=_machine(newest),
        versions=newest.stamp.get("versions", {}),
        answers=shown.answers,
        chapters=[_chapter(section, shown) for section in SECTIONS],
        missing=missing,
        most_named=MOST_NAMED,
        suffixes=("csv", "tex", "md"),
    )


def policy(scripts: Iterable[str]) -> str:
    """Return a policy by which a page connects to nothing and runs no scripts but these."""
    digests = (base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts)
    allowed = " ".join(f"'sha256-{digest}'" for digest in digests)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(_HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"rich": rich, "coded": coded, "inline": svg.inline}
    environment.filters |= {"quoted": _quoted, "bare": _bare}
    environment.filters["percent"] = partial(words_in, unit="%")
    return environment


def _quoted(text: str) -> Markup:
    """Return a text for an attribute in double quotes, where an apostrophe needs no escape."""
    return Markup(str(Markup.escape(text)).replace("&#39;", "'"))


def _bare(classes: str) -> Markup:
    """Return classes as an attribute’s value, in quotes where there are several."""
    return Markup(f'"{classes}"' if " " in classes else classes)


def _machine(record: Record) -> dict[str, str]:
    machine, versions = record.stamp.get("machine", {}), record.stamp.get("versions", {})
    cores, memory = machine.get("cores", "–"), machine.get("memory_gib")
    return {
        "Machine": machine.get("processor", "–"),
        "Cores": f"{cores} core{'' if cores == 1 else 's'}",
        "Memory": f"{memory} GiB" if memory else "–",
        "System": f"{machine.get('system', '–')}, Python {versions.get('python', '–')}",
        "Plumbob": f"{versions.get('plumbob', '–')}, sources {record.stamp.get('source', '–')}",
    }


def _chapter(section: Section, shown: Shown) -> Chapter:
    layouts = [layout for layout in section.layouts if shown.tables[layout].rows]
    main = next((layout for layout in layouts if layout.name == section.main), None)
    drawn = [shown.drawings[f] for layout in layouts for f in layout.figures if f in shown.drawings]
    figure = next((drawing for drawing in drawn if drawing.name == section.figure), None)
    return Chapter(
        section.name,
        section.short,
        section.title,
        section.about,
        [headline for headline in shown.answers.headlines if headline.chapter == section.name],
        figure,
        _shown(main, shown, figure, MOST_COLUMNS) if main else None,
        [_shown(layout, shown, figure) for layout in layouts if layout is not main],
        _motion(shown.scenes.get(section.name)),
        _unmeasured(section, shown),
    )


def _motion(scene: motion.Scene | None) -> Motion | None:
    return scene and Motion(scene.title, scene.shows, motion.fragment(scene))


def _shown(
    layout: Layout, shown: Shown, without: Drawing | None, most: int | None = None
) -> ShownTable:
    """Return a table with its figures but for one that stands elsewhere."""
    drawn = [shown.drawings[figure] for figure in layout.figures if figure in shown.drawings]
    beside = [drawing for drawing in drawn if drawing is not without]
    return shown_table(layout.question, shown.tables[layout], beside, most)


def _unmeasured(section: Section, shown: Shown) -> Unmeasured | None:
    questions: list[str] = []
    suites: dict[str, None] = {}
    for experiment in section.experiments:
        wanted = [layout for layout in offered(experiment) if not layout.optional]
        empty = [layout for layout in wanted if not shown.tables[layout].rows]
        questions += [layout.question for layout in empty]
        suites |= {experiment.suite: None} if empty else {}
    command = shlex.join(["plumbob", "bench", *suites])
    return Unmeasured(questions, command) if questions else None


def coded(text: str) -> Markup:
    """Return escaped text in which what stands between backticks is set as code."""
    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", str(Markup.escape(text))))
