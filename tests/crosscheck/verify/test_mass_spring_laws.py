"""Each law of a step at the edge of its tolerance: just within and just beyond.

The faults of `test_mass_spring.py` are gross; a tolerance or a verdict that is wrong by a factor
shows only here.
"""

import numpy as np
import pytest

from plumbob.crosscheck.verify.case import Case
from plumbob.crosscheck.verify.contestant import Answer, Exchange
from plumbob.crosscheck.verify.judgement import Verdict
from plumbob.crosscheck.verify.laws import equal_answers
from plumbob.crosscheck.verify.mass_spring import laws
from plumbob.crosscheck.verify.mass_spring.laws import (
    IMPRECISE,
    ROUNDINGS,
    SOLVED,
    StepContext,
    rounding,
)
from plumbob.crosscheck.verify.mass_spring.model import Integrator, StepModel, predicted
from plumbob.crosscheck.verify.mass_spring.problem import problem_of
from plumbob.crosscheck.verify.sentence import sentence

EPSILON = 2.0**-52
LINEARISED = StepModel(Integrator("newton", "x_n", 1), damper="explicit")
CONVERGED = StepModel(Integrator("converged", "y"))
RIGHT, RIGHT_BUT, WRONG = Verdict.RIGHT, Verdict.RIGHT_BUT, Verdict.WRONG


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


def judged(law, p, model=LINEARISED, declares_pins=True, known=True, **changes):
    """Return what a law finds of the model's own step with some outputs changed by an array."""
    expected = predicted(p, model)
    answered = {name: value + changes.get(name, 0.0) for name, value in expected.items()}
    allowed = rounding(p, model, EPSILON)
    return law(
        StepContext(p, answered, allowed, model, known, sentence(""), expected, declares_pins)
    )


def displacement(p, model=LINEARISED):
    return float(np.abs(predicted(p, model)["positions"] - p.positions).max())


def one_moved(particle, distance, axis=2):
    """Return an array that moves a single particle."""
    change = np.zeros((3, 3))
    change[particle, axis] = distance
    return change


def test_rounding_is_an_epsilon_of_the_way_in_every_substep():
    """The documented sum: the coordinates reached, times 1 + substeps + h² k / m, twice over h."""
    p = triangle()
    reached = 1.0 + p.h * 0.5 + p.h**2 * 9.81
    stiffness = p.stiffnesses + p.dampings / p.h
    stiffest = max(
        2.0 * (stiffness[0] + stiffness[2]) / 1.0,
        2.0 * (stiffness[0] + stiffness[1]) / 2.0,
        2.0 * (stiffness[1] + stiffness[2]) / 0.5,
    )
    for substeps in (1, 3):
        model = LINEARISED._replace(substeps=substeps)
        allowed = rounding(p, model, EPSILON)
        x = ROUNDINGS * EPSILON * reached * (1.0 + substeps + p.h**2 * stiffest)
        assert allowed.positions == pytest.approx(x, rel=1e-12)
        v = 2.0 * x / p.h + ROUNDINGS * EPSILON * 0.5
        assert allowed.velocities == pytest.approx(v, rel=1e-12)


@pytest.mark.parametrize(("share", "verdict"), [(0.5, RIGHT), (2.0, WRONG)])
def test_a_declared_pin_may_move_by_rounding_only(share, verdict):
    p = triangle([0, 1])
    bound = rounding(p, LINEARISED, EPSILON).positions
    found = judged(laws.pins, p, positions=one_moved(1, share * bound))
    assert (found.law, found.verdict, found.index) == ("pins", verdict, 1)
    assert found.error == pytest.approx(share * bound)
    assert found.tolerance == bound


@pytest.mark.parametrize(("share", "verdict"), [(0.5, RIGHT_BUT), (2.0, WRONG)])
def test_a_pin_that_nothing_is_said_of_may_move_by_what_is_imprecise(share, verdict):
    p = triangle([0])
    gap = share * IMPRECISE * displacement(p)
    found = judged(laws.pins, p, declares_pins=False, positions=one_moved(0, gap))
    assert found.verdict is verdict
    assert judged(laws.pins, p, positions=one_moved(0, gap)).verdict is WRONG


def test_a_penalty_s_pin_may_move_as_far_as_the_penalty_lets_it():
    p, model = triangle([0]), LINEARISED._replace(pins="penalty 1e6")
    yields = np.abs(predicted(p, model)["positions"] - p.positions)[0].max()
    assert yields > 1e3 * rounding(p, model, EPSILON).positions
    for axis, share, verdict in (
        (2, 0.0, RIGHT_BUT),
        (1, -3.0 - 2e-3 * displacement(p) / yields, WRONG),
    ):
        change = one_moved(0, share * yields, axis)
        assert judged(laws.pins, p, model, positions=change).verdict is verdict


GRADES = [
    (0.5 * SOLVED, RIGHT),
    (2.0 * SOLVED, RIGHT_BUT),
    (0.5 * IMPRECISE, RIGHT_BUT),
    (2.0 * IMPRECISE, WRONG),
]


@pytest.mark.parametrize(("share", "verdict"), GRADES)
@pytest.mark.parametrize("name", ["positions", "velocities"])
def test_imprecise_numbers_are_right_with_a_reservation(name, share, verdict):
    p = triangle()
    speed = np.abs(predicted(p, LINEARISED)["velocities"]).max()
    law, size = {
        "positions": (laws.declared_step, displacement(p)),
        "velocities": (laws.velocities, speed),
    }[name]
    finding = judged(law, p, **{name: one_moved(2, share * size)})
    assert finding.verdict is verdict
    assert finding.error == pytest.approx(share, rel=1e-3)
    assert finding.index == (2 if name == "positions" else None)


def test_velocities_are_held_against_the_positions_answered():
    """A solver whose positions are off has the velocities right that follow from them."""
    p, gap = triangle(), 0.01
    found = judged(
        laws.velocities, p, positions=one_moved(2, gap), velocities=one_moved(2, gap / p.h)
    )
    assert found.verdict is RIGHT
    assert judged(laws.velocities, p, positions=one_moved(2, gap)).verdict is WRONG


@pytest.mark.parametrize("axis", [0, 2])
@pytest.mark.parametrize(("share", "verdict"), [(0.5, RIGHT), (2.0, WRONG)])
def test_springs_do_not_move_the_centre_of_mass(axis, share, verdict):
    """By rounding at most: 4 times that of a coordinate."""
    p = triangle()
    bound = 4.0 * rounding(p, LINEARISED, EPSILON).positions
    gap = share * bound * p.masses.sum() / p.masses[1]
    found = judged(laws.momentum, p, positions=one_moved(1, gap, axis))
    assert (found.law, found.verdict) == ("momentum", verdict)
    assert found.error == pytest.approx(share * bound, rel=0.2)


@pytest.mark.parametrize(
    ("share", "verdict"),
    [(-1.0, RIGHT), (-0.5, RIGHT), (0.0, RIGHT), (-1.01, WRONG), (0.01, WRONG)],
)
def test_gravity_takes_the_centre_of_mass_no_farther_than_it_falls(share, verdict):
    """By h² g or by less, where a step leaves a part to its velocities; never beyond or upwards."""
    p = triangle()
    fall = np.tile(share * p.h**2 * p.gravity, (3, 1))
    assert judged(laws.momentum, p, positions=fall).verdict is verdict


@pytest.mark.parametrize(("share", "verdict"), [(0.5, RIGHT), (2.0, WRONG)])
def test_a_solver_that_iterates_may_leave_a_part_of_the_momentum(share, verdict):
    p = triangle()
    gap = share * 1e-4 * displacement(p, CONVERGED)
    shift = np.tile([0.0, 0.0, gap], (3, 1))
    assert judged(laws.momentum, p, CONVERGED, positions=shift).verdict is verdict


@pytest.mark.parametrize(
    "model",
    [
        LINEARISED._replace(scaling=0.98),
        LINEARISED._replace(damper="diagonal"),
        LINEARISED._replace(damper="blocks"),
        StepModel(Integrator("descent")),
    ],
)
def test_momentum_is_no_law_of_steps_that_do_not_keep_it(model):
    assert judged(laws.momentum, triangle(), model) is None
    assert judged(laws.momentum, triangle([0])) is None


@pytest.mark.parametrize(
    ("share", "verdict"), [(0.0, RIGHT), (0.5 * SOLVED, RIGHT), (0.01, RIGHT_BUT)]
)
def test_a_converged_step_is_the_minimiser_and_another_says_so(share, verdict):
    p = triangle()
    gap = share * displacement(p, CONVERGED)
    found = judged(laws.minimiser, p, CONVERGED, positions=one_moved(1, gap))
    assert (found.law, found.verdict) == ("minimiser", verdict)
    unknown = judged(laws.minimiser, p, CONVERGED, known=False, positions=one_moved(1, gap))
    assert unknown.verdict is (Verdict.UNDECIDED if verdict else RIGHT)


@pytest.mark.parametrize(("share", "verdict"), [(0.05, RIGHT), (0.2, WRONG), (-0.2, WRONG)])
def test_the_acceleration_of_a_small_step_is_the_force_over_the_mass(share, verdict):
    """To a tenth of the largest; the step itself is off by h omega, a thousandth here."""
    p = triangle([0]).changed(h=1e-4)
    scale = np.abs((predicted(p, LINEARISED)["velocities"] - p.velocities) / p.h)[1:].max()
    change = one_moved(1, share * scale * p.h)
    found = judged(laws.consistency, p, velocities=change)
    assert (found.law, found.verdict) == ("consistency", verdict)
    pin = one_moved(0, scale * p.h)
    assert judged(laws.consistency, p, velocities=pin).verdict is RIGHT


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
