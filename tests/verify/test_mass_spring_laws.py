"""Each law of a step at the edge of its tolerance: just within and just beyond.

The faults of `test_mass_spring.py` are gross; a tolerance or a verdict that is wrong by a factor
shows only here.
"""

import numpy as np
import pytest

from plumbob.reference.judging.minima import Minima
from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.exchange import Answer, Exchange
from plumbob.verify.greeting import Step
from plumbob.verify.judgement import Verdict
from plumbob.verify.laws import equal_answers
from plumbob.verify.mass_spring import laws
from plumbob.verify.mass_spring.laws import IMPRECISE, SOLVED, StepContext, rounding
from plumbob.verify.mass_spring.model import Integrator, Scaling, StepModel, predicted
from plumbob.verify.mass_spring.problem import problem_of, state_of, system_of

pytestmark = pytest.mark.usefixtures("verdict_alone")

EPSILON = 2.0**-52
LINEARISED = StepModel(Integrator("newton", "x_n", 1), damper="explicit")
CONVERGED = StepModel(Integrator("converged", "y"))
RIGHT, RIGHT_EXCEPT, WRONG = Verdict.RIGHT, Verdict.RIGHT_EXCEPT, Verdict.WRONG


def triangle(pinned=()):
    """Return three unequal particles joined by stretched, damped springs, in motion."""
    return problem_of(
        {
            "masses": [1.0, 2.0, 0.5],
            "springs": [[0, 1], [1, 2], [2, 0]],
            "rest_lengths": [0.7, 0.8, 0.9],
            "stiffnesses": [50.0, 80.0, 30.0],
            "dampings": [0.1, 0.2, 0.3],
            "pinned": pinned,
            "gravity": [0.0, -9.81, 0.0],
            "positions": [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.3, 0.9, 0.2]],
            "velocities": [[0.5, 0.0, 0.1], [-0.3, 0.2, 0.0], [0.0, 0.4, -0.2]],
            "h": 0.02,
        }
    )


def buckled():
    """A particle pressed between two pins, held in a plane by two more: it buckles up or down."""
    pins = [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, -2.0], [0.0, 0.0, 2.0]]
    return problem_of({
        "masses": np.ones(5), "springs": [[0, i] for i in range(1, 5)], "dampings": np.zeros(4),
        "rest_lengths": [1.0, 1.0, 0.5, 0.5], "stiffnesses": [100.0, 100.0, 60.0, 60.0],
        "pinned": [1, 2, 3, 4], "gravity": np.zeros(3), "h": 1.0,
        "positions": [[0.0, 0.1, 0.0], *pins], "velocities": np.zeros((5, 3)),
    })  # fmt: skip


def beside_another_minimum(p, share):
    """The change to the minimum beyond the pins, and on from there by a share of the step."""
    x = predicted(p, CONVERGED)["positions"]
    other = Minima(system_of(p), state_of(p), p.h).nearest(x * [1.0, -1.0, 1.0]).positions
    assert other[0, 1] < -0.1
    return other - x + share * (p.positions - other)


def judged(law, p, model=LINEARISED, pins="eliminated", known=True, **changes):
    """Return what a law finds of the model's own step with some outputs changed by an array."""
    expected = predicted(p, model)
    answered = {name: value + changes.get(name, 0.0) for name, value in expected.items()}
    allowed = rounding(p, model, EPSILON)
    step = Step(pins=pins)
    return law(StepContext(p, answered, allowed, model, known, sentence(""), expected, step))


def displacement(p, model=LINEARISED):
    return float(np.abs(predicted(p, model)["positions"] - p.positions).max())


def one_moved(particle, distance, axis=2):
    """Return an array that moves a single particle."""
    change = np.zeros((3, 3))
    change[particle, axis] = distance
    return change


def bound(p, model=LINEARISED):
    return rounding(p, model, EPSILON).positions


def speed(p):
    return np.abs(predicted(p, LINEARISED)["velocities"]).max()


def scale_of_acceleration(p):
    return np.abs((predicted(p, LINEARISED)["velocities"] - p.velocities) / p.h)[1:].max()


SMALL_STEP = triangle([0]).changed(h=1e-4)
EDGE = [(0.5, RIGHT), (2.0, WRONG)]
GRADES = [
    (0.5 * SOLVED, RIGHT), (2.0 * SOLVED, RIGHT_EXCEPT), (0.5 * IMPRECISE, RIGHT_EXCEPT),
    (2.0 * IMPRECISE, WRONG),
]  # fmt: skip
# A law, a problem, what differs from a linearised step, a change of the step's outputs by some
# share, and what the law says of such shares.
EDGES = {
    "a declared pin moves by rounding only": (
        laws.pins, triangle([0, 1]), {},
        lambda p, share: {"positions": one_moved(1, share * bound(p))}, EDGE),
    "a pin that nothing is said of moves by what is imprecise": (
        laws.pins, triangle([0]), {"pins": None},
        lambda p, share: {"positions": one_moved(0, share * IMPRECISE * displacement(p))},
        [(0.5, RIGHT_EXCEPT), (2.0, WRONG)]),
    "and a declared one does not": (
        laws.pins, triangle([0]), {},
        lambda p, share: {"positions": one_moved(0, share * IMPRECISE * displacement(p))},
        [(0.5, WRONG)]),
    "imprecise positions have a reservation": (
        laws.declared_step, triangle(), {},
        lambda p, share: {"positions": one_moved(2, share * displacement(p))}, GRADES),
    "imprecise velocities have a reservation": (
        laws.velocities, triangle(), {},
        lambda p, share: {"velocities": one_moved(2, share * speed(p))}, GRADES),
    "a pin that has a velocity has a reservation": (
        laws.pin_velocities, triangle([1]), {},
        lambda p, share: {"velocities": one_moved(1, share * rounding(p, LINEARISED, EPSILON)[1])},
        [(0.5, RIGHT), (2.0, RIGHT_EXCEPT)]),
    "velocities are held against the positions answered": (
        laws.velocities, triangle(), {},
        lambda p, share: {"positions": one_moved(2, 0.01),
                          "velocities": one_moved(2, share * 0.01 / p.h)},
        [(1.0, RIGHT), (0.0, WRONG)]),
    "springs move the centre of mass by rounding and a millionth of the displacement at most": (
        laws.momentum, triangle(), {},
        lambda p, share: {"positions": np.tile(
            [0, 0, share * (4.0 * bound(p) + SOLVED * displacement(p, LINEARISED))], (3, 1))},
        EDGE),
    "masses weigh in the centre of mass, of which the lightest particle is a seventh": (
        laws.momentum, triangle(), {},
        lambda p, share: {"positions": one_moved(0, 0.01) - one_moved(1, 0.005) + one_moved(
            2, 7.0 * share * (4.0 * bound(p) + SOLVED * 0.01))},
        EDGE),
    "gravity takes the centre of mass by h² g or by less, never beyond or upwards": (
        laws.momentum, triangle(), {},
        lambda p, share: {"positions": np.tile(share * p.h**2 * p.gravity, (3, 1))},
        [(-1.0, RIGHT), (-0.5, RIGHT), (0.0, RIGHT), (-1.01, WRONG), (0.01, WRONG)]),
    "a solver that iterates may leave a part of the momentum": (
        laws.momentum, triangle(), {"model": CONVERGED},
        lambda p, share: {"positions": np.tile([0, 0, share * 1e-4 * displacement(p, CONVERGED)],
                                               (3, 1))}, EDGE),
    "a converged step is the minimiser and another says so": (
        laws.minimiser, triangle(), {"model": CONVERGED},
        lambda p, share: {"positions": one_moved(1, share * displacement(p, CONVERGED))},
        [(0.0, RIGHT), (0.5 * SOLVED, RIGHT), (0.01, RIGHT_EXCEPT)]),
    "another minimum is as right, and beside it an answer is as wrong": (
        laws.minimiser, buckled(), {"model": CONVERGED},
        lambda p, share: {"positions": beside_another_minimum(p, share)},
        [(0.0, RIGHT), (1e-4, RIGHT_EXCEPT)]),
    "a declared step may end at another minimum, not beside it": (
        laws.declared_step, buckled(), {"model": CONVERGED},
        lambda p, share: {"positions": beside_another_minimum(p, share)},
        [(0.0, RIGHT), (0.5 * IMPRECISE, RIGHT), (0.01, WRONG)]),
    "nobody can tell of an unknown step": (
        laws.minimiser, triangle(), {"model": CONVERGED, "known": False},
        lambda p, share: {"positions": one_moved(1, share * displacement(p, CONVERGED))},
        [(0.0, RIGHT), (0.01, Verdict.UNDECIDED)]),
    "the acceleration of a small step is f / m to a tenth of the largest": (
        laws.consistency, SMALL_STEP, {},
        lambda p, share: {"velocities": one_moved(1, share * scale_of_acceleration(p) * p.h)},
        [(0.05, RIGHT), (0.2, WRONG), (-0.2, WRONG)]),
    "but not of a pin": (
        laws.consistency, SMALL_STEP, {},
        lambda p, share: {"velocities": one_moved(0, share * scale_of_acceleration(p) * p.h)},
        [(1.0, RIGHT)]),
}  # fmt: skip


@pytest.mark.parametrize("name", EDGES)
def test_a_law_holds_just_within_its_tolerance_and_not_beyond(name):
    law, p, options, change, verdicts = EDGES[name]
    for share, verdict in verdicts:
        assert judged(law, p, **options, **change(p, share)).verdict is verdict, share


@pytest.mark.parametrize(("pins", "best"), [("penalty", RIGHT), (None, RIGHT_EXCEPT)])
def test_a_penalty_s_pin_may_move_as_far_as_the_penalty_lets_it(pins, best):
    p, model = triangle([0]), LINEARISED._replace(pins="penalty 1e6")
    yields = np.abs(predicted(p, model)["positions"] - p.positions)[0].max()
    assert yields > 1e3 * rounding(p, model, EPSILON).positions
    for axis, share, verdict in (
        (2, 0.0, best),
        (1, -3.0 - 2e-3 * displacement(p) / yields, WRONG),
    ):
        change = one_moved(0, share * yields, axis)
        assert judged(laws.pins, p, model, pins, positions=change).verdict is verdict


def test_momentum_is_no_law_of_steps_that_do_not_keep_it():
    assert judged(laws.momentum, triangle(), LINEARISED._replace(scaling=Scaling(0.98))) is None
    assert judged(laws.momentum, triangle([0])) is None


def asked(answer, again=None, **facts):
    """Return a case with such an answer."""
    case = Case("", "mass_spring_step", {}, "", sentence(""), facts=facts)
    return Exchange(case, Answer(answer, 0.0), None if again is None else Answer(again, 0.0))


@pytest.mark.parametrize(("share", "verdict"), [(0.5, RIGHT), (2.0, WRONG)])
@pytest.mark.parametrize("name", ["positions", "velocities"])
def test_equal_requests_have_equal_answers_to_what_is_allowed(name, share, verdict):
    allowed = {"positions": 1e-12, "velocities": 1e-9}
    first = {key: np.ones((3, 3)) for key in allowed}
    second = first | {name: first[name] + one_moved(1, share * allowed[name])}
    found = equal_answers(asked(first, second), allowed)
    assert found.verdict is verdict
    assert found.tolerance == allowed[name]


@pytest.mark.parametrize(("share", "verdict"), [(0.5, RIGHT), (2.0, WRONG)])
@pytest.mark.parametrize("name", ["positions", "velocities", "forces"])
def test_an_answer_turns_with_the_world_and_the_numbering(rng, name, share, verdict):
    """Positions are rotated, shifted and renumbered; velocities and forces are not shifted."""
    allowed = {"positions": 1e-9, "velocities": 1e-6, "forces": 1e-3}
    base = {key: rng.standard_normal((3, 3)) for key in allowed}
    turn, shift = (
        np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
        np.array([1.0, 2, 3]),
    )
    order = np.array([2, 0, 1])  # particle i of the base has the number order[i]
    turned = {}
    for key, values in base.items():
        turned[key] = np.empty((3, 3))
        turned[key][order] = [turn @ v + (shift if key == "positions" else 0.0) for v in values]
    turned[name] = turned[name] + one_moved(1, share * allowed[name])
    changed = asked(turned, of="", matrix=turn, shift=shift, order=order)
    found = laws.symmetry(changed, [asked(base)], allowed)
    assert found.verdict is verdict
    assert found.error == pytest.approx(share, rel=1e-5)


@pytest.mark.parametrize("substeps", [1, 2, 4])
def test_an_unstable_explicit_step_multiplies_its_rounding(substeps):
    """By hs² k / m in each substep after the first, of a length that is unstable."""
    stiff, soft = (triangle().changed(stiffnesses=np.full(3, k), h=0.1) for k in (1e5, 1.0))
    model = StepModel(Integrator("symplectic"), substeps, "explicit", velocity="separate")
    implicit = LINEARISED._replace(substeps=substeps)
    stiffest = 2.0 * (2e5 + (0.2 + 0.3) / 0.1) / 0.5  # of the lightest particle's two springs
    growth = (stiffest * (0.1 / substeps) ** 2) ** (substeps - 1)
    ratio = rounding(stiff, model, EPSILON).positions / rounding(stiff, implicit, EPSILON).positions
    assert ratio == pytest.approx(growth)
    assert rounding(soft, model, EPSILON) == rounding(soft, implicit, EPSILON)
