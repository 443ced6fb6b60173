"""Resampling a polyline: laws only, since every program has a rule of its own."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import curves
from plumbob.reference.arguments import FloatArray, distinct_texts

from ..case import Case
from ..contestant import Answer, Asked
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Finding, TaskReport, Verdict
from ..sentence import Sentence, sentence
from ..timing import timed
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
    found = []
    for i in range(5 if thorough else 1):
        for scene in _scenes(generator(seed, f"resample {i}"), i):
            line = Line(scene.curve, scene.strokes, scene.closed)
            count = max(5, len(scene.curve) // 3)
            spacing = line.length / (2.5 * count)
            for kind, value in (("count", count), ("spacing", spacing)):
                found.append(_case(scene, line, kind, value))
    return sorted(found, key=lambda case: len(case.inputs["curve"]))


def _case(scene: Scene, line: Line, kind: str, value: float) -> Case:
    inputs = {
        "curve": scene.curve,
        "strokes": np.array(scene.strokes),
        "closed": scene.closed,
        kind: value,
    }
    facts = {"line": line, "size": float(np.abs(scene.curve).max())}
    return Case(f"{scene.name}, by {kind}", TASK, inputs, scene.name, scene.about, facts=facts)


def _scenes(rng: np.random.Generator, i: int) -> list[Scene]:
    number = f" {i + 1}"
    corner = np.array([[0.1, 0.0, 0.2], [0.9, 0.0, 0.2], [0.9, 0.0, 0.6]])
    walk = np.cumsum(rng.standard_normal((12, 3)) * rng.uniform(0.05, 0.5, (12, 1)), axis=0)
    bob = curves["plumb_bob"](100)
    return [
        Scene("segment" + number, sentence("A single segment."), rng.uniform(-1.0, 1.0, (2, 3))),
        Scene("corner" + number, sentence("Two segments at a right angle."), corner),
        Scene("uneven walk" + number, sentence("A random walk in space with uneven steps."), walk),
        Scene(
            "closed square" + number,
            sentence("A square whose end joins its start."),
            curves["square"](4),
            closed=True,
        ),
        Scene(
            "repeated points" + number,
            sentence("A polyline in which a point comes twice."),
            np.repeat(walk[:5], [1, 2, 1, 3, 1], axis=0),
        ),
        Scene(
            "two strokes" + number,
            sentence("Two strokes apart: bridged or kept, both are right."),
            np.concatenate([walk[:6], walk[6:] + 1.5]),
            (0, 6),
        ),
        Scene(
            "plumb bob" + number,
            sentence("A drawing in five strokes with uneven samples."),
            bob,
            tuple(range(0, 100, 20)),
        ),
        Scene("heart" + number, sentence("The lab's heart."), curves["heart"](90), closed=True),
    ]


def judge(asked: Sequence[Asked], greeting: Greeting, method: str) -> TaskReport:
    """Hold points against the laws of resampling; strokes may be bridged or kept."""
    judgements = [_judged(one, greeting) for one in asked]
    wrong = [one for one, told in zip(asked, judgements, strict=True) if told.verdict]
    found = diagnosis(asked, wrong, greeting)
    behaviour = _strokes(asked, greeting)
    told = Diagnosis(found.explanations, behaviour, tried=found.tried)
    return report(TASK, method, asked, judgements, told, greeting)


def _strokes(asked: Sequence[Asked], greeting: Greeting) -> Sentence | None:
    """Return whether strokes are bridged or kept, where an answer shows it."""
    for one in asked:
        if len(one.case.inputs["strokes"]) > 1 and isinstance(one.answer, Answer):
            points, line = one.answer.values.get("points"), one.case.facts["line"]
            if points is None or not len(points) or not np.isfinite(points).all():
                continue
            if _off(points, line, False).max() > _bound(one.case, greeting):
                return sentence("It bridges strokes: points lie between them as well.")
            return sentence("It keeps strokes apart: no points lie between them.")
    return None


def _bound(case: Case, greeting: Greeting) -> float:
    """Return what rounding allows: arc lengths add up over all points [m]."""
    line = case.facts["line"]
    return (
        rounding.ROUNDINGS_A_JOINT
        * greeting.epsilon
        * (len(case.inputs["curve"]) * case.facts["size"] + line.length)
    )


def _off(points: FloatArray, line: Line, bridged: bool) -> FloatArray:
    return np.array([line.nearest(point, bridged)[0] for point in points])


def _judged(one: Asked, greeting: Greeting) -> CaseJudgement:
    case, answer = one.case, one.answer
    (_, seconds) = timed(lambda: _even(case.inputs, case.facts["line"]))
    if not isinstance(answer, Answer):
        return CaseJudgement(case, answer, (), {}, None, seconds)
    findings = laws.Findings(greeting)
    points = answer.values.get("points")
    if points is None or not len(points):
        told = sentence("The answer has no points.")
        findings.add(Finding("numbers", Verdict.BROKEN, np.inf, 0.0, "", told))
    elif not np.isfinite(points).all():
        told = sentence("A point is not a number.")
        findings.add(Finding("numbers", Verdict.BROKEN, np.inf, 0.0, "", told))
    else:
        findings.extend(point_laws(points, case, greeting))
    findings.extend(laws.repeated(one, case.facts["size"], greeting))
    findings.extend(laws.remarks(answer))
    return CaseJudgement(case, answer, findings.all, {}, None, seconds)


def _even(inputs: Mapping[str, Any], line: Line) -> FloatArray:
    if "count" in inputs:
        return even_by_count(line, inputs["count"], True)
    return even_by_spacing(line, inputs["spacing"], True)


def point_laws(points: FloatArray, case: Case, greeting: Greeting) -> list[Finding]:
    """Return whether points are on the line, in order, evenly spaced and as many as asked for."""
    line, bound = case.facts["line"], _bound(case, greeting)
    off = _off(points, line, True)
    worst = int(np.argmax(off))
    found = [_on_line(points, off, line, bound)]
    found.append(_ends(points, case, bound))
    if "count" in case.inputs:
        found.append(_count(points, case))
    if off[worst] <= bound:
        at = line.parameters(points, bound)
        found += [_order(at, line, bound), _gaps(points, at, case, bound)]
        if case.inputs["closed"] and len(points) > 1:
            found.append(_closing(points, at, line, bound))
    return found


def _on_line(points: FloatArray, off: FloatArray, line: Line, bound: float) -> Finding:
    """Return whether points are on the line, or between two of its points."""
    worst = int(np.argmax(off))
    verdict = Verdict.WRONG
    told = sentence(
        "Point {index} is {error:.2g} m off the polyline.", index=worst, error=off[worst]
    )
    if all(line.is_on_chord(points[i], bound) for i in np.flatnonzero(off > bound)):
        verdict = Verdict.RIGHT_BUT
        told = sentence(
            "Points between given ones are left out, so that corners are cut by {error:.2g} m.",
            error=off[worst],
        )
    return laws.bounded("on the line", off[worst], bound, "m", told, verdict=verdict)


def _ends(points: FloatArray, case: Case, bound: float) -> Finding:
    curve = case.inputs["curve"]
    error = float(np.linalg.norm(points[0] - curve[0]))
    if not case.inputs["closed"]:
        error = max(error, float(np.linalg.norm(points[-1] - curve[-1])))
    told = sentence(
        "The curve's ends are not kept: the answer starts or ends {error:.2g} m from them.",
        error=error,
    )
    return laws.bounded("ends", error, bound, "m", told)


def _count(points: FloatArray, case: Case) -> Finding:
    asked, came = case.inputs["count"], len(points)
    told = sentence("It was asked for {asked} points and gives {came}.", asked=asked, came=came)
    repeated = case.inputs["closed"] and came == asked + 1
    verdict = Verdict.RIGHT_BUT if repeated else Verdict.WRONG
    return laws.bounded("count", abs(came - asked), 0.0, "", told, verdict=verdict)


def _order(at: FloatArray, line: Line, bound: float) -> Finding:
    back = float(np.max(-np.diff(at), initial=0.0))
    told = sentence("The points go back along the curve, by {error:.2g} m.", error=back)
    return laws.bounded("order", back, 2.0 * bound, "m", told)


def _gaps(points: FloatArray, at: FloatArray, case: Case, bound: float) -> Finding:
    """Return whether gaps are even, along the line with its bridges or without, or by chords."""
    line = case.facts["line"]
    kinds = [
        np.diff(at), np.diff(line.without_bridges(at)),
        np.linalg.norm(np.diff(points, axis=0), axis=-1),
    ]  # fmt: skip
    if "count" in case.inputs:
        error = min(_spread(gaps) for gaps in kinds)
        told = sentence(
            "The points are not evenly spaced: a gap differs from the mean by {error:.0%}.",
            error=error,
        )
        verdict = Verdict.RIGHT_BUT if len(case.inputs["strokes"]) > 1 else Verdict.WRONG
        tolerance = UNEVEN + 4.0 * bound / max(float(kinds[2].mean()), bound)
        return laws.bounded("spacing", error, tolerance, "", told, verdict=verdict)
    return _widest(kinds, case, bound)


def _closing(points: FloatArray, at: FloatArray, line: Line, bound: float) -> Finding:
    """Return whether the gap that closes the curve is no wider than the others."""
    back = float(np.linalg.norm(points[-1] - points[0])) > bound
    gap = line.length - float(at[-1]) if back else 0.0
    widest = float(np.diff(at).max()) * (1.0 + UNEVEN)
    side, others = distinct_texts(gap, widest, 3)
    told = sentence(
        "The side that closes the curve is left out: from the last point to the start it is "
        "{gap} m, between others at most {widest} m.",
        gap=side,
        widest=others,
    )
    return laws.bounded("closing side", gap, widest + 2.0 * bound, "m", told)


def _spread(gaps: FloatArray) -> float:
    mean = float(gaps.mean()) if len(gaps) else 0.0
    return float(np.abs(gaps / mean - 1.0).max()) if mean > 0.0 else 0.0


def _widest(kinds: Sequence[FloatArray], case: Case, bound: float) -> Finding:
    """Return whether no gap within a stroke is wider than asked for, and few are much narrower."""
    spacing, line = case.inputs["spacing"], case.facts["line"]
    bridges = len(line.strokes) - 1
    wide = min(float(np.sort(gaps)[: len(gaps) - bridges].max(initial=0.0)) for gaps in kinds)
    gap, limit = distinct_texts(wide, spacing, 3)
    told = sentence(
        "Neighbouring points are {gap} m apart, more than the {spacing} m asked for.",
        gap=gap,
        spacing=limit,
    )
    if wide > spacing * (1.0 + 1e-6) + 2.0 * bound:
        return Finding("spacing", Verdict.WRONG, wide, spacing, "m", told)
    narrow = int((kinds[2] < LEAST_GAP * spacing - 2.0 * bound).sum())
    told = sentence(
        "{narrow} gaps are narrower than half the spacing: the points are uneven.", narrow=narrow
    )
    allowed = 1.0 + bridges + len(case.inputs["curve"])
    if len(kinds[2]) > 4.0 * line.length / spacing + allowed:
        return Finding("spacing", Verdict.RIGHT_BUT, narrow, 0.0, "", told)
    return Finding("spacing", Verdict.RIGHT, wide, spacing, "m", laws.HOLDS)
