"""What answers of mass-spring systems show: equations solved from the answers.

Every answered force, or change of velocity or position, is the sum of what springs pull along their
directions and of gravity. Least squares give each pull; then the fewest terms are sought of which
all pulls are a sum with one coefficient each.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence, Set
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import BoolArray, FloatArray
from plumbob.text.sentence import Sentence, sentence

from ..contestant import Answer
from ..judgement import CaseJudgement
from ..mass_spring.problem import SpringProblem, problem_of
from .equalities import DIFFERENT
from .fits import INDEPENDENT, Term, fit, formula, is_sum
from .separation import MIN_CASES, TOLERANCE, Statement, Table, words_of

# Residuals of rounding: of positions times m / h², in units of the last place.
ROUNDINGS = 8.0
# Cases whose rounding is a larger share of the forces tell nothing.
MAX_ROUNDING = 1e-3
# An equation needs so many springs more than it has terms to have three terms.
SPRINGS_FOR_THREE = 25
# A gravity is constant if it differs by less between answers [m/s²], requests by more.
SAME_GRAVITY, OTHER_GRAVITY = 1e-4, 0.1
# What a spring may pull, by the stiffness k, length l, rest length r, damping c and rate dl/dt.
PULLS: Mapping[str, Any] = {
    "k l": lambda s: s.k * s.l,
    "k r": lambda s: s.k * s.r,
    "k": lambda s: s.k,
    "k l²": lambda s: s.k * s.l**2,
    "k r²": lambda s: s.k * s.r**2,
    "k l²/r": lambda s: s.k * s.l**2 / s.r,
    "k l³/r²": lambda s: s.k * s.l**3 / s.r**2,
    "k r²/l": lambda s: s.k * s.r**2 / s.l,
    "k l³": lambda s: s.k * s.l**3,
    "k r² l": lambda s: s.k * s.r**2 * s.l,
    "c dl/dt": lambda s: s.c * s.rate,
    "c": lambda s: s.c,
    "dl/dt": lambda s: s.rate,
    "k l/h": lambda s: s.k * s.l / s.h,
    "k r/h": lambda s: s.k * s.r / s.h,
    "c (l' - l)/h": lambda s: s.c * (s.l - s.first_length) / s.h,
}
OF_STEPS = ("k l/h", "k r/h", "c (l' - l)/h")
# Of which springs the pull may differ from that of the others.
KINDS = ("damped_spring", "compressed_spring", "spring_to_pin")


class SpringCase:
    """A request and its answer, as arrays."""

    def __init__(self, judgement: CaseJudgement, epsilon: float) -> None:
        assert isinstance(judgement.answer, Answer)
        self.name, self.case = judgement.case.name, judgement.case
        self.problem: SpringProblem = problem_of(judgement.case.inputs)
        p, outputs = self.problem, judgement.answer.values
        self.x, self.v, self.h = p.positions, p.velocities, p.h or 1.0
        self.masses, self.gravity = p.masses[:, None], p.gravity
        self.free = np.setdiff1d(np.arange(p.count), p.pinned)
        self.end, self.end_v = outputs.get("positions"), outputs.get("velocities")
        self.forces = outputs.get("forces")
        self.epsilon = epsilon

    @cached_property
    def acting(self) -> BoolArray:
        """The springs with a stiffness or a damping."""
        return (self.problem.stiffnesses > 0.0) | (self.problem.dampings > 0.0)

    def by_positions(self) -> FloatArray | None:
        """Return the force that moves positions further than the old velocities [N]."""
        if self.end is None:
            return None
        return self.masses * (self.end - self.x - self.h * self.v) / self.h**2

    def by_velocities(self) -> FloatArray | None:
        """Return the force that changes velocities [N]."""
        return None if self.end_v is None else self.masses * (self.end_v - self.v) / self.h

    def rounding(self) -> float:
        """Return the error of such a force that rounding of the answers leaves [N]."""
        if self.forces is not None:
            return ROUNDINGS * self.epsilon * float(np.abs(self.forces).max())
        size = float(np.abs(self.x).max() + self.h * np.abs(self.v).max())
        return ROUNDINGS * self.epsilon * float(self.masses.max()) * size / self.h**2

    @cached_property
    def size(self) -> float:
        """A bound of the terms of forces, by which errors are divided [N]."""
        p = self.problem
        springs = np.abs(p.incidence).T @ (p.stiffnesses * p.rest_lengths + p.dampings)
        weights = p.masses * float(np.linalg.norm(p.gravity))
        return max(float((springs + weights).max()), 1e-300)

    def features(self) -> dict[str, bool]:
        """Return the features of the case as a whole."""
        p, acting = self.problem, self.acting
        lengths = np.linalg.norm(p.incidence @ self.x, axis=1)
        return {
            "springs": bool(acting.any()),
            "several_springs": int(acting.sum()) > 1,
            "pins": bool(len(p.pinned)),
            "dampers": p.damped,
            "compressed": bool((acting & (lengths < p.rest_lengths - 1e-9)).any()),
        }

    def particle_features(self) -> dict[str, BoolArray]:
        """Return the features of all particles."""
        p, indices = self.problem, np.arange(self.problem.count)
        touches = p.incidence[self.acting] != 0.0
        is_at_pin = touches[:, p.pinned].any(axis=1)
        return {
            "several_springs_here": touches.sum(axis=0) > 1,
            "next_to_pin": touches[is_at_pin].any(axis=0),
            "first_particle": indices == 0,
            "last_particle": indices == p.count - 1,
        }


class Reading:
    """A force that follows from an answer, with the acting springs at some positions.

    Attributes:
        name: a key of READINGS.
        force: on all particles [N].
        k, c, r, l, u: stiffness, damping, rest length, length and direction of the acting springs.
        rate: dl/dt of the velocities that dampers see.
        first_length: the lengths in the request.
        h: time step.
    """

    def __init__(
        self, name: str, case: "SpringCase", force: FloatArray, x: FloatArray, v: FloatArray
    ) -> None:
        p, acting = case.problem, case.acting
        self.name, self.force, self.h = name, force, case.h
        first, second = p.springs[acting].T
        d, w, start = (values[first] - values[second] for values in (x, v, case.x))
        self.l = np.sqrt((d * d).sum(axis=1))
        self.u = d / np.maximum(self.l, 1e-300)[:, None]
        self.k, self.c, self.r = p.stiffnesses[acting], p.dampings[acting], p.rest_lengths[acting]
        self.rate = (w * self.u).sum(axis=1)
        self.first_length = np.sqrt((start * start).sum(axis=1))

    def terms(self) -> dict[str, FloatArray]:
        """Return what springs may pull, by symbols."""
        with np.errstate(all="ignore"):
            return {symbol: np.nan_to_num(rule(self)) for symbol, rule in PULLS.items()}


# Where the springs of a reading are taken.
READINGS: Mapping[str, Sentence] = {
    "forces": sentence("in the positions of the request"),
    "start": sentence("at the start of the step"),
    "end": sentence("at the end of the step"),
    "start, velocities": sentence("at the start of the step, by the velocities"),
    "end, velocities": sentence("at the end of the step, by the velocities"),
    "rest directions": sentence("in its rest direction, in the first iteration from x_n"),
    "rest directions from y": sentence("in its rest direction, in the first iteration from y"),
}


def readings_of(case: SpringCase) -> Iterator[Reading]:
    """Yield the force of an answer with springs at the start and at the end of the step."""
    if case.forces is not None:
        yield Reading("forces", case, case.forces, case.x, case.v)
    by_x, by_v, x, end = case.by_positions(), case.by_velocities(), case.x, case.end
    if by_x is not None and end is not None:
        yield Reading("start", case, by_x, x, case.v)
        yield Reading("end", case, by_x, end, (end - x) / case.h)
    if by_v is not None:
        yield Reading("start, velocities", case, by_v, x, case.v)
        if end is not None:
            yield Reading("end, velocities", case, by_v, end, case.v)
    # a damper is read in other directions than a spring in an iteration: leave such cases out
    if by_x is not None and end is not None and not case.problem.damped:
        p = case.problem
        pulls = p.stiffnesses[:, None] * (end[p.springs[:, 0]] - end[p.springs[:, 1]])
        stretched = by_x + p.incidence.T @ pulls
        yield Reading("rest directions", case, stretched, x, case.v)
        yield Reading("rest directions from y", case, stretched, x + case.h * case.v, case.v)


class Pulls(NamedTuple):
    """What springs pull in an answer, and gravity, solved from a reading."""

    case: SpringCase
    pulls: FloatArray  # of the acting springs [N]
    gravity: FloatArray | None  # [m/s²], None if taken from the request
    terms: Mapping[str, FloatArray]  # by symbols
    features: Mapping[str, BoolArray]


def solve_pulls(case: SpringCase, reading: Reading) -> Pulls | None:
    """Return pulls and gravity, None if an answer does not determine them or is no such sum."""
    p, acting, free = case.problem, case.acting, case.free
    count, incidence = int(acting.sum()), p.incidence[acting]
    is_measured = 3 * len(free) > count + 3
    if 3 * len(free) <= count:
        return None
    A = np.zeros((len(free), 3, count + 3))
    A[:, :, :count] = -incidence.T[free, None, :] * reading.u.T[None]
    A[:, :, count:] = case.masses[free, :, None] * np.eye(3)
    A, b = A.reshape(-1, count + 3), (reading.force - p.external)[free].ravel()
    if not is_measured:  # too few equations: take gravity from the request
        A, b = A[:, :count], b - (case.masses * case.gravity)[free].ravel()
    size = float(np.abs(b).max())
    allowed = max(TOLERANCE * size, case.rounding())
    if allowed > MAX_ROUNDING * size:
        return None
    solution, _, rank, _ = np.linalg.lstsq(A, b, INDEPENDENT)
    if rank < A.shape[1] or not np.abs(A @ solution - b).max() <= allowed:
        return None
    features = {
        "damped_spring": reading.c > 0.0,
        "compressed_spring": reading.first_length < reading.r,
        "spring_to_pin": np.isin(p.springs[acting], p.pinned).any(axis=1),
    }
    gravity = solution[count:] if is_measured else None
    return Pulls(case, solution[:count], gravity, reading.terms(), features)


class SpringEvidence(NamedTuple):
    """Tables, statements by equations, and what is right."""

    tables: dict[str, Table]
    statements: list[Statement]
    right: list[Sentence]


def spring_evidence(
    judgements: Sequence[CaseJudgement], epsilon: float, sound: Set[str] = frozenset()
) -> SpringEvidence:
    """Return what answers show; `sound` are the names of the cases with a right verdict."""
    cases = [SpringCase(judgement, epsilon) for judgement in judgements]
    cases = [case for case in cases if _is_finite(case)]
    evidence = SpringEvidence({}, [], [])
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
    _add_flights([case for case in cases if not case.acting.any()], evidence)
    _add_velocities(cases, evidence)
    return evidence


def _pull(solved: Sequence[Pulls]) -> bool:
    """Return whether enough answers tell pulls, and springs pull by them."""
    return len(solved) >= MIN_CASES and any(np.abs(part.pulls).max() > 1e-9 for part in solved)


def _is_finite(case: SpringCase) -> bool:
    outputs = (case.end, case.end_v, case.forces)
    return all(values is None or bool(np.isfinite(values).all()) for values in outputs)


# The equation of motion


def _add_motion(
    cases: Sequence[SpringCase],
    residuals: Mapping[tuple[str, str], Mapping[str, FloatArray]],
    sound: Set[str],
    evidence: SpringEvidence,
) -> None:
    """Add the right equation of motion, read in the way in which most particles keep it."""
    best = max(residuals, key=lambda key: _right_share(residuals[key]))
    is_force = best[0] == "forces"
    particles = Table("force" if is_force else "motion", sound)
    whole = Table("force_of_cases" if is_force else "motion_of_cases", sound, is_of_cases=True)
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
        evidence.tables.update(particles=particles, whole=whole)


def _right_share(residuals: Mapping[str, FloatArray]) -> int:
    return sum(int((gaps <= TOLERANCE).sum()) for gaps in residuals.values())


def _residuals(case: SpringCase, reading: Reading) -> Iterator[tuple[str, FloatArray]]:
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


def _add_pulls(name: str, solved: Sequence[Pulls], evidence: SpringEvidence) -> None:
    pulls = np.concatenate([part.pulls for part in solved])
    symbols = [symbol for symbol in PULLS if symbol not in OF_STEPS or name != "forces"]
    terms = {symbol: np.concatenate([p.terms[symbol] for p in solved]) for symbol in symbols}
    count: dict[str, Any] = {"count": len(pulls), "cases": len(solved), "place": READINGS[name]}
    max_terms = 3 if len(pulls) > SPRINGS_FOR_THREE else 2
    found = fit(pulls, terms, max_terms) if _pull(solved) else []
    right = _right_pulls(name, terms)
    if found is not None and any(is_sum(found, due) for due in right):
        evidence.right.append(sentence("what springs pull ({count})", count=len(pulls)))
    elif found == []:
        words = sentence(
            "Springs pull nothing {place} ({count} springs of {cases} cases).", **count
        )
        evidence.statements.append(_of_fit(words))
    elif found is not None:
        evidence.statements.append(_of_fit(sentence(
            "Every spring pulls {formula} {place}; right is {right} (k: stiffness, l: length, r: "
            "rest length, c: damping; {count} springs of {cases} cases, solved from the answers).",
            formula=formula(found), right=formula([Term(c, s) for s, c in right[0].items()]),
            **count)))  # fmt: skip
    else:
        _add_kinds(solved, pulls, terms, count, evidence)
    _add_gravity(solved, evidence)


def _right_pulls(name: str, terms: Mapping[str, FloatArray]) -> list[Mapping[str, float]]:
    """Return what springs pull by a reading; an honest step may have any damper, or none."""
    elastic = {"k r": -1.0} if name.startswith("rest") else {"k l": 1.0, "k r": -1.0}
    rate, change = {**elastic, "c dl/dt": 1.0}, {**elastic, "c (l' - l)/h": 1.0}
    if name == "forces":
        return [rate if terms["c"].any() else elastic]
    return [elastic, rate, change]


def _of_fit(words: Sentence) -> Statement:
    return Statement(0.0, words, is_exact=True)


def _add_kinds(
    solved: Sequence[Pulls],
    pulls: FloatArray,
    terms: Mapping[str, FloatArray],
    count: Mapping[str, Any],
    evidence: SpringEvidence,
) -> None:
    """Add the sums of springs with and without a feature, or that there is no plain sum."""
    cases = np.concatenate([np.full(len(part.pulls), i) for i, part in enumerate(solved)])
    for kind in KINDS:
        mask = np.concatenate([part.features[kind] for part in solved])
        sides = [mask, ~mask]
        if min(len({*cases[side]}) for side in sides) < MIN_CASES:
            continue
        sums = [fit(pulls[s], {key: t[s] for key, t in terms.items()}, 3) for s in sides]
        if sums[0] and sums[1] and sums[0] != sums[1]:
            words = sentence(
                "Springs pull {formula} {kind}, elsewhere {other}, {place} (k: stiffness, l: "
                "length, r: rest length, c: damping; {count} springs of {cases} cases).",
                formula=formula(sums[0]), other=formula(sums[1]),
                kind=words_of("feature", kind), **count)  # fmt: skip
            evidence.statements.append(_of_fit(words))
            return
    # at the end of a step iterations may not have converged: then no sum is exact
    if count["place"] in (READINGS["forces"], READINGS["start"]):
        words = sentence(
            "What springs pull {place} is along them, but no sum of few terms such as k l, k r and "
            "c dl/dt ({count} springs of {cases} cases).", **count)  # fmt: skip
        evidence.statements.append(Statement(5.0, words, is_exact=False))


def _add_gravity(solved: Sequence[Pulls], evidence: SpringEvidence) -> None:
    pairs = [(part.gravity, part.case.gravity) for part in solved if part.gravity is not None]
    if len(pairs) < MIN_CASES:
        return
    shown, requested = (np.array(side) for side in zip(*pairs, strict=True))
    is_same = np.ptp(shown, axis=0).max() < SAME_GRAVITY
    if is_same and np.ptp(requested, axis=0).max() > OTHER_GRAVITY:
        numbers = (f"{number:.4g}" for number in np.round(shown.mean(axis=0), 5) + 0.0)
        evidence.statements.append(_of_fit(sentence(
            "Gravity is ({gravity}) in all {count} cases in which it can be solved from the "
            "answers, whatever the request says.", gravity=", ".join(numbers),
            count=len(pairs))))  # fmt: skip


# Sums of velocities and displacements


def _add_flights(cases: Sequence[SpringCase], evidence: SpringEvidence) -> None:
    """Add what moves free particles without springs."""
    hs, gs = {case.h for case in cases}, {tuple(case.gravity) for case in cases}
    is_step = any(case.forces is None for case in cases)
    if len(cases) < 2 or len(gs) < 2 or (is_step and len(hs) < 2):
        return
    for name, quantity, dues in FLIGHTS:
        parts = [quantity(case) for case in cases]
        if any(part is None for part in parts) or not parts:
            continue
        symbols = FORCE_TERMS if name == "f" else STEP_TERMS
        columns = {s: _stacked(cases, rule) for s, rule in symbols.items()}
        y = np.concatenate([part[c.free].ravel() for part, c in zip(parts, cases, strict=True)])
        found = fit(y, columns, 2)
        if found is None:
            continue
        if any(is_sum(found, due) for due in dues):
            evidence.right.append(sentence(
                "{name} without springs ({count} cases)", name=name, count=len(cases)))  # fmt: skip
            continue
        evidence.statements.append(_of_fit(sentence(
            "Without springs {name} = {formula}; right is {right} ({count} cases, g: gravity).",
            name=name, formula=formula(found), count=len(cases),
            right=formula([Term(c, s) for s, c in dues[0].items()]))))  # fmt: skip


def _stacked(cases: Sequence[SpringCase], rule: Any) -> FloatArray:
    return np.concatenate([(rule(case) + 0.0 * case.x)[case.free].ravel() for case in cases])


def _scaled(cases: Sequence[SpringCase], rule: Any) -> FloatArray:
    """Return a quantity of all free particles, of each case over its largest velocity."""
    return _stacked(cases, lambda case: rule(case) / max(np.abs(case.end_v).max(), 1e-300))


# What free particles may be moved by: the quantity, and its right sums, the usual one first.
FLIGHTS: Sequence[tuple[str, Any, Sequence[Mapping[str, float]]]] = (
    ("x' - x", lambda c: None if c.end is None else c.end - c.x,
     ({"h v": 1.0, "h² g": 1.0}, {"h v": 1.0}, {"h v": 1.0, "h² g": 0.5})),
    ("v' - v", lambda c: None if c.end_v is None else c.end_v - c.v, ({"h g": 1.0},)),
    ("f", lambda c: c.forces, ({"m g": 1.0},)),
)  # fmt: skip
STEP_TERMS: Mapping[str, Any] = {
    "h v": lambda c: c.h * c.v,
    "h² g": lambda c: c.h**2 * c.gravity,
    "h g": lambda c: c.h * c.gravity,
    "v": lambda c: c.v,
    "g": lambda c: c.gravity,
    "h² v": lambda c: c.h**2 * c.v,
    "h² g/m": lambda c: c.h**2 * c.gravity / c.masses,
    "h g/m": lambda c: c.h * c.gravity / c.masses,
    "h² (0, 1, 0)": lambda c: c.h**2 * np.array([0.0, 1.0, 0.0]),
    "h (0, 1, 0)": lambda c: c.h * np.array([0.0, 1.0, 0.0]),
}
FORCE_TERMS: Mapping[str, Any] = {
    "m g": lambda c: c.masses * c.gravity,
    "g": lambda c: c.gravity,
    "m² g": lambda c: c.masses**2 * c.gravity,
    "m (0, 1, 0)": lambda c: c.masses * np.array([0.0, 1.0, 0.0]),
}
VELOCITY_TERMS: Mapping[str, Any] = {
    "(x' - x)/h": lambda c: (c.end - c.x) / c.h,
    "v": lambda c: c.v,
    "h g": lambda c: c.h * c.gravity,
    "x' - x": lambda c: c.end - c.x,
    "(x' - x)/h²": lambda c: (c.end - c.x) / c.h**2,
    "g": lambda c: c.gravity,
    "h (0, 1, 0)": lambda c: c.h * np.array([0.0, 1.0, 0.0]),
}


def _add_velocities(cases: Sequence[SpringCase], evidence: SpringEvidence) -> None:
    """Add of which differences of positions and old velocities the new ones are a sum."""
    cases = [c for c in cases if c.end is not None and c.end_v is not None and len(c.free)]
    cases = [case for case in cases if not case.problem.external.any()]
    hs, gs = {case.h for case in cases}, {tuple(case.gravity) for case in cases}
    if len(cases) < MIN_CASES or len(hs) < 2 or len(gs) < 2:
        return
    columns = {symbol: _scaled(cases, rule) for symbol, rule in VELOCITY_TERMS.items()}
    found = fit(_scaled(cases, lambda c: c.end_v), columns, 2)
    if found is None:
        return
    if is_sum(found, {"(x' - x)/h": 1.0}):
        evidence.right.append(sentence("v' = (x' - x)/h ({count} cases)", count=len(cases)))
        return
    gaps = _scaled(cases, lambda c: c.end_v - (c.end - c.x) / c.h)
    ends = np.cumsum([3 * len(case.free) for case in cases])[:-1]
    different = sum(np.abs(part).max() > DIFFERENT for part in np.split(gaps, ends))
    if different >= MIN_CASES:
        evidence.statements.append(_of_fit(sentence(
            "Velocities are {formula} in all {count} cases; of an implicit step they are "
            "(x' - x)/h.", formula=formula(found), count=len(cases))))  # fmt: skip
