"""A declared method that is kept is right, and so are its factors and pins."""

import numpy as np
import pytest

from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Greeting, Step
from plumbob.verify.judgement import Verdict
from plumbob.verify.mass_spring.cases import task_cases
from plumbob.verify.mass_spring.measured import measured
from plumbob.verify.mass_spring.model import Integrator, StepModel, simulate
from plumbob.verify.mass_spring.problem import problem_of
from plumbob.verify.verify import DISCIPLINES, judge_cases
from tests.honest_solvers import Stepper

STEP, MOTION = "mass_spring_step", "mass_spring_motion"


def model(*integrator, damper="none", **fields):
    """Return the model of a step."""
    return StepModel(Integrator(*integrator), damper=damper, **fields)


def judged(function, step, task=STEP):
    """Return the report on a function before a search among changed lines."""
    greeting = Greeting(1, (task,), step=step)
    cases = DISCIPLINES[task].cases(greeting, "", 0, False)
    return judge_cases(FunctionConnection({task: function}, greeting), task, "", cases)


def laws_with(report, verdict):
    findings = (finding for judgement in report.judgements for finding in judgement.findings)
    return {finding.law for finding in findings if finding.verdict is verdict}


def pull(i, x, v, stiffnesses, rest_lengths, dampings):
    """Return the force of each spring, with its damper, on its first particle [N]."""
    d, w = x[i[:, 0]] - x[i[:, 1]], v[i[:, 0]] - v[i[:, 1]]
    length = np.linalg.norm(d, axis=1)
    u = d / np.where(length > 0.0, length, 1.0)[:, None]
    return -(stiffnesses * (length - rest_lengths) + dampings * (w * u).sum(1))[:, None] * u


def forces(x, v, masses, springs, rest_lengths, stiffnesses, dampings, gravity):
    """Return the forces on all particles [N]."""
    f, pulls = masses[:, None] * gravity, pull(springs, x, v, stiffnesses, rest_lengths, dampings)
    np.add.at(f, springs[:, 0], pulls)
    np.add.at(f, springs[:, 1], -pulls)
    return f


class PositionsFirst:
    """Symplectic Euler that updates positions before velocities."""

    def __init__(self, substeps=1, damps=True, uses_old_positions=False, weight=1.0):
        self.substeps, self.damps = substeps, damps
        self.uses_old_positions, self.weight = uses_old_positions, weight

    def __call__(self, positions, velocities, h, pinned, masses, dampings, gravity, steps=None,
                 **system):  # fmt: skip
        """Return the last state, or all of several steps."""
        x, v, frames = positions.copy(), velocities.copy(), []
        v[pinned] = 0.0
        c, h = dampings * self.damps, h / self.substeps
        for number in range((steps or 1) * self.substeps):
            old, x = x, x + h * v
            f = forces(old if self.uses_old_positions else x, v, masses=masses, dampings=c,
                       gravity=self.weight * gravity, **system)  # fmt: skip
            v = v + h * f / masses[:, None]
            v[pinned] = 0.0
            if (number + 1) % self.substeps == 0:
                frames.append((x, v))
        X, V = map(np.array, zip(*frames, strict=True))
        return {"positions": X, "velocities": V} if steps else {"positions": x, "velocities": v}


SYMPLECTIC = Step("symplectic", order="positions_first", damper="explicit", pins="eliminated")
POSITIONS_FIRST = {
    "declared": (PositionsFirst(), SYMPLECTIC, STEP),
    "in substeps": (
        PositionsFirst(10),
        Step("symplectic", order="positions_first", substeps=10, damper="explicit"), STEP),
    "a motion": (PositionsFirst(), SYMPLECTIC, MOTION),
    "without dampers": (
        PositionsFirst(damps=False),
        Step("symplectic", order="positions_first", damper="none", pins="eliminated"), STEP),
}  # fmt: skip


@pytest.mark.sample("declared", "a motion")
@pytest.mark.parametrize("name", POSITIONS_FIRST)
def test_symplectic_euler_with_positions_first_is_right_if_declared(name):
    report = judged(*POSITIONS_FIRST[name])
    assert report.verdict is Verdict.RIGHT
    assert report.diagnosis.explanations == ()


@pytest.mark.sample("no order")
@pytest.mark.parametrize("step", [Step(), pytest.param(Step("symplectic"), id="no order")])
def test_the_order_of_updates_is_recognised_and_its_declaration_told(step):
    report = judged(PositionsFirst(), step)
    assert report.verdict is (Verdict.RIGHT if step.method else Verdict.RIGHT_EXCEPT)
    assert report.diagnosis.explanations == ()
    declaration = '"method": "symplectic", "order": "positions_first"'
    assert declaration in str(report.diagnosis.behaviour)


@pytest.mark.sample("mistake1")
@pytest.mark.parametrize("mistake", [{"uses_old_positions": True}, {"weight": 2.0}])
def test_a_mistake_in_a_step_with_positions_first_is_wrong(mistake):
    report = judged(PositionsFirst(**mistake), SYMPLECTIC)
    assert report.verdict is Verdict.WRONG
    if "weight" in mistake:
        assert report.diagnosis.explanations[0].faults == ("gravity doubled",)


@pytest.mark.usefixtures("verdict_alone")
def test_an_order_that_is_declared_and_not_kept_is_wrong():
    report = judged(PositionsFirst(), Step("symplectic", order="velocities_first"))
    assert report.verdict is Verdict.WRONG


class HeavyPins:
    """Symplectic Euler with pins that are heavy and have no weight."""

    def __init__(self, mass):
        self.mass = mass

    def __call__(self, positions, velocities, h, pinned, masses, dampings, **system):
        """Return the new state, pins as they move."""
        inertia = masses.copy()
        inertia[pinned] = self.mass
        f = forces(positions, velocities, masses=masses, dampings=dampings, **system)
        f[pinned] -= masses[pinned, None] * system["gravity"]
        v = velocities + h * f / inertia[:, None]
        return {"positions": positions + h * v, "velocities": v}


HEAVY = Step("symplectic", damper="explicit", pins="heavy")


@pytest.mark.sample(without=["1000"])
@pytest.mark.parametrize("mass", [1e3, 2e5, 1e6, 1e8, 1e10, 1e12])
@pytest.mark.usefixtures("verdict_alone")
def test_heavy_pins_of_any_mass_are_right_if_declared(mass):
    assert judged(HeavyPins(mass), HEAVY).verdict is Verdict.RIGHT


def test_the_mass_of_heavy_pins_is_measured():
    report = judged(HeavyPins(2e5), Step())
    assert report.verdict is Verdict.RIGHT_EXCEPT
    assert "pins of 2e5 kg" in str(report.diagnosis.behaviour)


@pytest.mark.usefixtures("verdict_alone")
def test_heavy_pins_of_a_motion_are_right_if_declared():
    step = Step("linearised", damper="none", pins="heavy")
    stepper = Stepper(model("newton", "x_n", 1, pins="weightless 2e4"))
    assert judged(stepper, step, MOTION).verdict is Verdict.RIGHT


@pytest.mark.sample(without=["2.0"])
@pytest.mark.parametrize("mass", [2.0, 20.0])
@pytest.mark.usefixtures("verdict_alone")
def test_pins_that_are_not_heavy_are_wrong(mass):
    assert judged(HeavyPins(mass), HEAVY).verdict is Verdict.WRONG


ANSWERS = [
    problem_of(case.inputs)
    for case in task_cases(STEP, Greeting(1, (STEP,)), 0, False)
    if case.facts.get("probe")
]
IMPLICIT = StepModel(Integrator("newton", "x_n", 1), damper="end_velocity")
EXPLICIT = StepModel(Integrator("symplectic"), 1, "explicit", velocity="separate")


@pytest.mark.parametrize("model", [IMPLICIT, EXPLICIT._replace(substeps=4)])
@pytest.mark.parametrize("pins", ["heavy 3e4", "weightless 3e4", "penalty 3e7", "springs 4e7"])
def test_the_strength_of_pins_is_that_of_the_answers(pins, model):
    if model.integrator.explicit and not pins.startswith(("heavy", "weightless")):
        pytest.skip("springs to pins do not act in a step that is explicit")
    answers = [(p, simulate(p, model._replace(pins=pins))) for p in ANSWERS]
    kind, strength = pins.split()
    numbers = measured(answers, None)
    assert numbers[kind] == [strength]
    assert numbers["substeps"] == ([4] if model.integrator.explicit else [])


@pytest.mark.parametrize("pins", ["eliminated", "overwritten", "heavy 2"])
def test_pins_that_hold_or_are_light_have_no_strength(pins):
    answers = [(p, simulate(p, IMPLICIT._replace(pins=pins))) for p in ANSWERS]
    assert measured(answers, None).keys() == {"substeps", "factor"}


class Slowed:
    """Explicit and symplectic Euler, by the order of three updates, with velocities scaled once."""

    def __init__(self, order, factor=0.97, substeps=1):
        self.order, self.factor, self.substeps = order, factor, substeps

    def __call__(self, positions, velocities, h, pinned, masses, dampings, **system):
        """Return the new state."""
        x, v = positions.copy(), velocities.copy()
        free = np.setdiff1d(np.arange(len(x)), pinned)
        for update in self.substeps * self.order.split():
            if update == "scale":
                v[free] *= self.factor
            elif update == "move":
                x[free] += h / self.substeps * v[free]
            else:
                f = forces(x, v, masses=masses, dampings=0.0 * dampings, **system)
                v[free] += h / self.substeps * (f / masses[:, None])[free]
        return {"positions": x, "velocities": v}


ORDERS = [
    "scale force move", "force scale move", "force move scale", "scale move force",
    "move scale force", "move force scale",
]  # fmt: skip


@pytest.mark.parametrize("substeps", [1, 3])
@pytest.mark.parametrize("order", ORDERS)
def test_a_declared_factor_may_act_before_forces_and_after(order, substeps):
    step = Step("symplectic", damper="global_factor", damping_factor=0.97, substeps=substeps)
    assert judged(Slowed(order, 0.97, substeps), step).verdict is Verdict.RIGHT
    if substeps == 1:
        assert judged(Slowed(order, 0.96), step).verdict is Verdict.WRONG


@pytest.mark.sample("force move scale")
@pytest.mark.parametrize("order", ORDERS)
def test_a_factor_that_is_not_declared_is_a_mistake(order):
    report = judged(Slowed(order), Step("symplectic"))
    is_last = order.endswith("move scale") or order == "move force scale"
    assert report.verdict is (Verdict.RIGHT_EXCEPT if is_last else Verdict.WRONG)
    if is_last:
        assert "velocity loss" in laws_with(report, Verdict.RIGHT_EXCEPT)


# Methods that do not converge, or hold pins by less than all, with all that a greeting may say.
KEPT = {
    "one local/global iteration": (
        model("local_global", "y"),
        Step("local_global", "y", 1, 1, "none", None, "eliminated", "displacement")),
    "one local/global iteration with dampers": (
        model("local_global", "x_n", damper="end_velocity"),
        Step("local_global", "x_n", 1, 1, "end_velocity")),
    "three local/global iterations from s_n": (
        model("local_global", "s_n", 3, damper="length_rate"),
        Step("local_global", "s_n", 3, 1, "length_rate")),
    "two Newton iterations": (
        model("newton", "y", 2), Step("newton", "y", 2, 1, "none")),
    "linearised": (
        model("newton", "x_n", 1, damper="explicit"), Step("linearised", damper="explicit")),
    "linearised, overwritten pins": (
        model("newton", "x_n", 1, pins="overwritten"),
        Step("linearised", damper="none", pins="overwritten")),
    "linearised, a penalty": (
        model("newton", "x_n", 1, pins="penalty 3e5"),
        Step("linearised", damper="none", pins="penalty")),
    "converged in substeps": (
        model("converged", "y", damper="length_rate", substeps=3),
        Step("converged", substeps=3, damper="length_rate")),
    "explicit": (
        model("explicit", damper="explicit", velocity="separate"),
        Step("explicit", damper="explicit", velocity="separate")),
}  # fmt: skip


@pytest.mark.sample("with dampers", "explicit")
@pytest.mark.parametrize("name", KEPT)
def test_a_declared_method_that_is_kept_is_right(name):
    stepper, step = KEPT[name]
    report = judged(Stepper(stepper), step)
    assert report.verdict is Verdict.RIGHT, laws_with(report, Verdict.RIGHT_EXCEPT)
    assert report.diagnosis.explanations == ()


@pytest.mark.slow
def test_an_undeclared_method_has_a_reservation_and_is_named_by_what_it_is():
    report = judged(Stepper(model("local_global", "y")), Step())
    assert report.verdict is Verdict.RIGHT_EXCEPT
    behaviour = str(report.diagnosis.behaviour)
    assert behaviour.startswith("It behaves like one local/global iteration from y")
    assert '"method": "local_global", "start": "y", "iterations": 1' in behaviour


def test_few_iterations_in_place_of_a_converged_step_are_told():
    report = judged(Stepper(model("local_global", "y", 4)), Step("converged", damper="none"))
    assert report.verdict is Verdict.WRONG
    (explanation,) = report.diagnosis.explanations
    assert "behaves like this: 4 local/global iterations from y" in str(explanation.sentence)
