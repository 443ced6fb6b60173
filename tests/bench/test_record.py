"""Result files: nothing is lost, nothing is read that is not there."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from bench.record import FILE_NAME, Record, RecordFile, decode, encode, key

ANY_FLOATS = arrays.arrays(
    np.float64, arrays.array_shapes(max_dims=3), elements=st.floats(allow_nan=True)
)


def block(solver="ccd", value=1.0, **settings):
    return Record("arm", "arm/circle", solver, settings, arrays={"residual": np.array([value])})


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


def test_what_is_no_number_is_refused():
    with pytest.raises(ValueError, match="expected numbers"):
        encode(Record("s", "p", "v", arrays={"x": np.array(["one"])}))


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


@pytest.mark.parametrize(
    "line", ["{", "[]", "null", '{"format": 99}', '{"format": 1}', "\x00\xff", '"NaN"']
)
def test_a_corrupt_line_elsewhere_is_an_error_with_its_number(tmp_path, line):
    file = RecordFile(tmp_path)
    file.append([block()])
    text = file.path.read_text()
    file.path.write_text(text + line + "\n" + text)
    with pytest.raises(ValueError, match=rf"{FILE_NAME}, line 2: not a record"):
        file.read()


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
