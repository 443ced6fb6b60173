"""Compute a dictionary: every known fault and changed line of the right programs of a task."""

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..case import Case
from ..fault_programs import IN_DICTIONARY, changes_of, source_of
from ..one_line.mutants import ENTRIES, Program
from ..one_line.right_programs import answer_of, faults_in
from .entry import Dictionary, Entry, likelihood
from .requests import FK, LARGEST, OUTPUTS, STEP, fractions, is_solve, keys, requests
from .rights import right_keys

# Differences of keys above this tell answers apart, the shortest distance of a look-up.
DISTINCT = 1e-6
# A change whose keys move by more than the second number when inputs move by the first, relative,
# is left out: rounding would decide what it answers.
NUDGE, MOVED = 1e-14, 1e-9
# The most entries with equal keys that are kept, the likeliest ones.
EQUAL = 3
# The functions whose changes are tried in each program: they do other things to other forms.
# Programs of these have conventions or choices of their own: all functions are changed in each.
ALL_FUNCTIONS = (FK, STEP)
IN_FORMS = {"conjugate", "cross", "product", "product_of_vectors", "by_cross", "by_product"}


def digest(task: str, method: str) -> str:
    """Return a digest of the programs, the lines of faults and the requests."""
    names = IN_DICTIONARY[method or task]
    parts: list[Any] = [(name, source_of(name)) for name in names]
    parts += [fault.lines for name in names for fault in faults_in(source_of(name), task, method)]
    parts += [change.source for name in names for change in changes_of(name)]
    parts += [[np.ravel(v).tolist() for v in c.inputs.values()] for c in requests(task, method)]
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


# The likeliest changes with equal keys, by these keys as bytes.
Classes = dict[bytes, list[tuple[Entry, FloatArray]]]


def program_groups(task: str, method: str) -> list[Sequence[str]]:
    """Return the names of a dictionary's programs in parts that can be computed beside each other.

    Programs that share functions, which are changed once, are in one part.
    """
    names = IN_DICTIONARY[method or task]
    return [[name] for name in names] if task in ALL_FUNCTIONS else [names]


@np.errstate(all="ignore")  # changed programs divide by zero
def classes_of(
    task: str, method: str, names: Sequence[str], notify: Callable[[str], None] = lambda text: None
) -> Classes:
    """Return the changes of some programs."""
    cases, base = requests(task, method), Program(source_of(IN_DICTIONARY[method or task][0]))
    right = [answer_of(base, method, case) for case in cases]
    own = [keys for rows in right_keys(task, method).values() for keys in rows]
    classes, functions = Classes(), set[str]()
    for name in names:
        program = Program(source_of(name))
        for entry, run in _changes(name, program, cases, method, functions):
            row = _row(run, cases, right, entry.function in ("", *ENTRIES))
            if row is None or any(_is_equal(row, keys) for keys in own):
                continue
            key = (np.round(row / DISTINCT) + 0.0).tobytes()
            if key in classes or _is_stable(run, cases, right, row):
                _add(classes.setdefault(key, []), entry, row, program)
        notify(f"{name}: {len(classes)} answers")
    return classes


def joined(task: str, method: str, parts: Sequence[Classes]) -> Dictionary:
    """Return the dictionary of a task and a method."""
    classes = Classes()
    for key, equal in (item for part in parts for item in part.items()):
        others = classes.get(key, [])
        count = sum(pairs[0][0].equal_count for pairs in (equal, others) if pairs)
        pairs = sorted([*others, *equal], key=lambda pair: likelihood(pair[0]))[:EQUAL]
        classes[key] = [(entry._replace(equal_count=count), row) for entry, row in pairs]
    rows = sorted(
        (pair for equal in classes.values() for pair in equal),
        key=lambda pair: tuple(np.nan_to_num(pair[1].ravel(), nan=LARGEST)),
    )
    entries = [entry for entry, _ in rows]
    return Dictionary(digest(task, method), entries, np.array([row for _, row in rows]))


def _add(
    equal: list[tuple[Entry, FloatArray]], entry: Entry, row: FloatArray, program: Program
) -> None:
    """Add a change of a program to those that answer alike, the likeliest of which remain."""
    count = (equal[0][0].equal_count if equal else 0) + (len(entry.codes) < 2)
    is_likely = len(equal) < EQUAL or likelihood(entry) < likelihood(equal[-1][0])
    if is_likely and all(entry[:6] != other[:6] for other, _ in equal):
        is_text = bool(entry.text or entry.codes)
        text = entry.text if is_text else program.text_of(entry.function)
        equal.append((entry._replace(text=text), row))
    equal.sort(key=lambda pair: likelihood(pair[0]))
    equal[:] = [(other._replace(equal_count=count), row) for other, row in equal[:EQUAL]]


Run = Callable[[Case], Mapping[str, Any]]


def _changes(
    name: str, program: Program, cases: Sequence[Case], method: str, functions: set[str]
) -> Iterator[tuple[Entry, Run]]:
    """Yield the changes of a program with their answers: while it has them, and no longer."""
    passes, answer = {}, partial(answer_of, program, method)
    for case in cases:
        _, passes[case.name] = program.count_passes(partial(answer, case))
    for codes in _codes(name, cases[0].task, method):
        entry = Entry(name, codes)
        with suppress(SyntaxError, ValueError):
            yield entry, partial(_within, entry.changed_program(), passes, method)
    for change in changes_of(name):
        wrong = Program(change.source)
        text = wrong.text_of(change.function)
        entry = Entry(name, (), change.kind, change.function, change.right, change.wrong, text)
        yield entry, partial(_within, wrong, passes, method)
    program.observe(lambda: [answer(case) for case in cases if not is_solve(case)])
    if cases[0].task in ALL_FUNCTIONS:
        functions.clear()
    functions -= {program.text_of(f) for f in IN_FORMS & program.names.keys()}
    for mutant in program.mutants(functions):

        def run(case: Case, mutant: Any = mutant) -> Mapping[str, Any]:
            with program.changed(mutant, passes[case.name]):
                return answer(case)

        yield Entry(name, (), mutant.kind, mutant.function, mutant.right, mutant.wrong), run


def _codes(name: str, task: str, method: str) -> Iterator[tuple[str, ...]]:
    """Yield the known faults of a program; of the first one also two at once."""
    codes = [fault.code for fault in faults_in(source_of(name), task, method)]
    yield from ((code,) for code in codes)
    if name == IN_DICTIONARY[method or task][0]:
        yield from combinations(codes, 2)


def _within(
    program: Program, passes: Mapping[str, int], method: str, case: Case
) -> Mapping[str, Any]:
    with program.within(passes[case.name]):
        return answer_of(program, method, case)


def _row(
    run: Run, cases: Sequence[Case], right: Sequence[Mapping[str, Any]], with_solves: bool = True
) -> FloatArray | None:
    """Return the keys of all answers; None if all are right, or none has numbers.

    Solves are asked of a change whose single sweeps are right: the keys of others are NaN.
    """
    row = np.full((len(cases), len(OUTPUTS[cases[0].task])), np.nan)
    for i, case in enumerate(cases):
        if is_solve(case) and (_is_wrong(row) or not with_solves):
            continue
        with suppress(Exception):  # of a changed program any may come
            row[i] = keys(run(case), right[i], case)
    return row if _is_wrong(row) else None


def _is_equal(row: FloatArray, right: FloatArray) -> bool:
    """Return whether keys are those of a right program, as far as there are any."""
    return bool(np.nanmax(np.abs(row - right), initial=0.0) <= DISTINCT)


def _is_wrong(row: FloatArray) -> bool:
    return bool(np.nanmax(np.abs(row), initial=0.0) > DISTINCT)


def _is_stable(
    run: Run, cases: Sequence[Case], right: Sequence[Mapping[str, Any]], row: FloatArray
) -> bool:
    """Return whether the first wrong answer moves little when the inputs move a little."""
    i = int(np.argmax(np.nanmax(np.abs(row), axis=1, initial=0.0) > DISTINCT))
    case = replace(cases[i], inputs=dict(map(_nudged, cases[i].inputs.items())))
    with suppress(Exception):
        moved = np.abs(keys(run(case), right[i], case) - row[i])
        return bool(np.nanmax(moved, initial=0.0) <= MOVED)
    return False


def _nudged(item: tuple[str, Any]) -> tuple[str, Any]:
    """Return an input, the numbers of an array moved by `NUDGE`, each otherwise."""
    name, value = item
    if not isinstance(value, np.ndarray) or value.dtype.kind != "f":
        return item
    return name, value * (1.0 + NUDGE * fractions(value.size, 9).reshape(value.shape))
