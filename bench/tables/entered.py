"""The table of the solvers that users entered."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from ..harness.record import Record
from ..harness.results import Results, listed
from .columns import text
from .layout import Layout
from .table import Column, Summary

NOT_ASKED = "not asked"


class Entered(NamedTuple):
    """A solver that was entered, with what is on record of it in a suite."""

    records: list[Record]

    @property
    def last(self) -> Record:
        """Its last record."""
        return self.records[-1]

    @property
    def version(self) -> str:
        """What it says of its version."""
        return str(self.last.settings.get("version") or "–")

    @property
    def commit(self) -> str:
        """The commit of its own sources, with a plus where they were changed."""
        commit, _, changes = str(self.last.conditions.get("solver_commit", "")).partition(" ")
        return commit[:7] + ("+" if changes else "") or "–"

    @property
    def remarks(self) -> list[str]:
        """Why it was not asked for all, and what it raised."""
        remarks = [_why_not_asked(record) or record.trouble for record in self.records]
        return list(dict.fromkeys(filter(None, remarks)))

    def fact(self, name: str) -> str:
        """Return what its last record says of it."""
        return str(self.last.facts.get(name) or "–")


def _why_not_asked(record: Record) -> str:
    """Return why a solver was not asked, "" if it was."""
    why = "" if record.arrays else str(record.notes.get("remark", ""))
    return why if why.startswith(NOT_ASKED) else ""


def remarks_of_entrants(results: Results, suites: Iterable[str]) -> list[str]:
    """Return sentences on solvers that were entered into suites and not asked for all."""
    known = [record for suite in suites for record in results.all(suite, entrant=True)]
    remarks = [f"{r.solver} was {why}." for r in known if (why := _why_not_asked(r))]
    return list(dict.fromkeys(remarks))


def _entered(results: Results) -> list[Entered]:
    solvers: dict[tuple[str, str], list[Record]] = {}
    for suite in ("ik", "cloth"):
        for record in results.all(suite, entrant=True):
            solvers.setdefault((suite, record.solver), []).append(record)
    return [Entered(records) for records in solvers.values()]


def _summary(entered: Sequence[Entered]) -> Summary:
    return Summary(f"{listed([f'{one.last.solver} ({one.version})' for one in entered])}.")


entered = Layout(
    "Which solvers of yours take part?",
    "entered",
    "Solvers that were entered",
    subjects=_entered,
    columns=(
        text("solver", lambda entered: entered.last.solver),
        text("suite", lambda entered: entered.last.suite),
        text("version", lambda entered: entered.version),
        text("commit", lambda entered: entered.commit),
        text("sources", lambda entered: entered.fact("digest")),
        text("door", lambda entered: entered.fact("door")),
        Column("records", read=lambda entered: len(entered.records)),
        text("remark", lambda entered: "; ".join(entered.remarks)),
    ),
    shows="A commit with a plus has changes beside it; sources are a digest of its files, "
    "and a change of them is measured anew.",
    measured="Opened by the doors of plumbob verify. A Python file is timed call by call in "
    "its own process, a program by the seconds of its answers, else by the round trip of a "
    "request: its remark says so.",
    summary=_summary,
    optional=True,
)
