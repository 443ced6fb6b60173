"""The known faults, changed lines and changed numbers of programs with a solver's answers."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import combinations, islice
from typing import Any

import numpy as np

from plumbob.text.sentence import Sentence, with_code

from ..case import Case
from ..dictionary.entry import ChangePair, Entry
from ..exchange import Answer, Exchange
from ..explain import Variant, explain, together
from ..fault_programs import CodedFault, coded_faults, source_of
from ..gaps import difference
from ..judgement import Explanation, TaskReport, Verdict
from . import constants
from .answers import MAX_PASSES, MIN_DIFFERENT, compare, telling_answers, trial_count
from .constants import text_of, with_number
from .fitted import fitted, is_fitted
from .mutants import Mutant, Program
from .right_programs import answer_of, faults_in
from .sentences import changes_in_words

# The share of the answers for a match.
MIN_SHARE = 0.75
# The changes of which each two are tried at once, in each program.
MAX_IN_PAIRS = 12
# Of a right step, which takes longer.
MAX_MUTANTS_OF_STEPS = 2_000
# Programs of these tasks answer in conventions of their own: shared lines are changed in each.
OF_STEPS = ("mass_spring_step", "mass_spring_motion")
# The functions with right results by forward kinematics, of programs with fitted constants.
FOUNDATIONS = ("multiply", "conjugate", "rotate", "kinematics")
# Relative differences by rounding and the ends of iterations, by precision.
TOLERANCE = {"double": 1e-7, "single": 2e-4}
# In single precision a change may enlarge rounding, up to so many times the tolerance. Rounded
# inputs move its answers by a part, and its own steps by this multiple.
ROUNDINGS, MOST_ENLARGED = 30.0, 50.0
NO_ANSWER = (ValueError, IndexError, ArithmeticError, np.linalg.LinAlgError)


def run_of(
    program: Program, report: TaskReport, compared: Sequence[Exchange]
) -> Callable[[Case], Mapping[str, Any]]:
    """Return the function with the answers of a program, its constants fitted to a solver."""
    run = partial(answer_of, program, report.method)
    if not is_fitted(program):
        return run
    pairs = ((one.case.name, one.answer) for one in compared)
    answers = {name: answer.values for name, answer in pairs if isinstance(answer, Answer)}
    return partial(fitted, program, run, answers, {})


def of_program(
    program: Program,
    report: TaskReport,
    compared: Sequence[Exchange],
    tolerance: float,
    functions: set[str] | None,
) -> tuple[Explanation, ...]:
    """Return the faults or changed lines of a program with given answers, most answers first.

    Answers of the unchanged program come last, and at most as many as other answers: equal answers
    do not speak for a change. Lines are changed where no known fault gives all answers, except in
    already changed `functions`, or in none.
    """
    run = run_of(program, report, compared)
    different, same, passes = compare(program, run, compared, tolerance)
    least = MIN_DIFFERENT if report.verdict <= Verdict.RIGHT_EXCEPT else 1
    if len(different) < least:
        return ()
    if is_fitted(program):  # a chance fit of few numbers costs time
        different.sort(key=lambda exchange: -len(exchange.case.facts["path"]))
    faults, mutants = dict[str, CodedFault](), dict[str, Mutant]()

    def variants() -> Iterator[Variant]:
        # known faults of all fitted programs have been tried before
        is_tried = is_fitted(program) and functions is not None
        known = () if is_tried else faults_in(program.source, report.task, report.method)
        for fault in known:
            faults[fault.name] = fault
            with suppress(SyntaxError):
                wrong = program.with_source(fault.planted_in(program.source))
                run_wrong = run_of(wrong, report, compared)
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
            else changes_in_words(mutants, keys)
        )

    telling = telling_answers(different, same)
    return explain(variants(), telling, tolerance, describe, trial_count(report))


def of_entries(
    entries: Sequence[Entry], report: TaskReport, compared: Sequence[Exchange], tolerance: float
) -> tuple[Explanation, ...]:
    """Return the entry of a dictionary with most answers, () if too few."""
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
    """Return two changes at once, of the likeliest proposed changes."""
    single = [entry for entry in entries if len(entry.codes) < 2]
    return [ChangePair(*pair) for pair in combinations(single[:MAX_IN_PAIRS], 2)]


def _of_changes(
    program: Program,
    entries: Sequence[Entry | ChangePair],
    report: TaskReport,
    compared: Sequence[Exchange],
    tolerance: float,
) -> tuple[Explanation, ...]:
    """Return the changes of a program with given answers, like `of_program`."""
    run = partial(answer_of, program, report.method)
    different, same, passes = compare(program, run, compared, tolerance)
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
            return changes_in_words(others, list(others), parts[0].equal_count)
        return together([words for part in parts for words in _sentences_of(part)])

    telling = telling_answers(different, same)
    return explain(variants(), telling, tolerance, describe, trial_count(report))


def _parts(change: Entry | ChangePair) -> tuple[Entry, ...]:
    return (change.first, change.second) if isinstance(change, ChangePair) else (change,)


def _count(parts: Sequence[Entry]) -> int:
    """Return the number of mistakes."""
    return sum(max(len(part.codes), 1) for part in parts)


def _names(entry: Entry, number: int, place: int) -> list[str]:
    """Return the keys of known faults, or a key of a changed line."""
    return [coded_faults()[code].name for code in entry.codes] or [f"{number}.{place}"]


def _sentences_of(entry: Entry) -> list[Sentence]:
    """Return the sentences of known faults, or the sentence of a changed line."""
    faults = [coded_faults()[code] for code in entry.codes]
    if faults:
        return [with_code(fault.code, fault.sentence) for fault in faults]
    return [changes_in_words({"": entry}, [""], entry.equal_count)]


def _answer_of_change(
    change: Entry | ChangePair,
    program: Program,
    report: TaskReport,
    compared: Sequence[Exchange],
    passes: Mapping[str, int],
) -> Callable[[Case], Mapping[str, Any]]:
    """Return the function with the answers of a change of a program, or of two at once."""
    if isinstance(change, ChangePair) or change.codes:
        wrong = change.changed_program()
        return partial(_faulty_answer, wrong, run_of(wrong, report, compared), passes)
    mutant = program.mutant_of(
        change.kind, change.function, change.right, change.wrong, change.text
    )
    run = run_of(program, report, compared)
    return partial(_changed_answer, program, mutant, passes, run)


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
    """Return numbers in single precision, other values unchanged."""
    is_real = isinstance(value, np.ndarray) and value.dtype.kind == "f"
    return value.astype(np.float32).astype(float) if is_real else value


def of_numbers(
    program: Program, report: TaskReport, compared: Sequence[Exchange], tolerance: float
) -> tuple[Explanation, ...]:
    """Return the changes of a program by a number, which answers tell, as `of_program` does."""
    run = partial(answer_of, program, report.method)
    different, same, passes = compare(program, run, compared, tolerance)
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

    telling, words = telling_answers(different, same), partial(changes_in_words, mutants)
    return explain(variants(), telling, tolerance, words, trial_count(report))


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
