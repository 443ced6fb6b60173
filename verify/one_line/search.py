"""Search the right program with a known fault, or a changed line, that gives wrong answers."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..dictionary.look_up import UNSTEADY, Proposals, look_up
from ..dictionary.requests import TASKS
from ..exchange import Answer, Connection
from ..explain import MORE
from ..fault_programs import IN_DICTIONARY, source_of
from ..gaps import difference
from ..greeting import Greeting, Step
from ..judgement import CaseJudgement, Explanation, TaskReport, Verdict
from ..kinematics.claims import OF_POSES
from ..kinematics.early_ends import EARLY_ENDS
from ..kinematics.limits import READINGS
from ..take.precision import judging_greeting
from . import tool_steps
from .answers import compared_answers, doubtful_answers, positions_alone, with_sweeps, without_near
from .candidates import (
    MIN_SHARE,
    OF_STEPS,
    TOLERANCE,
    Evidence,
    of_entries,
    of_numbers,
    of_program,
    parts_of,
    run_of,
)
from .fitted import is_fitted
from .mutants import Program
from .right_programs import programs_of

# No further right program is changed after so many changes, of half a millisecond each; where
# changes are looked up, few are left that only a search finds.
MAX_MUTANTS, MAX_BESIDE = 24_000, 4_000
IN_CONVENTIONS = ("robot_jacobian", "forward_kinematics", *OF_STEPS)
# The tasks whose answers tell numbers: they take no iterations.
WITH_NUMBERS = ("mass_spring_forces", "energy", *OF_STEPS)
# Where a right answer to all requests of the dictionary leaves known faults of rare cases alone.
RARE_ELSEWHERE = ("mass_spring_forces", "energy")
# Without a dictionary so many of the nearest right steps are tried: with known faults, and lines.
NEAREST_KNOWN, NEAREST = 8, 1


def with_changed_line(
    report: TaskReport,
    greeting: Greeting,
    connection: Connection | None = None,
    known_alone: bool = False,
) -> TaskReport:
    """Return a report on wrong answers with the fault or changed line that explains them.

    Beside a mistake that explains most answers, or where all targets are reached, the search is for
    known faults that explain all; so it is if `known_alone`, among those that are looked up. A
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
    report, proposals, is_over = _looked_up(report, greeting, connection)
    if is_over or (known_alone and proposals is None):
        return report
    if report.task in tool_steps.SOLVES:
        explanations = _of_steps(report, greeting, is_known)
    else:
        explanations = changed_lines(report, greeting, doubtful, is_known, proposals)
    if not explanations or explanations[0].share < min(share, 1.0):
        return report
    hints = () if explanations[0].share == 1.0 else report.diagnosis.hints
    diagnosis = replace(report.diagnosis, explanations=explanations, first_broken=None, hints=hints)
    return replace(report, diagnosis=diagnosis)


def _looked_up(
    report: TaskReport, greeting: Greeting, connection: Connection | None
) -> tuple[TaskReport, Proposals | None, bool]:
    """Return the report with the hint of a look-up, what it proposes, and whether that is all."""
    # a step of no declared method is undecided if no known step answers so
    least = Verdict.UNDECIDED if report.task in OF_STEPS else Verdict.WRONG
    if connection is None or report.verdict < least:
        return report, None, False
    proposals = look_up(connection, report.task, report.method, greeting)
    if proposals is None or proposals.hint is None:
        is_unknown = proposals is not None and not proposals.is_wrong
        # a method that no right program has, and nothing shows a mistake
        return report, proposals, is_unknown and report.verdict is Verdict.UNDECIDED
    hints = (*report.diagnosis.hints, proposals.hint)
    report = replace(report, diagnosis=replace(report.diagnosis, hints=hints))
    return report, None, proposals.hint == UNSTEADY  # without a dictionary all lines are searched


def _of_steps(report: TaskReport, greeting: Greeting, is_known: bool) -> tuple[Explanation, ...]:
    """Return the change of a line that gives the steps of robots, a known fault before others.

    Other lines are changed in the first view alone: single steps show more than where solves end,
    and the loops of solvers differ.
    """
    views = list(tool_steps.views(report))
    for view in (report, *views):
        if explanations := changed_lines(view, greeting, is_known=True):
            return explanations
    return () if is_known or not views else changed_lines(views[0], greeting)


def _least_share(report: TaskReport) -> float:
    """Return the share of answers that a program has to explain: many more than what is named.

    It has to explain all where answered positions are named, or how limits are read: a program
    tells of rotations as well. So it has where a measured test ends solves.
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
    """Return the change of a line that gives most wrong or doubtful answers, () if too few.

    If `is_known`, the search is for known faults alone. Where a dictionary proposes changes, these
    are tried; the lines of its first program, if answers to all its requests are right.
    """
    evidence = _evidence(report, greeting, doubtful)
    if not evidence.answers:
        return ()
    has_limits = any("cones" in exchange.case.inputs for exchange in evidence.answers)
    programs = [
        program
        for program in programs_of(report.task, report.method, greeting.step)
        if has_limits is ("within" in program.names) or report.task != "inverse_kinematics"
    ]
    best = tuple[Explanation, ...]()
    if proposals is not None:
        is_known |= not proposals.is_wrong and report.task in RARE_ELSEWHERE
        evidence = _as_proposed(evidence, proposals)
        entries = [
            entry for entry in proposals.entries
            if not is_known or all(part.codes for part in parts_of(entry))
        ]  # fmt: skip
        others = _beyond_dictionaries(programs, greeting.step)
        best = of_entries(entries, evidence, greeting)
        best = best or _of_programs(others, evidence, is_known=True)
        # Answers that are right to all requests of the dictionary are wrong in special cases.
        first = {source_of(names[0]) for names in IN_DICTIONARY.values()}
        programs = [p for p in programs if p.source in first and not proposals.is_wrong]
    is_choice = bool(doubtful) or report.task == tool_steps.TASK
    if is_choice and any(_gives(program, evidence) for program in programs):
        return ()
    best = best or _of_programs(programs, evidence, is_known)
    if report.task in WITH_NUMBERS and not best and not (doubtful or is_known):
        best = _of_numbers(evidence, greeting)
    return best if best and best[0].share >= MIN_SHARE else ()


def _evidence(
    report: TaskReport, greeting: Greeting, doubtful: Sequence[CaseJudgement]
) -> Evidence:
    """Return the answers that programs have to give."""
    compared = compared_answers(report, doubtful)
    tolerance = TOLERANCE[judging_greeting(compared, greeting)[0].precision]
    tolerance = tool_steps.SAME_STEP if report.task == tool_steps.TASK else tolerance
    compared = without_near(compared, report, tolerance)
    is_motion = report.task == tool_steps.MOTIONS
    return Evidence(report, compared[: tool_steps.MAX_MOTIONS if is_motion else None], tolerance)


def _functions_of(source: str) -> str:
    """Return the functions of a program, without the constants that are its choices."""
    return source[source.index("\ndef ") :]


def _beyond_dictionaries(programs: Sequence[Program], step: Step) -> list[Program]:
    """Return the programs whose changes are in no dictionary, or with other choices there."""
    names = (name for names in IN_DICTIONARY.values() for name in names)
    functions = {_functions_of(source_of(name)) for name in names}
    return [
        program
        for program in programs
        if _functions_of(program.source) not in functions or _has_other_choices(program, step)
    ]


def _has_other_choices(program: Program, step: Step) -> bool:
    """Return whether a number, or a declared choice, is not that of the program's text."""
    own = Program(program.source).names
    return any(
        own[name] != choice
        and (isinstance(choice, int) or getattr(step, name.lower(), None) is not None)
        for name, choice in program.choices.items()
    )


def _as_proposed(evidence: Evidence, proposals: Proposals) -> Evidence:
    """Return the answers with the sweeps that are always made, or their positions alone."""
    answers = evidence.answers
    if proposals.sweeps is not None:
        answers = with_sweeps(answers, proposals.sweeps)
    if proposals.of_positions:
        answers = positions_alone(answers)
    return evidence._replace(answers=answers)


def _of_numbers(evidence: Evidence, greeting: Greeting) -> tuple[Explanation, ...]:
    """Return the changed number of a right program, of the nearest one among steps."""
    task = evidence.report.task
    if task in OF_STEPS:
        programs = list(programs_of(task, evidence.report.method, greeting.step))
        programs = _nearest(programs, evidence)[:1]
    else:
        programs = [Program(source_of(name)) for name in IN_DICTIONARY[task]]
    found = (of_numbers(program, evidence) for program in programs)
    return next(filter(None, found), ())


def _of_programs(
    programs: Sequence[Program], evidence: Evidence, is_known: bool
) -> tuple[Explanation, ...]:
    """Return the fault or changed line of some programs that gives most answers.

    Of many right steps those are tried that come nearest, all known faults first.
    """
    best, functions, task = tuple[Explanation, ...](), set[str](), evidence.report.task
    most = MAX_BESIDE if task in {task for task, _ in TASKS} else MAX_MUTANTS
    most = tool_steps.MAX_MUTANTS.get(task, most)
    for program, known_alone in _trials(programs, evidence, is_known):
        if not known_alone and is_fitted(program) and best and best[0].share >= MIN_SHARE:
            break
        if task in IN_CONVENTIONS:
            functions.clear()
        explanations = of_program(program, evidence, None if known_alone else functions)
        best = max(best, explanations[:1], key=lambda e: e[0].share if e else 0.0)
        mutant_count = sum(other.mutant_count for other in programs)
        if (best and best[0].share == 1.0) or mutant_count > most:
            break
    return best


def _trials(
    programs: Sequence[Program], evidence: Evidence, is_known: bool
) -> list[tuple[Program, bool]]:
    """Return programs in the order of their trials, and whether known faults alone are tried."""
    if evidence.report.task in OF_STEPS:
        nearest = _nearest(programs, evidence)
        first = [(program, True) for program in nearest[:NEAREST_KNOWN]]
        return first + [(program, is_known) for program in nearest[:NEAREST]]
    # The lines of programs with fitted constants take seconds each.
    first = [(program, True) for program in programs if is_fitted(program) and not is_known]
    return first + [(program, is_known) for program in programs]


def _nearest(programs: Sequence[Program], evidence: Evidence) -> list[Program]:
    """Return programs, those first that give most answers, then those that come nearest."""

    def score(program: Program) -> tuple[int, float]:
        gaps = _gaps(program, evidence)
        return -sum(gap <= TOLERANCE["single"] for gap in gaps), float(np.median(gaps))

    return sorted(programs, key=score)


def _gives(program: Program, evidence: Evidence) -> bool:
    """Return whether a right program gives all answers."""
    return max(_gaps(program, evidence)) <= evidence.tolerance


def _gaps(program: Program, evidence: Evidence) -> list[float]:
    """Return the relative difference of each answer from a program's, infinite without any."""
    run, gaps = run_of(program, evidence), list[float]()
    for exchange in evidence.answers:
        assert isinstance(exchange.answer, Answer)
        try:
            gaps.append(difference(run(exchange.case), exchange.answer.values))
        except ArithmeticError:
            gaps.append(np.inf)
    return gaps
