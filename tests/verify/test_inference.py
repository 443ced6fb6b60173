"""What a solver takes without declaring it is inferred and said; diagnoses name no accident."""

import json

import msgspec
import numpy as np
import pytest

from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Greeting, Step, System
from plumbob.verify.judgement import Verdict
from plumbob.verify.kinematics.predictions import forward, path_to, solve
from plumbob.verify.mass_spring.problem import all_forces, problem_of
from plumbob.verify.screen.terminal import lines
from plumbob.verify.screen.words import Presentation, speaker
from plumbob.verify.verify import verify
from tests.honest_solvers import DECLARED, Stepper

FK, IK, FORCES, STEP = (
    "forward_kinematics", "inverse_kinematics", "mass_spring_forces", "mass_spring_step",
)  # fmt: skip


def chain(inputs):
    return inputs | {"parents": np.arange(-1, len(inputs["parents"]) - 1)}


def last(inputs):
    return inputs | {"effector": len(inputs["parents"]) - 1}


def solved(method="ccd", change=dict):
    return lambda **inputs: dict(
        zip(("local_rotations", "positions"), solve(method, change(inputs)), strict=False)
    )


def refuse_branches(**inputs):
    if (np.diff(inputs["parents"]) != 1).any():
        raise ValueError("it takes no branches")
    return forward(inputs)


def refuse_other_effectors(**inputs):
    if inputs["effector"] != len(inputs["parents"]) - 1:
        raise ValueError("it takes the last joint alone")
    return solved()(**inputs)


def move_points(offsets, target, tolerance, max_iterations):
    """FABRIK on points, which knows no rotations, no parents and no effector but the last."""
    x, lengths = np.cumsum(offsets, axis=0), np.linalg.norm(offsets, axis=1)
    for _ in range(max_iterations):
        if np.linalg.norm(x[-1] - target) <= tolerance:
            break
        x[-1] = target
        for ends in ((range(len(x) - 2, -1, -1), 1), (range(1, len(x)), -1)):
            for i in ends[0]:
                d = x[i] - x[i + ends[1]]
                x[i] = x[i + ends[1]] + lengths[max(i, i + ends[1])] * d / np.linalg.norm(d)
            x[0] = offsets[0]
    return {"positions": x}


def turn_in_plane(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    """CCD with an angle for each joint; z is ignored."""
    angles = 2.0 * np.arctan2(local_rotations[:, 3], local_rotations[:, 0])

    def placed():
        local = np.zeros((len(parents), 4))
        local[:, 0], local[:, 3] = np.cos(angles / 2.0), np.sin(angles / 2.0)
        arm = {"parents": parents, "offsets": offsets * [1, 1, 0], "local_rotations": local}
        return forward(arm)[0], local

    for _ in range(max_iterations):
        x, _ = placed()
        if np.linalg.norm((x[effector] - target)[:2]) <= tolerance:
            break
        for j in path_to(parents, effector)[-2::-1]:
            a, b = x[effector] - x[j], target - x[j]
            angles[j] += np.arctan2(a[0] * b[1] - a[1] * b[0], a[:2] @ b[:2])
            x, _ = placed()
    return dict(zip(("positions", "local_rotations"), placed(), strict=True))


def alike(*names):
    return lambda inputs: inputs | {n: np.resize(inputs[n][:1], len(inputs[n])) for n in names}


def refuse_different(*names):
    def checked(inputs):
        if any(np.ptp(inputs[name]) for name in names if len(inputs[name])):
            raise ValueError("all alike, please")
        return inputs

    return checked


def along_y(inputs):
    return inputs | {"gravity": inputs["gravity"] * [0, 1, 0]}


def flat(inputs):
    vectors = ("positions", "velocities", "gravity")
    return inputs | {name: inputs[name] * [1, 1, 0] for name in vectors}


def forces(change):
    return lambda **inputs: {"forces": all_forces(problem_of(change(inputs)))}


def step(change, name="linearised"):
    stepper = Stepper(DECLARED[name][0])
    return lambda **inputs: stepper(**change(inputs))


def measure(rest_positions, springs, **inputs):
    ends = rest_positions[springs]
    inputs["rest_lengths"] = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    return Stepper(DECLARED["linearised"][0])(springs=springs, **inputs)


def verlet(previous_positions, **inputs):
    inputs["velocities"] = (inputs["positions"] - previous_positions) / inputs["h"]
    return Stepper(DECLARED["linearised"][0])(**inputs)


KINDS = {
    "no branches": (FK, lambda **i: forward(chain(i)), {"chains_only": True}),
    "refuses branches": (FK, refuse_branches, {"chains_only": True}),
    "chains, CCD": (IK, solved(change=chain), {"chains_only": True}),
    "last joint": (IK, solved(change=last), {"effector": "last"}),
    "refuses other effectors": (IK, refuse_other_effectors, {"effector": "last"}),
    "points": (
        IK, move_points, {"chains_only": True, "effector": "last", "rotations": False}),
    "plane, CCD": (IK, turn_in_plane, {"planar": True}),
    "one stiffness": (FORCES, forces(alike("stiffnesses")), {"stiffnesses": "one"}),
    "one mass and rest length": (
        FORCES, forces(alike("masses", "rest_lengths")), {"masses": "one", "rest_lengths": "one"}),
    "refuses masses and dampings": (
        FORCES, forces(refuse_different("masses", "dampings")),
        {"masses": "one", "dampings": "one"}),
    "gravity along y": (FORCES, forces(along_y), {"gravity": "number"}),
    "plane, forces": (FORCES, forces(flat), {"planar": True}),
    "one mass": (STEP, step(alike("masses")), {"masses": "one"}),
    "no pins": (STEP, step(lambda i: i | {"pinned": i["pinned"][:0]}), {"pinned": False}),
    "rest shape": (STEP, measure, {"rest_lengths": "measured"}),
    "Verlet": (STEP, verlet, {"state": "previous_positions"}),
}  # fmt: skip


def judged(task, function, **declared):
    if task == STEP:
        declared = {"step": DECLARED["linearised"][1]} | declared
    return verify(FunctionConnection({task: function}, Greeting(1, (task,), **declared)))


def screen(report):
    text = lines(report, Presentation(speaker("en"), "en", ["x"]))
    assert max(map(len, text)) <= 80
    return " ".join(" ".join(text).split())


@pytest.mark.sample("no branches")  # the others take seconds each
@pytest.mark.parametrize("kind", KINDS)
def test_an_undeclared_restriction_is_inferred_and_its_field_is_named(kind):
    task, function, fields = KINDS[kind]
    report = judged(task, function)
    needs_declaration = bool({"stiffnesses", "rest_lengths", "pinned"} & fields.keys())
    needs_declaration &= fields != {"rest_lengths": "measured"}
    assert report.verdict is (Verdict.UNDECIDED if needs_declaration else Verdict.RIGHT_EXCEPT)
    assert report.tasks[0].assumptions
    text = screen(report)
    assert ("if not, it is a mistake" in text) is needs_declaration
    assert ("Next: declare what is meant in the greeting" in text) is needs_declaration
    assert "eclare it with" in text
    assert all(f'"{name}": {json.dumps(value)}' in text for name, value in fields.items())
    known = [field.name for kind in (Greeting, System) for field in msgspec.structs.fields(kind)]
    assert {name for name in known if f'"{name}"' in text} - {"system", "methods"} == fields.keys()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["chains, CCD", "one mass"])
@pytest.mark.usefixtures("verdict_alone")
def test_a_declared_restriction_needs_no_inference(kind):
    task, function, fields = KINDS[kind]
    declared = fields if task == IK else {"system": System(**fields)}
    assert not judged(task, function, **declared).tasks[0].assumptions


def test_a_declared_plane_is_not_told_to_be_declared():
    doubled = forces(lambda i: flat(i | {"stiffnesses": 2.0 * i["stiffnesses"]}))
    (report,) = judged(FORCES, doubled, planar=True).tasks
    assert report.verdict is Verdict.WRONG
    assert not report.assumptions


@pytest.mark.sample(without=["step-<lambda>", "forces-<lambda>1", "forces-<lambda>2"])
@pytest.mark.parametrize(("task", "function"), [
    (FORCES, forces(lambda i: i | {"masses": np.ones(len(i["masses"]))})),  # no mass at all
    (FORCES, forces(lambda i: i | {"masses": i["masses"][::-1]})),  # right if all are equal
    (FORCES, forces(lambda i: alike("masses")(i) | {"stiffnesses": 2.0 * i["stiffnesses"]})),
    (STEP, step(lambda i: i | {"pinned": i["pinned"][:1]})),  # right without pins
    (FK, lambda **i: forward(chain(i | {"offsets": 2.0 * i["offsets"]}))),
])  # fmt: skip
@pytest.mark.usefixtures("verdict_alone")
def test_inference_hides_no_fault(task, function):
    assert judged(task, function).verdict is Verdict.WRONG


def test_the_fault_that_explains_the_other_answers_is_still_named():
    task, function, _ = KINDS["no branches"]
    (report,) = judged(task, function).tasks
    assert report.diagnosis.explanations[0].codes == ("PB-FK-016",)


def by_method(method, **inputs):
    return solved({"ccd": "ccd", "fabrik": "fabrik"}.get(method, "fabrik"))(**inputs)


def named_only(method, **inputs):
    return solved({"ccd": "ccd"}[method])(**inputs)


@pytest.mark.sample("by_method")
@pytest.mark.parametrize(("function", "methods"), [
    (by_method, ["ccd", "fabrik"]), (named_only, ["ccd"]), (solved(), [""])])  # fmt: skip
def test_methods_are_inferred_from_answers(function, methods):
    report = judged(IK, function)
    assert [task.method for task in report.tasks] == methods
    assert report.verdict is Verdict.RIGHT_EXCEPT
    assert ("Judged by the methods" in screen(report)) == (methods != [""])


def returning(change):
    def solver(local_rotations, **inputs):
        return {"local_rotations": change(local_rotations)}

    return solver


@pytest.mark.sample("identity")
@pytest.mark.parametrize(("method", "change", "words"), [
    ("", lambda local: np.tile([1.0, 0.0, 0.0, 0.0], (len(local), 1)), "are the identity"),
    ("ccd", lambda local: local, "repeat the local rotations of the start"),
])  # fmt: skip
def test_a_solver_that_writes_no_result_is_told_so_and_accused_of_no_combination(
    method, change, words
):
    report = judged(IK, returning(change), methods=(method,))
    (task,) = report.tasks
    assert report.verdict is Verdict.WRONG
    assert words in screen(report)
    assert all(" + " not in key for e in task.diagnosis.explanations for key in e.faults)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["linearised", "symplectic"])
def test_an_inferred_step_is_declared_as_the_report_says(name):
    stepper = Stepper(DECLARED[name][0])
    (report,) = judged(STEP, stepper, step=Step()).tasks
    declaration = report.diagnosis.behaviour.values["declaration"]
    step = msgspec.convert(json.loads(f"{{{declaration}}}")["step"], Step)
    (report,) = judged(STEP, stepper, step=step).tasks
    assert report.verdict <= Verdict.RIGHT_EXCEPT
    assert report.diagnosis.behaviour is None
