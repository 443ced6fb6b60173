"""The known faults of a solver with a constant number of sweeps for any request."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from ..case import Case
from ..exchange import Answer, Exchange, Failure
from ..gaps import difference
from ..one_line.mutants import Program
from ..one_line.right_programs import answer_of, comparable
from .entry import Dictionary, Entry, likelihood

# The largest number of tried sweeps: most constants are smaller, or enough for poses to stay.
MAX_SWEEPS = 30
# More passes through loops than a sweep of a small skeleton needs.
PASSES = 100
# Poses with a smaller change by a further sweep stay.
STAYING = 1e-12
# Answers of equal sweeps differ by less, in single precision too.
SAME = 1e-6


def makes_constant_sweeps(cases: Sequence[Case], answers: Sequence[Answer | Failure]) -> bool:
    """Return whether the first request has the answer of a request for more sweeps."""
    case, answer = cases[0], answers[0]
    return any(
        np.array_equal(other.inputs["target"], case.inputs["target"])
        and isinstance(answer, Answer)
        and not np.allclose(answer.values["local_rotations"], case.inputs["local_rotations"])
        and isinstance(other_answer, Answer)
        and difference(answer.values, other_answer.values) <= SAME
        for other, other_answer in zip(cases[1:], answers[1:], strict=True)
    )


def known_fault(
    base: Program, dictionaries: Iterable[Dictionary], method: str, case: Case, answer: Answer,
    tolerance: float,
) -> tuple[list[Entry], int | None]:  # fmt: skip
    """Return the known fault with a request's answer after some sweeps, and their number.

    There is none if the right program does.
    """
    outputs = comparable(Exchange(case, answer, answer))
    count = _sweeps(base, method, outputs, tolerance)
    for entry in known(dictionaries) if count is None else ():
        with suppress(SyntaxError, ValueError):
            count = _sweeps(entry.changed_program(), method, outputs, tolerance)
            if count is not None:
                return [entry], count
    return [], count


def known(dictionaries: Iterable[Dictionary]) -> list[Entry]:
    """Return each single known fault, in the first of its programs."""
    first = dict[tuple[str, ...], Entry]()
    for entry in (entry for dictionary in dictionaries for entry in dictionary.entries):
        if len(entry.codes) == 1:
            first.setdefault(entry.codes, entry)
    return sorted(first.values(), key=likelihood)


def _sweeps(program: Program, method: str, exchange: Exchange, tolerance: float) -> int | None:
    """Return after how many sweeps a program has an answer, or None."""
    case = exchange.case
    assert isinstance(exchange.answer, Answer)
    for count in range(1, MAX_SWEEPS + 1):
        values: Mapping[str, Any] = {}
        with suppress(Exception), program.within(PASSES):  # of a changed program any may come
            values = answer_of(program, method, case)
        if difference(values, exchange.answer.values) <= tolerance:
            return count
        pose = values.get("local_rotations")
        if pose is None or abs(pose - case.inputs["local_rotations"]).max() <= STAYING:
            return None
        case = replace(case, inputs={**case.inputs, "local_rotations": pose})
    return None
