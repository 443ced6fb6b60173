"""Figures: six curves with names at most, legends off the data, texts apart, drawn only once."""

import itertools
import re
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from plumbob.bench.figures import canvas, drawing
from plumbob.bench.figures import sketch as figures
from plumbob.bench.figures.canvas import pdf_of  # before its stand-in is in place
from plumbob.bench.figures.chart import (
    LOOKS,
    MAX_LABELLED,
    Axis,
    Chart,
    Panel,
    chart_sketch,
    looks,
    series,
)
from plumbob.bench.figures.sketch import drawn
from plumbob.bench.page import page, report
from plumbob.bench.tables.results import Results

OURS = "Plumbob LM, first phase"

ENTRANT = "my very own solver, a name of some length"
CHARTS = 21


def with_solvers(records, count):
    """The records of every chart with solvers of its own and others up to a number."""
    found = list(records)
    for suite in ("arm", "ik", "cloth", "energy", "timing"):
        first = next(r.solver for r in records if r.suite == suite)
        for i in range(count):
            name = ENTRANT if i == 0 else f"an unknown solver no. {i}"
            facts = {"entrant": i == 0}
            found += [
                replace(r, solver=name).with_measured(**facts, **slower(r.numbers(), i))
                for r in records
                if r.suite == suite and r.solver in (first, OURS, "Plumbob Newton",
                    "Plumbob, compiled", "RK4", "ccd", "newton")
                and r.measured.get("task") not in ("few iterations", "dampers")
            ]  # fmt: skip
    return Results(list({r.key: r for r in found}.values()))


def slower(arrays, i):
    """The same numbers, a little greater where they are times."""
    return {k: v * (1 + 0.1 * i) if k == "seconds" else v for k, v in arrays.items()}


def charts(results):
    made = [sketch for figure in report.all_figures() if (sketch := figure(results))]
    return [s.data for s in made if isinstance(s.data, Chart)]


@pytest.mark.parametrize("count", [2, 5, 6, 7, 20])
def test_at_most_six_curves_are_labelled_and_every_other_can_be_named(records, count):
    made = charts(with_solvers(records, count))
    assert len(made) == CHARTS
    for chart in made:
        names = chart.labelled
        assert len(names) <= 6
        assert set(names) | set(chart.unlabelled) == set(chart.solvers)
        assert bool(chart.unlabelled) == (len(chart.solvers) > MAX_LABELLED)
        assert ("Point at a grey curve" in chart.caption) == bool(chart.unlabelled)


OURS = ("ccd", "fabrik", "levenberg_marquardt", "newton", "lbfgs", "chebyshev", "local_global")


def flat(names, **more):
    """A chart of level curves, each lower and so better than the one before."""
    x = np.arange(1.0, 11.0)
    curves = tuple(series(name, x, np.full(10, 10.0**-i)) for i, name in enumerate(names))
    return Chart("n", "t", "", (Panel("", curves),), Axis(), Axis(log=True), **more)


def test_entrants_the_best_of_ours_and_of_others_are_labelled_however_far_behind():
    others = [f"s{i}" for i in range(9)]
    chart = flat(["fabrik", "ccd", "mine", *others], user_solvers=frozenset({"mine"}))
    assert chart.labelled == ["ccd", "mine", "s5", "s6", "s7", "s8"]
    chart = flat(["s0", "s1", "mine", *OURS], user_solvers=frozenset({"mine"}))
    assert chart.labelled == ["s1", "mine", *OURS[-4:]]
    many = [f"entrant {i}" for i in range(8)]
    chart = flat([*many, "ccd", "s0"], user_solvers=frozenset(many))
    assert chart.labelled == many[-6:]


def test_the_best_by_the_measure_of_the_figure_are_those_labelled():
    chart = flat([f"s{i}" for i in range(12)])
    assert chart.labelled == [f"s{i}" for i in range(6, 12)]
    greatest = replace(chart, better="greater")
    assert greatest.labelled == [f"s{i}" for i in range(6)]
    assert "s3" in replace(chart, user_solvers=frozenset({"s3"})).labelled


@pytest.mark.parametrize("count", range(1, MAX_LABELLED + 1))
def test_labelled_curves_differ_in_colour_line_and_marker(count):
    for names in itertools.combinations(
        ["ccd", "fabrik", ENTRANT, "x", "yy", "Pinocchio", "lbfgs"], count
    ):
        made = list(looks(names).values())
        for part in zip(*made, strict=True):
            assert len(set(part)) == count
    assert len({look.colour for look in LOOKS}) == MAX_LABELLED


def laid_out(chart):
    with canvas.styled():
        return drawing.draw_chart(chart)


def test_text_on_the_page_is_never_below_seven_points(records):
    css = (page._FOLDER / "page.css").read_text()
    narrowest = min(
        float(rem) for rem in re.findall(r"figure svg \{[^}]*min-width: ([\d.]+)rem", css)
    )
    for figure in report.all_figures()[::3]:
        svg = drawn(figure(Results(records))).svg
        width = float(re.search(r'viewBox="0 0 ([\d.]+)', svg)[1])
        sizes = [float(x) for x in re.findall(r"font(?:-size)?: [^;\"]*?([\d.]+)px", svg)]
        shown = narrowest * 16 * 0.75 / width
        assert min(sizes) * shown >= 7


def test_every_curve_is_named_when_it_is_pointed_at(records):
    results = with_solvers(records, 9)
    for chart in charts(results)[::4]:
        svg = drawn(chart_sketch(chart)).svg
        told = Counter(re.findall(r'<g class="series"><title>([^<]*)</title>', svg))
        assert len(told) == len(chart.solvers), chart.name


def test_a_figure_is_drawn_again_only_if_it_shows_something_else(tmp_path, records, monkeypatch):
    sketches = (figure(Results(records)) for figure in report.all_figures())
    sketch = next(sketch for sketch in sketches if isinstance(sketch.data, Chart))
    first = drawn(sketch)
    (tmp_path / f"{sketch.name}.svg").write_text(first.svg, encoding="utf-8")
    (tmp_path / f"{sketch.name}.pdf").write_bytes(first.pdf)
    monkeypatch.setattr(figures, "_cache", type(figures._cache)())
    monkeypatch.setattr(figures, "_draw", lambda *_: ("drawn anew", b"%PDF"))
    assert drawn(sketch, tmp_path) == first
    other = replace(sketch.data, title="another title")
    assert drawn(chart_sketch(other), tmp_path).svg == "drawn anew"
    (tmp_path / f"{sketch.name}.pdf").unlink()
    monkeypatch.setattr(figures, "_cache", type(figures._cache)())
    assert drawn(sketch, tmp_path).svg == "drawn anew"


def test_a_pdf_has_its_fonts_and_its_text(records):
    hostile = flat([r"$\frac{$", "\x1b[2J", "\ufffe手腕", "right\u202eleft"])
    sketches = [figure(Results(records)) for figure in report.all_figures()[::9]]
    for sketch in [*sketches, chart_sketch(hostile)]:
        with canvas.styled():
            pdf = pdf_of(sketch.draw(sketch.data), sketch.title)
        assert pdf.startswith(b"%PDF")
        assert b"/FontFile2" in pdf
        assert b"/Type3" not in pdf


def test_curves_of_different_lengths_are_no_curve():
    with pytest.raises(ValueError, match="rows of one length"):
        series("x", [1.0, 2.0], [1.0])
    assert len(series("x", [1.0, np.nan, 3.0], [1.0, 2.0, np.inf]).x) == 1


@pytest.mark.sample("2", without=["20"])
@pytest.mark.parametrize("count", [2, 20])
def test_no_legend_covers_the_data(records, count):
    """That no two texts meet is seen in the browser: `test_labels`."""
    for chart in charts(with_solvers(records, count)):
        figure = laid_out(chart)
        with canvas.styled():
            figure.draw_without_rendering()
        for ax, legend in itertools.product(figure.axes, figure.legends):
            inside, box = ax.get_window_extent(), legend.get_window_extent()
            assert min(box.y1, inside.y1) - max(box.y0, inside.y0) < 0.5 or (
                min(box.x1, inside.x1) - max(box.x0, inside.x0) < 0.5
            ), chart.name


def test_no_point_lies_outside_of_its_axes(records):
    """But for what the limits of the chart itself leave out."""
    for chart in charts(with_solvers(records, 9)):
        figure = laid_out(chart)
        for ax, panel in zip(figure.axes, chart.panels, strict=True):
            for one in panel.series:
                for values, axis, (low, high) in (
                    (one.x, chart.x, sorted(ax.get_xlim())),
                    (one.y, chart.y, sorted(ax.get_ylim())),
                ):
                    inner = values[(values > 0) | (not axis.log)]
                    for limit, side in zip(axis.limits, (np.greater_equal, np.less_equal),
                                           strict=True):  # fmt: skip
                        inner = inner[side(inner, limit)] if limit is not None else inner
                    assert ((inner >= low) & (inner <= high)).all(), (chart.name, panel.title)


def test_panels_that_share_an_axis_hold_the_points_of_all():
    near, far = (series("a", x, np.array([1.0, 2.0])) for x in ([1.0, 2.0], [1e3, 1e5]))
    chart = Chart("n", "t", "", (Panel("", (near,)), Panel("", (far,))), Axis(log=True))
    low, high = laid_out(chart).axes[0].get_xlim()
    assert low <= 1.0
    assert high >= 1e5


@pytest.mark.parametrize(
    "foreign",
    ["<script>alert(2)</script>", "<foreignObject/>", '<g onclick="alert(3)"/>',
     '<use href="https://example.org/x"/>'],
)  # fmt: skip
def test_a_drawing_from_a_folder_brings_no_script_and_no_address_into_the_page(foreign, tmp_path):
    names = ("a", "b")
    chart = Chart("n", "t", "", (Panel("", tuple(series(n, [1.0], [2.0]) for n in names)),), Axis())
    sketch = chart_sketch(chart)
    clean = drawn(sketch)
    file = tmp_path / "n.svg"
    file.write_text(clean.svg.replace("</svg>", f"{foreign}</svg>"), encoding="utf-8")
    (tmp_path / "n.pdf").write_bytes(clean.pdf)
    figures._cache.clear()
    assert drawn(sketch, tmp_path).svg == clean.svg


def test_a_grey_curve_of_one_point_is_seen():
    names = [f"s{i}" for i in range(9)]
    chart = Chart("n", "t", "", (Panel("", tuple(series(n, [1.0], [2.0]) for n in names)),), Axis())
    lines = laid_out(chart).axes[0].get_lines()
    assert len(lines) == len(names)
    assert all(line.get_marker() not in ("none", "", None) for line in lines)
