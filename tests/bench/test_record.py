"""Result files: nothing is lost, nothing is read that is not there or not of its type."""

import errno
import json
import math
import os
import resource
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from plumbob.bench.measure.block import Block
from plumbob.bench.measure.measure import measure, record_of
from plumbob.bench.measure.record import FILE_NAME, Record, RecordFile, decode, encode, key

ANY_FLOATS = arrays.arrays(
    np.float64, arrays.array_shapes(max_dims=3), elements=st.floats(allow_nan=True)
)


def block(solver="ccd", value=1.0, **settings):
    return Record("made up", "arm/circle", solver, settings, {"residual": np.array([value])})


def returned(**measured):
    """The measured values of a record that was written and read."""
    return decode(encode(Record("s", "p", "v", measured=measured))).measured


@pytest.fixture
def file(tmp_path):
    return RecordFile(tmp_path)


def solvers(file):
    return [record.solver for record in file.read().records]


@given(ANY_FLOATS)
def test_numbers_come_back_bit_for_bit_as_standard_json(array):
    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    json.loads(encode(Record("s", "p", "v", measured={"x": array})), parse_constant=refuse)
    back = np.asarray(returned(x=array)["x"])
    assert back.shape == array.shape
    np.testing.assert_array_equal(back, array)
    np.testing.assert_array_equal(np.signbit(back), np.signbit(array) & ~np.isnan(array))


def test_integers_truth_values_and_words_come_back_as_they_are():
    back = returned(i=np.array([1, 2]), b=np.array([True, False]))
    assert [back[name].dtype.kind for name in "ib"] == ["i", "b"]
    words = {"title": "arm, circle", "joints": 7, "damping": 0.0, "closed": True, "strata": ["a"]}
    words |= {"none": None, "nothing": [], "infinite": math.inf}
    assert returned(**words) == words
    assert returned(failed="no file \udcff")["failed"] == "no file ?"
    with pytest.raises(ValueError, match="expected numbers"):
        encode(Record("s", "p", "v", measured={"x": np.array([None])}))


def test_the_key_ignores_the_order_of_settings_but_not_their_values():
    assert key("s", "p", "v", {"a": 1, "b": 2}) == key("s", "p", "v", {"b": 2, "a": 1})
    assert key("s", "p", "v", {"a": 1}) != key("s", "p", "v", {"a": 2})


def test_of_two_records_with_one_key_the_later_counts(file):
    assert file.read() == ([], "")
    file.append([block(value=1.0), block("fabrik")])
    file.append([block(value=2.0)])
    assert solvers(file) == ["ccd", "fabrik"]
    assert file.read().records[0].measured["residual"] == 2.0


@pytest.mark.parametrize("cut", [1, 2, 20, 100])
def test_a_truncated_last_line_is_left_out_and_replaced(file, cut):
    file.append([block("ccd"), block("fabrik")])
    whole = file.path.read_bytes()
    file.path.write_bytes(whole[:-cut])
    # With a cut of one only the line's end is missing, not a letter of the record.
    assert solvers(file) == ["ccd", "fabrik"][: 1 + (cut == 1)]
    assert ("cut off" in file.read().warning) == (cut > 1)
    file.append([block("fabrik")])
    assert file.path.read_bytes() == whole if cut > 1 else file.read().warning == ""
    assert solvers(file) == ["ccd", "fabrik"]


def changed(path, value):
    """A valid line with another value at a path, or without it."""
    content = json.loads(encode(block(tolerance=1e-4)))
    content["measured"]["remark"], content["when"] = "fine", "2000-01-02T03:04:05+00:00"
    content["stamp"] = {
        "machine": {"processor": "p", "cores": 1, "memory_gib": 0.5, "system": "s"},
        "versions": {"python": "3"},
        "source": "0",
    }
    *parents, last = path
    place = content
    for name in parents:
        place = place[name]
    if value is MISSING:
        del place[last]
    else:
        place[last] = value
    return json.dumps(content).encode()


MISSING = object()
TEXT, NUMBER, MAP = (None, 5, True, [], ["a"], {}), (None, "1", True, [], {}), (None, "a", 1, [])
NO_NUMBERS = ({}, {"number": 1}, [None], ["one", 1], [[1], [1, 2]], [[1], 2], [True, 1], [{}])
WRONG = {
    **dict.fromkeys([("suite",), ("problem",), ("solver",)], TEXT),
    **dict.fromkeys([("stamp", "source"), ("stamp", "machine", "processor")], TEXT),
    **dict.fromkeys([("stamp", "machine", "system"), ("stamp", "versions", "python")], TEXT),
    ("when",): (*TEXT, "yesterday"),
    **dict.fromkeys([("size",), ("seconds",)], NUMBER),
    ("stamp", "machine", "cores"): ("1", 1.5, True, []),
    ("stamp", "machine", "memory_gib"): ("1", True, []),
    **dict.fromkeys([("settings",), ("measured",), ("stamp",)], MAP),
    **dict.fromkeys([("stamp", "machine"), ("stamp", "versions")], MAP),
    ("settings", "tolerance"): ([], {}, [1.0]),
    ("measured", "residual"): NO_NUMBERS,
    ("format",): (None, 0, 1, 3, 5, 99, "4", True, [], 1.5),
}


def with_text(path, text):
    """A valid line with a JSON text at a path, which need not be valid."""
    return changed(path, "HERE").replace(b'"HERE"', text)


DAMAGED = {
    **{f"{'.'.join(path)}={value!r}": changed(path, value)
       for path, values in WRONG.items() for value in values},
    **{f"no {path[0]}": changed(path, MISSING) for path in WRONG if len(path) == 1},
    "broken": b"{", "a list": b"[]", "null": b"null", "a word": b'"NaN"', "nothing": b"{}",
    "binary": b"\x00\xff\xfe", "NUL": with_text(("solver",), b'"\x00"'),
    "deep": b"[" * 100_000, "deep and whole": b"[" * 100_000 + b"]" * 100_000,
    "deep array": with_text(("measured", "residual"), b"[" * 300 + b"]" * 300),
    "very deep array": with_text(("measured", "residual"), b"[" * 10**5 + b"]" * 10**5),
    "deep setting": with_text(("settings", "tolerance"), b"[" * 10**5 + b"]" * 10**5),
    "deep machine": with_text(("stamp", "machine"), b"[" * 10**5 + b"]" * 10**5),
    "deep unknown field": with_text(("more",), b"[" * 10**5 + b"]" * 10**5),
    "a lone surrogate": changed(("solver",), "\ud800"), "no UTF-8": b'{"format": 4, "\xff": 1}',
    "NaN": changed(("size",), float("nan")), "infinity": changed(("size",), float("inf")),
    "beyond floats": with_text(("size",), b"1e999"),
    "a huge integer": with_text(("size",), b"9" * 5000),
    "a huge setting": with_text(("settings", "tolerance"), b"9" * 5000),
    "cut off": encode(block()).encode()[:-20], "cut off early": b'{"format": 4',
    "two in one": encode(block()).encode() * 2, "a mark of order": b"\xef\xbb\xbf{}",
}  # fmt: skip


@pytest.mark.parametrize("line", DAMAGED.values(), ids=[name[:60] for name in DAMAGED])
def test_a_damaged_line_costs_itself_and_a_sentence_and_no_other(file, line):
    assert decode(changed(("solver",), "x")).solver == "x"
    file.append([block("ccd")])
    good = file.path.read_bytes()
    file.path.write_bytes(good + line + b"\n")
    file.append([block("fabrik"), block("lm")])
    records, sentence = file.read()
    assert [r.solver for r in records] == ["ccd", "fabrik", "lm"]
    assert sentence.startswith(f"Left out of {FILE_NAME}, for they are no records: line 2 (")
    assert sentence.isprintable()
    assert len(sentence) < 300
    file.drop(lambda record: record.solver == "fabrik")
    assert solvers(file) == ["ccd", "lm"]
    assert file.path.read_bytes().startswith(good + line + b"\n")


def test_of_many_damaged_lines_a_few_are_listed_and_all_are_counted(file):
    file.append([block()])
    file.path.write_bytes(b"rubbish\n\n" * 50 + file.path.read_bytes())
    records, sentence = file.read()
    assert len(records) == 1
    assert all(f"line {number} (" in sentence for number in (1, 3, 5, 7, 9))
    assert "; 45 more" in sentence
    assert len(sentence) < 500


def test_an_end_that_is_no_truncated_record_is_kept(file):
    file.append([block("ccd")])
    whole = file.path.read_bytes()
    file.path.write_bytes(whole + b"a note of mine")
    file.append([block("fabrik")])
    assert file.path.read_bytes().startswith(whole + b"a note of mine\n")
    assert solvers(file) == ["ccd", "fabrik"]


@pytest.mark.parametrize("kind", ["pipe", "device", "folder"])
def test_a_path_that_is_no_file_is_neither_read_nor_written(file, kind):
    if kind == "pipe":
        os.mkfifo(file.path)
    elif kind == "device":
        file.path.symlink_to("/dev/zero")
    else:
        file.path.mkdir()
    for use in (file.read, lambda: file.append([block()])):
        with pytest.raises(ValueError, match=f"{FILE_NAME}: expected a file, got a {kind}"):
            use()


def test_drop_removes_only_unwanted_records(file):
    kept = block("fabrik", size=3)
    file.append([block("ccd"), kept])
    file.drop(lambda record: record.solver == "ccd")
    assert [encode(record) for record in file.read().records] == [encode(kept)]
    assert list(file.path.parent.iterdir()) == [file.path]


def test_records_are_brought_into_order_and_all_else_keeps_its_place(file, monkeypatch):
    old, new = (block("b", value=value) for value in (1.0, 2.0))
    file.append([block("other"), block("c"), old, block("rest"), block("a"), new])
    file.path.write_bytes(b"rubbish\n" + file.path.read_bytes())
    before, order = file.path.read_bytes().splitlines(), [block(name).key for name in "abc"]
    file.arrange(order)
    after = file.path.read_bytes().splitlines()
    assert solvers(file) == ["other", "a", "b", "rest", "c"]
    assert sorted(after) == sorted(before)
    assert after[0] == b"rubbish"
    assert file.read().records[2].measured["residual"] == 2.0
    file.append([block("a", value=2.0)])  # which stands where it first stood
    monkeypatch.setattr(RecordFile, "_replace", None)
    file.arrange(order)


def test_a_full_disk_costs_one_sentence_and_nothing_on_record(file, monkeypatch):
    file.append([block("a")])
    whole = file.path.read_bytes()

    def full(descriptor):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space left on device; what was finished") as caught:
            file.append([block("b")])
        assert caught.value.filename == str(file.path)
        with pytest.raises(OSError, match="No space left"):
            file.drop(lambda record: True)
    assert file.path.read_bytes() == whole
    assert list(file.path.parent.iterdir()) == [file.path]


@pytest.mark.parametrize("truncated", [0, 20])
def test_a_write_that_ends_in_its_middle_leaves_no_part_of_it(file, truncated):
    """The limit on the size of files lets a part be written, as a disk does that fills up."""
    file.append([block("a")])
    whole = file.path.read_bytes()
    if truncated:
        file.path.write_bytes(whole + whole[:-truncated])
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(whole) + 100, hard))
    try:
        with pytest.raises(OSError, match="File too large; what was finished"):
            file.append([block("b")])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert file.path.read_bytes() == whole
    file.append([block("b")])
    assert solvers(file) == ["a", "b"]


# Records of their type.

SETTINGS = {"h": 0.1, "steps": 2, "every": 1, "tolerance": 1e-10}
FACTS = {"title": "undamped", "damping": 0.0}
BLOCK = Block("energy", "swing/undamped", "RK4", lambda: None, SETTINGS, facts=FACTS)
TIMES, LEFT = np.array([0.0, 0.1]), np.array([1.0, np.nan])


@pytest.fixture
def swing():
    return record_of(BLOCK, {"time": TIMES, "left": LEFT}, 1.0)


def test_typed_values_come_back_by_their_fields(swing):
    back = decode(encode(swing))
    assert list(back.numbers()) == ["time", "left"]
    np.testing.assert_array_equal(back.values.left, LEFT)
    assert (back.values.every, back.values.damping) == (1, 0.0)


@pytest.mark.parametrize(("part", "name", "value", "why"), [
    ("measured", "left", None, "missing required field `left`"),
    ("measured", "left", [[1.0]], "expected 1 dimensions, got 2 - at `left`"),
    ("measured", "left", 1.0, "expected 1 dimensions, got 0 - at `left`"),
    ("measured", "left", [True], "expected float64, got bool - at `left`"),
    ("measured", "damping", None, "missing required field `damping`"),
    ("measured", "damping", "much", "Expected `float`, got `str` - at `damping`"),
    ("settings", "every", 0.5, "Expected `int`, got `float` - at `every`"),
])  # fmt: skip
def test_a_line_of_the_wrong_type_is_refused_by_its_number(swing, file, part, name, value, why):
    content = json.loads(encode(swing))
    content[part].pop(name)
    content[part] |= {} if value is None else {name: value}
    file.append([block("other")])
    with file.path.open("a") as lines:
        lines.write(json.dumps(content) + "\n")
    records, sentence = file.read()
    assert [r.solver for r in records] == ["other"]
    assert "line 2 (" in sentence
    assert why in sentence


@pytest.mark.parametrize(("changes", "why"), [
    ({}, ""),
    ({"left": 1.0}, "ValueError: expected 1 dimensions, got 0 - at `left`"),
    ({"lift": 1.0}, "ValueError: measured: expected values that Swing declares, got lift"),
])  # fmt: skip
def test_a_measurement_of_another_type_or_name_is_a_failure(changes, why):
    measured = {"time": TIMES, "left": LEFT, **changes}
    assert measure(replace(BLOCK, measure=lambda: measured)).failed == why


def test_a_setting_is_not_read_as_an_array_of_the_same_name():
    """TRAC-IK has a time limit, `seconds`, and may have no times."""
    measured = {"task": "reachable", "setup": 0.1, "solved": np.ones(2, dtype=bool)}
    measured |= {"claims": np.ones(2, dtype=int), "stratum": np.zeros(2, dtype=int)}
    measured |= dict.fromkeys(("position", "rotation", "beyond"), np.zeros(2))
    record = Record("ik", "robots/ur5", "TRAC-IK", {"seconds": 0.005}, measured)
    assert record.values.seconds is None


def test_scalars_of_numpy_are_numbers():
    fields = {"subject": "kinematics", "group": "g", "work": "w", "seconds": np.ones((1, 1))}
    block = Block("timing", "p", "copy", lambda: {**fields, "moved": np.float64(3.0)})
    assert measure(block).values.moved == 3.0


@pytest.mark.parametrize("notes", [{"failed": "no memory"}, {"remark": "not installed"}])
def test_a_record_without_numbers_has_no_values(notes):
    back = decode(encode(record_of(BLOCK, notes, 1.0)))
    assert not back.has_numbers
    assert back.values.every == 1


def test_a_record_of_its_type_takes_the_place_of_one_that_is_not(swing, file):
    file.append([swing])
    line = file.path.read_text()
    file.path.write_text(line.replace('"left"', '"lift"') + line)
    assert file.read().warning == ""
    assert len(file.read().records) == 1
