"""Labels stand apart in every figure: on the page and in its files, at a desk and on a phone."""

from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, Browser

from plumbob.bench.figures.drawing import power, ticks
from plumbob.bench.measure.record import RecordFile
from plumbob.bench.page import report
from plumbob.bench.peers import catalogue

WIDTHS = (1440, 390)
DOCS = Path(__file__).parents[2] / "docs"
ROBOTS = ("Franka Panda", "UR5", "xArm7", "PR2, right arm", "character", "a robot of mine", "KUKA")
# Pairs of labels of a figure whose boxes meet, and labels that the figure cuts off. A box is a
# little wider than its letters and leaves out the room above and below them.
FAULTS = """(() => {
  const corners = text => {
    const box = text.getBBox(), to = text.getScreenCTM();
    const em = parseFloat(getComputedStyle(text).fontSize);
    const [x, y] = [box.x - 0.15 * em, box.y + 0.2 * em];
    const [w, h] = [box.width + 0.3 * em, box.height - 0.4 * em];
    return [[x, y], [x + w, y], [x + w, y + h], [x, y + h]].map(([a, b]) =>
      [to.a * a + to.c * b + to.e, to.b * a + to.d * b + to.f]);
  };
  const apart = (p, q) => [p, q].some(box => [0, 1].some(i => {
    const [u, v] = [box[i + 1][0] - box[i][0], box[i + 1][1] - box[i][1]];
    const [a, b] = [p, q].map(c => c.map(([x, y]) => x * u + y * v));
    return Math.max(...a) <= Math.min(...b) || Math.max(...b) <= Math.min(...a);
  }));
  const found = [];
  for (const svg of document.querySelectorAll("figure svg, svg:root")) {
    const labels = [...svg.querySelectorAll("text")].filter(text => text.textContent.trim());
    const said = labels.map(text => text.textContent.trim()), boxes = labels.map(corners);
    const name = svg.getAttribute("aria-label") ?? "", whole = svg.getBoundingClientRect();
    if (!whole.width) continue;  // of the other starts
    boxes.forEach((box, i) => {
      for (let k = i + 1; k < boxes.length; k++)
        if (!apart(box, boxes[k])) found.push([name, said[i], said[k]]);
      if (box.some(([x, y]) => x < whole.left - 2 || x > whole.right + 2
                            || y < whole.top - 2 || y > whole.bottom + 2))
        found.push([name, said[i], "is cut off"]);
    });
  }
  return found;
})()"""


def crowded(make):
    """Records of every solver: times over five decades, and factors of four digits."""
    for robot in ROBOTS:
        for i, peer in enumerate(catalogue.PEERS):
            for entry in peer.runs:
                seconds = {"seconds": 1e-6 * 3.7 ** min(i, 7) * np.arange(1.0, 5.0)}
                solved = {"solved": [True, True, i % 2 == 0, True]}
                named = make.raced(
                    peer.label_of(entry), entry.kind, robot=robot, **seconds, **solved
                )
                yield named.with_measured(title=robot)
    for stiffness in (1e2, 1e3, 1e4):
        for i, peer in enumerate(catalogue.cloth_peers()):
            seconds = (1e-4 * (1 + i), 2e-2, 15.0 + i)
            error = (0.5, 1e-4, 10.0 ** -(i % 14))
            yield make.worked(peer.title, stiffness, (20, 40, 100), seconds, error)
            yield make.fell(peer.title, stiffness, seconds=[1e-4, 1e-1, 12.0])


@pytest.fixture(scope="module")
def folder(tmp_path_factory, records, make):
    """A report with every figure."""
    folder = tmp_path_factory.mktemp("labels")
    made = {record.key: record for record in [*records, *crowded(make)]}
    RecordFile(folder).append(made.values())
    report.write(folder)
    return folder


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """A browser for all tests of this file."""
    if not CHROMIUM:
        pytest.skip("labels are measured in Chromium, which is not installed")
    browser = Browser(tmp_path_factory.mktemp("profile"))
    yield browser
    browser.close()


@pytest.mark.slow
@pytest.mark.parametrize("width", WIDTHS)
def test_no_labels_overlap_on_the_page(browser, folder, width):
    browser.open((folder / "index.html").as_uri(), width)
    browser.run("document.querySelectorAll('details').forEach(fold => { fold.open = true; })")
    assert browser.run("document.querySelectorAll('figure svg').length") == len(
        report.all_figures()
    )
    for starts in ("one start", "restarts"):
        browser.run(f"document.querySelector('input[value=\"{starts}\"]').click()")
        assert browser.run(FAULTS) == []


@pytest.mark.slow
@pytest.mark.parametrize("width", WIDTHS)
def test_no_labels_overlap_in_the_files(browser, folder, width):
    files = sorted((folder / "figures").glob("*.svg"))
    assert len(files) == len(report.all_figures())
    for file in [*files, *DOCS.glob("*_*.svg")]:
        browser.open(file.as_uri(), width)
        assert browser.run(FAULTS) == [], file.name


def test_labels_that_overlap_or_are_cut_off_are_noticed(browser, tmp_path):
    labels = '<text x="9" y="20">10</text><text x="{}" y="20">20</text>'
    for x, count in ((60, 0), (24, 1), (190, 1)):
        file = tmp_path / "labels.svg"
        svg = f'<svg xmlns="http://www.w3.org/2000/svg" width="200" height="40">{labels}</svg>'
        file.write_text(svg.format(x))
        browser.open(file.as_uri())
        assert len(browser.run(FAULTS)) == count


RANGES = [
    (low, low * factor)
    for low in (1e-14, 3e-6, 0.004, 0.1, 0.73, 1.0, 21.0, 900.0)
    for factor in (1.4, 2.0, 9.0, 30.0, 110.0, 1e3, 2e5, 1e8, 1e15)
]


@pytest.mark.parametrize("log", [True, False])
@pytest.mark.parametrize("room", [10, 14, 24, 40, 80])
def test_the_labels_of_ticks_fit_between_them_and_say_their_values(log, room):
    """Whatever the ends of an axis are; two ticks at least."""
    for low, high in RANGES:
        values = ticks(low, high, log, room, lambda x: len(power(x)))
        assert len(values) > 1
        assert low <= values[0] < values[-1] <= high
        scaled = np.log10(values) if log else np.array(values)
        whole = np.diff(np.log10([low, high]) if log else [low, high])
        places = room * (scaled - scaled[0]) / whole
        halves = np.array([len(power(x)) for x in values]) / 2
        assert len(values) == 2 or (np.diff(places) >= halves[1:] + halves[:-1]).all()
