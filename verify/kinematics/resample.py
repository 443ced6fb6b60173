"""Resampling a polyline: laws, since every program has its own rule."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import curves
from plumbob.reference.arguments import FloatArray, distinct_texts
from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..exchange import Exchange
from ..greeting import Greeting
from ..judgement import Finding, TaskReport, Verdict
from ..laws import finding, judge_case
from . import rounding
from .polylines import Polyline
from .report import report
from .skeletons import generator

TASK = "resample"
# Points are even if no gap along the line differs from the mean by more than this share. Chords of
# a fine polyline are shorter than its arcs by as much.
UNEVEN = 0.02
# Gaps from half the spacing to the whole are even, as for rules with kept corners.
MIN_GAP = 0.5 - 1e-9


class Curve(NamedTuple):
    """A polyline to resample."""

    name: str
    about: Sentence
    points: FloatArray  # (point, 3) [m]
    strokes: tuple[int, ...] = (0,)  # index of the first point of each
    closed: bool = False


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return polylines to be resampled by count and by spacing, the smallest first."""
    unsorted = [
        case
        for i in range(5 if thorough else 1)
        for curve in _curves(generator(seed, f"resample {i}"))
        for case in _cases_of(curve, i + 1)
        if greeting.resample_by == "any" or greeting.resample_by in case.inputs
    ]
    return sorted(unsorted, key=lambda case: len(case.inputs["curve"]))


def _cases_of(curve: Curve, number: int) -> Iterator[Case]:
    line = Polyline(curve.points, curve.strokes, curve.closed)
    count = max(5, len(curve.points) // 3)
    facts = {"line": line, "size": float(np.abs(curve.points).max())}
    family = f"{curve.name} {number}"
    shared = {"curve": curve.points, "strokes": np.array(curve.strokes), "closed": curve.closed}
    pieces = 2.5 * count + 0.2  # of which rounding down, up and to the nearest differ
    for rule in ({"count": count}, {"spacing": line.length / pieces}):
        name = f"{family}, by {next(iter(rule))}"
        yield Case(name, TASK, {**shared, **rule}, family, curve.about, facts=facts)


def _curves(rng: np.random.Generator) -> list[Curve]:
    corner = np.array([[0.1, 0.0, 0.2], [0.9, 0.0, 0.2], [0.9, 0.0, 0.6]])
    walk = np.cumsum(rng.standard_normal((12, 3)) * rng.uniform(0.05, 0.5, (12, 1)), axis=0)
    return [
        Curve("segment", sentence("A single segment."), rng.uniform(-1.0, 1.0, (2, 3))),
        Curve("corner", sentence("Two segments at a right angle."), corner),
        Curve("uneven walk", sentence("A random walk in space with uneven steps."), walk),
        Curve("closed square", sentence("A square whose end joins its start."),
              curves["square"](4), closed=True),
        Curve("repeated points", sentence("A polyline in which a point comes twice."),
              np.repeat(walk[:5], [1, 2, 1, 3, 1], axis=0)),
        Curve("two strokes", sentence("Two separate strokes: bridging the gap and leaving it "
                                      "are both right."),
              np.concatenate([walk[:6], walk[6:] + 1.5]), (0, 6)),
        Curve("plumb bob", sentence("A drawing in five strokes with uneven samples."),
              curves["plumb_bob"](100), tuple(range(0, 100, 20))),
        Curve("heart", sentence("The lab's heart."), curves["heart"](90), closed=True),
    ]  # fmt: skip


def judge(
    exchanges: Sequence[Exchange],
    greeting: Greeting,
    method: str,
) -> TaskReport:
    """Judge points by the laws of resampling; strokes may be bridged or not."""
    judgements = [
        judge_case(
            exchange, partial(_findings, exchange.case, greeting),
            rounding.repeats(greeting.epsilon, exchange.case.facts["size"]),
            partial(_even_points, exchange.case),
        )
        for exchange in exchanges
    ]  # fmt: skip
    return report(TASK, method, judgements)


def _even_points(case: Case) -> FloatArray:
    """Return the right points along a line and its bridges, (point, 3) [m]."""
    inputs, closed = case.inputs, bool(case.inputs["closed"])
    line = Polyline(inputs["curve"], tuple(inputs["strokes"]), closed)
    count = inputs["count"] if "count" in inputs else line.count(inputs["spacing"], closed)
    return line.even_points(count, closed)


def _bound(case: Case, greeting: Greeting) -> float:
    """Return what rounding allows: arc lengths add up over all points [m]."""
    size = len(case.inputs["curve"]) * case.facts["size"] + case.facts["line"].length
    return float(rounding.ROUNDINGS_A_JOINT * greeting.epsilon * size)


def _findings(case: Case, greeting: Greeting, outputs: Mapping[str, Any]) -> list[Finding]:
    points = outputs.get("points")
    if points is None or not len(points):
        return [finding("numbers, no points")]
    if not np.isfinite(points).all():
        return [finding("numbers, of a point")]
    return point_laws(points, case, greeting)


def point_laws(points: FloatArray, case: Case, greeting: Greeting) -> list[Finding]:
    """Return whether points are on the line, ordered, evenly spaced and of the requested count.

    A closed line may be walked either way round.
    """
    findings = _point_laws(points, case, greeting)
    if case.inputs["closed"] and any(entry.verdict >= Verdict.WRONG for entry in findings):
        backwards = _point_laws(np.roll(points[::-1], 1, axis=0), case, greeting)
        if all(entry.verdict < Verdict.WRONG for entry in backwards):
            return backwards
    return findings


def _point_laws(points: FloatArray, case: Case, greeting: Greeting) -> list[Finding]:
    line, bound, inputs = case.facts["line"], _bound(case, greeting), case.inputs
    distances = np.array([line.distance(point) for point in points])
    is_cut = all(line.is_on_chord(points[i], bound) for i in np.flatnonzero(distances > bound))
    key, index = "on the line, corners cut" if is_cut else "on the line", int(np.argmax(distances))
    findings = [
        finding(key, distances[index], bound, index=index),
        _ends(points, case, bound),
    ]
    if "count" in inputs:
        excess = len(points) - inputs["count"]
        is_start_repeated = inputs["closed"] and excess == 1
        findings.append(finding(
            "count", abs(excess), asked=inputs["count"], came=len(points),
            verdict=Verdict.RIGHT_EXCEPT if is_start_repeated else None,
        ))  # fmt: skip
    if distances.max() <= bound:
        arc = line.arc_lengths(points, bound)
        step_back = float(np.max(-np.diff(arc), initial=0.0))
        findings.append(finding("order", step_back, 2.0 * bound))
        findings.append(_gaps(points, arc, case, bound))
        if inputs["closed"] and len(points) > 1:
            findings.append(_closing(points, arc, line, bound))
    return findings


def _ends(points: FloatArray, case: Case, bound: float) -> Finding:
    errors = np.linalg.norm(points[[0, -1]] - case.inputs["curve"][[0, -1]], axis=-1)
    return finding("ends", errors[: 1 if case.inputs["closed"] else 2].max(), bound)


def _gaps(points: FloatArray, arc: FloatArray, case: Case, bound: float) -> Finding:
    """Return whether gaps are even along the line, with its bridges or without, or by chords."""
    measures = [
        np.diff(arc), np.diff(case.facts["line"].without_bridges(arc)),
        np.linalg.norm(np.diff(points, axis=0), axis=-1),
    ]  # fmt: skip
    if "count" not in case.inputs:
        return _gaps_by_spacing(measures, case, bound)
    error = min(_spread(gaps) for gaps in measures)
    verdict = Verdict.RIGHT_EXCEPT if len(case.inputs["strokes"]) > 1 else None
    mean = float(measures[2].sum()) / max(1, len(measures[2]))
    tolerance = UNEVEN + 4.0 * bound / max(mean, bound)
    return finding("spacing", error, tolerance, verdict=verdict)


def _spread(gaps: FloatArray) -> float:
    mean = float(gaps.mean()) if len(gaps) else 0.0
    return float(np.abs(gaps / mean - 1.0).max()) if mean > 0.0 else 0.0


def _gaps_by_spacing(measures: Sequence[FloatArray], case: Case, bound: float) -> Finding:
    """Return whether gaps within strokes keep to the requested spacing, and few are much less."""
    spacing, line, chords = case.inputs["spacing"], case.facts["line"], measures[2]
    bridges = len(line.strokes) - 1
    widest = min(float(np.sort(gaps)[: len(gaps) - bridges].max(initial=0.0)) for gaps in measures)
    if widest > spacing * (1.0 + 1e-6) + 2.0 * bound:
        gap, limit = distinct_texts(widest, spacing, 3)
        return finding("spacing, wide", widest, spacing, gap=gap, spacing=limit)
    narrow = 0
    if len(chords) > 4.0 * line.length / spacing + 1.0 + bridges + len(case.inputs["curve"]):
        narrow = int((chords < MIN_GAP * spacing - 2.0 * bound).sum())
    return finding("spacing, narrow", narrow, narrow=narrow)


def _closing(points: FloatArray, arc: FloatArray, line: Polyline, bound: float) -> Finding:
    """Return whether the gap that closes the curve is no wider than the others."""
    is_open = float(np.linalg.norm(points[-1] - points[0])) > bound
    gap = line.length - float(arc[-1]) if is_open else 0.0
    widest = float(np.diff(arc).max()) * (1.0 + UNEVEN)
    gap_text, limit = distinct_texts(gap, widest, 3)
    return finding("closing side", gap, widest + 2.0 * bound, gap=gap_text, widest=limit)
