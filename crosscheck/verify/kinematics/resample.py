"""Resampling a polyline: laws only, since every program has a rule of its own."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import curves
from plumbob.reference.arguments import FloatArray, distinct_texts

from ..case import Case
from ..contestant import Answer, Exchange
from ..greeting import Greeting
from ..judgement import CaseJudgement, Finding, TaskReport, Verdict
from ..sentence import Sentence, sentence
from . import laws, rounding
from .polylines import Line, even_by_count, even_by_spacing
from .report import report
from .resample_faults import diagnosis
from .skeletons import generator

TASK = "resample"
# Points are even if no gap along the line differs from the mean by more than this share: chords
# of a fine polyline are shorter than its arcs by so much.
UNEVEN = 0.02
# By spacing, gaps from a half of it to the whole are as even as a rule that keeps corners allows.
LEAST_GAP = 0.5 - 1e-9


class Scene(NamedTuple):
    """A polyline, where its strokes begin, and whether it is closed."""

    name: str
    about: Sentence
    curve: FloatArray
    strokes: tuple[int, ...] = (0,)
    closed: bool = False


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return polylines to be resampled by count and by spacing, the smallest first."""
    cases_of_scenes = [
        case
        for i in range(5 if thorough else 1)
        for scene in _scenes(generator(seed, f"resample {i}"))
        for case in _cases_of(scene, i + 1)
    ]
    return sorted(cases_of_scenes, key=lambda case: len(case.inputs["curve"]))


def _cases_of(scene: Scene, number: int) -> Iterator[Case]:
    line = Line(scene.curve, scene.strokes, scene.closed)
    count = max(5, len(scene.curve) // 3)
    facts = {"line": line, "size": float(np.abs(scene.curve).max())}
    family = f"{scene.name} {number}"
    for kind, value in (("count", count), ("spacing", line.length / (2.5 * count))):
        inputs = {
            "curve": scene.curve,
            "strokes": np.array(scene.strokes),
            "closed": scene.closed,
            kind: value,
        }
        yield Case(f"{family}, by {kind}", TASK, inputs, family, scene.about, facts=facts)


def _scenes(rng: np.random.Generator) -> list[Scene]:
    corner = np.array([[0.1, 0.0, 0.2], [0.9, 0.0, 0.2], [0.9, 0.0, 0.6]])
    walk = np.cumsum(rng.standard_normal((12, 3)) * rng.uniform(0.05, 0.5, (12, 1)), axis=0)
    return [
        Scene("segment", sentence("A single segment."), rng.uniform(-1.0, 1.0, (2, 3))),
        Scene("corner", sentence("Two segments at a right angle."), corner),
        Scene("uneven walk", sentence("A random walk in space with uneven steps."), walk),
        Scene("closed square", sentence("A square whose end joins its start."),
              curves["square"](4), closed=True),
        Scene("repeated points", sentence("A polyline in which a point comes twice."),
              np.repeat(walk[:5], [1, 2, 1, 3, 1], axis=0)),
        Scene("two strokes", sentence("Two strokes apart: bridged or kept, both are right."),
              np.concatenate([walk[:6], walk[6:] + 1.5]), (0, 6)),
        Scene("plumb bob", sentence("A drawing in five strokes with uneven samples."),
              curves["plumb_bob"](100), tuple(range(0, 100, 20))),
        Scene("heart", sentence("The lab's heart."), curves["heart"](90), closed=True),
    ]  # fmt: skip


def judge(asked: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
    """Hold points against the laws of resampling; strokes may be bridged or kept."""
    judgements = [_judged(one, greeting) for one in asked]
    wrong = [one for one, message in zip(asked, judgements, strict=True) if message.verdict]
    report_of_faults = diagnosis(asked, wrong, greeting, _strokes(asked, greeting))
    return report(TASK, method, judgements, report_of_faults)


def _strokes(asked: Sequence[Exchange], greeting: Greeting) -> Sentence | None:
    """Return whether strokes are bridged or kept, where an answer shows it."""
    for one in asked:
        if len(one.case.inputs["strokes"]) > 1 and isinstance(one.answer, Answer):
            points, line = one.answer.values.get("points"), one.case.facts["line"]
            if points is None or not len(points) or not np.isfinite(points).all():
                continue
            if _distances(points, line, False).max() > _bound(one.case, greeting):
                return sentence("It bridges strokes: points lie between them as well.")
            return sentence("It keeps strokes apart: no points lie between them.")
    return None


def _bound(case: Case, greeting: Greeting) -> float:
    """Return what rounding allows: arc lengths add up over all points [m]."""
    size = len(case.inputs["curve"]) * case.facts["size"] + case.facts["line"].length
    return float(rounding.ROUNDINGS_A_JOINT * greeting.epsilon * size)


def _distances(points: FloatArray, line: Line, bridged: bool) -> FloatArray:
    return np.array([line.nearest(point, bridged)[0] for point in points])


def _judged(one: Exchange, greeting: Greeting) -> CaseJudgement:
    inputs, line = one.case.inputs, one.case.facts["line"]
    if "count" in inputs:
        reference = partial(even_by_count, line, inputs["count"], True)
    else:
        reference = partial(even_by_spacing, line, inputs["spacing"], True)
    return laws.judged(one, greeting, partial(_findings, one.case, greeting), reference)


def _findings(case: Case, greeting: Greeting, values: Mapping[str, Any]) -> list[Finding]:
    points = values.get("points")
    if points is None or not len(points):
        return [laws.missing(sentence("The answer has no points."))]
    if not np.isfinite(points).all():
        return [laws.missing(sentence("A point is not a number."))]
    return point_laws(points, case, greeting)


def point_laws(points: FloatArray, case: Case, greeting: Greeting) -> list[Finding]:
    """Return whether points are on the line, in order, evenly spaced and as many as asked for."""
    line, bound = case.facts["line"], _bound(case, greeting)
    distances = _distances(points, line, True)
    findings = [_on_line(points, distances, line, bound), _ends(points, case, bound)]
    if "count" in case.inputs:
        findings.append(_count(points, case))
    if distances.max() <= bound:
        at = line.parameters(points, bound)
        findings += [_order(at, line, bound), _gaps(points, at, case, bound)]
        if case.inputs["closed"] and len(points) > 1:
            findings.append(_closing(points, at, line, bound))
    return findings


def _on_line(points: FloatArray, distances: FloatArray, line: Line, bound: float) -> Finding:
    """Return whether points are on the line, or between two of its points."""
    is_cut = all(line.is_on_chord(points[i], bound) for i in np.flatnonzero(distances > bound))
    message = sentence(
        "Points between given ones are left out, so that corners are cut by {error:.2g} m."
        if is_cut
        else "Point {index} is {error:.2g} m off the polyline.",
        index=int(np.argmax(distances)),
    )
    verdict = Verdict.RIGHT_BUT if is_cut else Verdict.WRONG
    return laws.bounded("on the line", distances.max(), bound, "m", message, verdict=verdict)


def _ends(points: FloatArray, case: Case, bound: float) -> Finding:
    curve = case.inputs["curve"]
    error = float(np.linalg.norm(points[0] - curve[0]))
    if not case.inputs["closed"]:
        error = max(error, float(np.linalg.norm(points[-1] - curve[-1])))
    message = sentence(
        "The curve's ends are not kept: the answer starts or ends {error:.2g} m from them."
    )
    return laws.bounded("ends", error, bound, "m", message)


def _count(points: FloatArray, case: Case) -> Finding:
    asked, came = case.inputs["count"], len(points)
    message = sentence("It was asked for {asked} points and gives {came}.", asked=asked, came=came)
    repeated = case.inputs["closed"] and came == asked + 1
    verdict = Verdict.RIGHT_BUT if repeated else Verdict.WRONG
    return laws.bounded("count", abs(came - asked), 0.0, "", message, verdict=verdict)


def _order(at: FloatArray, line: Line, bound: float) -> Finding:
    back = float(np.max(-np.diff(at), initial=0.0))
    message = sentence("The points go back along the curve, by {error:.2g} m.")
    return laws.bounded("order", back, 2.0 * bound, "m", message)


def _gaps(points: FloatArray, at: FloatArray, case: Case, bound: float) -> Finding:
    """Return whether gaps are even, along the line with its bridges or without, or by chords."""
    line = case.facts["line"]
    kinds = [
        np.diff(at), np.diff(line.without_bridges(at)),
        np.linalg.norm(np.diff(points, axis=0), axis=-1),
    ]  # fmt: skip
    if "count" in case.inputs:
        error = min(_spread(gaps) for gaps in kinds)
        message = sentence(
            "The points are not evenly spaced: a gap differs from the mean by {error:.0%}."
        )
        verdict = Verdict.RIGHT_BUT if len(case.inputs["strokes"]) > 1 else Verdict.WRONG
        tolerance = UNEVEN + 4.0 * bound / max(float(kinds[2].mean()), bound)
        return laws.bounded("spacing", error, tolerance, "", message, verdict=verdict)
    return _widest(kinds, case, bound)


def _closing(points: FloatArray, at: FloatArray, line: Line, bound: float) -> Finding:
    """Return whether the gap that closes the curve is no wider than the others."""
    back = float(np.linalg.norm(points[-1] - points[0])) > bound
    gap = line.length - float(at[-1]) if back else 0.0
    widest = float(np.diff(at).max()) * (1.0 + UNEVEN)
    side, others = distinct_texts(gap, widest, 3)
    message = sentence(
        "The side that closes the curve is left out: from the last point to the start it is "
        "{gap} m, between others at most {widest} m.",
        gap=side,
        widest=others,
    )
    return laws.bounded("closing side", gap, widest + 2.0 * bound, "m", message)


def _spread(gaps: FloatArray) -> float:
    mean = float(gaps.mean()) if len(gaps) else 0.0
    return float(np.abs(gaps / mean - 1.0).max()) if mean > 0.0 else 0.0


def _widest(kinds: Sequence[FloatArray], case: Case, bound: float) -> Finding:
    """Return whether no gap within a stroke is wider than asked for, and few are much narrower."""
    spacing, line = case.inputs["spacing"], case.facts["line"]
    bridges = len(line.strokes) - 1
    wide = min(float(np.sort(gaps)[: len(gaps) - bridges].max(initial=0.0)) for gaps in kinds)
    if wide > spacing * (1.0 + 1e-6) + 2.0 * bound:
        gap, limit = distinct_texts(wide, spacing, 3)
        message = sentence(
            "Neighbouring points are {gap} m apart, more than the {spacing} m asked for.",
            gap=gap,
            spacing=limit,
        )
        return Finding("spacing", Verdict.WRONG, wide, spacing, "m", message)
    if len(kinds[2]) > 4.0 * line.length / spacing + 1.0 + bridges + len(case.inputs["curve"]):
        narrow = int((kinds[2] < LEAST_GAP * spacing - 2.0 * bound).sum())
        message = sentence(
            "{narrow} gaps are narrower than half the spacing: the points are uneven.",
            narrow=narrow,
        )
        return Finding("spacing", Verdict.RIGHT_BUT, narrow, 0.0, "", message)
    return Finding("spacing", Verdict.RIGHT, wide, spacing, "m", laws.HOLDS)
