"""Look up the changes of right programs with a solver's answers to a few requests."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..exchange import Answer, Connection, Exchange, Failure
from ..fault_programs import IN_DICTIONARY, source_of
from ..gaps import difference
from ..greeting import Greeting
from ..one_line.mutants import Program
from ..one_line.right_programs import answer_of, comparable
from .constant_sweeps import known_fault, makes_constant_sweeps
from .entry import Dictionary, Entry, file_of, likelihood, read
from .requests import FK, IK, OUTPUTS, TASKS, is_solve, keys, requests, suitable

# Keys differ by ten times the rounding of an answer. Single precision loses three digits more, and
# a fourth where a mistake enlarges rounding; the fourth is tried where nothing is nearer.
TOLERANCES = {"double": (1e-6,), "single": (1e-4, 1e-3)}
# Answers to equal requests differ by less, except by threads with another order of sums.
SAME = 1e-6
# The most candidates, which all cases have to decide between.
MAX_CANDIDATES = 200
UNSTEADY = sentence(
    "Equal requests got different answers, also after a new start: no changed line is looked up."
)


class Proposals(NamedTuple):
    """What a look-up proposes."""

    entries: Sequence[Entry] = ()  # the likeliest first
    sweeps: int | None = None  # that are made whatever is asked
    is_wrong: bool = True  # whether the solver answers a request otherwise than right programs
    of_positions: bool = False  # whether positions alone are alike: rotations of no matrix are any
    hint: Sentence | None = None  # why nothing is looked up, or that no file can be read


def look_up(connection: Connection, task: str, method: str, greeting: Greeting) -> Proposals | None:
    """Return the changes with the answers of a new process of a solver, None without a dictionary.

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
    first, second = ([connection.answer(case) for case in cases] for _ in range(2))
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
    is_wrong = any(np.nanmax(np.abs(rows), initial=0.0) > tolerance for _, rows, _ in tables)
    for bound in TOLERANCES[greeting.precision]:
        if entries := _candidates(tables, bound):
            return Proposals(entries, is_wrong=is_wrong)
    if task == FK:
        positions = [(dictionary, rows[:, :1], solves) for dictionary, rows, solves in tables]
        return Proposals(_candidates(positions, tolerance), is_wrong=is_wrong, of_positions=True)
    return Proposals(is_wrong=is_wrong)


def _dictionary(task: str, method: str) -> Dictionary:
    """Return the dictionary of a task and a method; raise ValueError of other requests."""
    dictionary, count = read(file_of(task, method)), len(requests(task, method))
    if dictionary.keys.shape[1] != count:
        raise ValueError(f"expected keys of {count} requests, got {dictionary.keys.shape[1]}")
    return dictionary


# A dictionary, the keys of a solver's answers (request, output), and which requests are solves.
Table = tuple[Dictionary, FloatArray, list[bool]]


def _table(
    dictionary: Dictionary,
    task: str,
    method: str,
    cases: Sequence[Case],
    answers: Sequence[Answer | Failure],
) -> Table:
    """Return the keys of a solver's answers, NaN of unsent requests."""
    base, all_cases = Program(source_of(IN_DICTIONARY[method or task][0])), requests(task, method)
    names = [case.name for case in all_cases]
    rows = np.full((len(names), len(OUTPUTS[task])), np.nan)
    for case, answer in zip(cases, answers, strict=True):
        rows[names.index(case.name)] = _keys_of(answer, case, base, method)
    return dictionary, rows, list(map(is_solve, all_cases))


def _candidates(tables: Sequence[Table], tolerance: float) -> list[Entry]:
    """Return the likeliest entries with the keys of rows."""
    ranks = [pair for table in tables for pair in _matches(*table, tolerance)]
    ranks.sort(key=lambda pair: (pair[0], likelihood(pair[1])))
    return [entry for _, entry in ranks[:MAX_CANDIDATES]]


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


def _matches(
    dictionary: Dictionary, rows: FloatArray, is_solve: Sequence[bool], tolerance: float
) -> list[tuple[int, Entry]]:
    """Return the entries with the keys of all answered requests, or (1) of a single wrong answer.

    The rows have the keys of all outputs or of the first outputs. An entry with wrong single sweeps
    has no keys of solves.
    """
    keys = dictionary.keys[:, :, : rows.shape[1]]
    answered = np.isfinite(rows)
    with np.errstate(invalid="ignore"):
        gaps = np.abs(keys - rows) <= tolerance * np.maximum(1.0, np.abs(rows))
        is_wrong = np.any(np.abs(rows) > tolerance, axis=1)
    is_alike = np.all(gaps | ~answered, axis=2)
    is_unknown = np.all(np.isnan(keys), axis=2) & is_solve
    every, single = np.all(is_alike | is_unknown, axis=1), np.any(is_alike & is_wrong, axis=1)
    numbers = np.flatnonzero((every | single) & is_wrong.any())
    return [(int(not every[i]), dictionary.entries[i]) for i in numbers]
