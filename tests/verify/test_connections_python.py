"""Laws of Python files and objects as connections, in real processes."""

import math
import re
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hostile_programs import LIMITS, case, running

from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.connections import ProcessLimits, host, open_connection
from plumbob.verify.connections.files import FileConnection
from plumbob.verify.connections.program import ProgramConnection
from plumbob.verify.exchange import Answer, Failure, NoGreetingError
from plumbob.verify.functions import call
from plumbob.verify.message import (
    Request,
    decode_answer,
    decode_error,
    decode_greeting,
    decode_object,
    decode_request,
    encode_answer,
    encode_case,
)
from plumbob.verify.task import TASKS

TABLE = tomllib.loads(Path(__file__).with_name("python_files.toml").read_text("utf-8"))
FORWARD = "def forward_kinematics(parents, offsets, local_rotations):\n    "


@pytest.fixture
def solver(tmp_path):
    """Make a connection of a file's text; ends it afterwards and sees that nothing stays."""
    opened = []

    def make(text, spec="my_ik.py", limits=LIMITS, **files):
        for name, content in {"my_ik": text, **files}.items():
            (tmp_path / f"{name}.py").write_text(content, encoding="utf-8")
        opened.append(open_connection(f"{tmp_path}/{spec}", limits))
        return opened[-1]

    yield make
    for connection in opened:
        connection.close()
    assert not running(tmp_path)


class Inside:
    """The host of a Python solver in this process, asked as a child process is."""

    def __init__(self, spec, folder):
        self._solver, self._failure = host.load_safely(spec, folder)

    @property
    def greeting(self):
        fields = self._fields(Request(0, "greeting", {}))
        if "error" in fields:
            raise NoGreetingError(decode_error(fields))
        return decode_greeting(fields)

    def answer(self, case):
        request = decode_request(encode_case(1, case))
        return decode_answer(self._fields(request), TASKS[case.task], case.inputs, math.inf)

    def _fields(self, request):
        fields = self._solver.answer(request) if self._solver else self._failure
        return decode_object(encode_answer(request.id, **fields))


@pytest.fixture
def inside(tmp_path, monkeypatch):
    """Make a connection of a file's text without a process of its own."""
    monkeypatch.syspath_prepend(str(tmp_path))
    known = set(sys.modules)

    def make(text, spec="my_ik.py", **files):
        for name, content in {"my_ik": text, **files}.items():
            (tmp_path / f"{name}.py").write_text(content, encoding="utf-8")
        return Inside(f"{tmp_path}/{spec}", str(tmp_path))

    yield make
    for name in set(sys.modules) - known:
        del sys.modules[name]


def rows(name):
    """Parametrise over the rows of a table in python_files.toml."""
    columns = tuple(TABLE[name][0])
    return pytest.mark.parametrize(columns, [tuple(row.values()) for row in TABLE[name]])


def inverse(method=None):
    inputs = dict(case(2).inputs) | {"target": np.array([0.1, 0.2, 0.3]), "effector": 1}
    inputs |= {"method": method} if method else {}
    return Case("one", "inverse_kinematics", inputs, "", sentence("one"))


def words(failure):
    assert isinstance(failure, Failure), failure
    return f"{failure.kind}: {failure.sentence}"


@pytest.mark.parametrize("name", TABLE["answers"])
def test_an_answer_is_what_the_function_returns_bit_for_bit(inside, name):
    expression = TABLE["answers"][name]
    connection = inside(f"import numpy as np\n{FORWARD}return {expression}\n")
    expected = call(lambda parents: eval(expression), TASKS["forward_kinematics"], case(2).inputs)
    answer = connection.answer(case(2))
    assert answer.values.keys() == expected.values.keys()
    for key, value in expected.values.items():
        np.testing.assert_array_equal(answer.values[key], value)
    assert answer.seconds > 0.0
    assert answer.remarks == ()


def test_inputs_arrive_as_arrays_and_only_those_that_are_taken(inside):
    connection = inside(
        "def mass_spring_step(masses, h, **rest):\n"
        "    assert masses.dtype == float and rest['springs'].shape == (0, 2)\n"
        "    assert type(h) is float and 'tension_only' not in rest\n"
        "    return {'positions': rest['positions'] + h}\n"
        "def energy(positions, velocities=None):\n"
        "    return {'kinetic': 0.5 if velocities is not None else 0}\n"
    )
    state = {"positions": np.ones((2, 3)), "velocities": np.ones((2, 3))}
    inputs = {"masses": np.ones(2), "springs": np.zeros((0, 2), dtype=int), **state, "h": 0.5}
    step = connection.answer(Case("a", "mass_spring_step", inputs, "", sentence("a")))
    np.testing.assert_array_equal(step.values["positions"], np.full((2, 3), 1.5))
    energy = connection.answer(Case("a", "energy", inputs, "", sentence("a")))
    assert energy.values == {"kinetic": 0.5}


@rows("methods")
def test_methods_of_inverse_kinematics_are_found(inside, text, methods):
    connection = inside(text)
    assert connection.greeting.tasks == ("inverse_kinematics",)
    assert connection.greeting.methods == tuple(methods)
    for method, value in zip(methods, (1.0, 2.0), strict=False):
        assert connection.answer(inverse(method)).values["positions"][0, 0] == value


@rows("no_answers")
def test_an_answer_that_is_none_is_described(inside, answer, words):
    connection = inside(f"import numpy as np\n{FORWARD}return {answer}\n")
    assert str(connection.answer(case(2)).sentence).endswith(words)


def test_a_method_is_no_answer_to_another_task(inside):
    connection = inside(
        "def ccd(target): 1 / 0\ndef track(offsets): return {'positions': offsets[None]}"
    )
    assert connection.greeting.tasks == ("inverse_kinematics", "track")
    asked = Case("a", "track", inverse("ccd").inputs, "", sentence("a"))
    assert connection.answer(asked).values["positions"].shape == (1, 2, 3)


def test_what_a_file_says_of_itself_is_its_greeting(inside):
    connection = inside(
        "PLUMBOB = {'name': 'mine', 'precision': 'single', 'step': {'substeps': 3}}\n"
        f"{FORWARD}return offsets\n"
    )
    greeting = connection.greeting
    assert (greeting.name, greeting.precision, greeting.step.substeps) == ("mine", "single", 3)
    assert (greeting.tasks, greeting.language) == (("forward_kinematics",), "Python")


@rows("offers_nothing")
def test_a_file_that_offers_nothing_says_what_to_mend(inside, text, message):
    connection = inside(text, broken="x = 1\nx / 0")
    with pytest.raises(NoGreetingError) as caught:
        _ = connection.greeting
    said = words(caught.value.failure)
    assert re.search(message, said), said
    assert "Traceback" not in said


@pytest.mark.parametrize("name", ["forward_kinematics", "mass_spring_step", "ccd"])
def test_a_function_of_a_task_is_asked_even_if_no_argument_is_known(inside, name):
    connection = inside(f"def {name}(joint_parent): pass\ndef energy(masses): pass")
    task = "inverse_kinematics" if name == "ccd" else name
    assert set(connection.greeting.tasks) == {task, "energy"}


def test_a_helper_of_a_common_name_is_not_taken_for_a_task(inside):
    connection = inside(f"{FORWARD}return offsets\ndef resample(signal, n): pass\n")
    assert connection.greeting.tasks == ("forward_kinematics",)


@rows("does_wrong")
def test_what_a_function_does_wrong_is_told_with_its_line(inside, body, message):
    connection = inside(three_joints(body), helper="def deep(x):\n    return 1 / x\n")
    assert isinstance(connection.answer(case(2)), Answer)
    said = words(connection.answer(case(3)))
    assert re.search(message, said), said
    assert len(said) < 700


def three_joints(body):
    """A file with a function that does something else where it is given three joints."""
    return f"import helper\n{FORWARD}if len(parents) == 3:\n        {body}\n    return offsets\n"


@pytest.mark.sample("os.kill")
@rows("survives")
def test_a_process_survives_or_is_started_anew(solver, body, message):
    connection = solver(three_joints(body), helper="def deep(x):\n    return 1 / x\n")
    assert isinstance(connection.answer(case(2)), Answer)
    said = words(connection.answer(case(3)))
    assert re.search(message, said), said
    assert isinstance(connection.answer(case(2)), Answer)


@pytest.mark.sample("_exit")
@rows("cannot_load")
def test_a_process_that_cannot_load_its_file_says_so(solver, text, message):
    with pytest.raises(NoGreetingError) as caught:
        _ = solver(text).greeting
    assert re.search(message, words(caught.value.failure))


@rows("unknown_arguments")
def test_an_argument_that_no_input_has_is_told_with_those_there_are(inside, arguments, message):
    connection = inside(f"def forward_kinematics({arguments}): return offsets")
    said = words(connection.answer(case(2)))
    assert re.search(message, said), said


@pytest.mark.sample(every=3)
@rows("prints")
def test_prints_do_no_harm_and_are_remarked(solver, body, remarked):
    connection = solver(f"import os, sys\n{FORWARD}{body}\n    return offsets\n")
    for _ in range(2):
        remarks = connection.answer(case(2)).remarks
        if remarked:
            assert len(remarks) == 1
            assert "prints to its standard output, for example: joint 1" in str(remarks[0])


def test_a_print_while_loading_is_remarked_once(solver):
    connection = solver(f"print('loading')\n{FORWARD}return offsets\n")
    first, second = connection.answer(case(2)), connection.answer(case(2))
    assert ["loading" in str(one) for one in first.remarks] == [True]
    assert second.remarks == ()


def test_changed_arguments_are_remarked(inside):
    connection = inside(f"{FORWARD}offsets[0] = 3\n    return offsets\n")
    assert [str(one) for one in connection.answer(case(2)).remarks] == [
        "It changed its argument offsets."
    ]
    assert connection.answer(case(2)).values["positions"][1, 0] == 0.0


def test_the_demonstration_below_the_main_guard_does_not_run(inside):
    text = f"{FORWARD}return offsets\nif __name__ == '__main__':\n    1 / 0\n"
    assert inside(text).greeting.tasks == ("forward_kinematics",)


@pytest.mark.sample("names1")
@pytest.mark.parametrize("names", [("crosscheck", "message"), ("reference", "host", "task")])
def test_modules_beside_the_file_are_its_own(solver, names):
    imports = "".join(f"import {name}\n" for name in names if name != "crosscheck")
    last = names[-1]
    connection = solver(
        f"{imports}{FORWARD}return offsets + {last}.VALUE\n",
        **dict.fromkeys(names, "VALUE = 7.0\n"),
    )
    assert connection.answer(case(2)).values["positions"][0, 0] == 7.0


def test_a_file_runs_in_its_own_folder_wherever_it_is_called_from(solver, tmp_path, monkeypatch):
    (tmp_path / "sub").mkdir()
    (tmp_path / "data.txt").write_text("5")
    connection = solver(
        f"value = float(open('data.txt').read())\n{FORWARD}return offsets + value\n"
    )
    assert connection.answer(case(2)).values["positions"][0, 0] == 5.0
    monkeypatch.chdir(tmp_path / "sub")
    other = open_connection("../my_ik.py", LIMITS)
    assert other.answer(case(2)).values["positions"][0, 0] == 5.0
    other.close()


@pytest.mark.sample("numpy")
@pytest.mark.parametrize("name", ["my ik-2", "numpy", "message"])
def test_a_file_may_have_any_name(solver, name):
    text = f"import math\n{FORWARD}return offsets + math.pi\n"
    connection = solver(text, f"{name}.py", **{name: text})
    assert connection.answer(case(2)).values["positions"][0, 0] == math.pi
    assert connection.greeting.name == f"{name}.py"


OBJECTS = """
class Arm:
    PLUMBOB = {"name": "an arm"}
    def forward_kinematics(self, offsets):
        return offsets + 1
class Lazy:
    def __getattr__(self, name):
        raise AttributeError(name)
arm = Arm()
table = {"energy": lambda masses: 3.0, "other": 4}
def energy(masses): return 2.0
"""


@pytest.mark.parametrize(
    ("attribute", "tasks", "name"),
    [
        ("Arm", ("forward_kinematics",), "an arm"),
        ("arm", ("forward_kinematics",), "an arm"),
        ("table", ("energy",), "table"),
        ("energy", ("energy",), "energy"),
    ],
)
def test_an_object_offers_what_it_has(inside, tmp_path, attribute, tasks, name):
    connection = inside(OBJECTS, f"my_ik.py:{attribute}")
    of_module = Inside(f"my_ik:{attribute}", str(tmp_path))
    for one in (connection, of_module):
        assert (one.greeting.tasks, one.greeting.name) == (tasks, name)


def test_a_module_of_this_folder_is_found(tmp_path, monkeypatch):
    (tmp_path / "my_ik.py").write_text(OBJECTS)
    monkeypatch.chdir(tmp_path)
    connection = open_connection("my_ik:arm", LIMITS)
    assert connection.answer(case(2)).values["positions"][0, 0] == 1.0
    connection.close()


@pytest.mark.parametrize(
    ("attribute", "message"),
    [("Amr", "Amr: expected something .*did you mean arm"), ("Lazy", "Lazy: expected functions")],
)
def test_an_object_that_is_not_there_has_a_hint(inside, attribute, message):
    with pytest.raises(NoGreetingError, match=message):
        _ = inside(OBJECTS, f"my_ik.py:{attribute}").greeting


def test_the_host_loads_nothing_of_ours_that_it_does_not_need(solver):
    connection = solver(
        f"import sys\n{FORWARD}return offsets + sum(\n"
        "        name.split('.')[0] in ('reference', 'numba', 'scipy', 'bench', 'mujoco')\n"
        "        for name in sys.modules)\n"
    )
    assert connection.answer(case(2)).values["positions"][0, 0] == 0.0


@pytest.mark.parametrize("kind", ["list", "program", "folder"])
def test_a_door_opens_to_each_kind(tmp_path, kind):
    (tmp_path / "run").write_text("#!/bin/sh\nexit 3\n")
    (tmp_path / "run").chmod(0o755)
    (tmp_path / "export.json").write_text("{}")
    spec = {"list": ["sh", "-c", "exit 3"], "program": tmp_path / "run", "folder": tmp_path}[kind]
    connection = open_connection(spec, ProcessLimits())
    if kind == "folder":
        assert isinstance(connection, FileConnection)
    else:
        assert isinstance(connection, ProgramConnection)
        with pytest.raises(NoGreetingError, match="exit code 3"):
            _ = connection.greeting


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("nowhere.py", "expected a Python file, got nowhere.py, which does not exist"),
        ("nowhere.py:Arm", "expected a Python file, got nowhere.py, which does not exist"),
        ("nowhere", "got nowhere, which does not exist"),
        ("solver.js", "give the command that runs it, as in: -- node solver.js"),
        (".", "expected a folder of exported cases, got"),
    ],
)
def test_a_door_that_leads_nowhere_is_a_misuse(tmp_path, monkeypatch, spec, message):
    (tmp_path / "solver.js").write_text("")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=message):
        open_connection(spec)


def test_a_module_that_is_not_there_is_told():
    connection = open_connection("nowhere.at.all:solver")
    with pytest.raises(
        NoGreetingError, match="raised ModuleNotFoundError: No module named 'nowhere'"
    ):
        _ = connection.greeting


def test_compiled_functions_that_do_not_say_what_they_take_are_given_all():
    failure = call(math.hypot, TASKS["energy"], {"masses": np.ones(2)})
    assert "takes no keyword arguments" in str(failure.sentence)
    assert sys.modules["math"] is math
