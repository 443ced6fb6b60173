"""Figures within a page: their paths are shorter, and what is drawn is the same."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from bench.presentation.figures.sketch import Drawing
from bench.presentation.figures.svg import inline, shorter_path

STEPS = "M 0 5.000001  L 1 5  L 2 5  L 3 5  L 3 7  L 3 9.123456  L 4 9.123456 L 2 9.123456 z "


def test_points_on_level_and_upright_lines_are_left_out():
    assert shorter_path(STEPS) == "M 0 5 3 5 3 9.12 4 9.12 2 9.12 z"


def test_a_curve_keeps_its_letters_and_all_its_points():
    assert shorter_path("M 0 0 C 1 1.239 2 1 3 0 Q 1 2 3 4 L 4 4 z") == (
        "M 0 0 C 1 1.24 2 1 3 0 Q 1 2 3 4 L 4 4 z"
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(5))
def test_every_point_lies_on_the_shorter_path(seed):
    points = np.cumsum(np.random.default_rng(seed).integers(-1, 2, (60, 2)), axis=0)
    path = "M " + " L ".join(f"{x} {y}" for x, y in points)
    left = np.array(re.findall(r"-?[\d.]+", shorter_path(path)), dtype=float).reshape(-1, 2)
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
