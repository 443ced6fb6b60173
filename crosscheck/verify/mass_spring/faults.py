"""Faults of mass-spring solvers as independent changes of a problem or of a model, with remedies.

Those that were counted in public programs come first within their aspect.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..sentence import Sentence, sentence
from .model import Integrator, Model
from .problem import Problem


class Option(NamedTuple):
    """One choice of how a solver does a thing, right or wrong.

    Attributes:
        key: its name in reports.
        aspect: what it is a choice of; a solver makes one choice an aspect.
        sentence: what it does, and for a fault what to do instead.
        change: what it makes of the problem, or None.
        fields: what it makes of the model.
    """

    key: str
    aspect: str
    sentence: Sentence
    change: Callable[[Problem], Problem] | None = None
    fields: Mapping[str, Any] = {}


# In the order of the computation.
ASPECTS = (
    "time", "inertia", "masses", "gravity", "springs", "damping", "damper", "integrator",
    "matrix", "substeps", "pins", "velocity", "scaling",
)  # fmt: skip


def _weights(weigh: Callable[[Problem], Any]) -> Callable[[Problem], Problem]:
    """Return the change that puts other weights in place of m gravity."""
    return lambda p: p.changed(weights=weigh(p) * np.ones((p.count, 3)))


def _own_gravity(g: float) -> Callable[[Problem], Problem]:
    return lambda p: p.changed(gravity=np.array([0.0, -g, 0.0]))


def _along(axis: int) -> Callable[[Problem], Problem]:
    return lambda p: p.changed(gravity=-np.linalg.norm(p.gravity) * np.eye(3)[axis])


def _all_as_first(p: Problem) -> Problem:
    return p.changed(masses=np.full(p.count, p.masses[0]))


def _without_spring(which: int) -> Callable[[Problem], Problem]:
    def change(p: Problem) -> Problem:
        kept = np.ones(len(p.springs))
        kept[which] = 0.0
        return p.changed(stiffnesses=kept * p.stiffnesses, dampings=kept * p.dampings)

    return change


GRAVITY = (
    Option(
        "gravity g/m", "gravity",
        sentence("Gravity is divided by the mass: its force is taken for g, or g is divided by m "
                 "twice. The force is m g, and every mass falls alike."),
        _weights(lambda p: p.gravity),
    ),
    Option(
        "gravity doubled", "gravity",
        sentence("Gravity acts twice, as 2 h² g in a step. Add m g once."),
        _weights(lambda p: 2.0 * p.weighed[:, None] * p.gravity),
    ),
    Option(
        "gravity of its own 9.81", "gravity",
        sentence("It uses 9.81 for g instead of the gravity that is given."), _own_gravity(9.81),
    ),
    Option(
        "gravity of its own 9.8", "gravity",
        sentence("It uses 9.8 for g instead of the gravity that is given."), _own_gravity(9.8),
    ),
    Option(
        "gravity of its own 10", "gravity",
        sentence("It uses 10 for g instead of the gravity that is given."), _own_gravity(10.0),
    ),
    Option(
        "gravity of its own 0.3", "gravity",
        sentence("It uses 0.3 for g instead of the gravity that is given."), _own_gravity(0.3),
    ),
    Option(
        "gravity of its own 1", "gravity",
        sentence("It uses 1 for g instead of the gravity that is given."), _own_gravity(1.0),
    ),
    Option(
        "gravity missing", "gravity",
        sentence("Gravity is missing. Add m g to the forces."),
        _weights(lambda p: 0.0),
    ),
    Option(
        "gravity upwards", "gravity",
        sentence("Gravity has the wrong sign: it points upwards. Add m g, do not subtract."),
        lambda p: p.changed(gravity=-p.gravity),
    ),
    Option(
        "gravity m² g", "gravity",
        sentence("Gravity is multiplied by the mass twice. The force is m g."),
        _weights(lambda p: p.weighed[:, None] ** 2 * p.gravity),
    ),
    Option(
        "gravity halved", "gravity",
        sentence("Gravity acts by half, as in h²/2 g. A step of Euler moves a particle by h² g."),
        _weights(lambda p: 0.5 * p.weighed[:, None] * p.gravity),
    ),
    Option(
        "gravity along z", "gravity",
        sentence("Gravity points along -z. Take the direction that is given."), _along(2),
    ),
    Option(
        "external forces missing", "gravity",
        sentence("External forces are ignored. Add them to gravity."),
        lambda p: p.changed(external=np.zeros_like(p.external)),
    ),
    Option(
        "external forces doubled", "gravity",
        sentence("External forces act twice. Add them once."),
        lambda p: p.changed(external=2.0 * p.external),
    ),
    Option(
        "external forces as accelerations", "gravity",
        sentence("External forces are multiplied by the mass. They are forces in newton already."),
        lambda p: p.changed(external=p.weighed[:, None] * p.external),
    ),
)  # fmt: skip
STEP_GRAVITY = (
    Option(
        "gravity without h²", "gravity",
        sentence("Gravity lacks its factor h² in the equation of the step. The right-hand side is "
                 "M y + h² (m g) + h² J d."),
        lambda p: p.changed(weights=p.weighed[:, None] * p.gravity / p.h**2),
    ),
    Option(
        "gravity with h", "gravity",
        sentence("Gravity has the factor h instead of h² in the equation of the step."),
        lambda p: p.changed(weights=p.weighed[:, None] * p.gravity / p.h),
    ),
)  # fmt: skip
MASSES = (
    Option(
        "mass inverse missing", "masses",
        sentence("Forces are not divided by the mass, or M is missing: a = f / m."),
        lambda p: p.changed(masses=np.ones(p.count), weighing=p.masses),
    ),
    Option(
        "mass inverse squared", "masses",
        sentence("Forces are divided by the mass twice. a = f / m."),
        lambda p: p.changed(masses=p.masses**2, weighing=p.masses),
    ),
    Option(
        "mass 1 for all", "masses",
        sentence("Every particle has mass 1, whatever mass is given."),
        lambda p: p.changed(masses=np.ones(p.count)),
    ),
    Option(
        "first mass for all", "masses",
        sentence("Every particle has the mass of the first one. Use the mass of each particle."),
        _all_as_first,
    ),
)  # fmt: skip
SPRINGS = (
    Option(
        "springs twice", "springs",
        sentence("Every spring acts twice, as if each were listed from both ends. Add each "
                 "spring's force once to each of its two particles."),
        lambda p: p.changed(stiffnesses=2.0 * p.stiffnesses, dampings=2.0 * p.dampings),
    ),
    Option(
        "stiffness doubled", "springs",
        sentence("The stiffness counts twice. The energy k/2 (l - r)² has the force k (l - r)."),
        lambda p: p.changed(stiffnesses=2.0 * p.stiffnesses),
    ),
    Option(
        "stiffness halved", "springs",
        sentence("The stiffness counts by half. The force is k (l - r), without the 1/2 of the "
                 "energy."),
        lambda p: p.changed(stiffnesses=0.5 * p.stiffnesses),
    ),
    Option(
        "rest length halved", "springs",
        sentence("Springs rest at half their rest length."),
        lambda p: p.changed(rest_lengths=0.5 * p.rest_lengths),
    ),
    Option(
        "rest length ignored", "springs",
        sentence("Springs rest at length zero: the force is k l instead of k (l - r)."),
        lambda p: p.changed(rest_lengths=0.0 * p.rest_lengths),
    ),
    Option(
        "rest length from the state", "springs",
        sentence("Rest lengths are measured in the present positions, so that springs never pull. "
                 "Measure them once, in the rest shape."),
        lambda p: p.changed(rest_lengths=_lengths_now(p)),
    ),
    Option(
        "first end only", "springs",
        sentence("A spring pulls its first end only. Its second end takes the opposite force."),
        lambda p: p.changed(ends=(1.0, 0.0)),
    ),
    Option(
        "second end only", "springs",
        sentence("A spring pulls its second end only. Its first end takes the opposite force."),
        lambda p: p.changed(ends=(0.0, 1.0)),
    ),
    Option(
        "last spring of a particle only", "springs",
        sentence("Of the springs at a particle only the last one pulls: in NumPy, f[i] -= pull "
                 "counts a repeated index once. Use np.subtract.at(f, i, pull)."),
        lambda p: p.changed(accumulated=False),
    ),
    Option(
        "both ends alike", "springs",
        sentence("A spring adds the same force to both ends. The second takes the opposite one."),
        lambda p: p.changed(ends=(1.0, -1.0)),
    ),
    Option(
        "springs push", "springs",
        sentence("Springs push where they should pull: the sign of k (l - r) u is wrong."),
        lambda p: p.changed(stiffnesses=-p.stiffnesses),
    ),
    Option(
        "tension only", "springs",
        sentence("Springs do not push when they are shorter than at rest; they should."),
        lambda p: p.changed(tension_only=np.ones(len(p.springs), dtype=bool)),
    ),
    Option(
        "tension only ignored", "springs",
        sentence("Springs that resist no compression push all the same."),
        lambda p: p.changed(tension_only=np.zeros(len(p.springs), dtype=bool)),
    ),
    Option(
        "direction not normalised", "springs",
        sentence("The direction of a spring is not divided by its length, so that the force is "
                 "k (l - r) l."),
        lambda p: p.changed(normalised=False),
    ),
    Option(
        "stiffness over rest length", "springs",
        sentence("The force is that of a strain, k (l - r) / r; it should be k (l - r)."),
        lambda p: p.changed(
            stiffnesses=p.stiffnesses / np.where(p.rest_lengths > 0, p.rest_lengths, 1.0)
        ),
    ),
    Option(
        "last spring left out", "springs",
        sentence("The last spring has no effect: the loop over springs ends too early."),
        _without_spring(-1),
    ),
    Option(
        "first spring left out", "springs",
        sentence("The first spring has no effect: the loop over springs starts too late."),
        _without_spring(0),
    ),
    Option(
        "springs missing", "springs",
        sentence("Springs have no effect at all."),
        lambda p: p.changed(stiffnesses=0.0 * p.stiffnesses),
    ),
    Option(
        "first stiffness for all", "springs",
        sentence("Every spring has the stiffness of the first one."),
        lambda p: p.changed(stiffnesses=0.0 * p.stiffnesses + p.stiffnesses[:1]),
    ),
    Option(
        "first rest length for all", "springs",
        sentence("Every spring has the rest length of the first one."),
        lambda p: p.changed(rest_lengths=0.0 * p.rest_lengths + p.rest_lengths[:1]),
    ),
)  # fmt: skip


def _lengths_now(p: Problem) -> Any:
    d = p.positions[p.springs[:, 0]] - p.positions[p.springs[:, 1]]
    return np.sqrt((d * d).sum(axis=1))


DAMPING = (
    Option(
        "damping missing", "damping",
        sentence("Dampers have no effect. Add -c ((v_i - v_j)·u) u to a spring's force."),
        lambda p: p.changed(dampings=0.0 * p.dampings),
    ),
    Option(
        "damping wrong sign", "damping",
        sentence("Damping has the wrong sign and speeds motion up. Its force opposes the relative "
                 "velocity."),
        lambda p: p.changed(dampings=-p.dampings),
    ),
    Option(
        "damping doubled", "damping",
        sentence("Damping acts twice. Add it once to each end."),
        lambda p: p.changed(dampings=2.0 * p.dampings),
    ),
    Option(
        "damping halved", "damping",
        sentence("Damping acts by half."),
        lambda p: p.changed(dampings=0.5 * p.dampings),
    ),
    Option(
        "damping not projected", "damping",
        sentence("Damping acts on all of the relative velocity. Project it on the spring: "
                 "c ((v_i - v_j)·u) u."),
        lambda p: p.changed(damping="all"),
    ),
    Option(
        "damping as drag", "damping",
        sentence("Damping slows every particle by its own velocity, -c v, instead of the relative "
                 "velocity along the spring."),
        lambda p: p.changed(damping="drag"),
    ),
    Option(
        "damping of own velocity", "damping",
        sentence("Each end is damped by its own velocity along the spring. Use the difference of "
                 "the two ends' velocities."),
        lambda p: p.changed(damping="own"),
    ),
    Option(
        "damping times stiffness", "damping",
        sentence("Damping is multiplied by the stiffness: c k instead of c."),
        lambda p: p.changed(dampings=p.dampings * p.stiffnesses),
    ),
    Option(
        "first damping for all", "damping",
        sentence("Every spring has the damping of the first one."),
        lambda p: p.changed(dampings=0.0 * p.dampings + p.dampings[:1]),
    ),
)  # fmt: skip
STEP_DAMPING = (
    Option(
        "damping with h", "damping",
        sentence("Damping has a factor h too many."),
        lambda p: p.changed(dampings=p.h * p.dampings),
    ),
    Option(
        "damping without h", "damping",
        sentence("Damping lacks a factor h: c/h stands for c."),
        lambda p: p.changed(dampings=p.dampings / p.h),
    ),
)  # fmt: skip


def _matrix(key: str, said: Sentence) -> Option:
    return Option("matrix " + key, "matrix", said, fields={"matrix": key})


MATRIX = (
    _matrix("without k", sentence("The system matrix lacks the stiffness: the sum is of "
                                  "k A A', not of A A'.")),
    _matrix("without k, minus", sentence("The system matrix is M minus h² A A' without the "
                                         "stiffness. It should be M + h² L with L the sum of "
                                         "k A A'.")),
    _matrix("doubled beside", sentence("The entries of the system matrix off its diagonal are "
                                       "doubled: each spring adds -h² k once to each of the "
                                       "two.")),
    _matrix("M-h²L", sentence("The system matrix is M - h² L: the springs' part has the wrong "
                                "sign.")),
    _matrix("L", sentence("The system is solved with h² L; the matrix is M + h² L: the masses are "
                          "missing.")),
    _matrix("L without h²", sentence("The system is solved with L in place of M + h² L.")),
    _matrix("M+hL", sentence("The system matrix is M + h L; the springs' part needs h².")),
    _matrix("M+L", sentence("The system matrix is M + L; the springs' part needs its h².")),
    _matrix("positive beside", sentence("The entries of the system matrix off its diagonal have "
                                        "the wrong sign: each is -h² k.")),
    _matrix("diagonal", sentence("The system matrix has nothing off its diagonal.")),
    _matrix("M", sentence("The system matrix is M, without the springs' part h² L.")),
    _matrix("2M+h²L", sentence("The masses stand twice in the system matrix.")),
)  # fmt: skip
PINS = (
    Option(
        "pins free until the end", "pins",
        sentence("Pins move freely through all the substeps and are put back at the end only. "
                 "Hold them in every substep."),
        fields={"pins": "at_the_end"},
    ),
    Option(
        "pins free", "pins",
        sentence("Pins are not held at all."), fields={"pins": "free"},
    ),
    Option(
        "pins of one kilogram", "pins",
        sentence("Pins have a mass of 1 kg, which holds nothing."),
        fields={"pins": "one kilogram"},
    ),
    Option(
        "pins without springs", "pins",
        sentence("Springs to pins do not pull their other end. Pins do not move, yet they hold "
                 "their neighbours."),
        fields={"pins": "unattached"},
    ),
    Option(
        "pins at the origin", "pins",
        sentence("The columns of the pins were dropped from the system without moving their part "
                 "to the right-hand side: springs pull towards the origin."),
        fields={"pins": "origin"},
    ),
    Option(
        "first pin only", "pins",
        sentence("Only the first pin is held."), fields={"pins": "first"},
    ),
)  # fmt: skip


def _velocity(key: str, said: Sentence) -> Option:
    return Option("velocity " + key, "velocity", said, fields={"velocity": key})


VELOCITY = (
    _velocity("old forces", sentence("The velocity is v + h f(x_n) / m, from the forces at the "
                                     "start; it should be (x' - x) / h.")),
    _velocity("kept", sentence("The velocity stays what it was. It should be (x' - x) / h.")),
    _velocity("over 2h", sentence("The velocity is (x' - x) / (2 h). It should be (x' - x) / h.")),
    _velocity("with the old", sentence("The old velocity is added to (x' - x) / h, which has it "
                                       "already.")),
    _velocity("averaged", sentence("The velocity is the mean of the old one and (x' - x) / h.")),
    _velocity("not divided", sentence("The velocity is x' - x, not divided by h.")),
    _velocity("over h²", sentence("The velocity is (x' - x) / h². Divide by h once.")),
    _velocity("over the whole h", sentence("The displacement of a substep is divided by the whole "
                                           "h. Divide it by the substep's.")),
    _velocity("from y", sentence("The velocity is (x' - y) / h, which lacks the old velocity. It "
                                 "should be (x' - x) / h.")),
    _velocity("zero", sentence("The velocity is zero after the step. It should be (x' - x) / h.")),
    _velocity("backwards", sentence("The velocity is (x - x') / h: its sign is wrong.")),
)  # fmt: skip
INERTIA = (
    Option(
        "velocity not used", "inertia",
        sentence("The old velocity does not enter: y is x instead of x + h v."),
        fields={"inertia": "x_n"},
    ),
    Option(
        "velocity used twice", "inertia",
        sentence("The old velocity enters twice: y is x + 2 h v instead of x + h v."),
        fields={"inertia": "doubled"},
    ),
    Option(
        "velocity with h²", "inertia",
        sentence("The old velocity enters with h² instead of h: y is x + h v."),
        fields={"inertia": "squared"},
    ),
)  # fmt: skip


def _time(key: str, said: Sentence, time: str | float) -> Option:
    return Option(key, "time", said, fields={"time": time})


TIME = (
    _time("h not divided", sentence("Each substep is as long as the whole step. Divide h by their "
                                    "number."), "undivided"),
    _time("factor kept", sentence("The system matrix is that of an earlier h: it was factorised "
                                  "once and kept. Factorise again when h changes."), "before"),
    _time("h of its own 1/60", sentence("It uses 1/60 s for h, whatever h is given."), 1 / 60),
    _time("h of its own 0.01", sentence("It uses 0.01 s for h, whatever h is given."), 0.01),
    _time("h of its own 1/30", sentence("It uses 1/30 s for h, whatever h is given."), 1 / 30),
    _time("h of its own 0.001", sentence("It uses 0.001 s for h, whatever h is given."), 0.001),
)  # fmt: skip


def _descents() -> list[Option]:
    return [
        Option(
            "gradient descent", "integrator",
            sentence("It goes {n} times down the gradient of g by {rate} of it, which is far from "
                     "the minimum. Use Newton's method, or iterate to convergence.",
                     n=n, rate=rate),
            fields={"integrator": Integrator("descent", start, n, rate=rate)},
        )
        for rate in (0.001, 0.01, 0.1, 0.5, 1.0)
        for n in (1, 2, 3, 5, 10, 20, 50, 100)
        for start in ("x_n", "y")
    ]  # fmt: skip


def _shortened() -> list[Option]:
    return [
        Option(
            "Newton with a fixed step length", "integrator",
            sentence("It takes {n} steps of Newton's method, each only {rate} of its length, and "
                     "stops before it arrives. Take whole steps where they lower g.",
                     n=n, rate=rate),
            fields={"integrator": Integrator("newton", start, n, rate=rate)},
        )
        for rate in (0.01, 0.1, 0.5)
        for n in (1, 5, 10, 20, 50, 100)
        for start in ("x_n", "y")
    ]  # fmt: skip


def _wrong_hessians() -> list[Option]:
    return [
        Option(key, "integrator", said,
               fields={"integrator": Integrator("newton", start, n, kind)})
        for kind, key, said in (
            ("frozen", "Hessian frozen at x_n",
             sentence("The Hessian stays that of x_n in all iterations. Compute it anew where the "
                      "iteration has come to.")),
            ("flipped", "geometric term with the wrong sign",
             sentence("The term k (1 - r/l) (I - u u') of the Hessian has the wrong sign.")),
            ("transverse", "Hessian without k u u'",
             sentence("The Hessian lacks k u u', the stiffness along the spring.")),
        )
        for n in (1, 2, 3, 5, 10, 20)
        for start in ("x_n", "y")
        if not (kind == "frozen" and n == 1)
    ]  # fmt: skip


INTEGRATORS = (
    *_wrong_hessians(),
    *_shortened(),
    *_descents(),
    Option(
        "moved in place",
        "integrator",
        sentence(
            "Particles are moved one after another while forces are still summed, so that "
            "later ones see new positions. Compute all forces first."
        ),
        fields={"integrator": Integrator("in_place")},
    ),
)

FORCE_FAULTS = (*GRAVITY[:-3], *SPRINGS, *DAMPING)
STEP_FAULTS = (
    *TIME, *INERTIA, *MASSES, *GRAVITY, *STEP_GRAVITY, *SPRINGS, *DAMPING, *STEP_DAMPING,
    *INTEGRATORS, *MATRIX, *PINS, *VELOCITY,
)  # fmt: skip


def apply(options: tuple[Option, ...], p: Problem, model: Model) -> tuple[Problem, Model]:
    """Return the problem and the model as a solver with these options has them."""
    for option in options:
        if option.change is not None:
            p = option.change(p)
        if option.fields:
            model = model._replace(**option.fields)
    return p, model
