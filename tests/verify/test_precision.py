"""Whatever the greeting says, answers are judged by the precision that their numbers show."""

import json

import numpy as np
import pytest
from kinematics_solvers import faulty, textbook

from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Greeting
from plumbob.verify.judgement import (
    Report,
    Verdict,
)
from plumbob.verify.mass_spring.problem import all_forces, problem_of
from plumbob.verify.screen import json_file, junit, page, terminal
from plumbob.verify.screen.words import Presentation, speaker
from plumbob.verify.verify import DISCIPLINES, judge_cases, verify
from tests.honest_solvers import DECLARED, Stepper


def forward_kinematics(code):
    task = "forward_kinematics"
    return faulty(task, code) if code else textbook(task)


def ccd(code):
    task = "inverse_kinematics"
    return faulty(task, code) if code else textbook(task)


def forces(key):
    scale = -1.0 if key else 1.0
    return lambda **inputs: {
        "forces": all_forces(problem_of(inputs | {"gravity": scale * inputs["gravity"]}))
    }


def step(key):
    right = Stepper(DECLARED["linearised"][0])
    scale = -1.0 if key else 1.0
    return lambda **inputs: right(**inputs | {"gravity": scale * inputs["gravity"]})


# What makes a solver by the key of its fault, a fault, and what the greeting says besides.
TASKS = {
    "forward_kinematics": (forward_kinematics, "PB-FK-002", {}),
    "inverse_kinematics": (ccd, "PB-CCD-001", {"methods": ("ccd",)}),
    "mass_spring_forces": (forces, "gravity upwards", {}),
    "mass_spring_step": (step, "gravity upwards", {"step": DECLARED["linearised"][1]}),
}
EACH_TASK = pytest.mark.parametrize("task", TASKS)


def printed(pattern):
    return np.vectorize(lambda x: float(pattern % x), otypes=[float])


def as_float(x):
    return np.asarray(x, dtype=np.float32).astype(float)


SINGLE = "are single-precision values"
# The printed numbers of programs, and the remark about them.
PRINTERS = {
    "float": (as_float, SINGLE),
    "float, nine digits": (lambda x: printed("%.9g")(as_float(x)), SINGLE),
    "float, shortest": (np.vectorize(lambda x: float(str(np.float32(x))), otypes=[float]), SINGLE),
    "cout": (printed("%g"), "have only 6 significant digits"),
    "float, cout": (lambda x: printed("%g")(as_float(x)), "have only 6 significant digits"),
    "to_string": (printed("%f"), "have only 6 significant digits"),
    "twelve digits": (printed("%.12g"), "have only 12 significant digits"),
}


def of_each_task(printers):
    """Parametrise over tasks and printers."""
    pairs = [(task, printer) for task in TASKS for printer in printers]
    return pytest.mark.parametrize(("task", "printer"), pairs)


def connection(task, function, rounded=np.asarray, **greeting):
    def rounding(**inputs):
        answer = function(**inputs)
        return {n: rounded(value) if np.ndim(value) else value for n, value in answer.items()}

    return FunctionConnection({task: rounding}, Greeting(1, (task,), **TASKS[task][2], **greeting))


def judged(*arguments, **greeting):
    return verify(connection(*arguments, **greeting)).tasks[0]


@pytest.mark.sample(every=8)
@of_each_task(PRINTERS)
def test_a_right_solver_is_right_to_the_digits_that_it_prints(task, printer):
    rounded, words = PRINTERS[printer]
    report = judged(task, TASKS[task][0](None), rounded)
    assert words in str(report.assumptions[0])
    assert report.verdict is Verdict.RIGHT_EXCEPT
    assert max(one.verdict for one in report.judgements) <= Verdict.RIGHT_EXCEPT
    assert report.diagnosis.explanations == ()


@pytest.mark.sample(without=["step"], every=5)
@of_each_task(["float", "float, nine digits", "cout", "to_string"])
def test_a_wrong_solver_stays_wrong_and_its_fault_is_named(task, printer):
    make, key, _ = TASKS[task]
    rounded, words = PRINTERS[printer]
    report = judged(task, make(key), rounded)
    assert words in str(report.assumptions[0])
    assert report.verdict is Verdict.WRONG
    explanation = report.diagnosis.explanations[0]
    assert key in {*explanation.faults, *explanation.codes}


@EACH_TASK
def test_double_precision_is_believed_of_every_case_alone(task):
    """As --rerun asks them: some requests have short numbers, and answers as short."""
    program = connection(task, TASKS[task][0](None))
    method = program.greeting.methods[0]
    for case in DISCIPLINES[task].cases(program.greeting, method, 0, False):
        assert not judge_cases(program, task, method, [case]).assumptions, case.name


@pytest.mark.sample(without=["inverse"])
@of_each_task(["float", "cout"])
@pytest.mark.usefixtures("verdict_alone")
def test_one_answer_of_few_digits_excuses_nothing(task, printer):
    make, rounded = TASKS[task][0](None), PRINTERS[printer][0]
    asked = []

    def function(**inputs):
        asked.append(inputs)
        return {k: rounded(v) if len(asked) % 9 == 0 else v for k, v in make(**inputs).items()}

    report = judged(task, function)
    assert not report.assumptions
    assert report.verdict is Verdict.WRONG


@pytest.mark.usefixtures("verdict_alone")
def test_a_fault_as_small_as_single_precision_in_some_cases_is_no_precision():
    right = forward_kinematics(None)

    def function(**inputs):
        answer = right(**inputs)
        return answer | {"positions": answer["positions"] + 1e-7 * (len(inputs["parents"]) > 5)}

    report = judged("forward_kinematics", function)
    assert not report.assumptions
    assert report.verdict is Verdict.WRONG


@pytest.mark.slow
@pytest.mark.parametrize(
    ("task", "is_right"),
    [(task, is_right) for is_right in (True, False) for task in TASKS],
)
def test_answers_of_inputs_in_single_precision_are_judged_so_and_a_float_is_hinted_at(
    task, is_right
):
    make, key, _ = TASKS[task]
    solver = make(None if is_right else key)

    def function(**inputs):
        arrays = {
            name: as_float(value)
            for name, value in inputs.items()
            if isinstance(value, np.ndarray) and value.dtype.kind == "f"
        }
        return solver(**(inputs | arrays))

    report = judged(task, function)
    assert "Look for a float" in str(report.assumptions[0])
    if is_right:
        assert report.verdict is Verdict.RIGHT_EXCEPT
        assert report.diagnosis.explanations == ()
    else:
        assert report.verdict is Verdict.WRONG
        explanation = report.diagnosis.explanations[0]
        assert key in {*explanation.faults, *explanation.codes}


@pytest.mark.sample(every=2)
@EACH_TASK
@pytest.mark.usefixtures("verdict_alone")
def test_declared_single_precision_is_right_without_a_word(task):
    report = judged(task, TASKS[task][0](None), as_float, precision="single")
    assert not report.assumptions
    assert report.verdict <= Verdict.RIGHT_EXCEPT
    assert judged(task, TASKS[task][0](None), printed("%g"), precision="single").assumptions


@pytest.mark.usefixtures("verdict_alone")
def test_residual_in_single_precision_is_no_evidence():
    right = ccd(None)

    def function(**inputs):
        answer = right(**inputs)
        distance = np.linalg.norm(answer["positions"][inputs["effector"]] - inputs["target"])
        return answer | {"residual": as_float(distance)}

    assert not judged("inverse_kinematics", function).assumptions


@pytest.mark.parametrize("language", ["en", "zh"])
def test_the_precision_is_said_once_for_all_tasks_and_nothing_contradicts_it(language):
    greeting = Greeting(1, ("forward_kinematics", "mass_spring_forces"), name="mine")
    functions = {task: TASKS[task][0](None) for task in greeting.tasks}

    def rounding(task, **inputs):
        return {name: as_float(value) for name, value in functions[task](**inputs).items()}

    program = FunctionConnection(
        {task: lambda task=task, **inputs: rounding(task, **inputs) for task in functions}, greeting
    )
    report = verify(program)
    say = speaker(language)
    context = Presentation(say, language, ["my.py"])
    told = say(report.tasks[0].assumptions[0])
    assert '"precision": "single"' in told
    screen = "".join(" ".join(terminal.lines(report, context)).split())
    assert screen.count("".join(told.split())) == 1
    assert {"en": "doubleprecision", "zh": "双精度"}[language] not in screen
    assert json.loads(json_file.text(report, say))["remarks"] == [told]
    assert told.replace('"', "&#34;") in page.render(report, context)
    assert junit.text(report, say).count(told) == 2
    one = Report(greeting, [report.tasks[0], verify(program, ["mass_spring_forces"]).tasks[0]], 0)
    object.__setattr__(one.tasks[1], "assumptions", ())
    assert f"forward_kinematics: {told}" in json.loads(json_file.text(one, say))["remarks"]
