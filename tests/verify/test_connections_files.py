"""Laws of the folder of cases and of the answers beside them."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.connections import export, open_connection
from plumbob.verify.connections.export import export_cases, write_cases
from plumbob.verify.connections.files import FileConnection, place_of
from plumbob.verify.exchange import FailureKind, NoGreetingError
from plumbob.verify.greeting import Greeting
from plumbob.verify.task import TASKS


def chain(name="two joints", **more):
    inputs = {
        "parents": np.array([-1, 0]),
        "offsets": np.array([[0.1, 1 / 3, 5e-324], [1e300, -0.0, np.nan]]),
        "local_rotations": np.eye(4)[:2],
    }
    return Case(name, "forward_kinematics", inputs | more, "", sentence("one"))


def inverse(method):
    inputs = dict(chain().inputs) | {"target": np.ones(3), "effector": 1, "method": method}
    return Case("two joints", "inverse_kinematics", inputs, "", sentence("one"))


CASES = [chain(), chain("3 joints, bent / ü"), inverse("ccd"), inverse("my own")]
GREETING = Greeting(1, ("forward_kinematics", "inverse_kinematics"), name="mine")


@pytest.fixture
def folder(tmp_path):
    write_cases(tmp_path / "cases", CASES, GREETING, seed=3)
    return tmp_path / "cases"


def test_a_folder_holds_every_case_as_json(folder):
    places = (folder / "cases.txt").read_text(encoding="utf-8").splitlines()
    assert places == [place_of(case) for case in CASES]
    assert places[1:] == [
        "forward_kinematics/3_joints_bent",
        "inverse_kinematics_ccd/two_joints",
        "inverse_kinematics_my_own/two_joints",
    ]
    for place, case in zip(places, CASES, strict=True):
        request = json.loads((folder / place / "request.json").read_text(encoding="utf-8"))
        assert request.keys() == {"id", "task", *case.inputs}
        np.testing.assert_array_equal(np.array(request["parents"]), case.inputs["parents"])


def test_the_readme_names_every_file_and_output(folder):
    words = (folder / "README.txt").read_text(encoding="utf-8")
    for task in ("forward_kinematics", "inverse_kinematics"):
        assert all(field.name in words for field in (*TASKS[task].inputs, *TASKS[task].outputs))
    assert "mass_spring_step" not in words
    for name in ("cases.txt", "request.json", "answer.json", "greeting.json"):
        assert name in words


def test_a_folder_without_answers_says_what_to_write(folder):
    connection = FileConnection(folder)
    assert connection.greeting == GREETING
    assert (connection.seed, connection.thorough) == (3, False)
    failure = connection.answer(CASES[0])
    assert failure.kind is FailureKind.ABSENT
    assert "expected answer.json" in str(failure.sentence)


@pytest.mark.parametrize(
    ("answered", "tasks", "methods", "left_out"),
    [
        ((), GREETING.tasks, ("",), False),
        ((CASES[0],), ("forward_kinematics",), ("",), True),
        ((CASES[2],), ("inverse_kinematics",), ("ccd",), True),
        ((CASES[0], CASES[3]), GREETING.tasks, ("my own",), False),
    ],
    ids=["none", "one task", "one method", "a method of each task"],
)
def test_only_tasks_that_have_answers_are_judged(tmp_path, answered, tasks, methods, left_out):
    greeting = Greeting(1, GREETING.tasks, methods=("ccd", "my own")) if answered else GREETING
    write_cases(tmp_path / "cases", CASES, greeting)
    connection = FileConnection(tmp_path / "cases")
    for case in answered:
        (connection.folder / place_of(case) / "anwser.json").write_text("{}")  # as people write
    (connection.folder / place_of(CASES[1]) / ".hidden").write_text("")
    assert connection.greeting.tasks == tasks
    assert connection.greeting.methods == (methods if methods != ("",) else greeting.methods)
    assert any("Left out" in str(one) for one in connection.remarks) == left_out


ANSWER = {"positions": [[1, 2, 3], [4, 5, None]], "seconds": 0.5}
POSITIONS = np.array([[1, 2, 3], [4, 5, np.nan]])
JSON = {
    "plain": json.dumps(ANSWER).encode(),
    "pretty": json.dumps(ANSWER, indent=4).replace("\n", "\r\n").encode(),
    "marked": json.dumps(ANSWER).encode("utf-8-sig"),
    "utf-16": json.dumps(ANSWER).encode("utf-16"),
    "NaN": json.dumps(ANSWER).replace("null", "NaN").encode(),
}


@pytest.mark.parametrize("name", JSON)
def test_answers_in_json_are_read_each_time_the_same(folder, name):
    (folder / place_of(CASES[0]) / "answer.json").write_bytes(JSON[name])
    connection = FileConnection(folder)
    for _ in range(2):
        answer = connection.answer(CASES[0])
        np.testing.assert_array_equal(answer.values["positions"], POSITIONS)
        assert answer.seconds == 0.5
    assert connection.answer(CASES[1]).kind is FailureKind.ABSENT
    assert "whether equal requests have equal answers is not known" in str(connection.remarks[0])


DATA = tomllib.loads(Path(__file__).with_name("answer_files.toml").read_text("utf-8"))


@pytest.mark.parametrize("row", DATA["wrong_json"], ids=lambda row: row["words"])
def test_json_that_is_not_understood_says_why(folder, row):
    (folder / place_of(CASES[0]) / "answer.json").write_text(row["data"])
    failure = FileConnection(folder).answer(CASES[0])
    assert failure.kind == row["kind"]
    assert row["words"] in str(failure.sentence)


@pytest.mark.parametrize("name", ["answers.json", "answer.jsn", "Answer.JSON"])
def test_a_file_beside_its_name_is_named(folder, name):
    (folder / place_of(CASES[0]) / name).write_text("1,2,3", encoding="utf-8")
    failure = FileConnection(folder).answer(CASES[0])
    assert failure.kind is FailureKind.ABSENT
    assert f"but {name}; did you mean answer" in str(failure.sentence)


@pytest.mark.parametrize(
    "case", [chain(offsets=np.zeros((2, 3))), chain("unknown"), inverse("fabrik")]
)
def test_answers_to_other_cases_are_not_judged(folder, case):
    (folder / place_of(CASES[0]) / "answer.json").write_bytes(JSON["plain"])
    failure = FileConnection(folder).answer(case)
    assert failure.kind is FailureKind.ABSENT
    assert "holds another case: export again" in str(failure.sentence)


def test_a_second_export_keeps_answers_and_what_the_folder_says_of_the_solver(
    tmp_path, monkeypatch
):
    class Discipline:
        @staticmethod
        def cases(greeting, method, seed, thorough):
            return [chain(f"{greeting.precision} {seed} {thorough}")]

    monkeypatch.setattr(export, "DISCIPLINES", {"forward_kinematics": Discipline})
    monkeypatch.setattr("plumbob.verify.verify.DISCIPLINES", export.DISCIPLINES)
    assert export_cases(tmp_path / "a") == 1
    answer = tmp_path / "a/forward_kinematics/double_0_False/answer.json"
    answer.write_bytes(JSON["plain"])
    said = (tmp_path / "a/greeting.json").read_text(encoding="utf-8")
    (tmp_path / "a/greeting.json").write_text(said.replace("double", "single"), encoding="utf-8")
    export_cases(tmp_path / "a", seed=5, thorough=True)
    assert (tmp_path / "a/cases.txt").read_text(encoding="utf-8") == (
        "forward_kinematics/single_5_True\n"
    )
    assert answer.exists()
    connection = open_connection(tmp_path / "a")
    assert connection.greeting.precision == "single"
    assert (connection.seed, connection.thorough) == (5, True)


def test_a_folder_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "thesis.txt").write_text("words")
    with pytest.raises(ValueError, match="expected a new folder"):
        write_cases(tmp_path, CASES, GREETING)
    with pytest.raises(ValueError, match="expected a folder, got the file"):
        write_cases(tmp_path / "thesis.txt", CASES, GREETING)
    with pytest.raises(ValueError, match="expected a folder of exported cases"):
        FileConnection(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_two_cases_never_share_a_folder(tmp_path):
    with pytest.raises(ValueError, match=r"expected different names, got \S+/a_b twice"):
        write_cases(tmp_path, [chain("a b"), chain("a, b")], GREETING)


def test_a_greeting_that_is_not_understood_says_so(folder):
    (folder / "greeting.json").write_text('{"protocol": 1, "tasks": ["x"]}')
    with pytest.raises(NoGreetingError, match=r"greeting\.json: tasks: expected one of"):
        _ = FileConnection(folder).greeting
