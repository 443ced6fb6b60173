"""Figures within a page: their paths are shorter, and what is drawn is the same."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from plumbob.bench.figures.sketch import Drawing
from plumbob.bench.figures.svg import inline, shorter_path

NUMBERS = re.compile(r"-?[\d.]+")
STEPS = "M 0 5.000001  L 1 5  L 2 5  L 3 5  L 3 7  L 3 9.123456  L 4 9.123456 L 2 9.123456 z "


def test_points_on_level_and_upright_lines_are_left_out():
    assert shorter_path(STEPS) == "M0 5h3v4.12h1-2z"


def test_a_curve_keeps_its_letters_and_all_its_points():
    assert shorter_path("M 0 0 C 1 1.239 2 1 3 0 Q 1 2 3 4 L 4 4 z") == (
        "M0 0C1 1.24 2 1 3 0Q1 2 3 4L4 4z"
    )  # fmt: skip


def drawn(path):
    """Return the points of a path whose lines are told as differences."""
    points = []
    for letter, said in re.findall(r"([Mlhv])([^A-Za-z]*)", path):
        numbers = np.array(NUMBERS.findall(said), dtype=float)
        along = {"h": (1, 0), "v": (0, 1)}.get(letter)
        points += list(np.outer(numbers, along) if along else numbers.reshape(-1, 2))
    return np.cumsum(points, axis=0)


@pytest.mark.parametrize("size", [5, 60])
def test_differences_do_not_add_up_their_rounding(size):
    points = np.random.default_rng(size).uniform(-99, 99, (size, 2))
    path = "M " + " L ".join(f"{x} {y}" for x, y in points)
    assert np.abs(drawn(shorter_path(path)) - points).max() <= (0.0051 if size == 5 else 0.051)


@pytest.mark.parametrize("number", [0.5, -0.5, 10.5, -10.5, 20.04, 100, 0.004, -0.004, 0])
def test_a_number_is_written_in_few_letters(number):
    left = NUMBERS.findall(shorter_path(f"M {number} {-number} z"))
    assert [float(one) for one in left] == [round(number, 2), -round(number, 2)]
    assert not any(one.startswith(("0.", "-0.")) for one in left)


STYLED = """<svg xmlns="http://www.w3.org/2000/svg"><g><path d="M 0 0 L 1 1" style="{}"/>
<path d="M 0 0 L 2 1" style="{}"/></g></svg>"""


@pytest.mark.parametrize(
    ("first", "second", "shared"),
    [
        ("fill: none; stroke: red", "fill: none; stroke: red", True),
        ("fill: none", "fill: red", False),
        ("fill: none; opacity: 0.5", "fill: none; opacity: 0.5", False),
    ],
    ids=["alike", "another", "not inherited"],
)
def test_a_style_is_told_once_where_all_parts_inherit_it(first, second, shared):
    group = ET.fromstring(inline(Drawing("n", "t", "", STYLED.format(first, second)))).find("g")
    assert (group.get("style") == first.replace(" ", "")) == shared
    assert all(("style" in part.attrib) != shared for part in group)


@pytest.mark.parametrize("seed", range(5))
def test_every_point_lies_on_the_shorter_path(seed):
    points = np.cumsum(np.random.default_rng(seed).integers(-1, 2, (60, 2)), axis=0)
    path = "M " + " L ".join(f"{x} {y}" for x, y in points)
    left = drawn(shorter_path(path))
    assert len(left) < len(points)
    start, step = left[:-1], np.diff(left, axis=0)
    length = np.maximum(np.sum(step**2, axis=1), 1e-12)
    for point in points:
        along = np.clip(np.sum((point - start) * step, axis=1) / length, 0, 1)
        away = np.abs(start + along[:, None] * step - point).sum(axis=1)
        assert away.min() < 1e-9


def test_words_keep_their_spaces_and_nothing_else_does():
    text = '<text x="1.234567"> a <tspan>b  c</tspan></text>'
    svg = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">\n <g>\n  {text}\n </g>\n</svg>'
    )
    found = ET.fromstring(inline(Drawing("name", "title", "", svg)))
    assert found.find("g").text is None
    assert found.find("g/text").text == " a "
    assert found.find("g/text/tspan").text == "b  c"
