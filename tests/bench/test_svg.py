"""Figures within a page: the same drawing, with ids of its own and the page's colours and fonts."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from plumbob.bench.figures.chart import Axis, Chart, Panel, chart_sketch, series
from plumbob.bench.figures.sketch import Drawing, drawn
from plumbob.bench.figures.style import COLOURS
from plumbob.bench.figures.svg import inline

NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


@pytest.fixture(scope="module")
def figure():
    lines = tuple(series(name, [1.0, 2.0, 5.0], [1.0, 0.5, y]) for name, y in (("a", 2), ("b", 3)))
    chart = Chart("name", "Title & more", "", (Panel("panel", lines),), Axis("x [m]"))
    return drawn(chart_sketch(chart))


def corners(path):
    """The points of a path in the drawing's units; lower-case commands count from the last one."""
    points = [np.zeros(2)]
    for command, numbers in re.findall(r"([MLlCQ])([^MLlCQz]*)", path):
        for pair in np.reshape([float(n) for n in NUMBER.findall(numbers)], (-1, 2)):
            points.append(pair + (points[-1] if command == "l" else 0.0))
    return np.array(points[1:])


def distance(point, corners):
    """The distance of a point to a polyline."""
    starts, edges = corners[:-1], np.diff(corners, axis=0)
    lengths = np.maximum((edges**2).sum(axis=1), 1e-30)
    shares = np.clip(((point - starts) * edges).sum(axis=1) / lengths, 0.0, 1.0)
    return np.linalg.norm(starts + shares[:, None] * edges - point, axis=1).min()


def test_a_drawing_in_a_page_has_the_same_paths_to_a_tenth_of_a_point(figure):
    before, after = (
        [corners(path) for path in re.findall(r' d="([^"]*)"', text)]
        for text in (figure.svg, inline(figure))
    )
    assert len(before) == len(after)
    for long, short in zip(before, after, strict=True):
        assert len(short) <= len(long)
        assert max(distance(point, short) for point in long) <= 0.0501 * np.sqrt(2)
        assert np.abs(short[:, None] - long).max(axis=2).min(axis=1).max() <= 0.0501


def test_all_ids_are_the_drawings_own_and_every_reference_has_one(figure):
    text = inline(figure)
    ids, references = (
        re.findall(p, text) for p in (r'\bid="([^"]*)', r'(?:url\(|href=")#([^")]*)')
    )
    assert set(references) == set(ids)
    other = inline(figure._replace(name="other"))
    assert not set(ids) & set(re.findall(r'\bid="([^"]*)', other))


def test_a_page_gives_size_fonts_and_colours(figure):
    root = ET.fromstring(inline(figure))
    assert (root.get("aria-label"), root.get("width"), root.get("height")) == (
        "Title & more", None, None
    )  # fmt: skip
    text = inline(figure)
    assert not re.search("DejaVu|font-family|metadata|xmlns|version=|\n", text)
    assert not any(colour in text for colour in COLOURS.values())
    assert "var(--ink)" in text
    assert len(text) < 0.75 * len(figure.svg)


def test_what_is_written_in_a_drawing_stays(figure):
    """Ticks such as 0.75 are not rounded, for they are no coordinates."""
    before, after = (
        re.findall(r"<text[^>]*>([^<]*)<", svg) for svg in (figure.svg, inline(figure))
    )
    assert before == after
    assert any(re.search(r"\d\.\d", text) for text in after)


def test_words_keep_their_spaces():
    inner = "<g>\n  <text>a <tspan>b  c</tspan></text></g>"
    svg = f'<svg xmlns="http://www.w3.org/2000/svg">\n {inner}</svg>'
    found = ET.fromstring(inline(Drawing("name", "title", "", svg)))
    assert found.find("g").text is None
    assert (found.find("g/text").text, found.find("g/text/tspan").text) == ("a ", "b  c")
