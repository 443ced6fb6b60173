"""Search the right program whose known fault or changed line gives wrong answers."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..dictionary.look_up import UNSTEADY, Proposals, look_up
from ..dictionary.requests import TASKS
from ..exchange import Answer, Connection, Exchange
from ..explain import MORE
from ..fault_programs import IN_DICTIONARY, source_of
from ..gaps import difference
from ..greeting import Greeting
from ..judgement import CaseJudgement, Explanation, TaskReport, Verdict
from ..kinematics.claims import OF_POSES
from ..kinematics.early_ends import EARLY_ENDS
from ..kinematics.limits import READINGS
from ..take.precision import judging_greeting
from . import tool_steps
from .answers import compared_answers, doubtful_answers, positions_alone, with_sweeps, without_near
from .candidates import MIN_SHARE, OF_STEPS, TOLERANCE, of_entries, of_numbers, of_program, run_of
from .fitted import is_fitted
from .mutants import Program
from .right_programs import answer_of, programs_of

# No further right program is changed after so many changes, of half a millisecond each; beside a
# dictionary, only a search finds the few remaining changes.
MAX_MUTANTS, MAX_BESIDE = 24_000, 4_000
IN_CONVENTIONS = ("robot_jacobian", "forward_kinematics", *OF_STEPS)
# The tasks whose answers tell numbers, without iterations.
WITH_NUMBERS = ("mass_spring_forces", "energy", *OF_STEPS)
# Where a right answer to all requests of the dictionary leaves known faults of rare cases alone.
RARE_ELSEWHERE = ("mass_spring_forces", "energy")
# So many of the nearest right steps are tried with known faults, and with changed lines.
NEAREST_KNOWN, NEAREST = 8, 2


def with_changed_line(
    report: TaskReport,
    greeting: Greeting,
    connection: Connection | None = None,
    known_alone: bool = False,
) -> TaskReport:
    """Return a report on wrong answers with the explaining fault or changed line.

    Beside a mistake behind most answers, or where all targets are reached, known faults have to
    explain all answers. If `known_alone`, the search is for known faults of the dictionary. A
    `connection` can be asked for what a dictionary tells apart.
    """
    named, share = report.diagnosis.explanations, _least_share(report)
    if report.verdict > Verdict.RIGHT_EXCEPT:
        if share > 1.0 and named[0].share == 1.0:
            return report
        doubtful = list[CaseJudgement]()
        is_known = known_alone or (bool(named) and named[0].share == 1.0)
    else:
        doubtful, is_known = doubtful_answers(report)
        if named or not doubtful:
            return report
        share = 1.0
    proposals = None
    if connection is not None and report.verdict >= Verdict.WRONG:
        proposals = look_up(connection, report.task, report.method, greeting)
        if proposals is not None and proposals.hint is not None:
            hints = (*report.diagnosis.hints, proposals.hint)
            report = replace(report, diagnosis=replace(report.diagnosis, hints=hints))
            if proposals.hint == UNSTEADY:
                return report
            proposals = None  # without a dictionary all lines are searched
    if known_alone and proposals is None:
        return report
    explanations = _of_steps(report, greeting, is_known) or changed_lines(
        report, greeting, doubtful, is_known, proposals
    )
    if not explanations or explanations[0].share < min(share, 1.0):
        return report
    hints = () if explanations[0].share == 1.0 else report.diagnosis.hints
    diagnosis = replace(report.diagnosis, explanations=explanations, first_broken=None, hints=hints)
    return replace(report, diagnosis=diagnosis)


def _of_steps(report: TaskReport, greeting: Greeting, is_known: bool) -> tuple[Explanation, ...]:
    """Return the change of a line with the steps of robots, a known fault before other changes.

    Other lines are changed in the first view alone: single steps show more than where solves end.
    """
    views = list(tool_steps.views(report))
    for view in (report, *views) if views else ():
        if explanations := changed_lines(view, greeting, is_known=True):
            return explanations
    return () if is_known or not views else changed_lines(views[0], greeting)


def _least_share(report: TaskReport) -> float:
    """Return the share of answers for a program to explain: many more than by the named mistake.

    A program has to explain all beside named positions or readings of limits, since a program tells
    of rotations as well. Beside a measured test at the ends of solves, all answers count too.
    """
    named = report.diagnosis.explanations
    faults = {fault for explanation in named for fault in explanation.faults}
    if named and (
        READINGS.keys() | EARLY_ENDS >= faults or (faults <= OF_POSES and named[0].share < 1.0)
    ):
        return 1.0
    return max((explanation.share for explanation in named), default=0.0) + MORE


@np.errstate(all="ignore")  # changed programs divide by zero
def changed_lines(
    report: TaskReport,
    greeting: Greeting,
    doubtful: Sequence[CaseJudgement] = (),
    is_known: bool = False,
    proposals: Proposals | None = None,
) -> tuple[Explanation, ...]:
    """Return the change of a line with most wrong or doubtful answers, () if too few.

    If `is_known`, the search is for known faults alone. Where a dictionary proposes changes, these
    are tried; the lines of its first program, if answers to all its requests are right.
    """
    compared, tolerance = _compared(report, greeting, doubtful)
    if not compared:
        return ()
    programs = list(programs_of(report.task, report.method, greeting.step))
    if report.task == "inverse_kinematics":
        programs = [program for program in programs if _tells(program, compared)]
    best = tuple[Explanation, ...]()
    if proposals is not None:
        is_known |= not proposals.is_wrong and report.task in RARE_ELSEWHERE
        if proposals.sweeps is not None:
            compared = with_sweeps(compared, proposals.sweeps)
        if proposals.of_positions:
            compared = list(map(positions_alone, compared))
        entries = [entry for entry in proposals.entries if entry.codes or not is_known]
        best = of_entries(entries, report, compared, tolerance)
        looked_up = {source_of(name) for names in IN_DICTIONARY.values() for name in names}
        others = [program for program in programs if program.source not in looked_up]
        best = best or _of_programs(others, report, compared, tolerance, is_known=True)
        # With right answers to all requests of the dictionary, answers are wrong in special cases.
        first = {source_of(names[0]) for names in IN_DICTIONARY.values()}
        programs = [p for p in programs if p.source in first and not proposals.is_wrong]
    is_choice = bool(doubtful) or report.task == tool_steps.TASK
    if is_choice and any(_gives(program, report, compared, tolerance) for program in programs):
        return ()
    if not best:
        best = _of_programs(programs, report, compared, tolerance, is_known)
    if report.task in WITH_NUMBERS and not best and not (doubtful or is_known):
        names = IN_DICTIONARY.get(report.task, ())
        programs = programs or [Program(source_of(name)) for name in names]
        for program in programs[: 1 if report.task in OF_STEPS else None]:
            best = best or of_numbers(program, report, compared, tolerance)
    return best if best and best[0].share >= MIN_SHARE else ()


def _tells(program: Program, compared: Sequence[Exchange]) -> bool:
    """Return whether poses tell a program: of limits or not; its constants show in rotations."""
    has_limits = any("cones" in exchange.case.inputs for exchange in compared)
    answers = [exchange.answer for exchange in compared]
    is_shown = any(isinstance(a, Answer) and "local_rotations" in a.values for a in answers)
    return has_limits is ("within" in program.names) and (is_shown or not is_fitted(program))


def _compared(
    report: TaskReport, greeting: Greeting, doubtful: Sequence[CaseJudgement]
) -> tuple[list[Exchange], float]:
    """Return the answers for programs to give, and the relative difference of equal answers."""
    compared = compared_answers(report, doubtful)
    tolerance = TOLERANCE[judging_greeting(compared, greeting)[0].precision]
    tolerance = tool_steps.SAME_STEP if report.task == tool_steps.TASK else tolerance
    compared = without_near(compared, report, tolerance)
    is_motion = report.task == tool_steps.MOTIONS
    return compared[: tool_steps.MAX_MOTIONS if is_motion else None], tolerance


def _of_programs(
    programs: Sequence[Program],
    report: TaskReport,
    compared: Sequence[Exchange],
    tolerance: float,
    is_known: bool,
) -> tuple[Explanation, ...]:
    """Return the fault or changed line of some programs with most answers.

    The nearest of many right steps are tried, all known faults first.
    """
    best, functions = tuple[Explanation, ...](), set[str]()
    if report.task in tool_steps.SOLVES:
        functions |= {p.text_of(f) for p in programs for f in tool_steps.FUNCTIONS & p.names.keys()}
    most = MAX_BESIDE if report.task in {task for task, _ in TASKS} else MAX_MUTANTS
    most = tool_steps.MAX_MUTANTS.get(report.task, most)
    for program, known_alone in _trials(programs, report, compared, is_known):
        if not known_alone and is_fitted(program) and best and best[0].share >= MIN_SHARE:
            break
        if report.task in IN_CONVENTIONS:
            functions.clear()
        changed = None if known_alone else functions
        explanations = of_program(program, report, compared, tolerance, changed)
        best = max(best, explanations[:1], key=lambda e: e[0].share if e else 0.0)
        mutant_count = sum(other.mutant_count for other in programs)
        if (best and best[0].share == 1.0) or mutant_count > most:
            break
    return best


def _trials(
    programs: Sequence[Program],
    report: TaskReport,
    compared: Sequence[Exchange],
    is_known: bool,
) -> list[tuple[Program, bool]]:
    """Return programs in the order of their trials, and whether known faults alone are tried.

    Motions take too long for changes of all lines.
    """
    is_known |= report.task == tool_steps.MOTIONS
    if report.task in OF_STEPS:
        nearest = _nearest(programs, report, compared)
        first = [(program, True) for program in nearest[:NEAREST_KNOWN]]
        return first + [(program, is_known) for program in nearest[:NEAREST]]
    # The lines of programs with fitted constants take seconds each.
    first = [(program, True) for program in programs if is_fitted(program) and not is_known]
    return first + [(program, is_known) for program in programs]


def _nearest(
    programs: Sequence[Program], report: TaskReport, compared: Sequence[Exchange]
) -> list[Program]:
    """Return programs in the order of equal answers, then of distance."""

    def score(program: Program) -> tuple[int, float]:
        gaps = []
        for exchange in compared:
            assert isinstance(exchange.answer, Answer)
            try:
                values = answer_of(program, report.method, exchange.case)
                gaps.append(difference(values, exchange.answer.values))
            except ArithmeticError:
                gaps.append(np.inf)
        return -sum(gap <= TOLERANCE["single"] for gap in gaps), float(np.median(gaps))

    return sorted(programs, key=score)


def _gives(
    program: Program, report: TaskReport, compared: Sequence[Exchange], tolerance: float
) -> bool:
    """Return whether a right program gives all answers."""
    run = run_of(program, report, compared)
    pairs = ((run(one.case), one.answer) for one in compared)
    return all(
        isinstance(answer, Answer) and difference(right, answer.values) <= tolerance
        for right, answer in pairs
    )
