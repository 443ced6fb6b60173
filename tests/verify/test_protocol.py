"""The protocol as written down: page, schema, and what is said by judge and programs agree."""

import copy
import json
import re
import sys
from functools import cache

import jsonschema
import numpy as np
import pytest
from protocol_page import PAGE, TRANSCRIPT

from plumbob.cli import main as cli
from plumbob.text.sentence import sentence
from plumbob.verify import schema
from plumbob.verify.case import Case
from plumbob.verify.connections import LIMITS, open_connection
from plumbob.verify.exchange import Answer, Failure, FailureKind
from plumbob.verify.fault_programs import connection_to, source_of
from plumbob.verify.functions import MOST_POINTS
from plumbob.verify.greeting import MOST_ITERATIONS, PROTOCOL, Greeting
from plumbob.verify.message import encode_case, encode_greeting
from plumbob.verify.task import TASKS
from plumbob.verify.verify import DISCIPLINES

SCHEMA = json.loads(schema.text())
SOLVED = [(request, answer) for request, answer in TRANSCRIPT[1:] if "error" not in answer]
EVERYTHING = Greeting(PROTOCOL, tuple(TASKS))


@cache
def validator(kind):
    whole = SCHEMA if kind is None else {"$defs": SCHEMA["$defs"], "$ref": f"#/$defs/{kind}"}
    return jsonschema.Draft202012Validator(whole)


def broken(message, kind=None):
    """What breaks the schema of a kind of message, or of any message."""
    return [error.message for error in validator(kind).iter_errors(message)]


def kind_of_answer(request, answer):
    if "error" in answer:
        return schema.ERROR
    task = request["task"]
    return schema.GREETING if task == "greeting" else schema.answer_name(task)


def test_the_command_prints_the_schema(capsys):
    assert cli.run_command(["verify", "--schema"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out) == SCHEMA
    assert err == ""
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


def test_the_page_asks_for_every_task_in_order():
    tasks = [request["task"] for request, _ in TRANSCRIPT]
    assert tasks[: len(TASKS) + 1] == ["greeting", *TASKS]
    assert [request["id"] for request, _ in TRANSCRIPT] == list(range(len(TRANSCRIPT)))
    assert any("error" in answer for _, answer in TRANSCRIPT)


@pytest.mark.parametrize(("request_", "answer"), TRANSCRIPT)
def test_every_message_of_the_page_fits_the_schema(request_, answer):
    assert broken(request_, schema.request_name(request_["task"])) == []
    assert broken(answer, kind_of_answer(request_, answer)) == []
    assert answer["id"] == request_["id"]
    for message in (request_, answer):
        assert broken(message) == []


BAD = [
    (1, 0, "offsets", [[0.0, 1.0], [0.5, 0.0]]),
    (1, 0, "parents", [-1, 0.5]),
    (1, 0, "parents", "none"),
    (1, 0, "id", -1),
    (1, 1, "positions", [[0.0, 1.0, "x"]]),
    (2, 0, "method", 3),
    (2, 1, "converged", "yes"),
    (0, 1, "tasks", ["juggle"]),
    (0, 1, "precision", "half"),
    (0, 1, "step", {"method": "magic"}),
    (0, 1, "colour", "red"),
    (0, 0, "protocol", 2),
]


@pytest.mark.parametrize(("number", "side", "field", "value"), BAD)
def test_schema_refuses_a_wrong_field(number, side, field, value):
    request, answer = copy.deepcopy(TRANSCRIPT[number])
    (request, answer)[side][field] = value
    kind = kind_of_answer(request, answer) if side else schema.request_name(request["task"])
    assert broken((request, answer)[side], kind)


def test_schema_refuses_a_message_that_lacks_a_field_and_takes_null():
    request, kind = TRANSCRIPT[1][0], schema.request_name("forward_kinematics")
    for field in ("offsets", "id", "task"):
        assert broken({name: value for name, value in request.items() if name != field}, kind)
    kind = schema.answer_name("mass_spring_forces")
    assert broken({"id": 1, "seconds": 0.1}, kind)
    assert broken({"id": 1, "forces": [[None, 0.0, 1]]}, kind) == []


@pytest.mark.parametrize("task", TASKS)
def test_the_page_explains_every_field(task):
    section = PAGE.split(f"### `{task}`\n")[1].split("\n### ")[0]
    rows = [*TASKS[task].inputs, *TASKS[task].outputs]
    assert section.count("\n| `") == len(rows)
    for field in rows:
        shape = f"({', '.join(map(str, field.shape))})" if field.shape else field.kind
        assert re.search(
            rf"\| `{field.name}` \| .*\| {re.escape(f'{shape}: {field.about}')} \|", section
        )
    assert TASKS[task].about in section


def test_the_page_names_what_a_greeting_may_hold_and_how_long_one_waits():
    parts = (SCHEMA["$defs"][name]["properties"] for name in ("System", "Step", "Fixed"))
    properties = {name: field for part in parts for name, field in part.items()}
    said = set(re.findall(r"`(\w+)`", PAGE))
    assert properties.keys() <= said
    assert {"precision", "chains_only", "max_joints", "methods", "system", "step"} <= said
    for method in SCHEMA["$defs"]["Step"]["properties"]["method"]["anyOf"][0]["enum"]:
        assert method in PAGE
    assert re.search(rf"{LIMITS.first:.0f} s and any other {LIMITS.request:.0f} s", PAGE)
    assert f"{LIMITS.memory >> 30} GiB" in PAGE
    assert f"{LIMITS.line >> 20} MiB" in PAGE


def limits_of(parts):
    """The limits of fields: name, number or words, and reason."""
    for part in parts.values():
        for name, field in part.get("properties", {}).items():
            for kind in [field, *field.get("anyOf", []), *filter(None, [field.get("items")])]:
                most = [kind[key] for key in ("maxLength", "maxItems", "maximum") if key in kind]
                if most and "description" in kind:
                    yield name, most[0], kind["description"]


def test_the_page_says_every_limit_of_a_greeting():
    table = PAGE.split("beyond these limits is refused.")[1].split("\n## ")[0].splitlines()
    parts = {name: SCHEMA["$defs"][name] for name in ("greeting", "System", "Step", "Fixed")}
    limits = list(limits_of(parts))
    assert len(limits) == 10
    for name, most, reason in limits:
        assert any(f"`{name}`" in row and f"{most}" in row and reason in row for row in table), name
    assert f"and {MOST_ITERATIONS} iterations in all substeps" in PAGE
    assert f"An answer has at most {MOST_POINTS} points." in " ".join(PAGE.split())


@pytest.mark.parametrize("task", TASKS)
def test_every_request_that_is_made_fits_the_schema(task):
    greeting, method = EVERYTHING, "ccd" if task in ("inverse_kinematics", "track") else ""
    cases = DISCIPLINES[task].cases(greeting, method, 0, False)
    assert cases
    for case in cases[::4]:
        message = json.loads(encode_case(1, case))
        assert broken(message, schema.request_name(task)) == [], case.name
    assert broken(json.loads(encode_greeting()), schema.GREETING_REQUEST) == []


# Right programs of the tasks of which the page has an example.
RIGHT = {
    "forward kinematics": "forward_kinematics", "ccd": "inverse_kinematics", "track": "track",
    "resample": "resample", "forces": "mass_spring_forces", "energy": "energy",
    "local-global step": "mass_spring_step", "implicit motion": "mass_spring_motion",
    "robot_jacobian": "robot_jacobian", "robot_velocity": "robot_velocity",
}  # fmt: skip


@pytest.mark.parametrize("name", RIGHT)
def test_answers_of_the_page_are_those_of_right_programs(name):
    connection, compared = connection_to(source_of(name)), 0
    for request, expected in SOLVED:
        if request["task"] != RIGHT[name] or request.get("method") == "fabrik":
            continue
        answer = connection.answer(case_of(request))
        for output in (expected.keys() - {"id"}) & answer.values.keys():
            np.testing.assert_allclose(answer.values[output], expected[output], atol=1e-12)
            compared += 1
    assert compared


def case_of(request):
    """The case that a request of the page would be made from."""
    fields = {one.name: one for one in TASKS[request["task"]].inputs}
    inputs = {
        name: np.array(value) if fields[name].shape else value
        for name, value in request.items()
        if name in fields
    }
    return Case("of the page", request["task"], inputs, "page", sentence("An example."))


@pytest.fixture
def stub(tmp_path):
    """A program that knows the transcript by heart and gives each request its answer."""
    known = [
        ({name: one for name, one in request.items() if name != "id"}, answer)
        for request, answer in TRANSCRIPT
    ]
    program = tmp_path / "stub.py"
    program.write_text(
        "import json, sys\n"
        f"known = json.loads({json.dumps(known)!r})\n"
        "for line in sys.stdin:\n"
        "    request = json.loads(line)\n"
        "    number = request.pop('id')\n"
        "    answer = next(reply for asked, reply in known if asked == request)\n"
        "    print(json.dumps({**answer, 'id': number}), flush=True)\n",
        encoding="utf-8",
    )
    connection = open_connection([sys.executable, str(program)])
    yield connection
    connection.close()


def test_the_transcript_is_replayed_by_the_judge(stub):
    greeting = TRANSCRIPT[0][1]
    assert stub.greeting.tasks == tuple(greeting["tasks"])
    assert stub.greeting.step.damper == greeting["step"]["damper"]
    for request, expected in TRANSCRIPT[1:]:
        answer = stub.answer(case_of(request))
        if "error" in expected:
            assert isinstance(answer, Failure)
            assert answer.kind is FailureKind.REFUSED
            assert expected["error"] in str(answer.sentence)
            continue
        assert isinstance(answer, Answer), answer
        assert answer.values.keys() == expected.keys() - {"id", "seconds"}
        for name, value in answer.values.items():
            np.testing.assert_array_equal(value, expected[name])
