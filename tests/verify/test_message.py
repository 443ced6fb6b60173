"""Laws of the lines that requests and answers travel in."""

import json
import re
import tomllib
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from plumbob.text.printable import one_line
from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.exchange import Answer, Failure, FailureKind
from plumbob.verify.functions import understand
from plumbob.verify.message import (
    decode_answer,
    decode_greeting,
    decode_object,
    decode_request,
    did_you_mean,
    encode_answer,
    encode_case,
    encode_greeting,
)
from plumbob.verify.task import TASKS

DOUBLES = st.floats(allow_nan=True, allow_infinity=False, allow_subnormal=True)
HOSTILE = [5e-324, -0.0, 2.2250738585072011e-308, 1.7976931348623157e308, 0.1, 1 / 3, 1e22, 1e23]


def case(task, **inputs):
    return Case("a", task, inputs, "", sentence("one"))


def skeleton(count=2):
    return {
        "parents": np.arange(-1, count - 1),
        "offsets": np.ones((count, 3)),
        "local_rotations": np.eye(4)[np.zeros(count, dtype=int)],
    }


def same_bits(one, other):
    one, other = np.asarray(one), np.asarray(other)
    nan = np.isnan(one)
    assert one.dtype == other.dtype
    assert one.shape == other.shape
    assert (nan == np.isnan(other)).all()
    assert (one[~nan].view(np.uint64) == other[~nan].view(np.uint64)).all()


@given(arrays.arrays(np.float64, (4, 3), elements=DOUBLES))
@example(np.resize(HOSTILE, (4, 3)))
def test_a_request_arrives_bit_for_bit(offsets):
    sent = case("forward_kinematics", **skeleton() | {"offsets": offsets})
    line = encode_case(7, sent)
    request = decode_request(line)
    assert (request.id, request.task) == (7, "forward_kinematics")
    assert line.count(b"\n") == 1
    same_bits(offsets, request.inputs["offsets"])
    assert (request.inputs["parents"] == sent.inputs["parents"]).all()


@given(arrays.arrays(np.float64, (2, 3), elements=st.floats()))
@example(np.resize([*HOSTILE, np.nan, np.inf, -np.inf], (2, 3)))
def test_an_answer_arrives_bit_for_bit(positions):
    line = encode_answer(3, positions=positions, seconds=np.float64(0.5))
    answer = decoded(line)
    assert answer.seconds == 0.5
    same_bits(positions, answer.values["positions"])


@given(DOUBLES.filter(np.isfinite))
def test_digits_of_other_writers_give_the_same_number(number):
    for digits in (repr(number), f"{number:.17g}", f"{number:+.16e}".removeprefix("+")):
        found = decode_object(f'{{"id": 1, "a": [{digits}]}}'.encode())["a"]
        same_bits(np.array([number], dtype=float), np.asarray(found, dtype=float))


@given(DOUBLES, st.booleans(), st.integers(-(2**53), 2**53))
def test_single_values_arrive_unchanged_and_none_is_left_out(spacing, closed, count):
    inputs = {"curve": np.zeros((0, 3)), "spacing": spacing, "closed": closed, "count": count}
    line = encode_case(1, case("resample", **inputs, strokes=None))
    assert json.loads(line).keys() == {"id", "task", *inputs}
    request = decode_request(line).inputs
    assert request["curve"].shape == (0, 3)
    assert (request["closed"], request["count"]) == (closed, count)
    same_bits(np.float64(spacing).reshape(1), np.float64(request["spacing"]).reshape(1))


@pytest.mark.parametrize("value", [np.inf, np.array([1.0, -np.inf])])
def test_a_request_holds_no_infinity(value):
    with pytest.raises(ValueError, match="h: expected finite numbers"):
        encode_case(1, case("mass_spring_step", h=value))


def test_first_request_asks_for_the_greeting():
    assert json.loads(encode_greeting()) == {"id": 0, "task": "greeting", "protocol": 1}
    assert decode_request(encode_greeting()).task == "greeting"


def decoded(line, task="forward_kinematics", seconds=1.0, **inputs):
    return decode_answer(decode_object(line), TASKS[task], inputs or skeleton(), seconds)


@pytest.mark.parametrize(
    ("word", "value"),
    [
        *((word, np.nan) for word in ("null", "NaN", "nan", "-nan", "-nan(ind)", "nan(0x8000)")),
        *((word, np.inf) for word in ("Infinity", "inf", "1e999")),
        *((word, -np.inf) for word in ("-Infinity", "-inf", "-INF")),
    ],
)
def test_words_for_what_is_no_number_are_understood(word, value):
    line = f'{{"id": 1, "nan": "an inf, \\"nan\\"", "positions": [[1, {word}, 3], [4, 5, 6]]}}'
    found = decoded(line.encode()).values["positions"]
    np.testing.assert_array_equal(found, [[1, value, 3], [4, 5, 6]])


@pytest.mark.parametrize("line", [b"", b"hello", b"[1, 2]", b"3", b'"a"', b"\xff\xfe", b"nan"])
def test_line_without_an_object_is_a_print(line):
    assert decode_object(line) is None


@pytest.mark.parametrize("before", [b"", b"\xef\xbb\xbf", b"debug 12 ", b"  "])
@pytest.mark.parametrize("after", [b"", b"\r", b"  "])
def test_object_is_found_beside_prints(before, after):
    assert decode_object(before + b'{"id": 1}' + after) == {"id": 1}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b'{"id": 1, "positions": [1, 2,]}', "got '.*1, 2,]"),
        (b'{"id": 1', "expected JSON"),
        (b"{'id': 1}", "expected JSON"),
        (b'{"id": 1} trailing', "expected JSON"),
        (b'{"id": 1, "a": "\xff"}', "expected UTF-8, got byte 0xff"),
        (b'{"a":' + b"[" * 100_000, "nested too deeply"),
        (b'{"a": [nan, ' + b"[" * 100_000, "nested too deeply"),
        (b'{"a": ' + b"9" * 5000 + b"}", "expected JSON"),
    ],
)
def test_a_broken_object_says_where(line, words):
    with pytest.raises(ValueError, match=words) as caught:
        decode_object(line)
    assert len(str(caught.value)) < 300


def nested(depth):
    deep = []
    for _ in range(depth):
        deep = [deep]
    return deep


@pytest.mark.parametrize(
    ("positions", "words"),
    [
        ([[1, 2, 3]], r"positions: expected shape \(2, 3\), got \(1, 3\)"),
        ([], r"expected shape \(2, 3\), got \(0, 3\)"),
        ([["1", "2", "3"], ["4", "5", "6"]], "expected numbers"),
        ("nonsense", "expected numbers"),
        ([[1, 2], [3]], "expected numbers"),
        ({"x": 1}, "expected numbers"),
        ([[10**400, 2, 3], [4, 5, 6]], "expected numbers"),
        ([[[[[[[[[[1]]]]]]]]]], "expected shape"),
        (nested(900), "positions: expected"),
        (True, "expected shape"),
        (None, r"expected some of positions \(joint, 3\), .* got the keys id, positions"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_other_shapes_and_kinds_are_garbage(positions, words):
    fields = {"id": 1, "positions": positions}
    failure = decode_answer(fields, TASKS["forward_kinematics"], skeleton(), 1.0)
    assert isinstance(failure, Failure)
    assert failure.kind is FailureKind.GARBAGE
    assert re.search(words, str(failure.sentence))


@pytest.mark.parametrize("value", [1e300, 1.5, np.nan, np.inf, 2**63, 2**64, 10**30, "3"])
def test_other_numbers_than_integers_are_garbage(value):
    inputs = skeleton() | {"target": np.zeros(3)}
    failure = decode_answer({"iterations": value}, TASKS["inverse_kinematics"], inputs, 1.0)
    assert failure.kind is FailureKind.GARBAGE
    assert "iterations: expected one integer" in str(failure.sentence)


def test_null_and_unknown_keys_are_ignored():
    answer = decoded(b'{"id": 1, "positions": null, "rotations": [[1,0,0,0],[1,0,0,0]], "x": {}}')
    assert answer.values.keys() == {"rotations"}


@pytest.mark.parametrize(
    ("fields", "kind", "words"),
    [
        (b'"trees\\u001b[31m are not \\n mine"', FailureKind.REFUSED, "trees [31m are not mine"),
        (b'"no","kind":"raised","exception":"KeyError","file":"a{0.b}.py","line":3',
         FailureKind.RAISED, "It raised KeyError in line 3 of a{0.b}.py: no"),
    ],
)  # fmt: skip
def test_error_keeps_its_words_and_its_line(fields, kind, words):
    failure = decoded(b'{"id":1,"error":' + fields + b"}")
    assert failure.kind is kind
    assert words in str(failure.sentence)


@pytest.mark.parametrize(
    ("own", "seconds", "words"),
    [(0.25, 0.25, ""), (0, 0, ""), (0.0, 0.0, ""), (None, 1.0, "only the round trips")]
    + [(own, 1.0, f"got {own!r}"[:40])
       for own in (2.0, 1.5, -1, "1", True, np.nan, np.inf, 10**400, [0.1])],
    ids=lambda value: str(value)[:40],
)  # fmt: skip
def test_only_possible_seconds_are_the_solvers_own_time(own, seconds, words):
    answer = timed_answer(own)
    assert answer.seconds == seconds
    assert words in str(answer.untimed) if words else answer.untimed is None


def timed_answer(own):
    """An answer after a round trip of a second."""
    fields = {"positions": np.zeros((2, 3)).tolist(), "seconds": own}
    answer = decode_answer(fields, TASKS["forward_kinematics"], skeleton(), 1.0)
    assert isinstance(answer, Answer)
    return answer


GREETINGS = tomllib.loads(Path(__file__).with_name("wrong_greetings.toml").read_text("utf-8"))[
    "greeting"
]


def greeting(**fields):
    return {"id": 0, "protocol": 1, "tasks": ["energy", "energy"]} | fields


def test_greeting_is_read_with_and_without_options():
    short = decode_greeting(greeting())
    assert (short.tasks, short.name, short.methods) == (("energy",), "solver", ("",))
    system = {"masses": "one", "pinned": False}
    step = {"method": "linearised", "substeps": 3, "damping_factor": 1}
    fields = greeting(precision="single", methods=["ccd"], system=system, step=step, max_joints=9)
    full = decode_greeting(fields)
    assert (full.step.substeps, full.step.damping_factor) == (3, 1.0)
    assert (full.system.masses, full.methods, full.max_joints) == ("one", ("ccd",), 9)


@pytest.mark.parametrize(
    ("fields", "words"),
    [({"protocol": None}, "protocol: expected 1, got None"), *(row.values() for row in GREETINGS)],
)
def test_a_greeting_that_is_not_understood_says_what_to_mend(fields, words):
    with pytest.raises(ValueError, match=f"greeting: .*{words}"):
        decode_greeting(greeting(**fields))


LONG, MANY = "x" * 10**6, [f"m{i}" for i in range(5000)]


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"protocol": LONG}, "protocol: expected 1, got 1000000 characters: 'xxx"),
        ({"tasks": LONG}, "tasks: expected some of .*, got 1000000 characters: 'xxx"),
        ({"tasks": [LONG]}, "tasks: expected one of .*, got 1000000 characters: 'xxx"),
        ({LONG: 1}, "expected one of .*, got 1000000 characters: 'xxx"),
        ({"step": MANY}, "step: expected an object, got 5000 entries: \\['m0', "),
        ({"name": LONG}, "name: expected a text of at most 100 characters, got 1000000 char"),
        ({"methods": MANY}, "methods: expected a list of .*, at most 20 of them, got 5000 entries"),
        ({"methods": ["x" * 41]}, "methods: expected a list of texts of at most 40 characters, "),
    ],
    ids=lambda value: str(value)[:40],
)
def test_a_greeting_beyond_a_limit_is_refused_in_a_short_sentence(fields, words):
    with pytest.raises(ValueError, match=f"greeting: .*{words}") as error:
        decode_greeting(greeting(**fields))
    assert len(str(error.value)) < 400


def test_a_greeting_at_its_limits_is_understood():
    fields = greeting(name="x" * 100, methods=MANY[:20], step={"iterations": 2, "substeps": 500})
    assert decode_greeting(fields).methods == tuple(MANY[:20])


def test_frames_are_as_many_as_steps_and_points_at_most_a_thousand():
    motion = {name: np.zeros((2, 3)) for name in ("positions", "velocities")}
    line = encode_answer(1, positions=np.zeros((5, 2, 3)))
    failure = decoded(line, "mass_spring_motion", **motion, steps=4)
    assert "positions: expected shape (4, 2, 3), got (5, 2, 3)" in str(failure.sentence)
    inputs = {"curve": np.zeros((2, 3)), "strokes": np.zeros(1, dtype=int), "closed": False}
    right = decoded(encode_answer(1, points=np.zeros((1000, 3))), "resample", **inputs)
    assert right.values["points"].shape == (1000, 3)
    failure = decoded(encode_answer(1, points=np.zeros((1001, 3))), "resample", **inputs)
    assert "points: expected at most 1000 rows, got 1001" in str(failure.sentence)


def test_texts_among_numbers_take_no_memory_in_proportion_to_the_longest():
    """As NumPy's arrays of texts do: 4,000 bytes times a million, here."""
    values = ["x" * 1000, *[""] * 10**6]
    tracemalloc.start()
    with pytest.raises(ValueError, match="positions: expected numbers"):
        understand(TASKS["forward_kinematics"], {"joint": 2}, {"positions": values})
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 100e6


def test_a_name_far_from_all_has_no_hint():
    assert did_you_mean("draw", TASKS) == ""


def test_what_a_solver_says_is_shown_on_one_line_without_control_characters():
    assert one_line(b"a\x1b[2J\r\n\tb\x00\xff") == "a [2J b \ufffd"
    assert len(one_line("x" * 10**6, 50)) == 50
