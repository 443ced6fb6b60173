"""Faults of mass-spring solvers as independent changes of a problem or of a model, with remedies.

Those that were counted in public programs come first within their aspect.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from ..sentence import Sentence, sentence
from .model import Integrator, StepModel
from .problem import SpringProblem, frames

Change = Callable[[SpringProblem], SpringProblem]


class Option(NamedTuple):
    """One choice of how a solver does a thing, right or wrong."""

    key: str  # its name in reports
    aspect: str  # what it is a choice of; a solver makes one choice an aspect
    sentence: Sentence  # what it does, and for a fault what to do instead
    change: Change | None = None  # what it makes of the problem, or None
    fields: Mapping[str, Any] = {}  # what it makes of the model


# In the order of the computation.
ASPECTS = (
    "time", "inertia", "masses", "gravity", "springs", "damping", "damper", "integrator",
    "matrix", "substeps", "pins", "velocity", "scaling",
)  # fmt: skip


def faults_of(
    aspect: str, table: Mapping[str, tuple[Change | Mapping[str, Any], Sentence]]
) -> tuple[Option, ...]:
    """Return options by their keys: what each changes of the problem or sets in the model."""
    return tuple(
        Option(key, aspect, said, fields=what)
        if isinstance(what, Mapping)
        else Option(key, aspect, said, what)
        for key, (what, said) in table.items()
    )


def choices_of(aspect: str, table: Mapping[Any, Sentence]) -> tuple[Option, ...]:
    """Return an option for each value of the model's field of this name."""
    return tuple(
        Option(f"{aspect} {value}", aspect, said, fields={aspect: value})
        for value, said in table.items()
    )


def _set(**fields: Any) -> Change:
    return lambda p: p.changed(**fields)


def _scaled(**factors: float) -> Change:
    return lambda p: p.changed(**{name: f * getattr(p, name) for name, f in factors.items()})


def _weights(weigh: Callable[[SpringProblem], Any]) -> Change:
    """Return the change that puts other weights in place of m gravity."""
    return lambda p: p.changed(weights=weigh(p) * np.ones((p.count, 3)))


def _own_gravity(g: float) -> Change:
    return _set(gravity=np.array([0.0, -g, 0.0]))


def _along(axis: int) -> Change:
    return lambda p: p.changed(gravity=-np.linalg.norm(p.gravity) * np.eye(3)[axis])


def _all_as_first(name: str) -> Change:
    return lambda p: p.changed(**{name: 0.0 * getattr(p, name) + getattr(p, name)[:1]})


def _without_spring(which: int) -> Change:
    def change(p: SpringProblem) -> SpringProblem:
        kept = np.ones(len(p.springs))
        kept[which] = 0.0
        return p.changed(stiffnesses=kept * p.stiffnesses, dampings=kept * p.dampings)

    return change


def _tension_only(flag: bool) -> Change:
    return lambda p: p.changed(tension_only=np.full(len(p.springs), flag))


def _rest_now(p: SpringProblem) -> SpringProblem:
    return p.changed(rest_lengths=frames(p, p.positions)[0])


def _of_strain(p: SpringProblem) -> SpringProblem:
    r = np.where(p.rest_lengths > 0, p.rest_lengths, 1.0)
    return p.changed(stiffnesses=p.stiffnesses / r)


GRAVITY = faults_of("gravity", {
    "gravity g/m": (_weights(lambda p: p.gravity), sentence(
        "Gravity is divided by the mass: its force is taken for g, or g is divided by m twice. "
        "The force is m g, and every mass falls alike.")),
    "gravity doubled": (_weights(lambda p: 2.0 * p.weighed[:, None] * p.gravity), sentence(
        "Gravity acts twice, as 2 h² g in a step. Add m g once.")),
    **{f"gravity of its own {g:g}": (_own_gravity(g), sentence(
        "It uses {g:g} for g instead of the gravity that is given.", g=g))
       for g in (9.81, 9.8, 10.0, 0.3, 1.0)},
    "gravity missing": (_weights(lambda p: 0.0), sentence(
        "Gravity is missing. Add m g to the forces.")),
    "gravity upwards": (_scaled(gravity=-1.0), sentence(
        "Gravity has the wrong sign: it points upwards. Add m g, do not subtract.")),
    "gravity m² g": (_weights(lambda p: p.weighed[:, None] ** 2 * p.gravity), sentence(
        "Gravity is multiplied by the mass twice. The force is m g.")),
    "gravity halved": (_weights(lambda p: 0.5 * p.weighed[:, None] * p.gravity), sentence(
        "Gravity acts by half, as in h²/2 g. A step of Euler moves a particle by h² g.")),
    "gravity along z": (_along(2), sentence(
        "Gravity points along -z. Take the direction that is given.")),
    "external forces missing": (_scaled(external=0.0), sentence(
        "External forces are ignored. Add them to gravity.")),
    "external forces doubled": (_scaled(external=2.0), sentence(
        "External forces act twice. Add them once.")),
    "external forces as accelerations": (
        lambda p: p.changed(external=p.weighed[:, None] * p.external),
        sentence("External forces are multiplied by the mass. They are forces in newton already.")),
})  # fmt: skip
STEP_GRAVITY = faults_of("gravity", {
    "gravity without h²": (
        lambda p: p.changed(weights=p.weighed[:, None] * p.gravity / p.h**2),
        sentence(
            "Gravity lacks its factor h² in the equation of the step. The right-hand side is M y "
            "+ h² (m g) + h² J d.")),
    "gravity with h": (lambda p: p.changed(weights=p.weighed[:, None] * p.gravity / p.h), sentence(
        "Gravity has the factor h instead of h² in the equation of the step.")),
})  # fmt: skip
MASSES = faults_of("masses", {
    "mass inverse missing": (
        lambda p: p.changed(masses=np.ones(p.count), weighing=p.masses),
        sentence("Forces are not divided by the mass, or M is missing: a = f / m.")),
    "mass inverse squared": (lambda p: p.changed(masses=p.masses**2, weighing=p.masses), sentence(
        "Forces are divided by the mass twice. a = f / m.")),
    "mass 1 for all": (lambda p: p.changed(masses=np.ones(p.count)), sentence(
        "Every particle has mass 1, whatever mass is given.")),
    "first mass for all": (_all_as_first("masses"), sentence(
        "Every particle has the mass of the first one. Use the mass of each particle.")),
})  # fmt: skip
SPRINGS = faults_of("springs", {
    "springs twice": (_scaled(stiffnesses=2.0, dampings=2.0), sentence(
        "Every spring acts twice, as if each were listed from both ends. Add each spring's "
        "force once to each of its two particles.")),
    "stiffness doubled": (_scaled(stiffnesses=2.0), sentence(
        "The stiffness counts twice. The energy k/2 (l - r)² has the force k (l - r).")),
    "stiffness halved": (_scaled(stiffnesses=0.5), sentence(
        "The stiffness counts by half. The force is k (l - r), without the 1/2 of the energy.")),
    "rest length halved": (_scaled(rest_lengths=0.5), sentence(
        "Springs rest at half their rest length.")),
    "rest length ignored": (_scaled(rest_lengths=0.0), sentence(
        "Springs rest at length zero: the force is k l instead of k (l - r).")),
    "rest length from the state": (_rest_now, sentence(
        "Rest lengths are measured in the present positions, so that springs never pull. Measure "
        "them once, in the rest shape.")),
    "first end only": (_set(ends=(1.0, 0.0)), sentence(
        "A spring pulls its first end only. Its second end takes the opposite force.")),
    "second end only": (_set(ends=(0.0, 1.0)), sentence(
        "A spring pulls its second end only. Its first end takes the opposite force.")),
    "last spring of a particle only": (_set(accumulated=False), sentence(
        "Of the springs at a particle only the last one pulls: in NumPy, f[i] -= pull counts a "
        "repeated index once. Use np.subtract.at(f, i, pull).")),
    "both ends alike": (_set(ends=(1.0, -1.0)), sentence(
        "A spring adds the same force to both ends. The second takes the opposite one.")),
    "springs push": (_scaled(stiffnesses=-1.0), sentence(
        "Springs push where they should pull: the sign of k (l - r) u is wrong.")),
    "tension only": (_tension_only(True), sentence(
        "Springs do not push when they are shorter than at rest; they should.")),
    "tension only ignored": (_tension_only(False), sentence(
        "Springs that resist no compression push all the same.")),
    "direction not normalised": (_set(normalised=False), sentence(
        "The direction of a spring is not divided by its length, so that the force is k (l - r) "
        "l.")),
    "stiffness over rest length": (_of_strain, sentence(
        "The force is that of a strain, k (l - r) / r; it should be k (l - r).")),
    "last spring left out": (_without_spring(-1), sentence(
        "The last spring has no effect: the loop over springs ends too early.")),
    "first spring left out": (_without_spring(0), sentence(
        "The first spring has no effect: the loop over springs starts too late.")),
    "springs missing": (_scaled(stiffnesses=0.0), sentence("Springs have no effect at all.")),
    "first stiffness for all": (_all_as_first("stiffnesses"), sentence(
        "Every spring has the stiffness of the first one.")),
    "first rest length for all": (_all_as_first("rest_lengths"), sentence(
        "Every spring has the rest length of the first one.")),
})  # fmt: skip
DAMPING = faults_of("damping", {
    "damping missing": (_scaled(dampings=0.0), sentence(
        "Dampers have no effect. Add -c ((v_i - v_j)·u) u to a spring's force.")),
    "damping wrong sign": (_scaled(dampings=-1.0), sentence(
        "Damping has the wrong sign and speeds motion up. Its force opposes the relative "
        "velocity.")),
    "damping doubled": (_scaled(dampings=2.0), sentence(
        "Damping acts twice. Add it once to each end.")),
    "damping halved": (_scaled(dampings=0.5), sentence("Damping acts by half.")),
    "damping not projected": (_set(damping="all"), sentence(
        "Damping acts on all of the relative velocity. Project it on the spring: c ((v_i - "
        "v_j)·u) u.")),
    "damping as drag": (_set(damping="drag"), sentence(
        "Damping slows every particle by its own velocity, -c v, instead of the relative "
        "velocity along the spring.")),
    "damping of own velocity": (_set(damping="own"), sentence(
        "Each end is damped by its own velocity along the spring. Use the difference of the two "
        "ends' velocities.")),
    "damping times stiffness": (lambda p: p.changed(dampings=p.dampings * p.stiffnesses), sentence(
        "Damping is multiplied by the stiffness: c k instead of c.")),
    "first damping for all": (_all_as_first("dampings"), sentence(
        "Every spring has the damping of the first one.")),
})  # fmt: skip
STEP_DAMPING = faults_of("damping", {
    "damping with h": (lambda p: p.changed(dampings=p.h * p.dampings), sentence(
        "Damping has a factor h too many.")),
    "damping without h": (lambda p: p.changed(dampings=p.dampings / p.h), sentence(
        "Damping lacks a factor h: c/h stands for c.")),
})  # fmt: skip
MATRIX = choices_of("matrix", {
    "without k": sentence(
        "The system matrix lacks the stiffness: the sum is of k A A', not of A A'."),
    "without k, minus": sentence(
        "The system matrix is M minus h² A A' without the stiffness. It should be M + h² L with L "
        "the sum of k A A'."),
    "doubled beside": sentence(
        "The entries of the system matrix off its diagonal are doubled: each spring adds -h² k "
        "once to each of the two."),
    "M-h²L": sentence("The system matrix is M - h² L: the springs' part has the wrong sign."),
    "L": sentence(
        "The system is solved with h² L; the matrix is M + h² L: the masses are missing."),
    "L without h²": sentence("The system is solved with L in place of M + h² L."),
    "M+hL": sentence("The system matrix is M + h L; the springs' part needs h²."),
    "M+L": sentence("The system matrix is M + L; the springs' part needs its h²."),
    "positive beside": sentence(
        "The entries of the system matrix off its diagonal have the wrong sign: each is -h² k."),
    "diagonal": sentence("The system matrix has nothing off its diagonal."),
    "M": sentence("The system matrix is M, without the springs' part h² L."),
    "2M+h²L": sentence("The masses stand twice in the system matrix."),
})  # fmt: skip
PINS = faults_of("pins", {
    "pins free until the end": ({"pins": "at_the_end"}, sentence(
        "Pins move freely through all the substeps and are put back at the end only. Hold them "
        "in every substep.")),
    "pins free": ({"pins": "free"}, sentence("Pins are not held at all.")),
    "pins of one kilogram": ({"pins": "one kilogram"}, sentence(
        "Pins have a mass of 1 kg, which holds nothing.")),
    "pins without springs": ({"pins": "unattached"}, sentence(
        "Springs to pins do not pull their other end. Pins do not move, yet they hold their "
        "neighbours.")),
    "pins at the origin": ({"pins": "origin"}, sentence(
        "The columns of the pins were dropped from the system without moving their part to the "
        "right-hand side: springs pull towards the origin.")),
    "first pin only": ({"pins": "first"}, sentence("Only the first pin is held.")),
})  # fmt: skip
VELOCITY = choices_of("velocity", {
    "old forces": sentence(
        "The velocity is v + h f(x_n) / m, from the forces at the start; it should be (x' - x) / "
        "h."),
    "kept": sentence("The velocity stays what it was. It should be (x' - x) / h."),
    "over 2h": sentence("The velocity is (x' - x) / (2 h). It should be (x' - x) / h."),
    "with the old": sentence("The old velocity is added to (x' - x) / h, which has it already."),
    "averaged": sentence("The velocity is the mean of the old one and (x' - x) / h."),
    "not divided": sentence("The velocity is x' - x, not divided by h."),
    "over h²": sentence("The velocity is (x' - x) / h². Divide by h once."),
    "over the whole h": sentence(
        "The displacement of a substep is divided by the whole h. Divide it by the substep's."),
    "from y": sentence(
        "The velocity is (x' - y) / h, which lacks the old velocity. It should be (x' - x) / h."),
    "zero": sentence("The velocity is zero after the step. It should be (x' - x) / h."),
    "backwards": sentence("The velocity is (x - x') / h: its sign is wrong."),
})  # fmt: skip
INERTIA = faults_of("inertia", {
    "velocity not used": ({"inertia": "x_n"}, sentence(
        "The old velocity does not enter: y is x instead of x + h v.")),
    "velocity used twice": ({"inertia": "doubled"}, sentence(
        "The old velocity enters twice: y is x + 2 h v instead of x + h v.")),
    "velocity with h²": ({"inertia": "squared"}, sentence(
        "The old velocity enters with h² instead of h: y is x + h v.")),
})  # fmt: skip
TIME = faults_of("time", {
    "h not divided": ({"time": "undivided"}, sentence(
        "Each substep is as long as the whole step. Divide h by their number.")),
    "factor kept": ({"time": "before"}, sentence(
        "The system matrix is that of an earlier h: it was factorised once and kept. Factorise "
        "again when h changes.")),
    **{f"h of its own {h}": ({"time": float(Fraction(h))}, sentence(
        "It uses {h} s for h, whatever h is given.", h=h))
       for h in ("1/60", "0.01", "1/30", "0.001")},
})  # fmt: skip


def _integrators(key: str, said: Sentence, *values: Any, **settings: Any) -> list[Option]:
    """Return an integrator from each start."""
    return [
        Option(key, "integrator", said, fields={"integrator": how})
        for start in ("x_n", "y")
        for how in [Integrator(values[0], start, *values[1:], **settings)]
    ]


def _descents(n: int, rate: float) -> list[Option]:
    return _integrators("gradient descent", sentence(
        "It goes {n} times down the gradient of g by {rate} of it, which is far from the minimum. "
        "Use Newton's method, or iterate to convergence.", n=n, rate=rate),
        "descent", n, rate=rate)  # fmt: skip


def _shortened(n: int, rate: float) -> list[Option]:
    return _integrators("Newton with a fixed step length", sentence(
        "It takes {n} steps of Newton's method, each only {rate} of its length, and stops before "
        "it arrives. Take whole steps where they lower g.", n=n, rate=rate),
        "newton", n, rate=rate)  # fmt: skip


_HESSIANS = {
    "frozen": ("Hessian frozen at x_n", sentence(
        "The Hessian stays that of x_n in all iterations. Compute it anew where the iteration has "
        "come to.")),
    "flipped": ("geometric term with the wrong sign", sentence(
        "The term k (1 - r/l) (I - u u') of the Hessian has the wrong sign.")),
    "transverse": ("Hessian without k u u'", sentence(
        "The Hessian lacks k u u', the stiffness along the spring.")),
}  # fmt: skip
INTEGRATORS = (
    *(option for kind, words in _HESSIANS.items() for n in (1, 2, 3, 5, 10, 20)
      if (kind, n) != ("frozen", 1) for option in _integrators(*words, "newton", n, kind)),
    *(option for rate in (0.01, 0.1, 0.5) for n in (1, 5, 10, 20, 50, 100)
      for option in _shortened(n, rate)),
    *(option for rate in (0.001, 0.01, 0.1, 0.5, 1.0) for n in (1, 2, 3, 5, 10, 20, 50, 100)
      for option in _descents(n, rate)),
    *faults_of("integrator", {"moved in place": ({"integrator": Integrator("in_place")}, sentence(
        "Particles are moved one after another while forces are still summed, so that later ones "
        "see new positions. Compute all forces first."))}),
)  # fmt: skip

FORCE_FAULTS = (*GRAVITY[:-3], *SPRINGS, *DAMPING)
STEP_FAULTS = (
    *TIME, *INERTIA, *MASSES, *GRAVITY, *STEP_GRAVITY, *SPRINGS, *DAMPING, *STEP_DAMPING,
    *INTEGRATORS, *MATRIX, *PINS, *VELOCITY,
)  # fmt: skip


def apply(
    options: tuple[Option, ...], p: SpringProblem, model: StepModel
) -> tuple[SpringProblem, StepModel]:
    """Return the problem and the model as a solver with these options has them."""
    for option in options:
        if option.change is not None:
            p = option.change(p)
        if option.fields:
            model = model._replace(**option.fields)
    return p, model


def combined(options: Sequence[Option], most: int = 3) -> Iterator[tuple[Option, ...]]:
    """Yield each option, then each pair and so on, of different aspects."""
    for count in range(1, most + 1):
        for chosen in combinations(options, count):
            if len({one.aspect for one in chosen}) == count:
                yield chosen
