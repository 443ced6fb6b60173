"""Judging inverse kinematics: every fault is caught by a law and named, and nobody else accused."""

import itertools
import time

import conformance_students as students
import numpy as np
import pytest

from plumbob.crosscheck.verify.functions import FunctionContestant
from plumbob.crosscheck.verify.greeting import Greeting
from plumbob.crosscheck.verify.judgement import Verdict
from plumbob.crosscheck.verify.kinematics import problems
from plumbob.crosscheck.verify.kinematics import report as report_of_task
from plumbob.crosscheck.verify.kinematics.faults import FAULTS, combinations, switches
from plumbob.crosscheck.verify.kinematics.predictions import solve, variants
from plumbob.crosscheck.verify.verify import verify
from plumbob.reference import IK_SOLVERS, Skeleton, solve_ik

TASK = "inverse_kinematics"
METHODS = ("ccd", "fabrik")
BOTH = ("local_rotations", "positions")
# Faults that no answer tells apart where only these outputs come, and what cannot show at all.
TWINS = {
    BOTH: [],
    ("local_rotations",): [{"target from the root", "root offset dropped"}],
    ("positions",): [{"xyzw read", "xyzw throughout"}],
}
UNSEEN = {("positions",): {"xyzw written"}}


def judged(function, method="", **greeting):
    said = Greeting(1, (TASK,), methods=(method,), **greeting)
    return verify(FunctionContestant({TASK: function}, said)).tasks[0]


def faulty(method, faults, outputs=BOTH):
    switched = switches(faults)

    def function(**inputs):
        local, positions, _ = solve(method, inputs, switched)
        answer = {"local_rotations": local, "positions": positions}
        return {name: answer[name] for name in outputs}

    return function


def by_reference(solver):
    def function(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
        found = solve_ik(
            Skeleton(parents, offsets), local_rotations, target, solver, effector=effector,
            tolerance=tolerance, max_iterations=max_iterations,
        )  # fmt: skip
        return {
            "local_rotations": found.local_rotations,
            "positions": found.positions,
            "residual": found.residual,
            "iterations": found.iterations,
            "converged": found.outcome.name == "CONVERGED",
        }

    return function


def broken(report, least=Verdict.WRONG):
    return {
        finding.law
        for told in report.judgements
        for finding in told.findings
        if finding.verdict >= least
    }


def named(report):
    return [set(one.faults) for one in report.diagnosis.explanations]


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
    report = judged(faulty(method, [fault], outputs), method)
    assert report.verdict is (Verdict.RIGHT_BUT if fault.honest else Verdict.WRONG)
    assert broken(report, Verdict.RIGHT_BUT) - {"target reached"} or not fault.honest
    twins = next((two for two in TWINS[outputs] if fault.key in two), {fault.key})
    assert named(report) == [twins & {one.key for one in FAULTS[method]}]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("every", [17, pytest.param(1, marks=pytest.mark.slow)])
def test_fault_is_named_where_no_method_is_declared(method, every):
    for fault in FAULTS[method][::every]:
        report = judged(faulty(method, [fault]))
        assert named(report)[0] == {fault.key}


@pytest.mark.parametrize("method", ["", *METHODS])
def test_a_solver_that_does_not_move_is_no_slower_solver(method):
    report = judged(lambda local_rotations: {"local_rotations": local_rotations}, method)
    assert report.verdict is Verdict.WRONG
    findings = [finding.sentence for one in report.judgements for finding in one.findings]
    sentences = [*findings, report.diagnosis.behaviour, report.diagnosis.first_broken]
    assert not any("slower" in str(one) for one in sentences)


def pairs(method):
    return [faults for faults in combinations(method) if len(faults) == 2]


def is_named(report, faults):
    """Whether a pair is named, or one of its faults where no answer shows the other."""
    keys = {" + ".join(fault.key for fault in faults), *(fault.key for fault in faults)}
    found = report.diagnosis.explanations
    return bool(found) and found[0].share == 1.0 and bool(keys & set(found[0].faults))


def has_an_equal(report, faults):
    """Whether another variant of as few faults reproduces all that the pair answers."""
    found = report.diagnosis.explanations
    return bool(found) and found[0].share == 1.0


@pytest.mark.parametrize("method", METHODS)
def test_pairs_are_named(method):
    for faults in pairs(method)[5::197]:
        report = judged(faulty(method, faults), method)
        assert is_named(report, faults) or has_an_equal(report, faults), faults


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_every_pair_is_named(method):
    missed = []
    for faults in pairs(method):
        report = judged(faulty(method, faults), method)
        if not (is_named(report, faults) or has_an_equal(report, faults)):
            missed.append(faults)
    assert len(missed) <= 0.02 * len(pairs(method)), missed


@pytest.mark.parametrize("solver", IK_SOLVERS)
def test_reference_is_not_accused(solver):
    report = judged(by_reference(solver), solver)
    assert report.verdict <= Verdict.RIGHT_BUT
    assert not report.diagnosis.explanations


def test_reference_frees_collinear_chains():
    assert judged(by_reference("ccd"), "ccd").verdict is Verdict.RIGHT


@pytest.mark.parametrize("solver", some(IK_SOLVERS, {"ccd", "levenberg_marquardt"}))
def test_undeclared_reference_is_not_accused(solver):
    report = judged(by_reference(solver))
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
    report = judged(students.with_options(function, **options), method)
    assert report.verdict is Verdict.RIGHT_BUT  # stuck on collinear targets, if nothing else
    assert all(one.faults == ("root to tip",) for one in report.diagnosis.explanations)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("declared", [True, False])
@pytest.mark.parametrize("name", HONEST)
def test_honest_variant_in_single_precision_is_not_accused(name, declared):
    method, function, options = HONEST[name]
    single = students.in_single(function, **options)
    report = judged(single, method if declared else "", precision="single")
    assert report.verdict is Verdict.RIGHT_BUT


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ["half-way vector", "FABRIK"])
def test_single_precision_is_not_accused(name):
    method, function, options = HONEST[name]
    report = judged(students.in_single(function, **options), method, precision="single")
    assert report.verdict is Verdict.RIGHT_BUT


def test_helper_that_drops_small_rotations_stalls():
    single = students.in_single(students.ccd, dead=5e-4)
    report = judged(single, "ccd", precision="single")
    assert report.verdict is Verdict.RIGHT_BUT
    told = [str(f.sentence) for one in report.judgements for f in one.findings if f.verdict]
    assert sum("stalls" in one for one in told) >= 5


def changed(method="ccd", **changes):
    """A right solver whose answers are changed, each output by a function of answer and inputs."""

    def function(**inputs):
        local, positions, _ = solve(method, inputs)
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


def nan_effector(answer, inputs):
    local = answer["local_rotations"].copy()
    local[-1] = np.nan
    return local


NOISE = np.random.default_rng(0)
LIES = {
    "link lengths": {"positions": lambda a, i: 1.001 * a["positions"]},
    "root in place": {"positions": lambda a, i: a["positions"] + 1e-6},
    "rotations agree with positions": {"positions": lambda a, i: a["positions"] + 1e-3},
    "joints off the path": {"local_rotations": off_path},
    "branches": {"positions": lambda a, i: a["positions"] * [1.0, 1.0, -1.0]},
    "numbers": {"positions": lambda a, i: a["positions"] * np.nan},
    "claims": {"converged": lambda a, i: True},
    "equal answers": {"positions": lambda a, i: a["positions"] + 1e-6 * NOISE.uniform()},
}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("law", LIES)
def test_law_sees_the_lie(law, monkeypatch):
    monkeypatch.setattr(report_of_task, "variants", few_variants)
    if law == "branches":  # mirrored branches keep their distances: let one alone be moved
        report = judged(changed(positions=one_branch_moved), "ccd")
    else:
        report = judged(changed(**LIES[law]), "ccd")
    assert law in broken(report)
    assert report.verdict >= Verdict.WRONG


def few_variants(method, most_faults):
    return itertools.islice(variants(method), 60)


def one_branch_moved(answer, inputs):
    """Rotate the last joint about its parent, which keeps its link's length."""
    x, p = answer["positions"].copy(), inputs["parents"][-1]
    x[-1] = x[p] + (x[-1] - x[p]) * [1.0, -1.0, -1.0]
    return x


@pytest.mark.parametrize("key", ["world rotation on the left", "joints not placed anew"])
def test_what_is_inferred_does_not_contradict_what_is_wrong(key):
    """Sweeps that are not those of CCD are not said to be."""
    (fault,) = (one for one in FAULTS["ccd"] if one.key == key)
    found = judged(faulty("ccd", [fault]))
    said = [f.sentence for one in found.judgements for f in one.findings if f.verdict]
    assert any("Its sweep is not that of CCD" in str(words) for words in said)
    assert (
        str(found.diagnosis.behaviour)
        == "Its sweeps resemble those of CCD, with which it is compared."
    )
    assert str(judged(faulty("ccd", [])).diagnosis.behaviour) == "Its sweeps are those of CCD."


def test_claimed_residual_has_to_be_true():
    report = judged(changed(residual=lambda a, i: 0.0), "ccd")
    assert "claims" in broken(report)


def test_denied_arrival_is_told():
    report = judged(changed(converged=lambda a, i: False), "ccd")
    assert report.verdict is Verdict.RIGHT_BUT
    assert "claims" in broken(report, Verdict.RIGHT_BUT)


def test_nan_in_the_effectors_own_rotation_does_not_void_the_rest():
    def function(**inputs):
        local, _, _ = solve("ccd", inputs)
        if not (inputs["parents"] == inputs["effector"]).any():
            local[inputs["effector"]] = np.nan
        return {"local_rotations": local}

    report = judged(function, "ccd")
    assert report.verdict is Verdict.RIGHT_BUT
    assert "numbers" in broken(report, Verdict.RIGHT_BUT)


def test_nan_at_a_collinear_target_is_broken():
    def function(**inputs):
        local, positions, _ = solve("ccd", inputs)
        path = [inputs["parents"][inputs["effector"]]]
        at_root = np.allclose(inputs["target"], inputs["offsets"][0])
        return {"local_rotations": local * (np.nan if at_root and path else 1.0)}

    assert judged(function, "ccd").verdict is Verdict.BROKEN


def test_solver_that_goes_on_to_the_target_is_told():
    def function(**inputs):
        full = inputs | {"max_iterations": 500, "tolerance": 1e-9}
        return {"positions": solve("fabrik", full)[1]}

    report = judged(function, "fabrik")
    assert report.verdict is Verdict.RIGHT_BUT
    told = [str(f.sentence) for one in report.judgements for f in one.findings if f.verdict]
    assert any("goes on to the target" in one for one in told)


def test_answer_from_another_world_is_wrong():
    report = judged(faulty("ccd", [fault("ccd", "target from the origin")]), "ccd")
    assert "equal worlds" in broken(report)


def fault(method, key):
    return next(one for one in FAULTS[method] if one.key == key)


def test_growing_distance_is_a_law_of_its_own():
    report = judged(faulty("ccd", [fault("ccd", "world rotation on the right")]), "ccd")
    assert "distance does not grow" in broken(report)


def test_seventy_faults_are_known():
    keys = {(one.part, one.key) for method in METHODS for one in FAULTS[method]}
    assert len(keys) >= 60
    three = [fault("ccd", key) for key in ("xyzw read", "gap as direction", "one sweep more")]
    assert judged(faulty("ccd", three), "ccd").diagnosis.tried > 1300


def test_cases_suit_the_greeting():
    said = Greeting(1, (TASK,), chains_only=True, max_joints=5)
    cases = problems.cases(said, "", 0, False)
    assert len(cases) > 20
    for case in cases:
        parents = case.inputs["parents"]
        assert (parents == np.arange(-1, len(parents) - 1)).all()
        assert len(parents) <= 5


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_right_solvers_are_right_with_any_seed(seed):
    for method in METHODS:
        said = Greeting(1, (TASK,), methods=(method,))
        contestant = FunctionContestant({TASK: faulty(method, ())}, said)
        assert verify(contestant, seed=seed).verdict <= Verdict.RIGHT_BUT


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_student_is_judged_in_ten_seconds():
    tasks = ("forward_kinematics", TASK)
    functions = {
        "forward_kinematics": students.forward_kinematics,
        TASK: students.with_options(students.ccd),
    }
    contestant = FunctionContestant(functions, Greeting(1, tasks))
    verify(contestant)
    start = time.perf_counter()
    verify(contestant)
    assert time.perf_counter() - start < 10.0
