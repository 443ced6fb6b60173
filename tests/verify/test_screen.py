"""What is printed about a solver: screen, JSON, JUnit XML and page, in two languages."""

import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from html_page import Page
from rich.cells import cell_len
from small_discipline import SMALL, own_rotation, use_small_disciplines

from plumbob.reference import Skeleton, forward_kinematics
from plumbob.text.sentence import Sentence, sentence, with_code
from plumbob.verify import verify
from plumbob.verify.case import Case
from plumbob.verify.connections import saved
from plumbob.verify.exchange import Answer, Failure, FailureKind
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Greeting
from plumbob.verify.judgement import (
    CaseJudgement,
    Diagnosis,
    Explanation,
    Finding,
    Report,
    TaskReport,
    Verdict,
)
from plumbob.verify.screen import comparison, drawing, json_file, junit, page, terminal
from plumbob.verify.screen.words import GOOD, Presentation, digits, explanations, speaker

HOSTILE = '<script>alert(1)</script>\x1b[31m\u202e & "quotes" \' ]]>'
TASKS = tuple(SMALL)
MEND = sentence("Mend this.")


def right_positions(parents, offsets, local_rotations):
    return forward_kinematics(Skeleton(parents, offsets), local_rotations).positions


def fallen_too_far(positions, h, gravity):
    return positions + 1.5 * h * h * gravity


def raises(**_):
    raise RuntimeError(HOSTILE)


def solver(forward=own_rotation, name=HOSTILE):
    functions = {
        "forward_kinematics": forward,
        "inverse_kinematics": raises,
        "mass_spring_step": fallen_too_far,
    }
    return FunctionConnection(functions, Greeting(1, TASKS, name=name, methods=("ccd",)))


@pytest.fixture(scope="module", autouse=True)
def disciplines():
    with pytest.MonkeyPatch.context() as patch:
        use_small_disciplines(patch)
        yield


@pytest.fixture(scope="module")
def wrong():
    """A report in which everything is wrong."""
    return verify.verify(solver())


@pytest.fixture(scope="module")
def right():
    """A report in which all is right."""
    return verify.verify(solver(right_positions, "mine"), ["forward_kinematics"])


def shown(language="en", files=None):
    return Presentation(speaker(language), language, ["my_ik.py"], files or {})


def every_sentence(report):
    """All sentences of a report, untranslated."""
    for task in report.tasks:
        yield from explanations(task)
        for one in task.judgements:
            yield from one.complaints
            yield one.case.about


def normal(text):
    return " ".join(text.split())


def outputs(report, language="en"):
    """The screen, the page and both files as running text."""
    context = shown(language, FILES)
    fields = json_file.record(report, context.say)
    del fields["solver"]
    strings = [str(x) for x in leaves(msgspec.to_builtins(fields, enc_hook=str))]
    made = {
        "terminal": terminal.lines(report, context),
        "page": Page(page.render(report, context)).texts,
        "junit": ET.fromstring(junit.text(report, context.say).encode()).itertext(),
        "json": strings,
    }
    return {name: normal(" ".join(lines)) for name, lines in made.items()}


def leaves(entry):
    if isinstance(entry, dict | list):
        for part in entry.values() if isinstance(entry, dict) else entry:
            yield from leaves(part)
    else:
        yield entry


FILES = {("forward_kinematics", ""): Path("plumbob_failures/forward_kinematics.json")}


@pytest.mark.parametrize("language", ["en", "zh"])
def test_no_line_of_the_screen_has_more_than_80_columns(wrong, right, language):
    for report in (wrong, right):
        lines = terminal.lines(report, shown(language, FILES))
        assert [line for line in lines if cell_len(line) > terminal.WIDTH] == []


def test_screen_has_explanations_complaints_numbers_and_advice(wrong, right, capsys):
    terminal.show(wrong, shown(files=FILES))
    screen = capsys.readouterr().out
    for words in [
        *(str(words) for task in wrong.tasks for words in explanations(task)),
        *(speaker("en")(task.smallest_failure.complaints[0]) for task in wrong.tasks),
        "(explains 100% of the answers compared)",
        "plumbob verify --rerun plumbob_failures/forward_kinematics.json my_ik.py",
        "forward_kinematics WRONG",
        "inverse_kinematics ccd BROKEN",
        "Next: correct forward_kinematics first",
    ]:
        assert normal(words) in normal(screen)
    row = comparison.rows(wrong.tasks[0].smallest_failure)[0]
    for words in (*comparison.texts(row), "yours", "expected"):
        assert words in screen
    screen = "\n".join(terminal.lines(right, shown()))
    assert re.search(r"forward_kinematics  RIGHT +1\d\.\d +4/4", screen)
    assert "Next: --junit FILE for your CI" in screen
    assert "saved" not in screen


@pytest.mark.parametrize("output", ["page", "junit", "json"])
def test_page_and_files_hold_every_sentence(wrong, output):
    text = outputs(wrong)[output]
    sentences = {speaker("en")(one) for one in every_sentence(wrong)}
    if output == "junit":
        sentences.discard("A random one.")
    if output == "json":
        sentences = {
            one.removesuffix(" (explains 100% of the answers compared)") for one in sentences
        }
    assert [one for one in sentences if normal(one) not in text] == []


def test_a_fault_is_told_once_a_screen(wrong):
    fault = Explanation(("mend",), with_code("PB-FK-003", MEND), 1.0, 0.0)
    twice = replace(wrong, tasks=[
        replace(task, diagnosis=replace(task.diagnosis, explanations=(fault,)))
        for task in wrong.tasks[:2]
    ])  # fmt: skip
    screen = outputs(twice)["terminal"]
    assert screen.count(f"[PB-FK-003] {MEND}") == 1
    assert screen.count("[PB-FK-003], as above.") == 1


def test_a_fault_is_told_once_of_a_task(right):
    """A finding that states the choice of an explanation adds nothing."""
    words = with_code("PB-CCD-015", MEND)
    choice = Finding(
        "one sweep", Verdict.RIGHT_EXCEPT, 1.0, 0.0, "", sentence("{what}", what=words)
    )
    task = right.tasks[0]
    reserved = replace(task.judgements[0], findings=(choice,))
    diagnosis = replace(task.diagnosis, explanations=(Explanation(("mend",), words, 1.0, 0.0),))
    task = replace(task, judgements=[reserved, *task.judgements[1:]], diagnosis=diagnosis)
    screen = outputs(replace(right, tasks=[task]))["terminal"]
    assert screen.count("PB-CCD-015") == 1


def test_positions_that_rotations_do_not_give_stand_beside_those_that_they_give():
    inputs = {
        "parents": np.array([-1, 0]), "offsets": np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]),
        "effector": 1, "target": np.array([1.0, 0.0, 0.0]), "tolerance": 1e-4,
    }  # fmt: skip
    rotations = np.array([[1.0, 0.0, 0.0, 0.0]] * 2)
    for place, labels in ((1.0, []), (2.0, ["positions[1]"])):
        outputs = {"local_rotations": rotations, "positions": np.array([[0.0] * 3, [place, 0, 0]])}
        case = Case("", "inverse_kinematics", inputs, "", sentence("An arm."))
        rows = comparison.rows(CaseJudgement(case, Answer(outputs, 0.0), (), {}))
        assert [row.label for row in rows] == labels
        assert [row.expected for row in rows] == [[1.0, 0.0, 0.0]] * len(labels)


def test_numbers_side_by_side_are_whole():
    ours = np.array([[0.48315384, 0.24848917, -0.82854335, 0.1364]])
    for apart in (1e-8, 1e-11):
        theirs = ours + np.array([[0.0, 0.0, 0.0, apart]])
        one = answered("forward_kinematics", {}, {"rotations": theirs}, {"rotations": ours})
        text = "\n".join(terminal.numbers(one, speaker("en")))
        row = comparison.rows(one)[0]
        assert all(number in text for side in comparison.texts(row) for number in side.split())
        assert apart < 1e-10 or max(map(len, text.split("\n"))) <= terminal.WIDTH
    row = comparison.NumberRow("x", [1.23456], [2.34567])
    assert comparison.texts(row) == ("1.235", "2.346")


def judgement(verdict, words="One is off.", name="one", size=1, digits=None,
              numbers=(1.0, 0.0), **values):  # fmt: skip
    """A judgement of a case of such a size, with one finding of such an error and tolerance."""
    case = Case(name, "energy", {"masses": np.ones(size)}, "x", sentence("It is all."))
    finding = Finding("a law", verdict, *numbers, "m", Sentence(words, values))
    return CaseJudgement(case, Answer({"total": 1.0}, 1e-3), (finding,), {}, digits, 1e-3)


def a_wrong_task(share, words=MEND):
    """A report of a wrong task in which a fault explains such a share of the answers."""
    why = Explanation(("a fault",), words, share, 0.0)
    return TaskReport("energy", "", [judgement(Verdict.WRONG)], Diagnosis((why,)))


def test_methods_of_other_names_have_failure_files_of_their_own(tmp_path):
    names = ["a b", "a-b", "a  b", "a_b", "A b", "::", "?", "", f"{'a' * 99}b", f"{'a' * 99}c", "é"]
    task = a_wrong_task(1.0)
    paths = [saved.save(replace(task, method=name), tmp_path, 0, False) for name in names]
    assert len({path.name.lower() for path in paths}) == len(names)
    assert [saved.load(path).method for path in paths] == names
    assert all(re.fullmatch(r"[A-Za-z0-9_-]+\.json", path.name) for path in paths)
    assert paths[names.index("a_b")].name == "energy-a_b.json"


def test_no_control_character_is_printed(wrong, right):
    for report in (wrong, right):
        for text in (
            "".join(terminal.lines(report, shown())),
            json_file.text(report, speaker("en")).replace("\n", ""),
            junit.text(report, speaker("en")).replace("\n", ""),
            page.render(report, shown()).replace("\n", ""),
        ):
            assert [one for one in text if not one.isprintable()] == []


def undecided(verdict, digits=None):
    """A report of one case with such a verdict, and a reservation."""
    words = "It behaves as if it had {count} dampers."
    judged = judgement(verdict, words, digits=digits, numbers=(np.nan, np.inf), count=2)
    diagnosis = Diagnosis(behaviour=sentence("Damping is explicit."))
    return Report(Greeting(1, ("energy",)), [TaskReport("energy", "", [judged], diagnosis)], 0)


@pytest.mark.parametrize(("explained", "case"), [(False, "large"), (True, "small")])
def test_what_is_saved_of_a_broken_task_is_what_it_breaks_on(explained, case):
    found = {"small": Verdict.WRONG, "larger": Verdict.BROKEN, "large": Verdict.BROKEN}
    size = {"small": 1, "large": 2, "larger": 3}
    judgements = [
        judgement(verdict, f"{name} is off.", name, size[name]) for name, verdict in found.items()
    ]
    diagnosis = a_wrong_task(1.0).diagnosis if explained else Diagnosis()
    task = TaskReport("energy", "", judgements, diagnosis)
    assert task.smallest_failure.case.name == case
    assert TaskReport("energy", "", [], Diagnosis()).smallest_failure is None
    law = sentence("The first violated law is 'a law', in the case 'large': large is off.")
    told = replace(task, diagnosis=replace(task.diagnosis, first_broken=law))
    text = outputs(Report(Greeting(1, ("energy",)), [told], 0))["terminal"]
    assert text.count("large is off.") == 1
    broken, wrong = 'BROKEN cases: 2; the smallest is "large".', "small is off."
    assert text.index(broken) < text.index(f'WRONG cases: 1; the smallest, "small": {wrong}')


def test_what_is_the_same_of_several_tasks_is_printed_once():
    (energy,) = undecided(Verdict.UNDECIDED).tasks
    tasks = [replace(energy, task=task) for task in ("energy", "mass_spring_forces", "resample")]
    tasks[2] = replace(tasks[2], diagnosis=Diagnosis(behaviour=sentence("It is another.")))
    report = Report(Greeting(1, tuple(task.task for task in tasks)), tasks, 0)
    screen = terminal.lines(report, shown())
    assert [line for line in screen if line.endswith(":")] == [
        "energy, mass_spring_forces:", "resample:",
    ]  # fmt: skip
    assert " ".join(screen).count("Damping is explicit.") == 1


def test_zeros_have_no_sign():
    answer, expected = {"forces": -np.zeros((1, 3))}, {"forces": np.array([[-0.0, 1.0, 2.0]])}
    case = Case("one", "mass_spring_forces", {}, "x", sentence("It is all."))
    failure = CaseJudgement(case, Answer(answer, 1e-3), (), expected, -0.0)
    screen = [*terminal.numbers(failure, speaker("en")), digits(failure)]
    assert "-0" not in " ".join(screen)


@pytest.mark.parametrize("verdict", Verdict)
def test_each_verdict_has_its_words_and_its_reason(verdict):
    report = undecided(verdict)
    text = "\n".join(terminal.lines(report, shown()))
    assert f"energy  {verdict.name.replace('_', ' ')} " in text
    assert "Damping is explicit." in text
    if verdict is Verdict.RIGHT_EXCEPT:
        assert "It behaves as if it had 2 dampers." in text
    assert json.loads(json_file.text(report, speaker("en")))["passed"] is (verdict in GOOD)


def test_json_holds_every_verdict_and_number(wrong):
    text = json_file.text(wrong, speaker("en"))
    found = json.loads(text, parse_constant=lambda word: pytest.fail(word))
    assert (found["format"], found["version"]) == ("plumbob verify", 2)
    for task, record in zip(wrong.tasks, found["tasks"], strict=True):
        assert record["verdict"] == task.verdict.name.lower()
        names = [one["name"] for one in record["cases"]]
        assert names == [one.case.name for one in task.judgements]
    assert found["tasks"][1]["cases"][0]["failure"] == "raised"
    assert found["tasks"][0]["explanations"][0]["share"] == 1.0


def test_json_has_no_control_character_and_null_for_numbers_that_are_not_finite():
    greeting = Greeting(1, TASKS, HOSTILE, HOSTILE, HOSTILE, methods=(HOSTILE,))
    task = undecided(Verdict.RIGHT).tasks[0]
    report = Report(greeting, [TaskReport("energy", HOSTILE, task.judgements, Diagnosis())], 0)
    text = json_file.text(report, speaker("en"))
    assert text.replace("\n", "").isprintable()
    assert not re.search(r"(?<!\\)\\u00[01]", text)
    record = json.loads(text)
    assert record["solver"]["methods"] == [record["tasks"][0]["method"]]
    finding = record["tasks"][0]["cases"][0]["findings"][0]
    assert (finding["error"], finding["tolerance"]) == (None, None)


def test_junit_counts_what_it_holds(wrong):
    root = ET.fromstring(junit.text(wrong, speaker("en")).encode())
    assert root.tag == "testsuites"
    assert len(root) == len(wrong.tasks)
    for element in (root, *root):
        cases = list(element.iter("testcase"))
        assert int(element.get("tests")) == len(cases)
        for count, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
            assert int(element.get(count)) == len(list(element.iter(tag)))
    assert int(root.get("failures")) == 8
    assert int(root.get("errors")) == 4


def test_junit_skips_what_nobody_can_tell_and_passes_reservations():
    for verdict, tag in ((Verdict.UNDECIDED, "skipped"), (Verdict.RIGHT_EXCEPT, "system-out")):
        case = ET.fromstring(junit.text(undecided(verdict), speaker("en")).encode())[0][0]
        assert [child.tag for child in case] == [tag]
        assert "2 dampers" in "".join(case.itertext())


def test_page_is_self_contained_and_escapes_the_texts_of_a_solver(wrong):
    text = page.render(wrong, shown(files=FILES))
    parsed = Page(text)
    assert parsed.open == parsed.wrong == []
    assert all(link.startswith("#") for link in parsed.links)
    assert not re.search(r"url\((?!#)", text)
    names = [judgement.case.name for task in wrong.tasks for judgement in task.judgements]
    assert set(names) <= {name.strip() for row in parsed.rows for name in row}
    assert "<script" not in text.lower()
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in text
    assert "script" not in parsed.tags


def test_the_page_says_why_a_task_is_not_simply_right_before_it_lists_the_cases():
    text = page.render(undecided(Verdict.RIGHT_EXCEPT), shown())
    assert "2 dampers" in text.partition("<details")[0]


def test_the_page_draws_theirs_and_ours(wrong):
    forward, inverse, cloth = (
        Page(page.render(Report(wrong.greeting, [task], 0), shown())) for task in wrong.tasks
    )
    assert forward.tags.count("svg") == cloth.tags.count("svg") == 2  # one is the bob
    assert inverse.tags.count("svg") == 2  # where ours goes, as there is no answer
    assert cloth.tags.count("use") == 2 * 121 + 2  # and two pins


@pytest.mark.parametrize("output", ["terminal", "page", "junit", "json"])
def test_chinese_leaves_no_english_sentence(right, output):
    text = outputs(right, "zh")[output]
    # Names of cases and options, and sentences of the tests' own discipline.
    for name in ("A random one.", "positions differ", "pose", "junit FILE", "plumbob.testing",
                 "equal to the reference"):  # fmt: skip
        text = text.replace(name, "")
    text = re.sub(r"--[a-z-]+", "", text)
    assert re.findall(r"[a-z]{3,}(?: [a-z]{3,}){2,}", text) == []
    assert re.search(r"[\u4e00-\u9fff]{2}", text) or output == "junit"


@pytest.mark.parametrize(
    ("text", "size", "expected"),
    [
        ("", 10, []),
        ("one two three", 7, ["one two", "three"]),
        ("正运动学是错的，请改。", 8, ["正运动学", "是错的，", "请改。"]),
        ("正运动，学", 6, ["正运", "动，学"]),
        ("正运（动学）", 6, ["正运", "（动", "学）"]),
        ("abcdefghij", 4, ["abcd", "efgh", "ij"]),
        ("in 正运动学 only", 8, ["in 正运", "动学", "only"]),
    ],
)
def test_lines_are_broken_where_they_may_be(text, size, expected):
    assert terminal.wrapped(text, size=size) == expected
    assert terminal.wrapped(text, "  ", size + 2) == [f"  {line}" for line in expected]


def test_no_digits_are_not_taken_for_unknown_ones():
    report = undecided(Verdict.WRONG, digits=0.0)
    assert "  0.0 " in "\n".join(terminal.lines(report, shown()))
    assert "<td>0.0</td>" in page.render(report, shown())


def answered(task, inputs, theirs, ours):
    case = Case("one", task, inputs, "x", sentence("It is all."))
    answer = (
        Answer(theirs, 1e-3) if theirs is not None else Failure(FailureKind.HUNG, Sentence("", {}))
    )
    return CaseJudgement(case, answer, (), ours)


def test_numbers_are_shown_from_where_answers_part_to_the_largest_difference():
    ours = np.zeros((5, 3))
    theirs = ours.copy()
    theirs[2:, 1] = [0.1, 0.2, np.nan]
    theirs[1, 0] = 1e-9  # rounding
    one = answered("forward_kinematics", {}, {"positions": theirs}, {"positions": ours})
    labels = ["positions[2]", "positions[3]", "positions[4]"]
    assert [row.label for row in comparison.rows(one)] == labels
    theirs[4] = 0.0
    assert [row.label for row in comparison.rows(one)] == labels[:2]


@pytest.mark.parametrize(("count", "shown_joints"), [(1, [8]), (3, [1, 2, 8]), (8, range(1, 9))])
def test_the_largest_mistake_is_among_the_numbers_shown(count, shown_joints):
    """It grows along the chain from 1 mm to 0.5 m."""
    ours = np.ones((10, 3))
    theirs = ours.copy()
    theirs[1:9, 0] += [1e-3, 2e-3, 4e-3, 0.01, 0.02, 0.05, 0.1, 0.5]
    one = answered("forward_kinematics", {}, {"positions": theirs}, {"positions": ours})
    rows = comparison.rows(one, count)
    assert [row.label for row in rows] == [f"positions[{joint}]" for joint in shown_joints]


def with_reservations(*texts, method=""):
    """A report of a right task with such reservations, each in a case of its own."""
    judgements = [judgement(Verdict.RIGHT_EXCEPT, text, name=text) for text in texts]
    task = TaskReport("energy", method, judgements, Diagnosis())
    return Report(Greeting(1, ("energy",), name=method), [task], 0)


def test_each_reservation_begins_a_line():
    texts = ("It is slow.", "It prints.")
    screen = terminal.lines(with_reservations(*texts), shown())
    assert "  energy: It is slow." in screen
    assert "    It prints." in screen


def test_no_line_of_the_screen_is_a_command_of_a_ci_service():
    """GitHub obeys a line that begins with :: after spaces, or has ##[ anywhere."""
    for width in range(1, 80, 3):
        text = f"::error::x ##[error]y {'a' * width} ::error::x std::vector {'a' * 70}::error::z"
        report = with_reservations(text, f"Two. {text}", method=f"::error {'b' * width}::error::")
        lines = terminal.lines(report, shown())
        assert any("std::vector" in line for line in lines)
        assert [line for line in lines if re.match(r" *::", line) or "##[" in line] == []


def test_rounded_output_is_not_shown_beside_a_wrong_one():
    ours = {"positions": np.eye(3)[:2], "rotations": np.eye(4)[:2]}
    theirs = {name: value + 1e-8 for name, value in ours.items()}
    one = answered("forward_kinematics", {}, theirs, ours)
    assert {row.label[:9] for row in comparison.rows(one, 9)} == {"positions", "rotations"}
    near = {name: value + 1e-15 for name, value in ours.items()}
    assert comparison.rows(answered("forward_kinematics", {}, near, ours)) == []
    theirs["positions"] = theirs["positions"] + 1e-3
    assert {row.label[:9] for row in comparison.rows(one, 9)} == {"positions"}
    negated = {"rotations": -ours["rotations"]}
    del ours["positions"]
    assert comparison.rows(answered("forward_kinematics", {}, negated, ours)) == []


def test_lengths_of_answers_of_other_shapes_are_compared():
    one = answered("resample", {}, {"points": np.zeros((4, 3))}, {"points": np.zeros((5, 3))})
    assert comparison.rows(one) == [comparison.NumberRow("len(points)", [4.0], [5.0])]


ARM = {"parents": np.array([-1, 0]), "offsets": np.eye(3)[:2]}
DRAWN = {
    "positions": {"positions": np.eye(3)[:2]},
    "NaN": {"positions": np.full((2, 3), np.nan)},
    "huge": {"positions": np.full((2, 3), 1e300)},
    "no rotation": {"local_rotations": np.zeros((2, 4))},
    "global rotations": {"rotations": np.eye(4)[:2]},
    "nothing": {},
    "no answer": None,
}


@pytest.mark.parametrize("theirs", DRAWN.values(), ids=DRAWN)
def test_any_answer_is_drawn_without_a_number_that_svg_does_not_have(theirs):
    one = answered("forward_kinematics", ARM, theirs, {"positions": np.eye(3)[:2]})
    drawn = drawing.svg(comparison.drawing_of(one), "an <arm>")
    assert not re.search(r"\b(nan|inf)|\de\+", str(drawn), re.IGNORECASE)
    assert ET.fromstring(drawn).find("{*}title").text == "an <arm>"


def test_a_small_difference_is_drawn_larger():
    ours = {"positions": np.eye(3)[:2]}
    theirs = {"positions": np.eye(3)[:2] + 1e-5}
    seen = comparison.drawing_of(answered("forward_kinematics", ARM, theirs, ours))
    larger, factor = drawing.magnified(seen)
    assert factor == pytest.approx(0.2 / (3**0.5 * 1e-5), rel=0.5)
    assert drawing.distance(larger) == pytest.approx(0.2, rel=0.5)
    for other in (1.0, 1e-7):  # large, or as small as the rounding of single precision
        theirs["positions"][:] = ours["positions"] + other
        drawn = comparison.drawing_of(answered("forward_kinematics", ARM, theirs, ours))
        assert drawing.magnified(drawn)[1] == 1
