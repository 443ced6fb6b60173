"""What wrong answers show is true, names the mistake, and is silent where nothing is wrong."""

import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from kinematics_solvers import faulty, textbook
from observed_programs import PROGRAMS

from plumbob.reference import rotation
from plumbob.text.sentence import sentence
from plumbob.verify import fault_programs
from plumbob.verify.case import Case
from plumbob.verify.exchange import Answer, Failure, FailureKind
from plumbob.verify.fault_programs import source_of
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Greeting, Step
from plumbob.verify.judgement import CaseJudgement, Diagnosis, TaskReport, Verdict
from plumbob.verify.laws import finding
from plumbob.verify.mass_spring.model import Integrator, StepModel, predicted
from plumbob.verify.mass_spring.problem import all_forces, problem_of
from plumbob.verify.observe import (
    fits,
    inputs,
    observations,
    separation,
    spring_law,
    springs,
)
from plumbob.verify.observe.equalities import Equalities
from plumbob.verify.observe.separation import ElementTable
from plumbob.verify.screen import drawing
from plumbob.verify.screen import spring_law as drawn_law
from plumbob.verify.verify import DISCIPLINES, verify

FORWARD, INVERSE = "forward_kinematics", "inverse_kinematics"
FORCES, STEP = "mass_spring_forces", "mass_spring_step"
WRONG = finding("positions", verdict=Verdict.WRONG)
WRONG_FINDING = (replace(WRONG, verdict=Verdict.WRONG),)


def report_of(connection, task, method, seed=0):
    """Return the report in which every answer of a solver counts as wrong."""
    judgements = []
    for case in DISCIPLINES[task].cases(connection.greeting, method, seed, False):
        expected = inputs.right_answer(case, "") if task == FORWARD else {}
        judgements.append(CaseJudgement(case, connection.answer(case), WRONG_FINDING, expected))
    return TaskReport(task, method, judgements, Diagnosis())


def connection_to(function, task, method="", **greeting):
    return FunctionConnection({task: function}, Greeting(1, (task,), methods=(method,), **greeting))


def observed(function, task, method="", seed=0, **greeting):
    """Return what is said if every answer counts as wrong."""
    connection = connection_to(function, task, method, **greeting)
    with np.errstate(all="ignore"):
        report = report_of(connection, task, method, seed)
        return list(map(str, observations.observe(connection, report, seed)))


# What the six programs are told, as it was at the first run.
SENTENCES = {
    "leaves_not_rotated": ["Wrong at leaves and nowhere else: the global rotation of joints"],
    "joints_below_not_rotated": [
        "The global rotation of the effector is that of the request: in all 38 answers",
        "Wrong everywhere but at children of the root: positions, given the answered local",
    ],
    "ten_sweeps": ["The answers do not depend on max_iterations, on which right answers do"],
    "gravity_constant": [
        "The answers do not depend on gravity",
        "Gravity is (0, -9.8, 0) in all 37 cases",
        "Without springs x' - x = h v - 9.8 h² (0, 1, 0); right is h v + h² g",
        "Right everywhere: what springs pull",
    ],
    "velocities_without_h": ["Velocities are x' - x in all 58 cases"],
    "quartic_energy": ["Its springs follow another law: the energy k r²/8 ("],
}


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda program: program.__name__)
def test_wrong_program_in_another_form_shows_its_mistake(program):
    task, method = PROGRAMS[program]
    sentences = observed(program, task, method)
    expected = SENTENCES[program.__name__]
    assert [s[: len(e)] for s, e in zip(sentences, expected, strict=False)] == expected
    assert len(sentences) <= observations.SENTENCES + 1


def leaves_stay_on_the_stack(parents, offsets, local_rotations):
    """Forward kinematics by a stack, from which only joints with children are removed."""
    x, R, stack = offsets.copy(), local_rotations.copy(), []

    def visit(joint):
        if stack:
            position, above = stack[-1]
            x[joint] = position + rotation.rotate(above, offsets[joint])
            R[joint] = rotation.multiply(above, local_rotations[joint])
        stack.append((x[joint], R[joint]))
        children = np.flatnonzero(np.asarray(parents) == joint)
        for child in children:
            visit(child)
        if len(children):
            stack.pop()

    visit(0)
    return {"positions": x, "rotations": R}


def at_the_origin_with_a_long_link(**request):
    x = textbook(INVERSE, "fabrik")(**request)["positions"]
    x = x - x[0]
    x[3:] += 0.1
    return {"positions": x}


def still_beyond_reach(**request):
    links = np.linalg.norm(request["offsets"][1:], axis=1).sum()
    is_far = np.linalg.norm(request["target"] - request["offsets"][0]) > links
    solve = textbook(INVERSE)
    return solve(**request | {"max_iterations": 0} if is_far else request)


OBSERVED = {
    "wrong parents": (leaves_stay_on_the_stack, FORWARD, "", ["Every wrong joint hangs from"]),
    "obtuse angles": (faulty(INVERSE, "PB-QUAT-015"), INVERSE, "ccd",
                      ["Wrong at joints to be rotated by more than 90 degrees and nowhere"]),
    "degrees": (faulty(INVERSE, "PB-QUAT-016"), INVERSE, "ccd",
                ["The rotation of each joint in a sweep is by the right angle in degrees"]),
    "two mistakes": (at_the_origin_with_a_long_link, INVERSE, "mine",
                     ["The root is at the origin", "Wrong in part: lengths of links"]),
    "beyond reach": (still_beyond_reach, INVERSE, "mine",
                     ["Wrong where the target is out of reach"]),
}  # fmt: skip


@pytest.mark.parametrize("name", OBSERVED)
def test_observation_tells_a_mistake(name):
    function, task, method, expected = OBSERVED[name]
    greeting = {"rotations": False} if name == "two mistakes" else {}
    sentences = observed(function, task, method, **greeting)
    assert [s[: len(e)] for s, e in zip(sentences, expected, strict=False)] == expected


def step(integrator, damper, velocity="displacement"):
    model = StepModel(Integrator(*integrator), damper=damper, velocity=velocity)
    return lambda **request: predicted(problem_of(request), model)


RIGHT = {
    "forward kinematics": (FORWARD, "", textbook(FORWARD)),
    "CCD": (INVERSE, "ccd", textbook(INVERSE)),
    "FABRIK": (INVERSE, "fabrik", textbook(INVERSE, "fabrik")),
    "forces": (FORCES, "", lambda **request: {"forces": all_forces(problem_of(request))}),
    "symplectic Euler": (STEP, "", step(["symplectic"], "explicit", "separate")),
    "explicit Euler": (STEP, "", step(["explicit"], "explicit", "separate")),
    "positions first": (STEP, "", step(["positions_first"], "explicit", "separate")),
    "linearised": (STEP, "", step(["newton", "x_n", 1], "length_rate")),
    "one local/global": (STEP, "", step(["local_global", "y", 1], "length_rate")),
    "ten local/global": (STEP, "", step(["local_global", "x_n", 10], "none")),
}


def in_single(function):
    """Return a function of which all numbers are single-precision values."""

    def rounded(values):
        return {
            name: value.astype(np.float32).astype(float)
            if isinstance(value, np.ndarray) and value.dtype == float
            else value
            for name, value in values.items()
        }

    return lambda **request: rounded(function(**rounded(request)))


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("name", RIGHT)
def test_right_program_is_told_nothing_even_if_all_its_answers_count_as_wrong(
    name, precision, seed
):
    task, method, function = RIGHT[name]
    solver = in_single(function) if precision == "single" else function
    assert observed(solver, task, method, seed, precision=precision) == []


# The rules against false sentences


def half_forces(masses, springs, rest_lengths, stiffnesses, pinned, gravity, positions,
                velocities, h, **_):  # fmt: skip
    """One linearised step with half of the springs' forces, and a quarter of a term of K."""
    n, M = len(masses), np.diag(np.repeat(masses, 3))
    f, K = masses[:, None] * gravity, np.zeros((n, 3, n, 3))
    for (i, j), r, k in zip(springs, rest_lengths, stiffnesses, strict=True):
        d = positions[i] - positions[j]
        length = np.linalg.norm(d)
        u = d / length
        block = 0.5 * k * (1.0 - r / length) * np.eye(3) + 0.25 * k * r / length * np.outer(u, u)
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            K[a, :, b] += sign * block
        f[i] -= 0.5 * k * (length - r) * u
        f[j] += 0.5 * k * (length - r) * u
    free = np.setdiff1d(np.arange(3 * n), 3 * pinned[:, None] + np.arange(3))
    K, v = K.reshape(3 * n, 3 * n), velocities.ravel().copy()
    b = h * (f.ravel() - h * K @ v)
    v[free] += np.linalg.solve((M + h**2 * K)[np.ix_(free, free)], b[free])
    v = v.reshape(n, 3)
    return {"positions": positions + h * v, "velocities": v}


def test_what_springs_pull_in_a_linearised_step_is_solved_from_pairs():
    declared = Step("linearised", damper="none", pins="eliminated")
    (first, *_) = observed(half_forces, STEP, step=declared)
    assert "every spring pulls 1/2 k l - 1/2 k r + 1/2 k e - 1/4 k r e/l along it" in first
    assert "1/2 k - 1/2 k r/l for each metre" in first
    assert "right are k l - k r + k e and k - k r/l" in first


def test_requests_without_an_answer_are_left_out_and_a_crash_ends_them():
    def answered(kind):
        failures = iter([Failure(kind, sentence("It failed.")), *[Answer({}, 0.0)] * 9])
        connection = SimpleNamespace(answer=lambda case: next(failures))
        cases = [Case("", STEP, {}, "", sentence(""))] * 5
        return len(observations._ask(connection, cases, ""))

    assert answered(FailureKind.RAISED) == 4
    assert answered(FailureKind.CRASHED) == 0


def table(*cases, **of_all):
    """Return a table of cases, each a list of errors, wrong at leaves where a feature says so."""
    result = ElementTable("rotation", **of_all)
    for i, errors in enumerate(cases):
        features = {"leaf": np.arange(len(errors)) == len(errors) - 1}
        result.add(f"case {i}", errors, features)
    return result


RARE, BETWEEN = [0.0] * 40 + [1.0], 3.0 * separation.TOLERANCE


@pytest.mark.parametrize(
    ("cases", "sound", "is_said"),
    [
        ([RARE] * 2 + [[1.0] * 5], 0, False),  # 10^-3.2, but both classes in two cases
        ([RARE] * 3, 0, True),
        ([[0.0, 1.0]] * 3, 0, False),  # in three cases, each with a chance of a half
        ([[0.0, BETWEEN, 0.0, 0.0, 0.0, 1.0]] * 5, 0, True),  # between right and wrong
        ([[0.0, 0.0, 0.0, 0.0, 1.0]] * 8, 8, False),  # cases with a right verdict
    ],
)
def test_chance_and_support_are_needed(cases, sound, is_said):
    result = table(*cases, sound={f"case {i}" for i in range(sound)})
    found = separation.separation(result)
    assert bool(found and found.is_exact) is is_said


@pytest.mark.parametrize(("leaves", "is_said"), [(3, False), (2, True)])
def test_one_sided_statements_allow_a_quarter_of_exceptions(leaves, is_said):
    """All wrong joints are leaves; of five right ones two or one are leaves as well."""
    result = ElementTable("rotation")
    for case in range(20):
        features = {"leaf": np.arange(6) > 5 - leaves}
        result.add(f"case {case}", [0.0, 0.0, 0.0, 0.0, 0.0, 1.0], features)
    assert (separation.separation(result) is not None) is is_said


@pytest.mark.parametrize(
    ("right_gap", "cases", "is_said"), [(1.0, 3, 1), (1e-4, 9, 0), (1.0, 2, 0)]
)
def test_equality_counts_where_right_answers_differ_in_three_cases(right_gap, cases, is_said):
    found = Equalities()
    for i in range(cases):
        found.add("root_kept", f"case {i}", np.zeros(1), np.full(1, right_gap))
    found.add("root_kept", "at rest", np.zeros(1), np.zeros(1))
    assert len(found.strongest()) == is_said


def spring_judgements(function, change=lambda inputs: inputs):
    connection = connection_to(function, STEP)
    judgements = []
    for case in DISCIPLINES[STEP].cases(connection.greeting, "", 0, False):
        changed = replace(case, inputs={**case.inputs, **change(case.inputs)})
        judgements.append(CaseJudgement(changed, connection.answer(changed), WRONG_FINDING, {}))
    return judgements


def faster(**request):
    answer = RIGHT["symplectic Euler"][2](**request)
    return {**answer, "velocities": answer["velocities"] + request["h"] * request["gravity"]}


@pytest.mark.parametrize(
    ("change", "is_said"),
    [({}, True), ({"h": 0.05}, False), ({"gravity": np.array([0.0, -9.81, 0.0])}, False)],
    ids=["both differ", "one h", "one gravity"],
)
def test_sums_need_two_time_steps_and_two_gravities(change, is_said):
    judgements = spring_judgements(faster, lambda inputs: change)
    found = springs.spring_evidence(judgements, 2.0**-52).statements
    assert any("Velocities are" in str(statement.sentence) for statement in found) is is_said


def falling(substeps, weight):
    """Return a step of particles that only fall, by symplectic substeps."""

    def step(positions, velocities, masses, gravity, h, **request):
        x, v = positions, velocities
        for _ in range(substeps):
            v = v + h / substeps * weight(masses)[:, None] * gravity
            x = x + h / substeps * v
        return {"positions": x, "velocities": v}

    return step


@pytest.mark.parametrize(
    ("weight", "declared", "flight"),
    [(np.ones_like, 4, None), (np.ones_like, 1, "= h v + 5/8 h² g;"),
     (lambda masses: masses, 4, "= h v + 5/8 h² m g;")],
)  # fmt: skip
def test_a_flight_is_right_by_the_declared_substeps(weight, declared, flight):
    judgements = spring_judgements(falling(4, weight))
    found = springs.spring_evidence(judgements, 2.0**-52, substeps=declared)
    flights = [str(s.sentence) for s in found.statements if "x' - x =" in str(s.sentence)]
    assert len(flights) == (flight is not None)
    assert all(flight in words for words in flights)


def test_what_particles_show_is_not_said_of_cases_again():
    found = springs.spring_evidence(spring_judgements(faster), 2.0**-52)
    assert found.tables["particles"].is_right
    assert "whole" not in found.tables


SPRING, ENERGY = "k * (length - rest)", "(lengths - rest_lengths) ** 2"
LAWS = {
    "(lengths**2 - rest_lengths**2) ** 2": "2 k (l² - r²)²/4",
    "np.maximum(lengths - rest_lengths, 0.0) ** 2": "k max(l - r, 0)²/2",
    "0.5 * k * (length**3 / rest**2 - length)": "of the fourth order",
    "k * rest * np.log(length / rest)": "the logarithm of the stretch",
    "3 * k * (length**2 - rest**2)": "3 k (l² - r²)",
    "k * max(length - rest, 0.0)": "they resist no compression",
    SPRING: None,
    ENERGY: None,
    "1.7 * k * (length - rest)": None,
}


@pytest.mark.parametrize("law", LAWS)
def test_the_law_of_springs_is_measured_and_drawn(law):
    task, right = ("energy", ENERGY) if "lengths" in law else (FORCES, SPRING)
    source = source_of(task.removeprefix("mass_spring_")).replace(right, law)
    connection = fault_programs.connection_to(source)
    cases = observations.spring_cases(task, connection.greeting, 0)
    answers = ((case, connection.answer(case)) for case in cases)
    judgements = [CaseJudgement(case, answer, WRONG_FINDING, {}) for case, answer in answers]
    report = TaskReport(task, "", judgements, Diagnosis())
    evidence = observations._evidence(report, judgements, connection.greeting, ())
    words = [statement.sentence for statement in evidence.statements]
    curve = spring_law.law_in(words)
    assert (curve is not None) is (LAWS[law] is not None)
    if curve is not None:
        assert LAWS[law] in str(words[0])
        rows = drawn_law.rows(curve)
        assert rows[0].strip("| ")  # the strongest pull
        assert max(map(len, rows)) <= 1 + drawn_law.COLUMNS
        assert "<path" in drawing.law_svg(curve, "law")


def test_pins_and_rest_count_for_neither_side():
    connection = connection_to(lambda **request: {"forces": 0.0 * request["positions"]}, FORCES)
    judgements = report_of(connection, FORCES, "").judgements
    tables = springs.spring_evidence(judgements, 2.0**-52).tables
    pinned = {j.case.name for j in judgements if len(j.case.inputs.get("pinned", ())) == 2}
    counts = {j.case.name: len(j.case.inputs["masses"]) for j in judgements}
    for name in pinned:
        elements = [e for e in tables["particles"].elements if e.case == name]
        assert 0 < len(elements) <= counts[name] - 2
    assert not any(e.case == "one spring at rest" for e in tables["particles"].elements)


def test_statements_on_one_sweep_need_max_iterations_to_be_read():
    program = next(p for p in PROGRAMS if p.__name__ == "ten_sweeps")
    connection = connection_to(program, INVERSE, "ccd")
    with np.errstate(all="ignore"):
        report = report_of(connection, INVERSE, "ccd")
        must = [j for j in report.judgements if j.case.requirement == "must"]
        arguments = report, must, connection.greeting
        read, unread = (
            " ".join(map(str, observations.sentences(*arguments, names)))
            for names in ((), ("max_iterations",))
        )
    assert "in one sweep of CCD" in read
    assert "in one sweep of CCD" not in unread


def test_plainest_sum_is_chosen_and_nearly_right_ones_are_right():
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((2, 20))
    assert fits.fit(a, {"a": a, "2 a": 2.0 * a}, 1) == [(1.0, "a")]
    assert fits.fit(a + b, {"a": a, "same": a, "b": b}, 3) == [(1.0, "a"), (1.0, "b")]
    assert fits.fit(a[:5], {"a": a[:5]}, 1) is None  # too few numbers
    assert fits.is_sum([fits.Term(0.99998, "a")], {"a": 1.0})
    assert not fits.is_sum([fits.Term(0.999, "a")], {"a": 1.0})


def _with_verdicts(report, verdict):
    findings = (replace(WRONG, verdict=verdict),)
    judgements = [replace(judgement, findings=findings) for judgement in report.judgements]
    return replace(report, judgements=judgements)


def test_only_wrong_answers_to_enough_must_cases_are_observed():
    program = next(p for p in PROGRAMS if p.__name__ == "leaves_not_rotated")
    connection = connection_to(program, FORWARD)
    report = report_of(connection, FORWARD, "")
    assert observations.observe(connection, report, 0)
    for verdict in (Verdict.RIGHT, Verdict.RIGHT_EXCEPT, Verdict.UNDECIDED):
        assert observations.observe(connection, _with_verdicts(report, verdict), 0) == ()
    few = replace(report, judgements=report.judgements[-13:])
    assert observations.observe(connection, few, 0) == ()
    may = [
        replace(judgement, case=replace(judgement.case, requirement="may"))
        for judgement in report.judgements
    ]
    assert observations.observe(connection, replace(report, judgements=may), 0) == ()


# Beside the verdict and the search for causes


@pytest.mark.parametrize(
    ("stage", "words"), [("observe", "no luck"), ("_explained", "at leaves and nowhere else")]
)
def test_error_of_a_stage_costs_no_verdict_and_no_other_stage(stage, words, monkeypatch):
    def fails(*arguments):
        raise RuntimeError("no luck")

    program = next(p for p in PROGRAMS if p.__name__ == "leaves_not_rotated")
    owner = sys.modules["plumbob.verify.verify"].Attempt if stage == "_explained" else observations
    monkeypatch.setattr(owner, stage, fails)
    report = verify(connection_to(program, FORWARD)).tasks[0]
    assert report.verdict is Verdict.WRONG
    assert words in str(report.diagnosis.observations[0])
