"""Typed fields of records: what is not of its type is refused as it is read."""

import json
from dataclasses import replace

import numpy as np
import pytest

from plumbob.bench.experiments.energy.values import Swing, SwingDetails
from plumbob.bench.harness.block import Block, Measured
from plumbob.bench.harness.measure import measure, record_of
from plumbob.bench.harness.record import Record, RecordFile, decode, encode

SETTINGS = {"h": 0.1, "steps": 2, "every": 1, "tolerance": 1e-10}
FACTS = {"title": "undamped", "damping": 0.0}
BLOCK = Block("energy", "swing/undamped", "RK4", lambda: None, SETTINGS, facts=FACTS)
TIMES, LEFT = np.array([0.0, 0.1]), np.array([1.0, np.nan])


@pytest.fixture
def record():
    return record_of(BLOCK, Measured(Swing(TIMES, LEFT)), 1.0)


def test_what_is_measured_comes_back_by_its_fields(record):
    back = decode(encode(record))
    assert list(back.arrays) == ["time", "left"]
    np.testing.assert_array_equal(back.values.left, LEFT)
    assert back.details == SwingDetails("undamped", 0.0, **SETTINGS)


@pytest.mark.parametrize(("part", "name", "value", "why"), [
    ("arrays", "left", None, "missing required field `left`"),
    ("arrays", "left", [[1.0]], "expected 1 dimensions, got 2 - at `left`"),
    ("arrays", "left", 1.0, "expected 1 dimensions, got 0 - at `left`"),
    ("arrays", "left", [True], "expected float64, got bool - at `left`"),
    ("facts", "damping", None, "missing required field `damping`"),
    ("facts", "damping", "much", "Expected `float`, got `str` - at `damping`"),
    ("settings", "every", 0.5, "Expected `int`, got `float` - at `every`"),
])  # fmt: skip
def test_a_line_that_is_not_of_its_type_is_refused_by_its_number(
    record, tmp_path, part, name, value, why
):
    content = json.loads(encode(record))
    content[part].pop(name)
    content[part] |= {} if value is None else {name: value}
    file = RecordFile(tmp_path)
    file.append([Record("other", "problem", "solver")])
    with file.path.open("a") as lines:
        lines.write(json.dumps(content) + "\n")
    records, sentence = file.read()
    assert [r.suite for r in records] == ["other"]
    assert "line 2 (" in sentence
    assert why in sentence


def test_a_measurement_of_another_type_is_a_failure(record):
    wrong = replace(BLOCK, measure=lambda: Measured(Swing(TIMES, 1.0)))
    assert measure(wrong).failed == "ValueError: expected 1 dimensions, got 0 - at `left`"
    assert not measure(replace(BLOCK, measure=lambda: Measured(Swing(TIMES, LEFT)))).failed


@pytest.mark.parametrize("notes", [{"failed": "no memory"}, {"remark": "not installed"}])
def test_a_record_without_numbers_has_no_values(notes):
    back = decode(encode(record_of(BLOCK, Measured(None, notes), 1.0)))
    assert back.values is None
    assert back.details.every == 1


def test_a_record_of_its_type_takes_the_place_of_one_that_is_not(record, tmp_path):
    file = RecordFile(tmp_path)
    file.append([record])
    line = file.path.read_text()
    file.path.write_text(line.replace('"left"', '"lift"') + line)
    assert file.read().warning == ""
    assert len(file.read().records) == 1
