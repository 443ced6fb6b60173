"""The table of the solvers that users entered."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from ..harness.record import Record
from .columns import text
from .layout import Layout
from .results import Results, listed
from .table import Column, Summary

NOT_ASKED = "not asked"
# What is on record of a solver in a suite.
Entered = Sequence[Record]


def _why_not_asked(record: Record) -> str:
    why = "" if record.arrays else str(record.notes.get("remark", ""))
    return why if why.startswith(NOT_ASKED) else ""


def remarks_of_entrants(results: Results, suites: Iterable[str]) -> list[str]:
    """Return sentences on solvers that were entered into suites and not asked for all."""
    records = [record for suite in suites for record in results.all(suite, entrant=True)]
    remarks = (f"{r.solver} was {why}." for r in records if (why := _why_not_asked(r)))
    return list(dict.fromkeys(remarks))


def _entered(results: Results) -> list[Entered]:
    solvers: dict[tuple[str, str], list[Record]] = {}
    for record in [*results.all("ik", entrant=True), *results.all("cloth", entrant=True)]:
        solvers.setdefault((record.suite, record.solver), []).append(record)
    return list(solvers.values())


def _version(records: Entered) -> str:
    return str(records[-1].settings.get("version") or "–")


def _commit(records: Entered) -> str:
    """Return the commit of the solver's own sources, with a plus where they were changed."""
    of_solver = {"commit": records[-1].conditions.get("solver_commit", "")}
    return replace(records[-1], conditions=of_solver).commit or "–"


def _remark(records: Entered) -> str:
    """Return why a solver was not asked for all, and what it raised."""
    remarks = (_why_not_asked(record) or record.trouble for record in records)
    return "; ".join(dict.fromkeys(filter(None, remarks)))


def _summary(entered: Sequence[Entered]) -> Summary:
    names = [f"{records[-1].solver} ({_version(records)})" for records in entered]
    return Summary(f"{listed(names)}.")


entered = Layout(
    "Which solvers of yours take part?",
    "entered",
    "Solvers that were entered",
    subjects=_entered,
    columns=(
        text("solver", lambda records: records[-1].solver),
        text("suite", lambda records: records[-1].suite),
        text("version", _version),
        text("commit", _commit),
        text("sources", lambda records: str(records[-1].facts.get("digest") or "–")),
        text("door", lambda records: str(records[-1].facts.get("door") or "–")),
        Column("records", read=len),
        text("remark", _remark),
    ),
    shows="A commit with a plus has changes beside it; sources are a digest of its files, "
    "and a change of them is measured anew.",
    measured="Opened by the doors of plumbob verify. A Python file is timed call by call in "
    "its own process, a program by the seconds of its answers, else by the round trip of a "
    "request: its remark says so.",
    summary=_summary,
    optional=True,
)
