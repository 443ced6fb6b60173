"""Test the judge: laws catch every known fault, the search names each, right programs are right.

A fault is caught if a law calls an answer wrong, or if the solver is judged by restricted requests.
A fault named beside a reservation is caught as well; a mere reservation does not count.
"""

from collections.abc import Iterator
from contextlib import suppress
from typing import NamedTuple

from plumbob.text.sentence import codes_in

from .exchange import Connection
from .fault_programs import PROGRAMS, CodedFault, coded_faults, connection_to, source_of
from .judgement import Report, TaskReport, Verdict
from .kinematics.honest import HONEST as HONEST_SWEEPS
from .one_line.right_programs import is_of
from .task import TASKS
from .verify import verify

HONEST = "honest solvers"
# Mistakes with the answers of another mistake, which is named in their place.
EQUAL = {"PB-TRACK-021": "PB-TRACK-006", "PB-CCD-030": "PB-TRACK-020"}
# The families whose codes stand for many changes of a line, and for state of the process.
WITHOUT_PROGRAMS = ("LINE", "STATE")


class Subject(NamedTuple):
    """A solver with a known fault, or an honest solver."""

    name: str
    family: str  # of its fault: "CCD", "STEP"; HONEST
    task: str
    connection: Connection
    code: str = ""  # of its fault; "" of an honest solver


class Trial(NamedTuple):
    """The judgement of a subject."""

    subject: Subject
    verdict: Verdict
    laws: frozenset[str]  # that were broken
    is_named: bool  # whether the fault is named; of an honest solver, whether no fault is
    first_verdict: Verdict | None = None  # before any cause was sought

    @property
    def caught(self) -> bool:
        """Whether a law is broken, or the fault is named although no law is."""
        return bool(self.laws) or (self.is_named and self.verdict > Verdict.RIGHT)

    @property
    def passed(self) -> bool:
        """Whether the fault is caught and named, or the honest solver is not accused."""
        if self.subject.code:
            return self.caught and self.is_named
        return self.verdict <= Verdict.RIGHT_EXCEPT and self.is_named


def attempt(subject: Subject) -> Trial:
    """Judge a subject as `verify` judges any solver."""
    published: list[Report] = []
    report = verify(subject.connection, [subject.task], publish=published.append).tasks[0]
    laws = frozenset(
        finding.law
        for judgement in report.judgements
        for finding in judgement.findings
        if finding.verdict >= Verdict.WRONG
    )
    if report.assumptions and (report.needs_declaration or report.verdict is Verdict.RIGHT_EXCEPT):
        laws |= {"takes what is sent"}
    is_named = not report.diagnosis.explanations
    if subject.code:
        is_named = EQUAL.get(subject.code, subject.code) in _codes(report)
    return Trial(subject, report.verdict, laws, is_named, published[-1].verdict)


def _codes(report: TaskReport) -> set[str]:
    """Return the codes of the first explanation and hints; of reservations about right answers."""
    sentences = [explanation.sentence for explanation in report.diagnosis.explanations[:1]]
    sentences += report.diagnosis.hints
    if report.verdict is Verdict.RIGHT_EXCEPT:  # the mistake may be on purpose
        sentences += [words for judgement in report.judgements for words in judgement.complaints]
    return {code for words in sentences for code in codes_in(words)}


def subjects() -> Iterator[Subject]:
    """Yield a program with each known fault, then the right programs."""
    honest = {
        code
        for choices in HONEST_SWEEPS.values()
        for choice in choices
        for code in codes_in(choice.sentence)
    }
    for fault in coded_faults().values():
        if fault.code not in honest and fault.family not in WITHOUT_PROGRAMS:
            connection = connection_to(_in_another_form(fault))
            yield Subject(fault.name, fault.family, fault.task, connection, fault.code)
    for name, entry in PROGRAMS.items():
        if entry["task"] in TASKS:  # programs of equations alone answer no request
            yield Subject(name, HONEST, entry["task"], connection_to(source_of(name)))


def _in_another_form(fault: CodedFault) -> str:
    """Return a program with a fault, not the fault's own program if another has its lines."""
    method = {"CCD": "ccd", "FABRIK": "fabrik"}.get(fault.family)
    for name in PROGRAMS if method or fault.family == "FK" else ():
        if name != fault.program and is_of(name, fault.task, method or ""):
            with suppress(ValueError):
                return fault.planted_in(source_of(name))
    return fault.wrong_program
