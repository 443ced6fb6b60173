"""Faults of resampling, as whole answers: most programs' rules are their own, and right."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..case import Case
from ..contestant import Answer, Exchange
from ..explain import Variant, explain
from ..greeting import Greeting
from ..judgement import Diagnosis
from ..sentence import Sentence, sentence
from .polylines import Line, even_by_count


def _count(case: Case) -> int:
    """Return how many points there are to be."""
    inputs, line = case.inputs, case.facts["line"]
    if "count" in inputs:
        return int(inputs["count"])
    pieces = max(1, int(np.ceil(line.length / inputs["spacing"] - 1e-9)))
    return pieces if inputs["closed"] else pieces + 1


def _even(
    case: Case, line: Line | None = None, *, more: int = 0, closed: bool | None = None
) -> FloatArray:
    """Return evenly spaced points, by default the right ones."""
    closed = bool(case.inputs["closed"]) if closed is None else closed
    return even_by_count(line or case.facts["line"], _count(case) + more, closed)


def _by_index(case: Case) -> FloatArray:
    """Space points by the number of samples instead of the length along the curve."""
    points, closed = case.facts["line"].points, bool(case.inputs["closed"])
    at = np.linspace(0.0, len(points) - 1.0, _count(case), endpoint=not closed)
    return np.stack([np.interp(at, np.arange(len(points)), x) for x in points.T], axis=-1)


def _left_open(case: Case) -> FloatArray:
    """Forget the segment from the end of a closed curve to its start."""
    if not case.inputs["closed"]:
        return _even(case)
    line = Line(case.inputs["curve"], case.facts["line"].strokes, False)
    return _even(case, line, closed=False)


def _samples_before(case: Case) -> FloatArray:
    """Take the samples at or before the even lengths, without interpolating between them."""
    line, closed = case.facts["line"], bool(case.inputs["closed"])
    at = np.linspace(0.0, line.length, _count(case), endpoint=not closed)
    last = np.searchsorted(line.at, at, side="right") - 1
    return line.points[np.minimum(last, len(line.points) - 1)]


FAULTS: dict[str, tuple[Callable[[Case], FloatArray], Sentence]] = {
    "by index": (_by_index, sentence(
        "Points are spaced by the number of samples, not by the length along the curve: they are "
        "as uneven as the samples. Add up the lengths of the segments and divide those.")),
    "end left out": (partial(_even, closed=True), sentence(
        "The last point is left out on open curves: divide the length by count - 1, so that the "
        "end is kept.")),
    "one point less": (partial(_even, more=-1), sentence(
        "There is one point less than asked for: the loop ends too early.")),
    "one point more": (partial(_even, more=1), sentence(
        "There is one point more than asked for: count points, not gaps.")),
    "left open": (_left_open, sentence(
        "The segment from the end of a closed curve back to its start is missing.")),
    "reversed": (lambda case: _even(case)[::-1], sentence(
        "The points come in the reverse order of the curve.")),
    "samples only": (_samples_before, sentence(
        "Points are taken from the samples. Interpolate between two samples where the even length "
        "falls between them.")),
}  # fmt: skip


def _predict(make: Callable[[Case], FloatArray], case: Case) -> Mapping[str, Any]:
    return {"points": make(case)}


def diagnosis(
    asked: Sequence[Exchange],
    wrong: Sequence[Exchange],
    greeting: Greeting,
    behaviour: Sentence | None,
) -> Diagnosis:
    """Return the faults that reproduce the answers."""
    if not any(isinstance(one.answer, Answer) for one in wrong):
        return Diagnosis(behaviour=behaviour)
    variants = [Variant((), partial(_predict, _even))]
    variants += [Variant((key,), partial(_predict, make)) for key, (make, _) in FAULTS.items()]
    compared = [*wrong, *(one for one in asked if one not in wrong)]
    explanations, tried = explain(variants, compared, partial(_likeness, greeting), _describe)
    named = tuple(one for one in explanations if one.faults != ("",))
    return Diagnosis(named, behaviour, variant_count=tried)


def _likeness(greeting: Greeting, case: Case) -> float:
    return max(1e-9, 64.0 * greeting.epsilon * len(case.inputs["curve"]))


def _describe(keys: Sequence[str]) -> Sentence:
    if keys[0] not in FAULTS:
        return sentence("It does what the textbook does.")
    return FAULTS[keys[0]][1]
