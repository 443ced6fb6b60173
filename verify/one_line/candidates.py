"""The known faults, changed lines and changed numbers of programs that give answers."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import combinations, islice
from typing import Any, NamedTuple

import numpy as np

from plumbob.text.sentence import Sentence, with_code

from ..case import Case
from ..dictionary.entry import ChangePair, Entry
from ..exchange import Answer, Exchange
from ..explain import Variant, explain, together
from ..fault_programs import CodedFault, coded_faults
from ..gaps import difference
from ..greeting import Greeting
from ..judgement import Explanation, TaskReport, Verdict
from . import constants
from .answers import MAX_PASSES, MIN_DIFFERENT, compare, telling_answers, trial_count
from .constants import text_of, with_number
from .fitted import fitted, is_fitted
from .mutants import Mutant, Program
from .right_programs import answer_of, faults_in, in_choices
from .sentences import changes_in_words

# The share of the answers that a program has to give.
MIN_SHARE = 0.75
# The changes of which each two are tried at once, in each program.
MAX_IN_PAIRS = 12
# Of a right step, which takes longer.
MAX_MUTANTS_OF_STEPS = 2_000
# Programs of these answer in conventions of their own: what they share is changed in each.
OF_STEPS = ("mass_spring_step", "mass_spring_motion")
# The functions of programs with fitted constants that forward kinematics shows to be right.
FOUNDATIONS = ("multiply", "conjugate", "rotate", "kinematics")
# Relative differences that rounding and the ends of iterations explain, by precision.
TOLERANCE = {"double": 1e-7, "single": 2e-4}
# In single precision a change may enlarge rounding, up to so many times the tolerance: inputs in it
# move its answers by a part, and its own steps by so many times as much.
ROUNDINGS, MOST_ENLARGED = 30.0, 50.0
NO_ANSWER = (ValueError, IndexError, ArithmeticError, np.linalg.LinAlgError)

Run = Callable[[Case], Mapping[str, Any]]  # returns the answer of a program
Describe = Callable[[Sequence[str]], Sentence]  # puts the changes of some keys into words


class Evidence(NamedTuple):
    """The answers that a program has to give, and the relative difference of equal ones."""

    report: TaskReport
    answers: Sequence[Exchange]
    tolerance: float


class RightProgram:
    """A right program beside answers: which of them it gives, and which changes give the others."""

    def __init__(self, program: Program, evidence: Evidence, run: Run) -> None:
        self.program, self._evidence, self.run = program, evidence, run
        self.different, self._same, self.passes = compare(
            program, run, evidence.answers, evidence.tolerance
        )

    def explain(self, variants: Iterable[Variant], describe: Describe) -> tuple[Explanation, ...]:
        """Return the variants that give answers, most answers first.

        Answers that the program gives as it is come last, and no more of them than of the others:
        they do not speak for a change.
        """
        report, _, tolerance = self._evidence
        telling = telling_answers(self.different, self._same)
        return explain(variants, telling, tolerance, describe, trial_count(report))

    def of_fault(self, wrong: Program) -> Run:
        """Return the function that answers as a program with a fault."""
        run = run_of(wrong, self._evidence)

        def answer(case: Case) -> Mapping[str, Any]:
            with wrong.within(max(self.passes[case.name], MAX_PASSES)):
                return run(case)

        return answer

    def of_line(self, mutant: Mutant) -> Run:
        """Return the function that answers as the program with a changed line."""

        def answer(case: Case) -> Mapping[str, Any]:
            with self.program.changed(mutant, self.passes[case.name]):
                return self.run(case)

        return answer


def run_of(program: Program, evidence: Evidence) -> Run:
    """Return the function that gives the answers of a program, its constants fitted to a solver."""
    run = partial(answer_of, program, evidence.report.method)
    if not is_fitted(program):
        return run
    pairs = ((one.case.name, one.answer) for one in evidence.answers)
    answers = {name: answer.values for name, answer in pairs if isinstance(answer, Answer)}
    return partial(fitted, program, run, answers, {})


def of_program(
    program: Program, evidence: Evidence, functions: set[str] | None
) -> tuple[Explanation, ...]:
    """Return the faults or changed lines of a program that give answers, most answers first.

    Lines are changed where no known fault gives all answers, except in `functions` that are changed
    already, or in none.
    """
    report, right = evidence.report, RightProgram(program, evidence, run_of(program, evidence))
    if len(right.different) < (MIN_DIFFERENT if report.verdict <= Verdict.RIGHT_EXCEPT else 1):
        return ()
    if is_fitted(program):  # a chance fit of few numbers costs time
        right.different.sort(key=lambda exchange: -len(exchange.case.facts["path"]))
    faults, mutants = dict[str, CodedFault](), dict[str, Mutant]()

    def variants() -> Iterator[Variant]:
        for fault in faults_in(program.source, report.task, report.method):
            faults[fault.name] = fault
            with suppress(SyntaxError):
                wrong = program.with_source(fault.planted_in(program.source))
                yield Variant((fault.name,), right.of_fault(wrong))
        if len(right.different) < MIN_DIFFERENT or functions is None:
            return
        program.observe(partial(right.run, right.different[0].case))
        if is_fitted(program):
            functions.update(map(program.text_of, FOUNDATIONS))
        limit = MAX_MUTANTS_OF_STEPS if report.task in OF_STEPS else None
        for number, mutant in enumerate(islice(program.mutants(functions), limit)):
            mutants[str(number)] = mutant
            yield Variant((str(number),), right.of_line(mutant), is_special=True)

    def describe(keys: Sequence[str]) -> Sentence:
        known = [faults[key] for key in keys if key in faults]
        if known:
            return with_code(known[0].code, known[0].sentence)
        return changes_in_words(mutants, keys)

    return right.explain(variants(), describe)


def of_entries(
    entries: Sequence[Entry | ChangePair], evidence: Evidence, greeting: Greeting
) -> tuple[Explanation, ...]:
    """Return the entry of a dictionary that gives most answers, () if too few.

    A program is tried with each of the choices that the solver does not declare.
    """
    best = tuple[Explanation, ...]()
    by_program = dict[str, list[Entry | ChangePair]]()
    for entry in entries:
        by_program.setdefault(parts_of(entry)[0].program, []).append(entry)
    # programs of steps have many choices: only pairs are tried whose keys add up
    for kind in (list,) if evidence.report.task in OF_STEPS else (list, _pairs):
        for name, changes in by_program.items():
            for program in in_choices(name, greeting.step):
                explanations = _of_changes(program, kind(changes), evidence)
                best = max(best, explanations[:1], key=lambda e: e[0].share if e else 0.0)
                if best and best[0].share == 1.0:
                    return best
    return best if best and best[0].share >= MIN_SHARE else ()


def _pairs(entries: Sequence[Entry | ChangePair]) -> list[ChangePair]:
    """Return two changes at once, of the likeliest changes that requests propose."""
    single = [entry for entry in entries if isinstance(entry, Entry) and len(entry.codes) < 2]
    return [ChangePair(*pair) for pair in combinations(single[:MAX_IN_PAIRS], 2)]


def _of_changes(
    program: Program, entries: Sequence[Entry | ChangePair], evidence: Evidence
) -> tuple[Explanation, ...]:
    """Return the changes of a program that give answers, as `of_program` does."""
    run = partial(answer_of, program, evidence.report.method)
    right = RightProgram(program, evidence, run)
    if not right.different or not entries:
        return ()
    ordered = sorted(map(parts_of, entries), key=lambda parts: (_count(parts), not parts[0].codes))
    changes = dict[str, tuple[Entry, ...]]()

    def variants() -> Iterator[Variant]:
        for number, parts in enumerate(ordered):
            if parts[0].codes or len(right.different) >= MIN_DIFFERENT:
                faults = tuple(
                    name for place, part in enumerate(parts) for name in _names(part, number, place)
                )
                changes[" + ".join(faults)] = parts
                with suppress(SyntaxError, ValueError):
                    predict = _answer_of_change(parts, right)
                    enlarged = _enlargement(predict, right.different[0].case, evidence.tolerance)
                    yield Variant(faults, predict, not parts[0].codes, enlarged)

    def describe(keys: Sequence[str]) -> Sentence:
        parts = changes[keys[0]]
        if len(parts) == 1 and not parts[0].codes:
            others = {key: changes[key][0] for key in keys if len(changes[key]) == 1}
            return changes_in_words(others, list(others), parts[0].equal_count)
        return together([words for part in parts for words in _sentences_of(part)])

    return right.explain(variants(), describe)


def parts_of(change: Entry | ChangePair) -> tuple[Entry, ...]:
    """Return a change, or the two of a pair."""
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
    return [changes_in_words({"": entry}, [""], entry.equal_count)]


def _answer_of_change(parts: tuple[Entry, ...], right: RightProgram) -> Run:
    """Return the function that answers as a program with a change, or two at once."""
    program, (first, *others) = right.program, parts
    if others or first.codes:
        change = ChangePair(first, *others) if others else first
        return right.of_fault(change.changed_program(program.choices))
    return right.of_line(
        program.mutant_of(first.kind, first.function, first.right, first.wrong, first.text)
    )


def _enlargement(predict: Run, case: Case, tolerance: float) -> float:
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


def of_numbers(program: Program, evidence: Evidence) -> tuple[Explanation, ...]:
    """Return the changes of a program by a number, which answers tell, as `of_program` does."""
    run = partial(answer_of, program, evidence.report.method)
    right = RightProgram(program, evidence, run)
    if len(right.different) < MIN_DIFFERENT:
        return ()
    program.observe(partial(run, right.different[0].case))
    mutants, certain = dict[str, Mutant](), set[str]()
    if not _vary(right.different):
        return ()

    def variants() -> Iterator[Variant]:
        exchanges, passes = right.different, right.passes
        for mutant, number in constants.fitted(program, run, exchanges, passes, evidence.tolerance):
            key = str(len(mutants))
            mutants[key] = text_of(mutant, number)
            certain.update([key] if constants.is_fraction(number) else [])
            predict = partial(with_number, program, mutant, number, passes, run)
            yield Variant((key,), predict, is_special=True)

    explanations = right.explain(variants(), partial(changes_in_words, mutants))
    return tuple(e for e in explanations if e.share == 1.0 or certain & {*e.faults})


def _vary(exchanges: Sequence[Exchange]) -> bool:
    """Return whether requests differ in their masses, which a fitted number may hide."""
    masses = [np.ravel(e.case.inputs.get("masses", i)) for i, e in enumerate(exchanges)]
    return any(not np.array_equal(masses[0], other) for other in masses)
