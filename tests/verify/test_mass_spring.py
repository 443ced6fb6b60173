"""Faults of mass-spring solvers are caught by laws and named; honest solvers are not accused."""

import dataclasses
import re

import numpy as np
import pytest

from plumbob.reference.explicit import runge_kutta, symplectic_euler
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.exchange import Answer, Failure, FailureKind
from plumbob.verify.fault_programs import connection_to, source_of
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Greeting, Step, System
from plumbob.verify.judgement import CaseJudgement, Finding, Report, Verdict
from plumbob.verify.mass_spring import energy, stepping
from plumbob.verify.mass_spring.cases import task_cases, trace_of
from plumbob.verify.mass_spring.model import Integrator, StepModel, simulate
from plumbob.verify.mass_spring.problem import problem_of, state_of, system_of
from plumbob.verify.screen import terminal
from plumbob.verify.screen.words import Presentation, speaker
from plumbob.verify.verify import MAX_HANGS, verify
from tests.honest_solvers import (
    CONVERGED,
    DECLARED,
    LINEARISED,
    Stepper,
)


def report(function, task="mass_spring_step", step=None, **greeting):
    """Return the report on a function."""
    hello = Greeting(1, (task,), step=step or Step(), **greeting)
    return verify(FunctionConnection({task: function}, hello)).tasks[0]


def broken_laws(report):
    findings = (finding for judgement in report.judgements for finding in judgement.findings)
    return {finding.law for finding in findings if finding.verdict >= Verdict.WRONG}


def wrapped(stepper, change):
    """Return a step whose positions are changed by a function of the request's inputs."""

    def step(**inputs):
        state = stepper(**inputs)
        return state | {"positions": state["positions"] + change(**inputs)}

    return step


def _solver(name, **options):
    return lambda s, state, h: ImplicitEuler(s, h=h, solver=name, **options).step(state).state


# A step of the reference, and the dense model that is the same.
STEPS = {
    "converged": (_solver("newton", tolerance=0.0), CONVERGED),
    "local_global": (_solver("local_global", tolerance=0.0, max_iterations=3),
                     StepModel(Integrator("local_global", "y", 3))),
    "newton": (_solver("newton", tolerance=0.0, max_iterations=2),
               StepModel(Integrator("newton", "y", 2))),
    "gauss_newton": (_solver("gauss_newton", tolerance=0.0, max_iterations=1),
                     StepModel(Integrator("newton", "x_n", 1, "gauss"))),
    "symplectic": (symplectic_euler,
                   StepModel(Integrator("symplectic"), 1, "explicit", velocity="separate")),
    "runge_kutta": (runge_kutta,
                    StepModel(Integrator("runge_kutta"), 1, "explicit", velocity="separate")),
}  # fmt: skip


@pytest.mark.parametrize("name", STEPS)
def test_the_dense_step_is_the_reference_s(name):
    for case in task_cases("mass_spring_step", Greeting(1, ("mass_spring_step",)), 0, False):
        if case.family == "compression" or case.name == "stiff cloth":
            continue  # there Newton's safeguards act, which nobody declares
        p, (step, model) = problem_of(case.inputs), STEPS[name]
        judged, wanted = simulate(p, model), step(system_of(p), state_of(p), p.h)
        moved = np.abs(wanted.positions - p.positions).max()
        np.testing.assert_allclose(
            judged["positions"], wanted.positions, rtol=0, atol=1e-13 + 1e-9 * moved
        )


@pytest.mark.sample("step")
@pytest.mark.parametrize("task", ["mass_spring_step", "mass_spring_motion"])
def test_a_solution_is_reproduced_from_itself_and_others_are_told_apart(task):
    compared = 0
    for case in task_cases(task, Greeting(1, (task,)), 0, False):
        if case.family == "compression" or case.name == "stiff cloth":
            continue  # several minima
        p = problem_of(case.inputs)
        solution = simulate(p, CONVERGED)["positions"]
        moved = np.abs(solution - p.positions).max()
        near = simulate(p, CONVERGED, solution)["positions"]
        np.testing.assert_allclose(near, solution, rtol=0, atol=1e-13 + 1e-9 * moved)
        free = np.setdiff1d(np.arange(p.count), p.pinned)
        if moved > 1e-3 and free.size:
            other = solution.copy()
            other[..., free, 1] += 0.1 * moved
            away = np.abs(simulate(p, CONVERGED, other)["positions"] - other).max()
            assert away > 1e-3 * moved, case.name
            compared += 1
    assert compared > 10


def extended_position_based(**inputs):
    """A step of extended position-based dynamics, which is none of those that are known."""
    p = problem_of(inputs)
    weights = 1.0 / p.masses
    weights[p.pinned] = 0.0
    x = p.positions + p.h * (p.velocities + p.h * p.gravity) * (weights > 0.0)[:, None]
    multipliers = np.zeros(len(p.springs))
    for _ in range(7):
        for s, (i, j) in enumerate(p.springs):
            d = x[i] - x[j]
            length = np.linalg.norm(d)
            compliance = 1.0 / max(p.stiffnesses[s] * p.h**2, 1e-9)
            gap = length - p.rest_lengths[s] + compliance * multipliers[s]
            change = -gap / (weights[i] + weights[j] + compliance)
            multipliers[s] += change
            x[i] += weights[i] * change * d / length
            x[j] -= weights[j] * change * d / length
    return {"positions": x, "velocities": (x - p.positions) / p.h}


@pytest.mark.slow
@pytest.mark.usefixtures("without_changed_lines")
def test_of_a_step_that_is_unknown_the_nearest_and_what_holds_are_told():
    judged = report(extended_position_based)
    assert judged.verdict is Verdict.UNDECIDED
    nearest, holds = map(str, judged.diagnosis.hints)
    assert nearest.startswith("The nearest known step is ")
    assert '"method": "position_based"' in nearest
    median, worst = (float(x) for x in re.search(r"by (\S+) in .* by (\S+) in", nearest).groups())
    assert 0.0 < median <= worst < 0.1
    laws_that_hold = set(holds.removesuffix(".").partition(": ")[2].split(", "))
    assert laws_that_hold >= {"pins", "momentum", "equal answers", "symmetry", "consistency"}
    screen = " ".join(" ".join(terminal.lines(
        Report(Greeting(1, ("mass_spring_step",)), [judged], 0),
        Presentation(speaker("en"), "en", ["x.py"]),
    )).split())  # fmt: skip
    assert nearest in screen
    assert holds in screen
    assert "Next: compare your step with the nearest known one" in screen
    sentences = {str(f.sentence) for one in judged.judgements for f in one.findings if f.verdict}
    assert not any("inf" in words.split() for words in sentences)
    assert not any("Another model than converged" in words for words in sentences)


@pytest.mark.parametrize(
    ("factor", "words"), [(0.0, "positions in its answers are zero"), (1.0, "nothing moves")]
)
def test_of_a_step_that_gives_no_new_state_just_that_is_told(factor, words):
    judged = report(lambda **inputs: {"positions": factor * inputs["positions"]},
                    step=Step(method="symplectic"))  # fmt: skip
    told = (judged.diagnosis.first_broken, *judged.diagnosis.hints)
    assert judged.verdict is Verdict.WRONG
    assert not judged.diagnosis.explained
    assert any(words in str(line) for line in told)


def test_a_solver_that_hangs_is_asked_no_more_and_the_cases_left_out_are_told():
    class Hung(FunctionConnection):
        def answer(self, case):
            asked.append(case)
            return Failure(FailureKind.HUNG, sentence("It computed."))

    asked, task = [], "mass_spring_step"
    (judged,) = verify(Hung({task: None}, Greeting(1, (task,)))).tasks
    assert len(asked) == len(judged.judgements) == MAX_HANGS
    assert "cases were not sent" in str(judged.diagnosis.hints[-1])
    assert judged.diagnosis.behaviour is None


@pytest.mark.slow
def test_a_step_that_is_wrong_in_large_systems_is_not_said_to_behave_like_a_right_one():
    right = Stepper(LINEARISED)
    wrong = wrapped(right, lambda masses, **inputs: 0.01 * (len(masses) > 8))
    for function, words in ((wrong, "In small cases it behaves like"), (right, "It behaves like")):
        judged = report(function)
        assert str(judged.diagnosis.behaviour).startswith(f"{words} one linearised implicit step")
        assert (judged.verdict is Verdict.WRONG) is (function is wrong)


@pytest.mark.parametrize("first", [Verdict.RIGHT, Verdict.RIGHT_EXCEPT, Verdict.UNDECIDED])
@pytest.mark.parametrize("family", ["springs", "dampers", "pins", "h changes", "cloth"])
def test_where_to_look_is_told_only_if_the_cases_before_are_right(first, family):
    def judged(name, family, verdict):
        case = Case(name, "mass_spring_step", {}, family, sentence(""))
        finding = Finding("a law", verdict, 1.0, 0.0, "m", sentence("It is off."))
        return CaseJudgement(case, Answer({}, 0.0), (finding,), {})

    told = str(stepping.first_broken_step([
        judged("one", "flight", first), judged("two", family, Verdict.WRONG),
        judged("three", "cloth", Verdict.WRONG),
    ]))  # fmt: skip
    assert "in the case 'two': It is off." in told
    assert (str(trace_of(family)) in told) is (first is not Verdict.UNDECIDED)
    assert stepping.first_broken_step([judged("one", "flight", first)]) is None


def test_a_solver_gets_the_systems_that_it_takes():
    system = System("one", "one", "one", "measured", "number", state="previous_positions")
    cases = task_cases("mass_spring_step", Greeting(1, (), system=system), 0, False)
    assert len(cases) >= 15
    for case in cases:
        assert "previous_positions" in case.inputs
        assert np.ptp(case.inputs["masses"]) == 0 != case.inputs["masses"][0] - 1


class GoesOn:
    """A solver that starts a case that follows another from its own last answer."""

    def __init__(self, step, declared):
        hello = Greeting(1, ("mass_spring_step",), system=System(continues=True), step=declared)
        self.connection = FunctionConnection({"mass_spring_step": step}, hello)
        self.greeting, self.last = hello, {}

    def answer(self, case):
        state = self.last if case.follows else {}
        judged = self.connection.answer(dataclasses.replace(case, inputs={**case.inputs, **state}))
        self.last = judged.values
        return judged

    def close(self):
        """Nothing was started."""


@pytest.mark.usefixtures("verdict_alone")
def test_a_solver_that_goes_on_is_judged_from_its_own_state():
    model, declared = DECLARED["linearised"]
    judged = verify(GoesOn(Stepper(model), declared)).tasks[0]
    assert judged.verdict is Verdict.RIGHT, broken_laws(judged)


PARTS = ("total", "kinetic", "potential", "elastic", "gravitational")


def test_of_energies_that_are_all_zero_just_that_is_told():
    judged = report(lambda **inputs: dict.fromkeys(PARTS, 0.0), "energy")
    assert str(judged.diagnosis.first_broken) == "Every energy is 0 in all cases."


def energies(shift=0.0, **factors):
    def function(**inputs):
        values = energy.predict(problem_of(inputs))
        for name in ("total", "potential", "gravitational"):
            values[name] += shift
        return {name: factors.get(name, 1.0) * value for name, value in values.items()}

    return function


@pytest.mark.parametrize("name", ["kinetic", "elastic", "gravitational", "potential", "total"])
def test_a_wrong_energy_is_caught(name):
    assert report(energies(**{name: 0.5}), "energy").verdict is Verdict.WRONG


@pytest.mark.usefixtures("verdict_alone")
def test_the_zero_of_gravity_is_free():
    assert report(energies(shift=42.0), "energy").verdict is Verdict.RIGHT


@pytest.mark.parametrize(
    ("pins", "words"),
    [([0], "Without pins all is right"), ([], "others with pins and without are not")],
)
def test_pins_are_looked_at_where_nothing_else_is_wrong(pins, words):
    judgements = []
    for name, family, pinned in (("rope", "pins", [0]), ("small h", "small h", pins)):
        inputs = {"pinned": np.array(pinned, dtype=int)}
        case = Case(name, "mass_spring_step", inputs, family, sentence("It is all."))
        broken = Finding("law", Verdict.WRONG, 1.0, 0.0, "m", sentence("Off."))
        judgements.append(CaseJudgement(case, Answer({}, 0.0), (broken,), {}, None, 0.0))
    assert words in str(stepping.first_broken_step(judgements))


GRADIENTS = """
def conjugate_gradients(A, b, goal=1e-6):
    blocks = A * (np.arange(len(b))[:, None] // 3 == np.arange(len(b)) // 3)
    x, r = np.zeros(len(b)), b.copy()
    p = z = np.linalg.solve(blocks, r)
    while r @ z > goal:
        rate = (r @ z) / (p @ A @ p)
        x, rest = x + rate * p, r - rate * A @ p
        after = np.linalg.solve(blocks, rest)
        p, r, z = after + (rest @ after) / (r @ z) * p, rest, after
    return x
"""


def test_conjugate_gradients_with_blocks_that_end_at_a_constant_are_named():
    """The errors are small, but springs move the centre of mass."""
    right = "np.linalg.solve(A[np.ix_(free, free)], b[free])"
    source = source_of("change of velocity")
    wrong = source.replace(right, "conjugate_gradients(A[np.ix_(free, free)], b[free])")
    assert wrong != source
    report = verify(connection_to(wrong + GRADIENTS), ["mass_spring_step"]).tasks[0]
    assert report.verdict is Verdict.WRONG
    (explanation,) = report.diagnosis.explanations
    assert explanation.codes == ("PB-STEP-168",)
    assert "change of velocity is below about 0.001" in str(explanation.sentence)
