"""The table of the solvers that users entered, for each suite that asks them."""

from collections.abc import Iterable, Sequence
from functools import partial
from typing import NamedTuple

from ..harness.record import Record
from ..harness.results import Results, listed
from ..tables.columns import text
from ..tables.layout import Layout
from ..tables.table import Column, Summary

NOT_ASKED = "not asked"


class Entered(NamedTuple):
    """A solver that was entered, with what is on record of it in a suite."""

    name: str
    records: list[Record]

    @property
    def commit(self) -> str:
        """The commit of its own sources, with a plus where they were changed."""
        known = str(self.records[-1].conditions.get("solver_commit", ""))
        commit, _, changes = known.partition(" ")
        return commit[:7] + ("+" if changes else "") or "–"

    @property
    def remarks(self) -> list[str]:
        """Why it was not asked for all, and what it raised."""
        remarks = [_why_not_asked(record) or record.trouble for record in self.records]
        return list(dict.fromkeys(filter(None, remarks)))

    def fact(self, name: str) -> str:
        """Return what its last record says of it."""
        return str(self.records[-1].facts.get(name, "")) or "–"


def _why_not_asked(record: Record) -> str:
    """Return why a solver was not asked, "" if it was."""
    why = "" if record.arrays else str(record.notes.get("remark", ""))
    return why if why.startswith(NOT_ASKED) else ""


def remarks_of_entrants(results: Results, suites: Iterable[str]) -> list[str]:
    """Return sentences on solvers that were entered into suites and not asked for all."""
    known = [record for suite in suites for record in results.all(suite, entrant=True)]
    said = [f"{r.solver} was {why}." for r in known if (why := _why_not_asked(r))]
    return list(dict.fromkeys(said))


def _entered(suite: str, results: Results) -> list[Entered]:
    by: dict[str, list[Record]] = {}
    for record in results.all(suite, entrant=True):
        by.setdefault(record.solver, []).append(record)
    return [Entered(name, records) for name, records in by.items()]


def _summary(entered: Sequence[Entered]) -> Summary:
    names = [f"{one.name} ({one.records[-1].settings.get('version') or '–'})" for one in entered]
    return Summary(f"{listed(names)}.")


def entered(suite: str, task: str) -> Layout:
    """Return the table of the solvers that users entered into a suite."""
    return Layout(
        f"Which solvers of yours take part in {task}?",
        f"entered_{suite}",
        f"Solvers that were entered, {task}",
        subjects=partial(_entered, suite),
        columns=(
            text("solver", lambda one: one.name),
            text("version", lambda one: one.records[-1].settings.get("version") or "–"),
            text("commit", lambda one: one.commit),
            text("sources", lambda one: one.fact("digest")),
            text("door", lambda one: one.fact("door")),
            Column("records", read=lambda one: len(one.records)),
            text("remark", lambda one: "; ".join(one.remarks)),
        ),
        shows="A commit with a plus has changes beside it; sources are a digest of its files, "
        "and a change of them is measured anew.",
        measured="Opened by the doors of plumbob verify. A Python file is timed call by call in "
        "its own process, a program by the seconds of its answers, else by the round trip of a "
        "request: its remark says so.",
        summary=_summary,
        optional=True,
    )
