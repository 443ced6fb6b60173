"""Render the page of the report."""

import base64
import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from markupsafe import Markup

from plumbob.text import html

from ..figures import svg
from ..figures.robot_map import RobotMap
from ..figures.sketch import Drawing
from ..measure.record import Record
from ..peers.packages import peers_command
from ..player import motion
from ..tables.columns import words_in
from ..tables.layout import Figure, Layout
from ..tables.table import Table
from .claim_strip import DECADES, ClaimDot, claim_dots
from .headlines import Overview
from .page_tables import PageTable, page_table, rich
from .sections import SECTIONS, Section
from .standings import Headline

_FOLDER = Path(__file__).parent
SCRIPT = motion.squeezed((_FOLDER / "page.js").read_text(encoding="utf-8"))
# Unfolded columns of a chapter's main table, and its rows until a reader asks for more.
MAX_COLUMNS, MAX_ROWS = 7, 6
# Sentences on the first screen, and in a chapter before a fold.
MAX_SENTENCES = {"kinematics": 4, "cloth": 1, "speed": 1, "yours": 3, "wins": 2, "absent": 5}
MAX_SENTENCES |= {"chapter": 4}


class Contents(NamedTuple):
    """The contents of the report, made from its records; scenes by chapter."""

    tables: Mapping[Layout, Table]
    drawings: Mapping[Figure, Drawing]
    answers: Overview
    scenes: Mapping[str, motion.Scene]
    maps: Sequence[RobotMap]


class Chapter(NamedTuple):
    """A chapter on the page."""

    section: Section  # name, title and introduction
    headlines: list[Headline]  # its answers
    figures: list[Drawing]  # unfolded
    dots: list[ClaimDot]  # claims against their tolerances
    main: PageTable | None  # the unfolded table; None if it has none
    folds: list[PageTable]  # the other tables

    @property
    def tables(self) -> list[PageTable]:
        """All tables, the unfolded table first."""
        return [*filter(None, [self.main]), *self.folds]


def render(contents: Contents, newest: Record, missing: Sequence[str]) -> str:
    """Return the page, with machine and versions of the newest record."""
    scripts = [SCRIPT, *([motion.SCRIPT] if contents.scenes else [])]
    environment = html.environment(_FOLDER)
    environment.filters |= {"rich": rich, "coded": coded, "inline": svg.inline}
    environment.filters |= {"percent": partial(words_in, unit="%"), "player": motion.fragment}
    return environment.get_template("page.html").render(
        style=Markup(html.BASE_STYLE + (_FOLDER / "page.css").read_text(encoding="utf-8")),
        motion_style=Markup(motion.STYLE if contents.scenes else ""),
        scripts=list(map(Markup, scripts)),
        policy=policy(scripts),
        date=newest.when.replace("T", " ").replace("+00:00", " UTC"),
        day=newest.when[:10],
        machine=_machine(newest),
        versions=newest.stamp.get("versions", {}),
        answers=contents.answers,
        peers_command=peers_command(),
        maps=contents.maps,
        scenes=contents.scenes,
        chapters=[c for section in SECTIONS if (c := _chapter(section, contents)).tables],
        missing=missing,
        max=MAX_SENTENCES,
        max_rows=MAX_ROWS,
        decades=DECADES,
        suffixes=("csv", "tex", "md"),
    )


def policy(scripts: Iterable[str]) -> str:
    """Return a policy that allows these scripts only, and no connection."""
    digests = (base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts)
    allowed = " ".join(f"'sha256-{digest}'" for digest in digests)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def coded(text: str) -> Markup:
    """Return escaped text with the parts between backticks set as code."""
    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", str(Markup.escape(text))))


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


def _chapter(section: Section, contents: Contents) -> Chapter:
    layouts = [layout for layout in section.layouts if contents.tables[layout].rows]
    drawings = {layout: [contents.drawings[f] for f in layout.figures if f in contents.drawings]
                for layout in layouts}  # fmt: skip
    tables = {layout.name: _page_table(layout, section, contents, drawings) for layout in layouts}
    return Chapter(
        section,
        [headline for headline in contents.answers.headlines if headline.chapter == section.name],
        [d for layout in layouts for d in drawings[layout] if d.name in section.figures],
        claim_dots(tables["check"]) if "check" in tables else [],
        tables.pop(section.main, None),
        list(tables.values()),
    )


def _page_table(
    layout: Layout, section: Section, contents: Contents, drawings: Mapping[Layout, list[Drawing]]
) -> PageTable:
    figures = [drawing for drawing in drawings[layout] if drawing.name not in section.figures]
    columns = MAX_COLUMNS if layout.name == section.main else None
    return page_table(layout.question, contents.tables[layout], figures, columns)
