"""Look up the changes of right programs that answer a few requests as a solver does."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import BoolArray, FloatArray
from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..exchange import Answer, Connection, Exchange, Failure
from ..fault_programs import IN_DICTIONARY, source_of
from ..gaps import difference
from ..greeting import Greeting
from ..one_line.mutants import Program
from ..one_line.right_programs import answer_of, comparable
from .constant_sweeps import known_fault, makes_constant_sweeps
from .entry import ChangePair, Dictionary, Entry, file_of, likelihood, read
from .requests import (
    FK,
    IK,
    OF_SPRINGS,
    OUTPUTS,
    STEP,
    TASKS,
    fitted_to,
    fractions,
    is_solve,
    keys,
    requests,
    suitable,
)
from .rights import right_keys

# Keys differ by ten times the rounding of an answer: single precision loses three digits more, and
# a fourth where a mistake enlarges rounding, which is tried where nothing is nearer.
TOLERANCES = {"double": (1e-6,), "single": (1e-4, 1e-3)}
# Equal requests get answers that differ by less, but for threads that add up in another order.
SAME = 1e-6
# The most candidates, which all cases have to decide between, and the most pairs of changes.
MAX_CANDIDATES, MAX_PAIRS = 200, 12
UNSTEADY = sentence(
    "Equal requests got different answers, also after a new start: no changed line is looked up."
)


class Proposals(NamedTuple):
    """What a look-up proposes."""

    entries: Sequence[Entry | ChangePair] = ()  # the likeliest first
    sweeps: int | None = None  # that are made whatever is asked
    is_wrong: bool = True  # whether the solver answers a request otherwise than right programs
    # whether positions alone are alike: rotations of no matrix are any, and velocities of steps may
    # have a second mistake
    of_positions: bool = False
    hint: Sentence | None = None  # why nothing is looked up, or that no file can be read


def look_up(connection: Connection, task: str, method: str, greeting: Greeting) -> Proposals | None:
    """Return the changes that a new process of a solver answers like, None without a dictionary.

    Each request is looked up alone as well: a second mistake may hide the first in another.
    """
    methods = [own for name, own in TASKS if name == task and method in (own, "")]
    cases = [case for case in requests(task, method) if suitable(case, greeting)]
    if not methods or not cases:
        return None
    dictionaries = dict[str, Dictionary]()
    for own in methods:
        try:
            dictionaries[own] = _dictionary(task, own)
        except (OSError, ValueError):
            return Proposals(hint=_unreadable(file_of(task, own).name))
    connection.close()
    sent = [fitted_to(case, greeting) for case in cases]
    first, second = ([connection.answer(case) for case in sent] for _ in range(2))
    if not all(map(_is_same, first, second)):
        return Proposals(hint=UNSTEADY)
    tolerance, *_ = TOLERANCES[greeting.precision]
    if task == IK and makes_constant_sweeps(cases, first):
        assert isinstance(first[0], Answer)
        base = Program(source_of(IN_DICTIONARY[methods[0]][0]))
        known = known_fault(base, dictionaries.values(), methods[0], cases[0], first[0], tolerance)
        if known[1] != 1:  # which solves show better
            return Proposals(*known)
    tables = [_table(dictionaries[own], task, own, cases, first) for own in methods]
    is_wrong = any(table.wrong_requests(tolerance).any() for table in tables)
    for bound in TOLERANCES[greeting.precision]:
        if entries := _candidates(tables, bound):
            return Proposals(entries, is_wrong=is_wrong)
    if task in (FK, STEP):
        positions = [table.of_first_outputs(1) for table in tables]
        entries = _candidates(positions, tolerance)
        return Proposals(entries, is_wrong=is_wrong, of_positions=task == FK or bool(entries))
    return Proposals(is_wrong=is_wrong)


def _dictionary(task: str, method: str) -> Dictionary:
    """Return the dictionary of a task and a method; raise ValueError if it is of other requests."""
    dictionary, count = read(file_of(task, method)), len(requests(task, method))
    if dictionary.keys.shape[1] != count:
        raise ValueError(f"expected keys of {count} requests, got {dictionary.keys.shape[1]}")
    return dictionary


class KeyTable(NamedTuple):
    """A dictionary, and the keys of a solver's answers."""

    dictionary: Dictionary
    rows: FloatArray  # (request, output)
    is_solve: Sequence[bool]  # which requests are solves
    rights: Mapping[str, Sequence[FloatArray]]  # the keys of right programs
    output_count: int  # of the first outputs, which are compared
    is_additive: bool  # whether mistakes in two terms change an answer by a sum

    def of_first_outputs(self, count: int) -> "KeyTable":
        """Return the table of the first outputs alone."""
        return self._replace(rows=self.rows[:, :count], output_count=count)

    def wrong_requests(self, tolerance: float) -> BoolArray:
        """Return which requests are answered as no right program answers them."""
        rights = np.array([row for rows in self.rights.values() for row in rows])
        with np.errstate(invalid="ignore"):
            gaps = np.abs(self.rows - rights[:, :, : self.output_count])
            is_other = gaps > tolerance * np.maximum(1.0, np.abs(self.rows))
        return np.asarray(is_other.any(axis=2).all(axis=0))


def _table(
    dictionary: Dictionary,
    task: str,
    method: str,
    cases: Sequence[Case],
    answers: Sequence[Answer | Failure],
) -> KeyTable:
    """Return the keys of a solver's answers, NaN of requests that are not sent."""
    base, all_cases = Program(source_of(IN_DICTIONARY[method or task][0])), requests(task, method)
    names = [case.name for case in all_cases]
    rows = np.full((len(names), len(OUTPUTS[task])), np.nan)
    for case, answer in zip(cases, answers, strict=True):
        rows[names.index(case.name)] = _keys_of(answer, case, base, method)
    solves = list(map(is_solve, all_cases))
    return KeyTable(
        dictionary, rows, solves, right_keys(task, method), len(OUTPUTS[task]), task in OF_SPRINGS
    )


def _candidates(tables: Sequence[KeyTable], tolerance: float) -> list[Entry | ChangePair]:
    """Return the likeliest of the entries that match rows of keys, and sums of two if none does."""
    ranks = [pair for table in tables for pair in _matches(table, tolerance)]
    ranks.sort(key=lambda pair: (pair[0], likelihood(pair[1])))
    entries: list[Entry | ChangePair] = [entry for _, entry in ranks[:MAX_CANDIDATES]]
    if any(not rank for rank, _ in ranks):
        return entries
    return [*(pair for table in tables for pair in two_changes(table, tolerance)), *entries]


def _unreadable(file: str) -> Sentence:
    """Return why all lines are searched where a file is missing, or is no dictionary."""
    return sentence(
        "The dictionary {file} cannot be read: all lines are searched instead, which takes longer "
        "and finds less. Install Plumbob again, or run `make dictionary` in its folder.",
        file=file,
    )


def _is_same(first: Answer | Failure, second: Answer | Failure) -> bool:
    if isinstance(first, Failure) or isinstance(second, Failure):
        return isinstance(first, Failure) and isinstance(second, Failure)
    return difference(first.values, second.values) <= SAME


def _keys_of(answer: Answer | Failure, case: Case, base: Program, method: str) -> FloatArray:
    """Return the keys of an answer, NaN of a failure."""
    if isinstance(answer, Failure):
        return np.full(len(OUTPUTS[case.task]), np.nan)
    outputs = comparable(Exchange(case, answer, answer)).answer
    assert isinstance(outputs, Answer)
    return keys(outputs.values, answer_of(base, method, case), case)


def _matches(table: KeyTable, tolerance: float) -> list[tuple[int, Entry]]:
    """Return the entries with the keys of all answered requests, or (1) of a single wrong one.

    An entry with wrong single sweeps has no keys of solves.
    """
    entries, rows = table.dictionary.entries, table.rows
    keys = table.dictionary.keys[:, :, : table.output_count]
    with np.errstate(invalid="ignore"):
        gaps = np.abs(keys - rows) <= tolerance * np.maximum(1.0, np.abs(rows))
    is_alike = np.all(gaps | ~np.isfinite(rows), axis=2)
    is_wrong = table.wrong_requests(tolerance)
    is_unknown = np.all(np.isnan(keys), axis=2) & table.is_solve
    every, single = np.all(is_alike | is_unknown, axis=1), np.any(is_alike & is_wrong, axis=1)
    numbers = np.flatnonzero((every | single) & is_wrong.any())
    return [(int(not every[i]), entries[i]) for i in numbers]


def two_changes(table: KeyTable, tolerance: float) -> list[ChangePair]:
    """Return the two changes of a program, the likeliest first, that together have all keys.

    Terms of forces add up, and so do keys of mistakes in different terms: what both change is the
    sum of what each changes.
    """
    if not (table.is_additive and table.wrong_requests(tolerance).any()):
        return []
    pairs = list[ChangePair]()
    programs = np.array([entry.program for entry in table.dictionary.entries])
    is_answered = np.isfinite(table.rows)
    goal = table.rows[is_answered]
    for name, rights in table.rights.items():
        numbers = np.flatnonzero(programs == name)
        changes = table.dictionary.keys[numbers][:, :, : table.output_count][:, is_answered]
        right = rights[0][:, : table.output_count][is_answered]
        is_finite = np.isfinite(changes).all(axis=1)
        numbers, changes = numbers[is_finite], changes[is_finite] - right
        for i, j in _summands(changes, goal - right, tolerance):
            first, second = (table.dictionary.entries[numbers[k]] for k in (i, j))
            if max(len(first.codes), len(second.codes)) < 2:  # two codes are two mistakes
                pairs.append(ChangePair(first, second))
    pairs.sort(key=lambda pair: sorted(map(likelihood, pair)))
    return pairs[:MAX_PAIRS]


def _summands(changes: FloatArray, goal: FloatArray, tolerance: float) -> Iterator[tuple[int, int]]:
    """Yield the numbers i < j of rows whose sum is a goal."""
    if not len(goal) or not len(changes):
        return
    weights = fractions(len(goal), 6)
    bounds = tolerance * np.maximum(1.0, np.abs(goal))
    sums, margin = changes @ weights, float(np.abs(weights) @ bounds)
    order = np.argsort(sums)
    needed = goal @ weights - sums
    first = np.searchsorted(sums[order], needed - margin)
    last = np.searchsorted(sums[order], needed + margin)
    for i in np.flatnonzero(first < last).tolist():
        for j in order[first[i] : last[i]].tolist():
            if i < j and (np.abs(changes[i] + changes[j] - goal) <= bounds).all():
                yield i, j
