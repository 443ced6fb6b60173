"""A right program with one line changed explains answers that no known mistake explains."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from plumbob.text.sentence import sentence
from plumbob.verify.dictionary.look_up import Proposals
from plumbob.verify.exchange import Answer, Exchange
from plumbob.verify.fault_programs import (
    FAMILIES,
    PROGRAMS,
    changes_of,
    coded_faults,
    connection_to,
    source_of,
)
from plumbob.verify.greeting import PROTOCOL, Greeting, Step
from plumbob.verify.judgement import Diagnosis, Explanation, TaskReport, Verdict
from plumbob.verify.one_line import answers, candidates, right_programs, search, sentences
from plumbob.verify.one_line.mutants import Mutant, Program
from plumbob.verify.screen import terminal
from plumbob.verify.screen.words import Presentation, speaker
from plumbob.verify.verify import DISCIPLINES, judge_cases, trials, verify


def report_on(source, task):
    """Judge a program by its task's laws, and name no mistakes by lines."""
    connection = connection_to(source)
    ((task, method),) = trials(connection.greeting, [task])
    cases = DISCIPLINES[task].cases(connection.greeting, method, 0, False)
    return judge_cases(connection, task, method, cases), connection.greeting


def test_an_unknown_step_with_right_answers_to_the_dictionary_has_no_name(monkeypatch):
    monkeypatch.setattr(search, "look_up", lambda *arguments: Proposals(is_wrong=False))
    monkeypatch.delattr(search, "changed_lines")  # an XPBD step, as a right one of its method
    report = TaskReport("mass_spring_step", "", [], Diagnosis())
    assert report.verdict is Verdict.UNDECIDED
    assert search.with_changed_line(report, Greeting(PROTOCOL, ()), object()) is report


def changed_lines(source, task):
    report, greeting = report_on(source, task)
    return search.changed_lines(report, greeting)


# Several texts are changed at once by tables, which a dictionary has and no search.
TABLED = {change.kind for name in PROGRAMS for change in changes_of(name)}
TABLED -= {"condition", "reading"}
LINES = {
    fault.name: fault
    for fault in coded_faults().values()
    if fault.family == "LINE" and fault.name not in TABLED
}


@pytest.mark.sample("order", "condition")  # the programs of the others take long
@pytest.mark.parametrize("name", LINES)
@pytest.mark.usefixtures("verdict_alone")
def test_a_changed_line_is_named(name, monkeypatch):
    fault = LINES[name]
    monkeypatch.setattr(
        right_programs, "SELF_NAMED", FAMILIES
    )  # lines that are known faults as well
    (explanation,) = changed_lines(fault.wrong_program, fault.task)
    assert explanation.codes == (fault.code,)
    assert explanation.share == 1.0


def test_a_fault_is_indented_as_the_line_that_it_replaces():
    line = "    forces = masses[:, None] * gravity\n"  # two lines in place of a line
    lines = ((line, "    masses, h = masses, h\n" + line),)
    fault = coded_faults()["PB-STEP-095"]._replace(lines=lines)
    depths = {
        name: {
            len(line) - len(line.lstrip())
            for line in fault.planted_in(source_of(name)).splitlines()
            if "masses, h = " in line or "forces = masses[:, None] * gravity" in line
        }
        for name in ("step", "motion")
    }
    assert depths == {"step": {4}, "motion": {8}}


def test_jacobians_are_compared_whichever_part_comes_first():
    case = DISCIPLINES["robot_jacobian"].cases(Greeting(PROTOCOL, ()), "", 0, False)[0]
    J = np.arange(12.0).reshape(6, 2)
    answers = [Answer({"jacobian": np.roll(J, shift, axis=0)}, 0.0) for shift in (0, 3)]
    first, second = (right_programs.comparable(Exchange(case, a, a)).answer.values for a in answers)
    np.testing.assert_array_equal(first["jacobian"], second["jacobian"])


def test_the_line_is_printed_where_the_catalogue_knows_no_mistake():
    right, wrong = "length - rest_lengths[s]", "length - stiffnesses[s]"
    source = source_of("energy in loops").replace(right, wrong)
    report = verify(connection_to(source))
    screen = " ".join(
        "\n".join(terminal.lines(report, Presentation(speaker("en"), "en", ["solver.py"]))).split()
    )
    assert (
        "a right program has `rest_lengths`, your answers are as if yours had `stiffnesses`"
        in screen
    )
    assert "[PB-LINE-013]" in screen


def test_a_mistake_of_the_catalogue_is_named_rather_than_a_line():
    fault = coded_faults()["PB-ENERGY-003"]
    (report,) = verify(connection_to(fault.wrong_program)).tasks
    assert report.diagnosis.explanations[0].codes == (fault.code,)


@pytest.mark.parametrize(("share", "is_named"), [(0.75, True), (0.74, False)])
@pytest.mark.usefixtures("verdict_alone")
def test_a_changed_line_has_to_give_three_quarters_of_the_answers(share, is_named, monkeypatch):
    explanation = Explanation(("a line",), sentence("It is wrong."), share, 0.0)
    monkeypatch.setattr(search, "of_program", lambda *arguments: (explanation,))
    source = source_of("energy in loops")
    wrong = source.replace("length - rest_lengths[s]", "length - stiffnesses[s]")
    assert changed_lines(wrong, "energy") == ((explanation,) if is_named else ())


@pytest.mark.usefixtures("verdict_alone")
def test_answers_of_a_right_program_speak_for_no_change():
    """A line that may be left out without effect would explain all answers."""
    report, greeting = report_on(source_of("energy in loops"), "energy")
    (judgement, *_) = report.judgements
    broken = replace(judgement.findings[0], verdict=Verdict.WRONG)
    judgements = [replace(each, findings=(broken,)) for each in report.judgements]
    report = replace(report, judgements=judgements)
    assert answers.compared_answers(report, [])
    assert search.changed_lines(report, greeting) == ()


@pytest.mark.parametrize(("gap", "is_near"), [(1e-7, True), (1e-5, False)])
def test_wrong_answers_next_to_right_ones_tell_no_cause(gap, is_near):
    report, _ = report_on(source_of("energy in loops"), "energy")
    (judgement, *_) = report.judgements
    moved = {name: value * (1.0 + gap) for name, value in judgement.answer.values.items()}
    answer = replace(judgement.answer, values=moved)
    broken = replace(judgement.findings[0], verdict=Verdict.WRONG)
    wrong = replace(judgement, answer=answer, findings=(broken,), expected=judgement.answer.values)
    report = replace(report, judgements=[wrong])
    exchange = Exchange(judgement.case, answer, answer)
    assert answers.without_near([exchange], report, 1e-7) == ([] if is_near else [exchange])


LOOP = """
def count(end):
    i, total = 0, 0
    while i < end:
        total = total + i
        i = i + 1
    return total
"""


def test_a_changed_program_without_end_is_stopped():
    program = Program(LOOP)
    run = partial(program.names["count"], 4)
    program.observe(run)
    answer, passes = program.count_passes(run)
    assert (answer, passes) == (6, 4)
    endless = next(m for m in program.mutants(set()) if m.right == "i = i + 1" and m.wrong == "")
    with program.changed(endless, passes), pytest.raises(ArithmeticError, match="without end"):
        program.names["count"](4)
    assert program.names["count"](4) == 6  # the right function is back


@pytest.mark.parametrize(
    ("source", "inputs", "wrong"),
    [
        ("def f(x, k):\n    return x[k + 1]", ([1.0, 2.0], 0),
         {"return x[min(k + 1 + 1, len(x) - 1)]", "return x[max(k + 1 - 1, 0)]"}),
        ("def f(a, b):\n    return [a, b]", (1.0, 2.0), {"return [b, a]"}),
        ("def f(a):\n    def g(b):\n        return b + a\n    return g(1.0)", (2.0,),
         {"return b - a"}),
        ("def f(n):\n    i = 0\n    while i < n:\n        n = n - 0\n        i = {'a': i + 1}['a']",
         (2,), {"i = {'a': i + 1}['a']  # before the loop: while i < n:"}),
    ],
)  # fmt: skip
def test_lines_are_changed(source, inputs, wrong):
    """Indices to neighbours that exist, lists, inner functions, and lines with braces that move."""
    program = Program(source)
    program.observe(partial(program.names["f"], *inputs))
    first = [(mutant.kind, mutant.wrong) for mutant in program.mutants(set())]
    assert wrong <= {line for _, line in first}
    assert {kind for kind, _ in first} <= set(right_programs.FAULTS)
    assert first == [(mutant.kind, mutant.wrong) for mutant in program.mutants(set())]


def test_no_module_stands_for_a_value():
    """NumPy in an array of numbers crashes Python."""
    program = Program("import numpy as np\n\n\ndef f(x):\n    return np.sin(x)\n")
    program.observe(partial(program.names["f"], 1.0))
    assert "return np" not in {mutant.wrong for mutant in program.mutants(set())}


def test_long_lines_are_cut_to_what_differs():
    line = "result = " + " + ".join(f"term_{i}" for i in range(30))
    right, wrong = sentences.excerpts(line, line.replace("term_15", "term_51"))
    assert "term_15" in right
    assert "term_51" in wrong
    assert len(right) < 75
    assert (right[0], right[-1]) == ("…", "…")
    assert sentences.excerpts("a = b", "a = c") == ("a = b", "a = c")


@pytest.mark.sample("LINE-010")
@pytest.mark.parametrize(
    ("program", "method", "right", "wrong", "code"),
    [
        ("resample by arc lengths", "", "while k < len", "if k < len", "PB-LINE-010"),
        ("forward kinematics by angles one after the other", "", "2 * (y * z - w * x)]",
         "2 * (y * z + w * x)]", "PB-QUAT-039"),
        ("forward kinematics by matrices, from the largest component", "",
         "2 * (y * z - w * x), 0", "2 * (y * z + w * x), 0", "PB-LINE-005"),
        ("fabrik", "fabrik", "        P = R[parents[joint]]\n", "        P = R[joint]\n",
         "PB-QUAT-042"),
        ("scene graph", "ccd", "        descendants += children_of(parents, k)\n", "",
         "PB-LINE-001"),
        ("scene graph", "fabrik", "offsets[path[k + 1]]", "offsets[path[k]]", "PB-LINE-012"),
        ("hinges and cones", "ccd", "multiply(tilt, twist)", "multiply(twist, tilt)",
         "PB-LINE-004"),
        ("ccd", "ccd", "between(x[effector] - x[joint]",
         "between(x[effector] - x[max(parents[joint], 0)]", "PB-LINE-012"),
    ],
)  # fmt: skip
@pytest.mark.usefixtures("verdict_alone")
def test_lines_of_kinematics_are_named(program, method, right, wrong, code):
    """Positions kept by a scene graph, limits of joints, Euler angles and resampling in loops."""
    source = source_of(program)
    assert source.count(right) == 1
    source = source.replace(right, wrong)
    if method:
        limits = "within" in source
        source += f'\nPLUMBOB = {{"methods": ["{method}"], "limits": {limits}}}\n'
    (explanation,) = changed_lines(source, PROGRAMS[program]["task"])
    assert explanation.codes == (code,)


def test_a_missing_placement_is_told_for_programs_that_keep_positions():
    changes = {"": Mutant("missing line", "ccd", "x, R = kinematics(p, o, q)", "", None)}
    assert "mark all of them as out of date" in str(sentences.changes_in_words(changes, [""]))


@pytest.mark.parametrize(
    ("right", "wrong", "words"),
    [
        ("+ c * rate) * u", "+ 1.7 * c * rate) * u", "1.7"),
        ("length = np.linalg.norm(d)", "length = np.linalg.norm(d) + 0.05", "0.05"),
    ],
)  # fmt: skip
def test_a_number_is_fitted_to_the_answers(right, wrong, words):
    report, greeting = report_on(source_of("forces").replace(right, wrong), "mass_spring_forces")
    evidence = search._evidence(report, greeting, ())
    (explanation, *_) = candidates.of_numbers(Program(source_of("forces")), evidence)
    assert explanation.share == 1.0
    assert words in str(explanation.sentence)


def test_a_step_has_a_program_in_each_choice_that_is_not_declared():
    def choices(step):
        programs = right_programs.programs_of("mass_spring_step", "", step)
        return [p.choices for p in programs if p.source == source_of("newton step")]

    (declared,) = choices(Step("linearised", damper="none"))
    assert declared == {"METHOD": "linearised", "DAMPER": "none"}
    assert {choice["METHOD"] for choice in choices(Step())} == {"linearised", "converged"}
    assert choices(Step("symplectic")) == []
