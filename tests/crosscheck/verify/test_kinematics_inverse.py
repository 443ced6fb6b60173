"""Judging inverse kinematics: every fault is caught by a law and named, and nobody else accused."""

import itertools
import time

import conformance_students as students
import numpy as np
import pytest
from kinematics_solvers import (
    FORWARD,
    INVERSE,
    METHODS,
    broken,
    judged,
    named,
    reference,
    textbook,
    told,
)

from plumbob.crosscheck.verify.functions import FunctionContestant
from plumbob.crosscheck.verify.greeting import Greeting
from plumbob.crosscheck.verify.judgement import Verdict
from plumbob.crosscheck.verify.kinematics import problems
from plumbob.crosscheck.verify.kinematics import report as report_of_task
from plumbob.crosscheck.verify.kinematics.faults import FAULTS, by_key, combinations
from plumbob.crosscheck.verify.kinematics.predictions import solve, variants
from plumbob.crosscheck.verify.verify import verify
from plumbob.reference import IK_SOLVERS

BOTH = ("local_rotations", "positions")
# Faults that no answer tells apart where only these outputs come, and what cannot show at all.
TWINS = {
    BOTH: [],
    ("local_rotations",): [{"target from the root", "root offset dropped"}],
    ("positions",): [{"xyzw read", "xyzw throughout"}],
}
UNSEEN = {("positions",): {"xyzw written"}}


def faulty(method, *keys, declared=True, outputs=None):
    """Return the report on a textbook's method with some faults."""
    faults = [by_key(method)[key] for key in keys]
    function = textbook(INVERSE, faults, method, outputs)
    return judged(INVERSE, function, method if declared else "")


def some(names, quick):
    """Those that the default run tries, and the others in the slow one."""
    return [pytest.param(name, marks=() if name in quick else pytest.mark.slow) for name in names]


def cases_of_faults():
    for method, outputs in itertools.product(METHODS, TWINS):
        for fault in FAULTS[method]:
            if fault.key not in UNSEEN.get(outputs, ()):
                name = f"{method}, {fault.key}, {'+'.join(outputs)}"
                marks = () if outputs == BOTH else pytest.mark.slow
                yield pytest.param(method, fault, outputs, id=name, marks=marks)


@pytest.mark.parametrize(("method", "fault", "outputs"), list(cases_of_faults()))
def test_fault_is_caught_and_named(method, fault, outputs):
    report = faulty(method, fault.key, outputs=outputs)
    assert report.verdict is (Verdict.RIGHT_BUT if fault.honest else Verdict.WRONG)
    assert broken(report, Verdict.RIGHT_BUT) - {"target reached"} or not fault.honest
    twins = next((two for two in TWINS[outputs] if fault.key in two), {fault.key})
    assert named(report) == [twins & by_key(method).keys()]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("every", [17, pytest.param(1, marks=pytest.mark.slow)])
def test_fault_is_named_where_no_method_is_declared(method, every):
    for fault in FAULTS[method][::every]:
        assert named(faulty(method, fault.key, declared=False))[0] == {fault.key}


@pytest.mark.parametrize("method", ["", *METHODS])
def test_a_solver_that_does_not_move_is_no_slower_solver(method):
    report = judged(INVERSE, lambda local_rotations: {"local_rotations": local_rotations}, method)
    assert report.verdict is Verdict.WRONG
    sentences = [*told(report), report.diagnosis.behaviour, report.diagnosis.first_broken]
    assert not any("slower" in str(one) for one in sentences)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("pairs", "allowed"),
    [(slice(5, None, 197), 0.0), pytest.param(slice(None), 0.02, marks=pytest.mark.slow)],
)
def test_pairs_are_named(method, pairs, allowed):
    """Or another variant of as few faults that reproduces all that the pair answers."""
    chosen = [faults for faults in combinations(method) if len(faults) == 2][pairs]
    missed = []
    for faults in chosen:
        found = faulty(method, *(fault.key for fault in faults)).diagnosis.explanations
        if not found or found[0].share < 1.0:
            missed.append(faults)
    assert len(missed) <= allowed * len(chosen), missed


@pytest.mark.parametrize("solver", IK_SOLVERS)
def test_reference_is_not_accused(solver):
    report = judged(INVERSE, reference(INVERSE, solver), solver)
    assert report.verdict <= (Verdict.RIGHT if solver == "ccd" else Verdict.RIGHT_BUT)
    assert not report.diagnosis.explanations


@pytest.mark.parametrize("solver", some(IK_SOLVERS, {"ccd", "levenberg_marquardt"}))
def test_undeclared_reference_is_not_accused(solver):
    report = judged(INVERSE, reference(INVERSE, solver))
    assert report.verdict <= Verdict.RIGHT_BUT
    assert not report.diagnosis.explanations
    if solver in METHODS:
        assert "sweeps are those of" in str(report.diagnosis.behaviour)


HONEST = {
    "half-way vector": ("ccd", students.ccd, {}),
    "axis and angle": ("ccd", students.ccd, {"kind": students.axis_angle}),
    "not normalised": ("ccd", students.ccd, {"normalises": False}),
    "small angles dropped": ("ccd", students.ccd, {"dead": 1e-6}),
    "root to tip": ("ccd", students.ccd, {"up": False}),
    "effector rotated": ("ccd", students.ccd, {"rotates_tip": True}),
    "capped": ("ccd", students.ccd, {"kind": students.axis_angle, "most": 0.3}),
    "damped": ("ccd", students.ccd, {"kind": students.axis_angle, "share": 0.7}),
    "FABRIK": ("fabrik", students.fabrik, {}),
    "straight beyond reach": ("fabrik", students.fabrik, {"stretches": True}),
    "tests after a sweep": ("fabrik", students.fabrik, {"tests_last": True}),
    "rotations from rest": ("fabrik", students.fabrik, {"from_rest": True}),
}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "name", some(HONEST, {"half-way vector", "root to tip", "FABRIK", "rotations from rest"})
)
def test_honest_variant_is_not_accused(name):
    method, function, options = HONEST[name]
    report = judged(INVERSE, students.with_options(function, **options), method)
    assert report.verdict is Verdict.RIGHT_BUT  # stuck on collinear targets, if nothing else
    assert all(one.faults == ("root to tip",) for one in report.diagnosis.explanations)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("declared", [True, pytest.param(False, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", some(HONEST, {"half-way vector", "FABRIK"}))
def test_honest_variant_in_single_precision_is_not_accused(name, declared):
    method, function, options = HONEST[name]
    single = students.in_single(function, **options)
    report = judged(INVERSE, single, method if declared else "", precision="single")
    assert report.verdict is Verdict.RIGHT_BUT


def test_helper_that_drops_small_rotations_stalls():
    single = students.in_single(students.ccd, dead=5e-4)
    report = judged(INVERSE, single, "ccd", precision="single")
    assert report.verdict is Verdict.RIGHT_BUT
    assert sum("stalls" in one for one in told(report)) >= 5


def changed(**changes):
    """A right solver whose answers are changed, each output by a function of answer and inputs."""

    def function(**inputs):
        local, positions, _ = solve("ccd", inputs)
        answer = {"local_rotations": local, "positions": positions}
        return answer | {name: change(answer, inputs) for name, change in changes.items()}

    return function


def off_path(answer, inputs):
    local, path = answer["local_rotations"].copy(), set()
    j = inputs["effector"]
    while j >= 0:
        path.add(j)
        j = inputs["parents"][j]
    for j in set(range(len(local))) - path:
        local[j] = [0.6, 0.8, 0.0, 0.0]
    return local


def one_branch_moved(answer, inputs):
    """Rotate the last joint about its parent, which keeps its link's length."""
    x, p = answer["positions"].copy(), inputs["parents"][-1]
    x[-1] = x[p] + (x[-1] - x[p]) * [1.0, -1.0, -1.0]
    return x


NOISE = np.random.default_rng(0)
LIES = {
    "link lengths": {"positions": lambda a, i: 1.001 * a["positions"]},
    "root in place": {"positions": lambda a, i: a["positions"] + 1e-6},
    "rotations agree with positions": {"positions": lambda a, i: a["positions"] + 1e-3},
    "joints off the path": {"local_rotations": off_path},
    "branches": {"positions": one_branch_moved},
    "numbers": {"positions": lambda a, i: a["positions"] * np.nan},
    "claims": {"converged": lambda a, i: True},
    "claims of a residual": {"residual": lambda a, i: 0.0},
    "equal answers": {"positions": lambda a, i: a["positions"] + 1e-6 * NOISE.uniform()},
}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("law", LIES)
def test_law_sees_the_lie(law, monkeypatch):
    def few_variants(method, most_faults):
        return itertools.islice(variants(method), 60)

    monkeypatch.setattr(report_of_task, "variants", few_variants)
    report = judged(INVERSE, changed(**LIES[law]), "ccd")
    assert law.split(" of ")[0] in broken(report)
    assert report.verdict >= Verdict.WRONG


@pytest.mark.parametrize("key", ["world rotation on the left", "joints not placed anew"])
def test_what_is_inferred_does_not_contradict_what_is_wrong(key):
    """Sweeps that are not those of CCD are not said to be."""
    report = faulty("ccd", key, declared=False)
    assert any("Its sweep is not that of CCD" in words for words in told(report))
    resemble = "Its sweeps resemble those of CCD, with which it is compared."
    assert str(report.diagnosis.behaviour) == resemble
    right = faulty("ccd", declared=False)
    assert str(right.diagnosis.behaviour) == "Its sweeps are those of CCD."


def test_denied_arrival_is_told():
    report = judged(INVERSE, changed(converged=lambda a, i: False), "ccd")
    assert report.verdict is Verdict.RIGHT_BUT
    assert "claims" in broken(report, Verdict.RIGHT_BUT)


def nan_effector(answer, inputs):
    local, effector = answer["local_rotations"], inputs["effector"]
    if not (inputs["parents"] == effector).any():
        local[effector] = np.nan
    return local


def nan_at_the_root(answer, inputs):
    at_root = np.allclose(inputs["target"], inputs["offsets"][0])
    return answer["local_rotations"] * (np.nan if at_root else 1.0)


@pytest.mark.parametrize(
    ("change", "verdict"), [(nan_effector, Verdict.RIGHT_BUT), (nan_at_the_root, Verdict.BROKEN)]
)
def test_nan_in_the_effectors_own_rotation_does_not_void_the_rest(change, verdict):
    def function(**inputs):
        return {"local_rotations": changed(local_rotations=change)(**inputs)["local_rotations"]}

    report = judged(INVERSE, function, "ccd")
    assert report.verdict is verdict
    assert "numbers" in broken(report, Verdict.RIGHT_BUT)


def test_solver_that_goes_on_to_the_target_is_told():
    def function(**inputs):
        full = inputs | {"max_iterations": 500, "tolerance": 1e-9}
        return {"positions": solve("fabrik", full)[1]}

    report = judged(INVERSE, function, "fabrik")
    assert report.verdict is Verdict.RIGHT_BUT
    assert any("goes on to the target" in one for one in told(report))


@pytest.mark.parametrize(
    ("key", "law"),
    [
        ("target from the origin", "equal worlds"),
        ("world rotation on the right", "distance does not grow"),
    ],
)
def test_a_fault_breaks_a_law_of_its_own(key, law):
    assert law in broken(faulty("ccd", key))


def test_seventy_faults_are_known():
    keys = {(one.part, one.key) for method in METHODS for one in FAULTS[method]}
    assert len(keys) >= 60
    report = faulty("ccd", "xyzw read", "gap as direction", "one sweep more")
    assert report.diagnosis.variant_count > 1300


def test_cases_suit_the_greeting():
    said = Greeting(1, (INVERSE,), chains_only=True, max_joints=5)
    cases = problems.cases(said, "", 0, False)
    assert len(cases) > 20
    for case in cases:
        parents = case.inputs["parents"]
        assert (parents == np.arange(-1, len(parents) - 1)).all()
        assert len(parents) <= 5


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("method", METHODS)
def test_right_solvers_are_right_with_any_seed(seed, method):
    report = judged(INVERSE, textbook(INVERSE, (), method), method, seed)
    assert report.verdict <= Verdict.RIGHT_BUT


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_student_is_judged_in_ten_seconds():
    functions = {
        FORWARD: students.forward_kinematics,
        INVERSE: students.with_options(students.ccd),
    }
    contestant = FunctionContestant(functions, Greeting(1, tuple(functions)))
    verify(contestant)
    start = time.perf_counter()
    verify(contestant)
    assert time.perf_counter() - start < 10.0
