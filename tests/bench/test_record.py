"""Result files: nothing is lost, nothing is read that is not there."""

import json
import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from plumbob.bench.harness.record import FILE_NAME, Record, RecordFile, decode, encode, key

ANY_FLOATS = arrays.arrays(
    np.float64, arrays.array_shapes(max_dims=3), elements=st.floats(allow_nan=True)
)


def block(solver="ccd", value=1.0, **settings):
    return Record("made up", "arm/circle", solver, settings, arrays={"residual": np.array([value])})


def same(a, b):
    return encode(a) == encode(b)


@given(ANY_FLOATS)
def test_numbers_come_back_bit_for_bit_nan_and_infinities_too(values):
    back = decode(encode(Record("s", "p", "v", arrays={"x": values}))).arrays["x"]
    assert back.shape == values.shape
    np.testing.assert_array_equal(back, values)
    np.testing.assert_array_equal(np.signbit(back), np.signbit(values) & ~np.isnan(values))


def test_integers_and_truth_values_keep_their_kind():
    made = Record("s", "p", "v", arrays={"i": np.array([1, 2]), "b": np.array([True, False])})
    back = decode(encode(made)).arrays
    assert back["i"].dtype.kind == "i"
    assert back["b"].dtype.kind == "b"


def test_a_line_is_standard_json_whatever_the_numbers():
    line = encode(Record("s", "p", "v", arrays={"x": np.array([np.nan, np.inf, -np.inf])}))

    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    json.loads(line, parse_constant=refuse)


def test_facts_come_back_as_they_are():
    facts = {"title": "arm, circle", "joints": 7, "damping": 0.0, "closed": True, "strata": ["a"]}
    assert decode(encode(Record("s", "p", "v", facts={**facts, "none": None}))).facts == {
        **facts, "none": None,
    }  # fmt: skip


def test_what_is_no_number_is_refused():
    with pytest.raises(ValueError, match="expected numbers"):
        encode(Record("s", "p", "v", arrays={"x": np.array(["one"])}))


def test_a_note_with_half_a_surrogate_pair_is_written_so_that_it_can_be_read():
    made = Record("s", "p", "v", notes={"failed": "no file \udcff"})
    assert decode(encode(made)).failed == "no file ?"


def test_the_key_ignores_the_order_of_settings_but_not_their_values():
    assert key("s", "p", "v", {"a": 1, "b": 2}) == key("s", "p", "v", {"b": 2, "a": 1})
    assert key("s", "p", "v", {"a": 1}) != key("s", "p", "v", {"a": 2})


def test_of_two_records_with_one_key_the_later_counts(tmp_path):
    file = RecordFile(tmp_path)
    file.append([block(value=1.0), block("fabrik")])
    file.append([block(value=2.0)])
    read = file.read().records
    assert [r.solver for r in read] == ["ccd", "fabrik"]
    assert read[0].arrays["residual"] == 2.0


def test_no_file_holds_no_records(tmp_path):
    assert RecordFile(tmp_path).read() == ([], "")


@pytest.mark.parametrize("cut", [1, 2, 20, 100])
def test_a_last_line_cut_off_is_left_out_and_said_and_mended(tmp_path, cut):
    file = RecordFile(tmp_path)
    file.append([block("ccd"), block("fabrik")])
    whole = file.path.read_bytes()
    file.path.write_bytes(whole[:-cut])
    records, warning = file.read()
    if cut == 1:  # only the line's end is missing, not a letter of the record
        assert len(records) == 2
        assert warning == ""
    else:
        assert [r.solver for r in records] == ["ccd"]
        assert "cut off" in warning
    file.append([block("fabrik")])
    assert file.path.read_bytes() == whole if cut > 1 else file.read().warning == ""
    assert [r.solver for r in file.read().records] == ["ccd", "fabrik"]


def changed(path, value):
    """A good line in which what stands at a path is another value, or is not there."""
    content = json.loads(encode(block(tolerance=1e-4)))
    content["notes"], content["when"] = {"remark": "fine"}, "2000-01-02T03:04:05+00:00"
    content["stamp"] = {
        "machine": {"processor": "p", "cores": 1, "memory_gib": 0.5, "system": "s"},
        "versions": {"python": "3"},
        "source": "0",
    }
    at = content
    for name in path[:-1]:
        at = at[name]
    if value is MISSING:
        del at[path[-1]]
    else:
        at[path[-1]] = value
    return json.dumps(content).encode()


MISSING = object()
TEXT, NUMBER, MAP = (None, 5, True, [], ["a"], {}), (None, "1", True, [], {}), (None, "a", 1, [])
NO_NUMBERS = (None, "a", {}, [None], ["one"], [[1], [1, 2]], [[1], 2], [True, 1], [{}], [10**30])
WRONG = {
    **dict.fromkeys([("suite",), ("problem",), ("solver",), ("notes", "remark")], TEXT),
    **dict.fromkeys([("stamp", "source"), ("stamp", "machine", "processor")], TEXT),
    **dict.fromkeys([("stamp", "machine", "system"), ("stamp", "versions", "python")], TEXT),
    ("when",): (*TEXT, "yesterday"),
    **dict.fromkeys([("size",), ("seconds",)], NUMBER),
    ("stamp", "machine", "cores"): ("1", 1.5, True, []),
    ("stamp", "machine", "memory_gib"): ("1", True, []),
    **dict.fromkeys([("settings",), ("arrays",), ("notes",), ("stamp",), ("facts",)], MAP),
    **dict.fromkeys([("stamp", "machine"), ("stamp", "versions")], MAP),
    ("settings", "tolerance"): ([], {}, [1.0]),
    ("arrays", "residual"): NO_NUMBERS,
    ("format",): (None, 0, 1, 2, 4, 99, "3", True, [], 1.5),
}
FIELDS = [path for path in WRONG if len(path) == 1]
DAMAGED = {
    **{f"{'.'.join(path)}={value!r}": changed(path, value)
       for path, values in WRONG.items() for value in values},
    **{f"no {path[0]}": changed(path, MISSING) for path in FIELDS},
    "broken": b"{", "a list": b"[]", "null": b"null", "a word": b'"NaN"', "nothing": b"{}",
    "binary": b"\x00\xff\xfe", "NUL": changed(("solver",), "a").replace(b'"a"', b'"\x00"'),
    "deep": b"[" * 100_000, "deep and whole": b"[" * 100_000 + b"]" * 100_000,
    "deep array": changed(("arrays", "residual"), 0).replace(
        b'"residual": 0', b'"residual": ' + b"[" * 300 + b"]" * 300),
    "very deep array": changed(("arrays", "residual"), 0).replace(
        b'"residual": 0', b'"residual": ' + b"[" * 10**5 + b"]" * 10**5),
    "a lone surrogate": changed(("solver",), "\ud800"), "no UTF-8": b'{"format": 3, "\xff": 1}',
    "NaN": changed(("size",), float("nan")), "infinity": changed(("size",), float("inf")),
    "beyond floats": changed(("size",), 0).replace(b'"size": 0', b'"size": 1e999'),
    "a huge integer": changed(("size",), 0).replace(b'"size": 0', b'"size": ' + b"9" * 5000),
    "a huge setting": changed(("settings", "tolerance"), 0).replace(
        b'"tolerance": 0', b'"tolerance": ' + b"9" * 5000),
    "cut off": encode(block()).encode()[:-20], "cut off early": b'{"format": 3',
    "two in one": encode(block()).encode() * 2, "a mark of order": b"\xef\xbb\xbf{}",
}  # fmt: skip


def test_the_line_that_is_damaged_is_whole_before():
    assert decode(changed(("solver",), "x")).solver == "x"
    assert len(DAMAGED) >= 62


@pytest.mark.parametrize("line", DAMAGED.values(), ids=[name[:60] for name in DAMAGED])
def test_a_damaged_line_costs_itself_and_a_sentence_and_no_other(tmp_path, line):
    file = RecordFile(tmp_path)
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
    assert [r.solver for r in file.read().records] == ["ccd", "lm"]
    assert file.path.read_bytes().startswith(good + line + b"\n")


def test_of_many_damaged_lines_a_few_are_named_and_all_are_counted(tmp_path):
    file = RecordFile(tmp_path)
    file.append([block()])
    file.path.write_bytes(b"rubbish\n\n" * 50 + file.path.read_bytes())
    records, sentence = file.read()
    assert len(records) == 1
    assert all(f"line {number} (" in sentence for number in (1, 3, 5, 7, 9))
    assert sentence.endswith("; 45 more.")
    assert len(sentence) < 500


@pytest.mark.parametrize("line", [b"rubbish", b"{}", b"\x00\xff", b'{"format": 99}', b"[" * 10**5])
def test_a_file_without_a_record_is_not_ours(tmp_path, line):
    file = RecordFile(tmp_path)
    file.path.write_bytes(line + b"\n" + line)
    with pytest.raises(ValueError, match=rf"{FILE_NAME}, line 1: not a record"):
        file.read()


def test_an_end_that_is_no_record_cut_off_is_kept(tmp_path):
    file = RecordFile(tmp_path)
    file.append([block("ccd")])
    whole = file.path.read_bytes()
    file.path.write_bytes(whole + b"a note of mine")
    file.append([block("fabrik")])
    assert file.path.read_bytes().startswith(whole + b"a note of mine\n")
    assert [r.solver for r in file.read().records] == ["ccd", "fabrik"]


def in_the_way(path, kind):
    """Put something at a path that cannot be read to its end."""
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        path.mkdir()


@pytest.mark.parametrize("kind", ["pipe", "device", "folder"])
def test_what_is_no_file_is_neither_read_nor_written(tmp_path, kind):
    file = RecordFile(tmp_path)
    in_the_way(file.path, kind)
    message = f"{FILE_NAME}: expected a file, got a {kind}"
    with pytest.raises(ValueError, match=message):
        file.read()
    with pytest.raises(ValueError, match=message):
        file.append([block()])


def test_a_corrupt_file_is_not_written_to(tmp_path):
    file = RecordFile(tmp_path)
    file.append([block()])
    file.path.write_text("rubbish\n")
    with pytest.raises(ValueError, match="line 1"):
        file.drop(lambda record: True)
    assert file.path.read_text() == "rubbish\n"


def test_drop_removes_just_what_is_unwanted(tmp_path):
    file = RecordFile(tmp_path)
    kept = block("fabrik", size=3)
    file.append([block("ccd"), kept])
    file.drop(lambda record: record.solver == "ccd")
    assert len(file.read().records) == 1
    assert same(file.read().records[0], kept)
    assert list(tmp_path.iterdir()) == [file.path]


def test_records_are_brought_into_order_and_all_else_keeps_its_place(tmp_path):
    file = RecordFile(tmp_path)
    old, new = (block("b", value=value) for value in (1.0, 2.0))
    given = [block("other"), block("c"), old, block("rest"), block("a"), new]
    file.append(given)
    file.path.write_bytes(b"rubbish\n" + file.path.read_bytes())
    before = file.path.read_bytes().splitlines()
    file.arrange([block(name).key for name in "abc"])
    after = file.path.read_bytes().splitlines()
    assert [r.solver for r in file.read().records] == ["other", "a", "b", "rest", "c"]
    assert sorted(after) == sorted(before)
    assert after[0] == b"rubbish"
    assert file.read().records[2].arrays["residual"] == 2.0


def test_a_file_in_order_is_not_written_again(tmp_path, monkeypatch):
    """A record that was measured again stands where it first stood."""
    file = RecordFile(tmp_path)
    file.append([block("a"), block("b"), block("a", value=2.0)])
    monkeypatch.setattr(RecordFile, "_replace", None)
    file.arrange([block(name).key for name in "ab"])
