"""What answers of mass-spring systems show: the fewest terms of their equations.

All pulls of springs, all displacements of free particles and all velocities are compared with sums
of few terms, a coefficient each.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence, Set
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence, sentence

from ..judgement import CaseJudgement
from .equalities import DIFFERENT
from .fits import Term, fit, formula, is_sum
from .linearised import linearised_pulls
from .pulls import (
    MAX_ROUNDING,
    OF_STEPS,
    PULLS,
    READINGS,
    ForceReading,
    Pulls,
    SpringCase,
    readings_of,
    solve_pulls,
)
from .separation import MIN_CASES, TOLERANCE, ElementTable, Findings, Statement
from .spring_law import law_words

# An equation of three terms needs so many springs more than terms.
SPRINGS_FOR_THREE = 25
# A gravity is constant if answers differ by less [m/s²], requests by more.
SAME_GRAVITY, OTHER_GRAVITY = 1e-4, 0.1


def spring_evidence(
    judgements: Sequence[CaseJudgement],
    epsilon: float,
    sound: Set[str] = frozenset(),
    is_damped: bool = True,
    substeps: int = 1,
) -> Findings:
    """Return what answers show; `sound` are the names of the cases with a right verdict.

    Dampers count as none unless the step is damped. A step declares so many substeps.
    """
    cases = [SpringCase(judgement, epsilon, is_damped) for judgement in judgements]
    cases = [case for case in cases if _is_told(case)]
    evidence = Findings({}, [], [])
    solved: dict[str, list[Pulls]] = defaultdict(list)
    residuals: dict[tuple[str, str], dict[str, FloatArray]] = defaultdict(dict)
    for case in cases:
        for reading in readings_of(case):
            for damper, gaps in _residuals(case, reading):
                residuals[reading.name, damper][case.name] = gaps
            pulls = solve_pulls(case, reading) if len(reading.k) else None
            if pulls is not None:
                solved[reading.name].append(pulls)
    if residuals:
        _add_motion(cases, residuals, sound, evidence)
    # the reading by which most answers are sums of pulls, the plainest of equals
    name = max(solved, key=lambda key: (_pull(solved[key]), len(solved[key])), default="")
    if sum(case.name not in sound for case in cases) < MIN_CASES:
        return evidence  # what equations differ from the usual are honest choices
    if len(solved[name]) >= MIN_CASES:
        _add_pulls(name, solved[name], evidence)
    linearised = linearised_pulls(cases) if not evidence.statements else None
    if linearised is not None and not linearised[1]:
        evidence.statements.append(_of_fit(linearised[0]))
    _add_flights([case for case in cases if not case.acting.any()], evidence, substeps)
    _add_velocities(cases, evidence, substeps)
    return evidence


def _pull(solved: Sequence[Pulls]) -> bool:
    """Return whether enough answers tell pulls, and springs pull by these terms."""
    return len(solved) >= MIN_CASES and any(np.abs(part.pulls).max() > 1e-9 for part in solved)


def _is_told(case: SpringCase) -> bool:
    """Return whether a case has numbers, and no springs that may be slack."""
    outputs = (case.end, case.end_v, case.forces)
    is_finite = all(values is None or bool(np.isfinite(values).all()) for values in outputs)
    return is_finite and not case.problem.tension_only.any()


# The equation of motion


def _add_motion(
    cases: Sequence[SpringCase],
    residuals: Mapping[tuple[str, str], Mapping[str, FloatArray]],
    sound: Set[str],
    evidence: Findings,
) -> None:
    """Add the right equation of motion, in the reading of most particles."""
    best = max(residuals, key=lambda key: _right_share(residuals[key]))
    is_force = best[0] == "forces"
    particles = ElementTable("force" if is_force else "motion", sound)
    whole = ElementTable(
        "force_of_cases" if is_force else "motion_of_cases", sound, is_of_cases=True
    )
    for case in cases:
        gaps = residuals[best].get(case.name)
        tolerance = max(TOLERANCE, case.rounding() / case.size)
        if gaps is None or tolerance > MAX_ROUNDING:
            continue
        is_idle = ~case.v.any() and not case.gravity.any()
        counted = np.isin(np.arange(case.problem.count), case.free) & (not is_idle)
        if counted.any():
            particles.add(case.name, gaps, case.particle_features(), tolerance, counted)
            whole.add(case.name, gaps[counted].max(), case.features(), tolerance)
    right = [e for e in whole.elements if e.features["springs"] and not e.is_wrong]
    if is_force or len(right) >= MIN_CASES:  # else the step is read in another way than it is made
        evidence.tables["particles"] = particles
        if particles.wrong_count:  # else all cases are right too
            evidence.tables["whole"] = whole


def _right_share(residuals: Mapping[str, FloatArray]) -> int:
    return sum(int((gaps <= TOLERANCE).sum()) for gaps in residuals.values())


def _residuals(case: SpringCase, reading: ForceReading) -> Iterator[tuple[str, FloatArray]]:
    """Yield a kind of damper and how far each particle is from the right equation, relatively."""
    p, incidence = case.problem, case.problem.incidence[case.acting]
    is_projected = reading.name.startswith("rest")
    stretch = -reading.r if is_projected else reading.l - reading.r
    dampers = {"rate": reading.c * reading.rate}
    if case.end is not None:
        dampers["none"] = 0.0 * reading.c
        dampers["change"] = reading.c * (reading.l - reading.first_length) / case.h
    for name, damper in dampers.items():
        pull = reading.k * stretch + damper
        due = p.constant - incidence.T @ (pull[:, None] * reading.u)
        yield name, np.abs(reading.force - due).max(axis=1) / case.size


# What springs pull


def _add_pulls(name: str, solved: Sequence[Pulls], evidence: Findings) -> None:
    pulls = np.concatenate([part.pulls for part in solved])
    symbols = [symbol for symbol in PULLS if symbol not in OF_STEPS or name != "forces"]
    terms = {symbol: np.concatenate([p.terms[symbol] for p in solved]) for symbol in symbols}
    count: dict[str, Any] = {"count": len(pulls), "cases": len(solved), "place": READINGS[name]}
    max_terms = 3 if len(pulls) > SPRINGS_FOR_THREE else 2
    fitted = fit(pulls, terms, max_terms) if _pull(solved) else []
    right = _right_pulls(name, terms)
    is_elastic = np.concatenate([part.is_elastic for part in solved])
    is_along = not name.startswith("rest") and fitted != []
    law = law_words(pulls, terms, is_elastic, count) if is_along else None
    if fitted is not None and any(is_sum(fitted, due) for due in right):
        evidence.right.append(sentence("what springs pull ({count})", count=len(pulls)))
    elif fitted == []:
        words = sentence(
            "Springs pull nothing {place} ({count} springs of {cases} cases).", **count
        )
        evidence.statements.append(_of_fit(words))
    elif law is not None:
        evidence.statements.append(_of_fit(law))
    elif fitted is not None:
        evidence.statements.append(_of_fit(sentence(
            "Every spring pulls {formula} {place}; right is {right} (k: stiffness, l: length, r: "
            "rest length, c: damping; {count} springs of {cases} cases, solved from the answers).",
            formula=formula(fitted), right=formula(_nearest(right, fitted)),
            **count)))  # fmt: skip
    elif count["place"] in (READINGS["forces"], READINGS["start"]):
        # at the end of a step iterations may not have converged: then no sum is exact
        words = sentence(
            "What springs pull {place} is along them, but no sum of few terms such as k l, k r and "
            "c dl/dt ({count} springs of {cases} cases).", **count)  # fmt: skip
        evidence.statements.append(Statement(5.0, words, is_exact=False))
    _add_gravity(solved, evidence)


def _right_pulls(name: str, terms: Mapping[str, FloatArray]) -> list[Mapping[str, float]]:
    """Return what springs pull by a reading; an honest step may have any damper, or none."""
    elastic = {"k r": -1.0} if name.startswith("rest") else {"k l": 1.0, "k r": -1.0}
    rate, change = {**elastic, "c dl/dt": 1.0}, {**elastic, "c (l' - l)/h": 1.0}
    if name == "forces":
        return [rate if terms["c"].any() else elastic]
    return [elastic, rate, change]


def _nearest(sums: Sequence[Mapping[str, float]], fitted: Sequence[Term]) -> list[Term]:
    """Return the right sum with most of the terms of a fitted sum, the usual sum of equals."""
    symbols = {term.symbol for term in fitted}
    nearest = max(sums, key=lambda due: len(symbols & due.keys()))
    return [Term(coefficient, symbol) for symbol, coefficient in nearest.items()]


def _of_fit(words: Sentence) -> Statement:
    return Statement(0.0, words, is_exact=True)


def _add_gravity(solved: Sequence[Pulls], evidence: Findings) -> None:
    pairs = [(part.gravity, part.case.gravity) for part in solved if part.gravity is not None]
    if len(pairs) < MIN_CASES:
        return
    values, requests = (np.array(side) for side in zip(*pairs, strict=True))
    is_same = np.ptp(values, axis=0).max() < SAME_GRAVITY
    if is_same and np.ptp(requests, axis=0).max() > OTHER_GRAVITY:
        numbers = (f"{number:.4g}" for number in np.round(values.mean(axis=0), 5) + 0.0)
        evidence.statements.append(_of_fit(sentence(
            "Gravity is ({gravity}) in all {count} cases in which it can be solved from the "
            "answers, whatever the request says.", gravity=", ".join(numbers),
            count=len(pairs))))  # fmt: skip


# Sums of velocities and displacements


def _sum_of(
    cases: Sequence[SpringCase], quantity: Any, symbols: Sequence[str]
) -> list[Term] | None:
    """Return the fewest terms of a quantity of all free particles."""
    return fit(_stacked(cases, quantity), {s: _stacked(cases, TERMS[s]) for s in symbols}, 2)


def _stacked(cases: Sequence[SpringCase], rule: Any) -> FloatArray:
    """Return a quantity of all free particles, of each case over the size of its velocities."""
    parts = [(rule(c) + 0.0 * c.x)[c.free].ravel() / _speed(c) for c in cases]
    return np.concatenate(parts)


def _speed(case: SpringCase) -> float:
    """Return the size of the velocities of a case, and of what gravity adds, 1 if all are zero."""
    velocities = case.v, case.h * case.gravity, 0.0 if case.end_v is None else case.end_v
    return max(float(np.abs(v).max()) for v in velocities) or 1.0


def _differ(cases: Sequence[SpringCase]) -> bool:
    """Return whether requests have two time steps, if any, and two gravities."""
    hs, gs = {case.h for case in cases}, {tuple(case.gravity) for case in cases}
    return len(gs) > 1 and (len(hs) > 1 or all(case.forces is not None for case in cases))


def _add_flights(cases: Sequence[SpringCase], evidence: Findings, substeps: int) -> None:
    """Add what moves free particles without springs."""
    declared = [{"h v": 1.0, "h² g": share} for share in _gravity_shares(substeps)]
    right = {"x' - x": declared} if substeps > 1 else {}
    if not _differ(cases):
        return
    for name, quantity, symbols, dues in FLIGHTS:
        if any(quantity(case) is None for case in cases):
            continue
        fitted = _sum_of(cases, quantity, symbols)
        if fitted is None:
            continue
        dues = right.get(name, dues)
        if any(is_sum(fitted, due) for due in dues):
            words = sentence("{name} without springs ({count} cases)", name=name, count=len(cases))
            evidence.right.append(words)
            continue
        evidence.statements.append(_of_fit(sentence(
            "Without springs {name} = {formula}; right is {right} ({count} cases, g: gravity).",
            name=name, formula=formula(fitted), count=len(cases),
            right=formula([Term(c, s) for s, c in dues[0].items()]))))  # fmt: skip


UP = np.array([0.0, 1.0, 0.0])
TERMS: Mapping[str, Any] = {
    "h v": lambda c: c.h * c.v,
    "h² g": lambda c: c.h**2 * c.gravity,
    "h g": lambda c: c.h * c.gravity,
    "h² m g": lambda c: c.h**2 * c.masses * c.gravity,
    "h m g": lambda c: c.h * c.masses * c.gravity,
    "v": lambda c: c.v,
    "g": lambda c: c.gravity,
    "h² v": lambda c: c.h**2 * c.v,
    "h² g/m": lambda c: c.h**2 * c.gravity / c.masses,
    "h g/m": lambda c: c.h * c.gravity / c.masses,
    "h² (0, 1, 0)": lambda c: c.h**2 * UP,
    "h (0, 1, 0)": lambda c: c.h * UP,
    "m g": lambda c: c.masses * c.gravity,
    "m² g": lambda c: c.masses**2 * c.gravity,
    "m (0, 1, 0)": lambda c: c.masses * UP,
    "(x' - x)/h": lambda c: (c.end - c.x) / c.h,
    "x' - x": lambda c: c.end - c.x,
    "(x' - x)/h²": lambda c: (c.end - c.x) / c.h**2,
}
OF_FORCES = ("m g", "g", "m² g", "m (0, 1, 0)")
OF_MOTION = tuple(TERMS)[:12]
OF_VELOCITIES = ("(x' - x)/h", "v", "h g", "x' - x", "(x' - x)/h²", "g", "h (0, 1, 0)")
# What free particles may be moved by: quantity, terms and right sums, the usual sum first.
FLIGHTS: Sequence[tuple[str, Any, Sequence[str], Sequence[Mapping[str, float]]]] = (
    ("x' - x", lambda c: None if c.end is None else c.end - c.x, OF_MOTION,
     ({"h v": 1.0, "h² g": 1.0}, {"h v": 1.0}, {"h v": 1.0, "h² g": 0.5})),
    ("v' - v", lambda c: None if c.end_v is None else c.end_v - c.v, OF_MOTION, ({"h g": 1.0},)),
    ("f", lambda c: c.forces, OF_FORCES, ({"m g": 1.0},)),
)  # fmt: skip


def _gravity_shares(substeps: int) -> Sequence[float]:
    """Return what gravity adds to free flights over h² g, symplectic and explicit substeps."""
    return [(substeps + 1.0) / (2.0 * substeps), (substeps - 1.0) / (2.0 * substeps)]


def _add_velocities(cases: Sequence[SpringCase], evidence: Findings, substeps: int) -> None:
    """Add the sum of differences of positions and old velocities in new velocities."""
    cases = [c for c in cases if c.end is not None and c.end_v is not None and len(c.free)]
    cases = [case for case in cases if not case.problem.external.any()]
    if len(cases) < MIN_CASES or not _differ(cases):
        return
    fitted = _sum_of(cases, lambda c: c.end_v, OF_VELOCITIES)
    if fitted is None:
        return
    share = _gravity_shares(substeps)[0]
    if substeps > 1 and is_sum(fitted, {"(x' - x)/h": 1.0 / share, "v": 1.0 - 1.0 / share}):
        return  # as a constant force leaves them after symplectic substeps
    if is_sum(fitted, {"(x' - x)/h": 1.0}):
        evidence.right.append(sentence("v' = (x' - x)/h ({count} cases)", count=len(cases)))
    elif sum(map(_has_other_velocities, cases)) >= MIN_CASES:
        evidence.statements.append(_of_fit(sentence(
            "Velocities are {formula} in all {count} cases; of an implicit step they are "
            "(x' - x)/h.", formula=formula(fitted), count=len(cases))))  # fmt: skip


def _has_other_velocities(case: SpringCase) -> bool:
    """Return whether velocities differ from the displacement over the time step."""
    assert case.end is not None
    assert case.end_v is not None
    gaps = np.abs(case.end_v - (case.end - case.x) / case.h)[case.free]
    return bool(gaps.max() > DIFFERENT * np.abs(case.end_v).max())
