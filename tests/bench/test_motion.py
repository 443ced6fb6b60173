"""Motions on a page: data that is small and true, and a script that plays them."""

import base64
import re
from dataclasses import replace

import numpy as np
import pytest
from browser import CHROMIUM, Browser

from plumbob.bench.experiments.pictures import arm_motion, cloth_motion
from plumbob.bench.measure.record import RecordFile
from plumbob.bench.page import report
from plumbob.bench.player import motion
from plumbob.bench.player.motion import Moving, Scene, data_of
from plumbob.bench.tables.results import Results

KILOBYTE = 1024


def scene(frames=7, points=4, solvers=("a", "b"), distances=False, name="arm"):
    rng = np.random.default_rng(3)
    made = [
        Moving(s, rng.uniform(-2, 3, (frames, points, 3)), rng.uniform(1e-5, 1e-2, frames),
               rng.uniform(0, 1e-2, (frames, points)) if distances else None)
        for s in solvers
    ]  # fmt: skip
    curve = None if distances else rng.uniform(-1, 1, (20, 3))
    return Scene(name, "A title", "What it shows.", made, 0.05, "distance", (0.5, 0.4), 2, curve)


def unpacked(text):
    return np.frombuffer(base64.b64decode(text), dtype="<u2") / 65535


def test_positions_survive_to_within_half_a_step_of_16_bits():
    one = scene()
    data = data_of(one)
    every = np.concatenate([*(m.positions.reshape(-1, 3) for m in one.motions), one.curve])
    low, size = every.min(axis=0), (every.max(axis=0) - every.min(axis=0)).max()
    for sent, moving in zip(data["motions"], one.motions, strict=True):
        found = unpacked(sent["at"]).reshape(moving.positions.shape) * size + low
        assert np.abs(found - moving.positions).max() <= 0.5001 * size / 65535
        np.testing.assert_allclose(sent["errors"], moving.errors, rtol=6e-3)


def test_shades_are_the_logarithm_of_the_distance():
    one = scene(distances=True, points=9)
    data = data_of(one)
    low, high = data["decades"]
    for sent, moving in zip(data["motions"], one.motions, strict=True):
        shades = np.frombuffer(base64.b64decode(sent["shades"]), dtype=np.uint8) / 255
        share = np.clip((np.log10(moving.distances) - low) / (high - low), 0, 1)
        np.testing.assert_allclose(shades, share.ravel(), atol=0.5001 / 255)


def test_what_is_no_number_is_drawn_as_far_off_and_never_sent():
    one = scene(distances=True, points=9)
    one.motions[0].positions[2, 3] = np.nan
    one.motions[0].errors[2] = np.nan
    one.motions[0].distances[2, 3] = np.nan
    data = data_of(one)
    assert data["motions"][0]["errors"][2] is None
    assert base64.b64decode(data["motions"][0]["shades"])[2 * 9 + 3] == 255
    assert "NaN" not in motion.fragment(one)


def test_the_script_and_the_motions_of_a_report_are_small():
    assert len(motion.SCRIPT.encode()) <= 6 * KILOBYTE
    arms = scene(178, 5, [f"solver {i}" for i in range(6)])
    cloths = scene(51, 121, [f"solver {i}" for i in range(4)], distances=True)
    assert sum(len(motion.fragment(one)) for one in (arms, cloths)) < 300 * KILOBYTE


@pytest.mark.parametrize(
    "spoil",
    [
        lambda s: s._replace(motions=[s.motions[0], s.motions[1]._replace(errors=np.zeros(3))]),
        lambda s: s._replace(motions=[s.motions[0]._replace(positions=np.zeros((7, 4)))]),
        lambda s: s._replace(curve=np.zeros(4)),
        lambda s: s._replace(marked=(4,)),
    ],
)
def test_motions_of_other_shapes_are_no_scene(spoil):
    assert scene().checked()
    with pytest.raises(ValueError, match="expected"):
        spoil(scene()).checked()


def test_names_are_data():
    nasty = '</script><img src=x onerror="alert(1)">'
    text = str(motion.fragment(scene(solvers=(nasty, "b"))._replace(title=nasty)))
    assert "<img" not in text
    assert text.count("</script>") == 1


def test_without_motions_on_record_a_page_has_neither_them_nor_their_script(tmp_path, records):
    others = [r for r in records if r.suite in ("check", "finished")]
    RecordFile(tmp_path).append(others)
    text = report.write(tmp_path).page.read_text()
    assert "motion-arm" not in text
    assert motion.SCRIPT not in text
    assert arm_motion(Results(others)) is None
    assert cloth_motion(Results(others)) is None


def test_entrants_are_among_the_motions_that_are_shown(make):
    found = [r for r in make.moved() if "arm" in r.problem]
    many = [replace(found[0].with_measured(order=i), solver=f"s{i}")
            for i in range(9)]  # fmt: skip
    mine = replace(found[0].with_measured(order=99, entrant=True), solver="mine")
    shown = arm_motion(Results([*many, mine]))
    assert [one.label for one in shown.motions] == ["mine", *(f"s{i}" for i in range(5))]


def test_what_the_colours_mean_stands_beside_them():
    text = str(motion.fragment(scene(distances=True, points=9)))
    ticks = re.findall(r"<span>([^<]*)</span>", text)
    assert ticks[0] == "distance"
    assert ticks[1].startswith("≤ ")
    assert all(tick.endswith("m") for tick in ticks[1:])


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    if not CHROMIUM:
        pytest.skip("no Chromium is installed")
    made = Browser(tmp_path_factory.mktemp("profile"))
    yield made
    made.close()


@pytest.fixture(scope="module")
def played(tmp_path_factory, browser, records):
    """A page with the arm and the cloth of the example records, opened."""
    folder = tmp_path_factory.mktemp("played")
    results = Results(records)
    found = [motion.page(make(results)) for make in (arm_motion, cloth_motion)]
    body = re.search(r"<figure.*</figure>", found[1], re.DOTALL)[0]
    page = folder / "both.html"
    page.write_text(found[0].replace("</main>", f"{body}</main>"), encoding="utf-8")
    browser.open(page.as_uri())
    yield browser
    assert requests_and_complaints(browser, page) == []


def requests_and_complaints(browser, page):
    """What was asked of the network, and what the console said."""
    browser.run("1")
    told = ("Log.entryAdded", "Runtime.exceptionThrown", "Runtime.consoleAPICalled")
    asked = [e["params"]["request"]["url"] for e in browser.events
             if e.get("method") == "Network.requestWillBeSent"]  # fmt: skip
    return [e for e in browser.events if e.get("method") in told] + [
        url for url in asked if url not in (page.as_uri(), "about:blank")
    ]


# How wide and how high what has the colour of the target's curve is on a canvas.
TARGET = """(() => {
  const canvas = document.querySelector("canvas"), {width, height} = canvas;
  const style = getComputedStyle(canvas).getPropertyValue("--rule").match(/[0-9a-f]{2}/g);
  const rule = style.map(part => parseInt(part, 16)), ends = [[9e9, -9e9], [9e9, -9e9]];
  const {data} = canvas.getContext("2d").getImageData(0, 0, width, height);
  for (let i = 0; i < width * height; i++)
    if (rule.every((part, k) => Math.abs(data[4 * i + k] - part) < 3))
      [i % width, i / width | 0].forEach((place, k) => {
        ends[k] = [Math.min(ends[k][0], place), Math.max(ends[k][1], place)]; });
  return ends.map(([low, high]) => high - low);
})()"""


def test_a_circle_is_almost_round_on_the_page(browser, tmp_path, records):
    turn = np.linspace(0.0, 2 * np.pi, 80)
    circle = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=-1)
    made = arm_motion(Results(records))._replace(curve=circle)
    (tmp_path / "circle.html").write_text(motion.page(made), encoding="utf-8")
    browser.open((tmp_path / "circle.html").as_uri())
    browser.run(SETTLED)
    wide, high = browser.run(TARGET)
    assert wide > 100
    assert 0.9 < high / wide < 1.05  # the line drawn hides a part of the sides


SETTLED = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"


def pictures(browser, name):
    """What is painted on the canvases of a scene."""
    browser.run(SETTLED)
    return browser.run(
        f"[...document.querySelectorAll('#motion-{name} canvas')].map(c => c.toDataURL())"
    )


def slid(browser, name, frame):
    browser.run(
        f"{{ const s = document.querySelector('#motion-{name} input'); s.value = {frame};"
        " s.dispatchEvent(new Event('input', {bubbles: true})); }"
    )
    return pictures(browser, name)


@pytest.mark.parametrize("name", ["arm", "cloth"])
def test_the_scrubber_moves_every_solver(played, name):
    first, second = slid(played, name, 0), slid(played, name, 3)
    assert len(first) == 2
    assert all(a != b for a, b in zip(first, second, strict=True))
    assert slid(played, name, 0) == first
    assert first[0] != first[1]


@pytest.mark.parametrize("name", ["arm", "cloth"])
def test_arrow_keys_and_dragging_orbit_all_cloths_together(played, name):
    before = pictures(played, name)
    played.run(
        f"document.querySelector('#motion-{name} canvas').dispatchEvent("
        "new KeyboardEvent('keydown', {key: 'ArrowLeft'}))"
    )
    turned = pictures(played, name)
    assert all(a != b for a, b in zip(before, turned, strict=True))
    played.run(f"document.querySelector('#motion-{name} canvas').scrollIntoView()")
    box = played.run(
        f"(r => [r.x, r.y, r.width, r.height])(document.querySelector('#motion-{name} canvas')"
        ".getBoundingClientRect())"
    )
    x, y = box[0] + box[2] / 2, box[1] + box[3] / 2
    for kind, dx in (("mousePressed", 0), ("mouseMoved", 40), ("mouseReleased", 40)):
        played.send("Input.dispatchMouseEvent", type=kind, x=x + dx, y=y, button="left",
                    buttons=1, clickCount=1)  # fmt: skip
    dragged = pictures(played, name)
    assert all(a != b for a, b in zip(turned, dragged, strict=True))


def test_another_solver_is_shown_where_it_is_chosen(played):
    before = slid(played, "cloth", 2)
    played.run(
        "{ const s = document.querySelector('#motion-cloth select'); s.value = 1;"
        " s.dispatchEvent(new Event('change', {bubbles: true})); }"
    )
    after = pictures(played, "cloth")
    assert after[0] != before[0]
    assert after[0] == after[1] == before[1]
    text = "document.querySelector('#motion-cloth .motion-pane output').textContent"
    assert played.run(text) == "error now 0, largest 0"


@pytest.mark.parametrize("calm", [False, True])
def test_play_stops_at_the_end_and_starts_only_when_asked(played, calm):
    played.send("Emulation.setEmulatedMedia", features=[
        {"name": "prefers-reduced-motion", "value": "reduce" if calm else "no-preference"}
    ])  # fmt: skip
    state = "[document.querySelector('#motion-cloth button').textContent,"
    state += "+document.querySelector('#motion-cloth input').value]"
    slid(played, "cloth", 2)
    assert played.run(state) == ["Play", 2]
    played.run("document.querySelector('#motion-cloth button').click()")
    assert played.run(state)[0] == "Pause"
    ended = "new Promise(done => setTimeout(done, 500))"
    played.run(ended)
    assert played.run(state) == (["Pause", 2] if calm else ["Play", 3])
    if calm:
        played.run("document.querySelector('#motion-cloth button').click()")
