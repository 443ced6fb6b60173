"""Search the right program with a known fault, or a changed line, that gives wrong answers."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import combinations, islice, takewhile
from typing import Any

import numpy as np

from plumbob.text.sentence import Sentence, sentence, with_code

from ..case import Case
from ..contestant import Answer, Contestant, Exchange, Failure
from ..dictionary.entry import ChangePair, Entry
from ..dictionary.look_up import UNSTEADY, Proposals, look_up
from ..dictionary.requests import TASKS
from ..explain import MORE, Variant, explain, together
from ..fault_programs import IN_DICTIONARY, NOTES, CodedFault, coded_faults, source_of
from ..gaps import difference
from ..greeting import Greeting
from ..judgement import CaseJudgement, Explanation, Finding, TaskReport, Verdict
from ..kinematics.claims import OF_POSES
from ..kinematics.early_ends import EARLY_ENDS
from ..kinematics.limits import READINGS
from ..kinematics.sweeps import ROUNDED, PoseTrial
from ..laws import LAWS
from ..precision import judging_greeting
from . import constants, tool_steps
from .constants import text_of, with_number
from .fitted import fitted, is_fitted
from .mutants import Mutant, Program
from .right_programs import FAULTS, KINDS, answer_of, comparable, faults_in, programs_of

# The most small and large wrong answers, and small right ones, that are compared with programs; a
# program has to give the first of them.
SMALL, LARGE, TRIAL = 9, 3, 1
# Of quarter turns rounding decides which of equal components a quaternion is made of.
TRIAL_OF_QUARTERS = 6
# So many answers a right program has to miss before its lines are changed, or, if they keep all
# laws, before any mistake is named: fewer would be met by many changes by chance.
MIN_DIFFERENT = 3
# The share of the answers that a program has to give.
MIN_SHARE = 0.75
# Cases for which a right program goes through its loops more often are left out: they take long,
# unless a pass is along a curve. A known fault may have loops that the right program lacks.
MAX_PASSES, OF_CURVES = 200, 2000
# But not if they go as often through them for the shortest case, as a constant number of sweeps.
LONGER = 3
# The changes of which each two are tried at once, in each program.
MAX_IN_PAIRS = 12
# No further right program is changed after so many changes, of half a millisecond each; where
# changes are looked up, few are left that only a search finds.
MAX_MUTANTS, MAX_BESIDE = 24_000, 4_000
# Of a right step, which takes longer.
MAX_MUTANTS_OF_STEPS = 2_000
# Programs of these answer in conventions of their own: what they share is changed in each.
OF_STEPS = ("mass_spring_step", "mass_spring_motion")
IN_CONVENTIONS = ("robot_jacobian", "forward_kinematics", *OF_STEPS)
# The functions of programs with fitted constants that forward kinematics shows to be right.
FOUNDATIONS = ("multiply", "conjugate", "rotate", "kinematics")
# The tasks whose answers tell numbers: they take no iterations.
WITH_NUMBERS = ("mass_spring_forces", "energy", *OF_STEPS)
# Where a right answer to all requests of the dictionary leaves known faults of rare cases alone.
RARE_ELSEWHERE = ("mass_spring_forces", "energy")
# Of right steps, so many that come nearest are tried with known faults, and with changed lines.
NEAREST_KNOWN, NEAREST = 8, 2
# The law of sweeps that are neither the textbook's nor those of a known honest program.
ANOTHER = "one sweep, another"
# The input that asks for a single iteration of a solver.
ITERATIONS = "max_iterations"
# Longer lines are cut to what differs, with so many letters before and after.
LINE, AROUND = 60, 20
# Relative differences that rounding and the ends of iterations explain, by precision.
TOLERANCE = {"double": 1e-7, "single": 2e-4}
# In single precision a change may enlarge rounding, up to so many times the tolerance: inputs in it
# move its answers by a part, and its own steps by so many times as much.
ROUNDINGS, MOST_ENLARGED = 30.0, 50.0
NO_ANSWER = (ValueError, IndexError, ArithmeticError, np.linalg.LinAlgError)


def with_changed_line(
    report: TaskReport,
    greeting: Greeting,
    contestant: Contestant | None = None,
    known_alone: bool = False,
) -> TaskReport:
    """Return a report on wrong answers with the fault or changed line that explains them.

    Beside a mistake that explains most answers, or where all targets are reached, the search is for
    known faults that explain all; so it is if `known_alone`. A `contestant` can be asked for what a
    dictionary tells apart.
    """
    named, share = report.diagnosis.explanations, _least_share(report)
    if report.verdict > Verdict.RIGHT_EXCEPT:
        if share > 1.0 and named[0].share == 1.0:
            return report
        doubtful = list[CaseJudgement]()
        is_known = known_alone or (bool(named) and named[0].share == 1.0)
    else:
        doubtful, is_known = _doubtful(report)
        if named or not doubtful:
            return report
        share = 1.0
    proposals = None
    if contestant is not None and report.verdict >= Verdict.WRONG:
        proposals = look_up(contestant, report.task, report.method, greeting)
        if proposals is not None and proposals.hint is not None:
            hints = (*report.diagnosis.hints, proposals.hint)
            report = replace(report, diagnosis=replace(report.diagnosis, hints=hints))
            if proposals.hint == UNSTEADY:
                return report
            proposals = None  # without a dictionary all lines are searched
    explanations = _of_steps(report, greeting, is_known) or changed_lines(
        report, greeting, doubtful, is_known, proposals
    )
    if not explanations or explanations[0].share < min(share, 1.0):
        return report
    hints = () if explanations[0].share == 1.0 else report.diagnosis.hints
    diagnosis = replace(report.diagnosis, explanations=explanations, first_broken=None, hints=hints)
    return replace(report, diagnosis=diagnosis)


def _of_steps(report: TaskReport, greeting: Greeting, is_known: bool) -> tuple[Explanation, ...]:
    """Return the change of a line that gives the steps of robots, a known fault before others.

    Other lines are changed in the first view alone: single steps show more than where solves end.
    """
    views = list(tool_steps.views(report))
    for view in (report, *views) if views else ():
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


def _doubtful(report: TaskReport) -> tuple[list[CaseJudgement], bool]:
    """Return answers that keep all laws but may be a mistake's, and whether it is a known one.

    These are sweeps that differ from the textbook's, or else solves that end short of the nearest
    point, or else all sweeps within limits where all targets are reached.
    """
    sweeps = [j for j in report.judgements if j.case.requirement == "must" and _is_single(j)]
    differing = [
        j
        for j in sweeps
        if any(map(_is_of_another, j.findings))
        and not PoseTrial(Exchange(j.case, j.answer, j.answer)).has_ended
    ]
    if differing:
        return differing, False
    if short := [j for j in report.judgements if _misses(j, "nearest point")]:
        return short, True
    limited = [j for j in report.judgements if "cones" in j.case.inputs]
    is_missed = any(_misses(judgement, "target reached") for judgement in limited)
    return [j for j in sweeps if j in limited], not is_missed


def _misses(judgement: CaseJudgement, law: str) -> bool:
    """Return whether an answer is reproached by a law."""
    return any(entry.verdict and entry.law == law for entry in judgement.findings)


def _is_of_another(entry: Finding) -> bool:
    """Return whether a sweep is not the textbook's, nor that of a known honest program."""
    return bool(entry.verdict) and entry.sentence.template == LAWS[ANOTHER]["sentence"]


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
    compared = _compared(report, doubtful)
    if not compared:
        return ()
    tolerance = TOLERANCE[judging_greeting(compared, greeting)[0].precision]
    tolerance = tool_steps.SAME_STEP if report.task == tool_steps.TASK else tolerance
    if report.task == tool_steps.MOTIONS:
        compared = compared[: tool_steps.MAX_MOTIONS]
    has_limits = any("cones" in exchange.case.inputs for exchange in compared)
    programs = [
        program
        for program in programs_of(report.task, report.method, greeting.step)
        if has_limits is ("within" in program.names) or report.task != "inverse_kinematics"
    ]
    best = tuple[Explanation, ...]()
    if proposals is not None:
        is_known |= not proposals.is_wrong and report.task in RARE_ELSEWHERE
        if proposals.sweeps is not None:
            compared = _with_sweeps(compared, proposals.sweeps)
        if proposals.of_positions:
            compared = list(map(_of_positions, compared))
        entries = [entry for entry in proposals.entries if entry.codes or not is_known]
        best = _of_entries(entries, report, compared, tolerance)
        looked_up = {source_of(name) for names in IN_DICTIONARY.values() for name in names}
        others = [program for program in programs if program.source not in looked_up]
        best = best or _of_programs(others, report, compared, tolerance, is_known=True)
        # Answers that are right to all requests of the dictionary are wrong in special cases.
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
            best = best or _of_numbers(program, report, compared, tolerance)
    return best if best and best[0].share >= MIN_SHARE else ()


def _of_programs(
    programs: Sequence[Program],
    report: TaskReport,
    compared: Sequence[Exchange],
    tolerance: float,
    is_known: bool,
) -> tuple[Explanation, ...]:
    """Return the fault or changed line of some programs that gives most answers.

    Of many right steps those are tried that come nearest, all known faults first.
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
        explanations = _of_program(program, report, compared, tolerance, changed)
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


def _of_numbers(
    program: Program, report: TaskReport, compared: Sequence[Exchange], tolerance: float
) -> tuple[Explanation, ...]:
    """Return the changes of a program by a number, which answers tell, as `_of_program` does."""
    run = partial(answer_of, program, report.method)
    different, same, passes = _compare(program, run, compared, tolerance)
    if len(different) < MIN_DIFFERENT:
        return ()
    program.observe(partial(run, different[0].case))
    mutants = dict[str, Mutant]()

    def variants() -> Iterator[Variant]:
        for mutant, number in constants.fitted(program, run, different, passes, tolerance):
            key = str(len(mutants))
            mutants[key] = text_of(mutant, number)
            predict = partial(with_number, program, mutant, number, passes, run)
            yield Variant((key,), predict, is_special=True)

    telling = _telling(different, same)
    return explain(
        variants(), telling, lambda _: tolerance, partial(_describe, mutants), _trial(report)
    )[0]


def _nearest(
    programs: Sequence[Program], report: TaskReport, compared: Sequence[Exchange]
) -> list[Program]:
    """Return programs, those first that give most answers, then those that come nearest."""

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
    run = _runner(program, report, compared)
    pairs = ((run(one.case), one.answer) for one in compared)
    return all(
        isinstance(answer, Answer) and difference(right, answer.values) <= tolerance
        for right, answer in pairs
    )


def _runner(
    program: Program, report: TaskReport, compared: Sequence[Exchange]
) -> Callable[[Case], Mapping[str, Any]]:
    """Return the function that gives the answers of a program, its constants fitted to a solver."""
    run = partial(answer_of, program, report.method)
    if not is_fitted(program):
        return run
    pairs = ((one.case.name, one.answer) for one in compared)
    answers = {name: answer.values for name, answer in pairs if isinstance(answer, Answer)}
    return partial(fitted, program, run, answers, {})


def _of_program(
    program: Program,
    report: TaskReport,
    compared: Sequence[Exchange],
    tolerance: float,
    functions: set[str] | None,
) -> tuple[Explanation, ...]:
    """Return the faults or changed lines of a program that give answers, most answers first.

    Answers that the program gives as it is come last, and no more of them than of the others: they
    do not speak for a change. Lines are changed where no known fault gives all answers, except in
    `functions` that are changed already, or in none.
    """
    run = _runner(program, report, compared)
    different, same, passes = _compare(program, run, compared, tolerance)
    least = MIN_DIFFERENT if report.verdict <= Verdict.RIGHT_EXCEPT else 1
    if len(different) < least:
        return ()
    if is_fitted(program):  # a chance fit of few numbers costs time
        different.sort(key=lambda exchange: -len(exchange.case.facts["path"]))
    faults, mutants = dict[str, CodedFault](), dict[str, Mutant]()

    def variants() -> Iterator[Variant]:
        for fault in faults_in(program.source, report.task, report.method):
            faults[fault.name] = fault
            with suppress(SyntaxError):
                wrong = program.with_source(fault.planted_in(program.source))
                run_wrong = _runner(wrong, report, compared)
                predict = partial(_faulty_answer, wrong, run_wrong, passes)
                yield Variant((fault.name,), predict)
        if len(different) < MIN_DIFFERENT or functions is None:
            return
        program.observe(partial(run, different[0].case))
        if is_fitted(program):
            functions.update(map(program.text_of, FOUNDATIONS))
        limit = MAX_MUTANTS_OF_STEPS if report.task in OF_STEPS else None
        for number, mutant in enumerate(islice(program.mutants(functions), limit)):
            mutants[str(number)] = mutant
            predict = partial(_changed_answer, program, mutant, passes, run)
            yield Variant((str(number),), predict, is_special=True)

    def describe(keys: Sequence[str]) -> Sentence:
        catalogue = [faults[key] for key in keys if key in faults]
        return (
            with_code(catalogue[0].code, catalogue[0].sentence)
            if catalogue
            else _describe(mutants, keys)
        )

    telling = _telling(different, same)
    return explain(variants(), telling, lambda _: tolerance, describe, _trial(report))[0]


def _of_entries(
    entries: Sequence[Entry], report: TaskReport, compared: Sequence[Exchange], tolerance: float
) -> tuple[Explanation, ...]:
    """Return the entry of a dictionary that gives most answers, () if too few."""
    best = tuple[Explanation, ...]()
    by_program = dict[str, list[Entry]]()
    for entry in entries:
        by_program.setdefault(entry.program, []).append(entry)
    for kind in (list, _pairs):
        for name, changes in by_program.items():
            explanations = _of_changes(
                Program(source_of(name)), kind(changes), report, compared, tolerance
            )
            best = max(best, explanations[:1], key=lambda e: e[0].share if e else 0.0)
            if best and best[0].share == 1.0:
                return best
    return best if best and best[0].share >= MIN_SHARE else ()


def _pairs(entries: Sequence[Entry]) -> list[ChangePair]:
    """Return two changes at once, of the likeliest changes that requests propose."""
    single = [entry for entry in entries if len(entry.codes) < 2]
    return [ChangePair(*pair) for pair in combinations(single[:MAX_IN_PAIRS], 2)]


def _of_changes(
    program: Program,
    entries: Sequence[Entry | ChangePair],
    report: TaskReport,
    compared: Sequence[Exchange],
    tolerance: float,
) -> tuple[Explanation, ...]:
    """Return the changes of a program that give answers, as `_of_program` does."""
    run = partial(answer_of, program, report.method)
    different, same, passes = _compare(program, run, compared, tolerance)
    if not different:
        return ()
    ordered = sorted(map(_parts, entries), key=lambda parts: (_count(parts), not parts[0].codes))
    changes = dict[str, tuple[Entry, ...]]()

    def variants() -> Iterator[Variant]:
        for number, parts in enumerate(ordered):
            if parts[0].codes or len(different) >= MIN_DIFFERENT:
                faults = tuple(
                    name for place, part in enumerate(parts) for name in _names(part, number, place)
                )
                changes[" + ".join(faults)] = parts
                entry = parts[0] if len(parts) == 1 else ChangePair(*parts)
                with suppress(SyntaxError, ValueError):
                    predict = _answer_of_change(entry, program, report, compared, passes)
                    enlarged = _enlargement(predict, different[0].case, tolerance)
                    yield Variant(faults, predict, not parts[0].codes, enlarged)

    def describe(keys: Sequence[str]) -> Sentence:
        parts = changes[keys[0]]
        if len(parts) == 1 and not parts[0].codes:
            others = {key: changes[key][0] for key in keys if len(changes[key]) == 1}
            return _describe(others, list(others), parts[0].equal_count)
        return together([words for part in parts for words in _sentences_of(part)])

    return explain(variants(), _telling(different, same), lambda _: tolerance, describe,
                   _trial(report))[0]  # fmt: skip


def _parts(change: Entry | ChangePair) -> tuple[Entry, ...]:
    return (change.first, change.second) if isinstance(change, ChangePair) else (change,)


def _count(parts: Sequence[Entry]) -> int:
    """Return the number of mistakes."""
    return sum(max(len(part.codes), 1) for part in parts)


def _names(entry: Entry, number: int, place: int) -> list[str]:
    """Return the keys of known faults, or a key of a changed line."""
    return [coded_faults()[code].name for code in entry.codes] or [f"{number}.{place}"]


def _sentences_of(entry: Entry) -> list[Sentence]:
    """Return the sentences of known faults, or that of a changed line."""
    faults = [coded_faults()[code] for code in entry.codes]
    if faults:
        return [with_code(fault.code, fault.sentence) for fault in faults]
    return [_describe({"": entry}, [""], entry.equal_count)]


def _enlargement(
    predict: Callable[[Case], Mapping[str, Any]], case: Case, tolerance: float
) -> float:
    """Return by how much more than the tolerance allows a change enlarges single precision."""
    if tolerance < TOLERANCE["single"]:
        return 1.0
    inputs = {name: _rounded(value) for name, value in case.inputs.items()}
    with suppress(*NO_ANSWER):
        moved = difference(predict(replace(case, inputs=inputs)), predict(case))
        return min(max(1.0, ROUNDINGS * moved / tolerance), MOST_ENLARGED)
    return 1.0


def _rounded(value: Any) -> Any:
    """Return numbers in single precision, others as they are."""
    is_real = isinstance(value, np.ndarray) and value.dtype.kind == "f"
    return value.astype(np.float32).astype(float) if is_real else value


def _answer_of_change(
    change: Entry | ChangePair,
    program: Program,
    report: TaskReport,
    compared: Sequence[Exchange],
    passes: Mapping[str, int],
) -> Callable[[Case], Mapping[str, Any]]:
    """Return the function that answers as a change of a program, or two at once."""
    if isinstance(change, ChangePair) or change.codes:
        wrong = change.changed_program()
        return partial(_faulty_answer, wrong, _runner(wrong, report, compared), passes)
    mutant = program.mutant_of(
        change.kind, change.function, change.right, change.wrong, change.text
    )
    run = _runner(program, report, compared)
    return partial(_changed_answer, program, mutant, passes, run)


def _of_positions(exchange: Exchange) -> Exchange:
    """Return an answer with its positions alone."""
    assert isinstance(exchange.answer, Answer)
    return replace(exchange, answer=Answer({"positions": exchange.answer.values["positions"]}, 0.0))


def _with_sweeps(compared: Sequence[Exchange], count: int) -> list[Exchange]:
    """Return answers with the number of sweeps that they have, whatever was asked.

    They are of requests without a tolerance, which a solver may not read either.
    """
    return [
        replace(e, case=replace(e.case, inputs={**e.case.inputs, ITERATIONS: count}))
        for e in compared
        if e.case.inputs["tolerance"] == 0.0
    ]


def _telling(different: Sequence[Exchange], same: Sequence[Exchange]) -> list[Exchange]:
    """Return answers that a program does not give, then no more of the others."""
    return [*different, *same[: max(len(different), MIN_DIFFERENT)]]


def _trial(report: TaskReport) -> int:
    return TRIAL_OF_QUARTERS if report.task == "forward_kinematics" else TRIAL


def _compare(
    program: Program,
    run: Callable[[Case], Mapping[str, Any]],
    compared: Sequence[Exchange],
    tolerance: float,
) -> tuple[list[Exchange], list[Exchange], dict[str, int]]:
    """Return the answers that a right program does not give, the answers that it gives, and passes.

    The passes through its loops are by the names of cases; answers of too many are left out.
    """
    answers = [program.count_passes(partial(run, exchange.case)) for exchange in compared]
    most = max(MAX_PASSES, LONGER * min((count for _, count in answers), default=0))
    passes, different, same = dict[str, int](), list[Exchange](), list[Exchange]()
    for exchange, (right, count) in zip(compared, answers, strict=True):
        assert isinstance(exchange.answer, Answer)
        is_curve = exchange.case.task == "resample"
        if count <= (OF_CURVES if is_curve else most):
            passes[exchange.case.name] = count
            is_same = difference(right, exchange.answer.values) <= tolerance
            (same if is_same else different).append(exchange)
    # Single iterations of another solver differ everywhere: they decide soon.
    single = [exchange for exchange in different if exchange.case.inputs.get(ITERATIONS) == 1]
    return (single if len(single) >= MIN_DIFFERENT else different), same, passes


def _compared(report: TaskReport, doubtful: Sequence[CaseJudgement]) -> list[Exchange]:
    """Return small and large answers, the wrong or doubtful answers first."""
    judgements = [
        judgement
        for judgement in report.judgements
        if judgement.case.requirement == "must" and _is_telling(judgement.case, judgement.answer)
    ]
    is_sweep = [j for j in judgements if "sweeps" in j.case.facts]
    if any(j.verdict >= Verdict.UNDECIDED for j in is_sweep):
        judgements = is_sweep
    judgements.sort(key=lambda j: j.case.size)
    wrong = [j for j in judgements if j.verdict >= Verdict.UNDECIDED or j in doubtful]
    right = [j for j in judgements if j not in wrong and not doubtful]
    telling = [*wrong[:SMALL], *wrong[SMALL:][-LARGE:], *right[:SMALL]]
    single = [j for j in right if _is_single(j) and j not in telling]
    telling += single if judgements is not is_sweep else []
    return [comparable(Exchange(j.case, j.answer, j.answer)) for j in telling if wrong]


def _is_single(judgement: CaseJudgement) -> bool:
    return bool(judgement.case.inputs.get(ITERATIONS) == 1)


def _is_telling(case: Case, answer: Answer | Failure) -> bool:
    """Return whether an answer has numbers alone, and not only zeros and numbers of the request."""
    if not isinstance(answer, Answer):
        return False
    names = {"local_rotations"} & answer.values.keys() or answer.values.keys()
    outputs = [np.asarray(answer.values[name], dtype=float) for name in names]
    inputs = [np.zeros(()), *(np.asarray(v) for v in case.inputs.values() if np.ndim(v) > 0)]
    is_new = (
        not any(_repeats(output, array) for array in inputs) and output.any() for output in outputs
    )
    return all(np.isfinite(output).all() for output in outputs) and any(is_new)


def _repeats(output: Any, array: Any) -> bool:
    """Return whether an output is an input, but for rounding and the signs of quaternions."""
    is_alike = np.shape(output) == np.shape(array)
    return is_alike and np.allclose(np.abs(output), np.abs(array), rtol=0.0, atol=ROUNDED)


def _changed_answer(
    program: Program,
    mutant: Mutant,
    passes: Mapping[str, int],
    run: Callable[[Case], Mapping[str, Any]],
    case: Case,
) -> Mapping[str, Any]:
    with program.changed(mutant, passes[case.name]):
        return run(case)


def _faulty_answer(
    program: Program,
    run: Callable[[Case], Mapping[str, Any]],
    passes: Mapping[str, int],
    case: Case,
) -> Mapping[str, Any]:
    with program.within(max(passes[case.name], MAX_PASSES)):
        return run(case)


def _describe(
    mutants: Mapping[str, Mutant | Entry], keys: Sequence[str], count: int = 1
) -> Sentence:
    """Return the sentence of the likeliest changes, in up to two functions, of equal answers.

    They are the likeliest of `count` changes.
    """
    ordered = sorted(
        (mutants[key] for key in keys),
        key=lambda m: (KINDS.index(m.kind), abs(len(m.right) - len(m.wrong)), len(m.wrong)),
    )
    mutant = ordered[0]
    entry = FAULTS[mutant.kind]
    right, wrong = excerpts(mutant.right, mutant.wrong)
    if wrong:
        words = sentence(
            "{what} Where a right program has `{right}`, your answers are as if yours had "
            "`{wrong}`; names in it may differ.",
            what=Sentence(entry["sentence"], {}), right=right, wrong=wrong,
        )  # fmt: skip
    else:
        words = sentence(
            "{what} Your answers are as if the line `{right}` of a right program were missing in "
            "yours; names in it may differ.",
            what=Sentence(entry["sentence"], {}), right=right,
        )  # fmt: skip
    for other in ordered:
        if wrong and other.kind == mutant.kind and other.function != mutant.function:
            right, wrong = excerpts(other.right, other.wrong)
            words = sentence("{one} Or, as well, `{wrong}` in the place of `{right}`.",
                             one=words, right=right, wrong=wrong)  # fmt: skip
            break
    for note in NOTES.values():
        if any(text in mutant.right for text in note["texts"]):
            words = sentence("{words} {note}", words=words, note=Sentence(note["sentence"], {}))
    if count > 1:
        words = sentence("{words} This is one of {count} changes that give the same answers.",
                         words=words, count=count)  # fmt: skip
    return with_code(entry["code"], words)


def excerpts(right: str, wrong: str) -> tuple[str, str]:
    """Return two lines, of long lines only the difference and some letters around it.

    `x = x` reads an input: its value alone is returned, and the value in its place.
    """
    if reading := re.fullmatch(r"(\w+) = \1", right):
        right, wrong = reading[1], wrong.removeprefix(f"{reading[1]} = ")
    if max(len(right), len(wrong)) <= LINE or not wrong:
        return right, wrong
    before = _common_length(right, wrong)
    after = _common_length(right[before:][::-1], wrong[before:][::-1])
    start = max(0, right.rfind(" ", 0, max(0, before - AROUND)) + 1)

    def excerpt(line: str) -> str:
        end = line.find(" ", len(line) - after + AROUND)
        end = len(line) if end < 0 else end
        return f"{'… ' * (start > 0)}{line[start:end]}{' …' * (end < len(line))}"

    return excerpt(right), excerpt(wrong)


def _common_length(first: str, second: str) -> int:
    """Return the number of letters with which both texts begin."""
    pairs = zip(first, second, strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))
