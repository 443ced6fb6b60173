"""The table of the solvers that users entered."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from ..measure.record import Record
from .columns import text
from .layout import Layout
from .results import Results, grouped, listed
from .table import Column, Summary

NOT_ASKED = "not asked"
# The records of a user's solver in a suite.
SolverRecords = Sequence[Record]


def _why_not_asked(record: Record) -> str:
    remark = "" if record.has_numbers else record.remark
    return remark if remark.startswith(NOT_ASKED) else ""


def solver_remarks(results: Results, suites: Iterable[str]) -> list[str]:
    """Return a sentence on each user's solver that a task of the suites leaves out, with reason."""
    records = [record for suite in suites for record in results.all(suite, entrant=True)]
    remarks = (f"{r.solver} was {why}." for r in records if (why := _why_not_asked(r)))
    return list(dict.fromkeys(remarks))


def _user_solvers(results: Results) -> list[SolverRecords]:
    records = [*results.all("ik", entrant=True), *results.all("cloth", entrant=True)]
    return list(grouped(records, lambda record: (record.suite, record.solver)).values())


def _version(records: SolverRecords) -> str:
    return str(records[-1].settings.get("version") or "–")


def _commit(records: SolverRecords) -> str:
    """Return the commit of the solver's own sources, with a plus if changed."""
    conditions = {"commit": records[-1].conditions.get("solver_commit", "")}
    return replace(records[-1], conditions=conditions).commit or "–"


def _remark(records: SolverRecords) -> str:
    """Return why a solver was not asked for every task, and its errors."""
    remarks = (_why_not_asked(record) or record.trouble for record in records)
    return "; ".join(dict.fromkeys(filter(None, remarks)))


def _summary(user_solvers: Sequence[SolverRecords]) -> Summary:
    names = [f"{records[-1].solver} ({_version(records)})" for records in user_solvers]
    return Summary(f"{listed(names)}.")


user_solver_table = Layout(
    "Which solvers of yours take part?",
    "entered",
    "Your solvers",
    subjects=_user_solvers,
    columns=(
        text("solver", lambda records: records[-1].solver),
        text("suite", lambda records: records[-1].suite),
        text("version", _version),
        text("commit", _commit),
        text("sources", lambda records: str(records[-1].measured.get("digest") or "–")),
        text("address", lambda records: str(records[-1].measured.get("door") or "–")),
        Column("records", read=len),
        text("remark", _remark),
    ),
    shows="A plus behind a commit stands for uncommitted changes. “sources” is a digest of the "
    "solver’s files; when they change, the solver is measured again.",
    measured="Opened as by plumbob verify. A Python file is timed call by call in its own "
    "process; a program by the seconds in its answers, or else by the round trip of a request, "
    "as its remark says.",
    summary=_summary,
)
