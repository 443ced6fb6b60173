"""The page in a browser: its first screen, its tables, its addresses; it asks for nothing."""

import itertools
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, Browser

from plumbob.bench.measure.record import FINISHED, RecordFile
from plumbob.bench.page import page as pages
from plumbob.bench.page import report
from plumbob.bench.page.sections import SECTIONS
from plumbob.bench.peers import catalogue
from plumbob.bench.peers.peer import ONE_START
from plumbob.bench.player import motion

DESK, PHONE = (1440, 900), (390, 844)
ROBOTS = ("Panda", "UR5", "xArm7", "PR2", "Atlas")
# The table that is tried: it is folded, and has a row for each of these solvers on each robot.
MAIN = "robots_by_robot"
PACKAGES = (
    "plumbob",
    "pin",
    "pin-pink",
    "mink",
    "mujoco",
    "roboticstoolbox-python",
    "pytracik",
    "ikpy",
)
PRESENT = [peer for peer in catalogue.PEERS if peer.package in PACKAGES]  # the others are absent
ABSENT = [peer for peer in catalogue.PEERS if peer not in PRESENT]
ENTRIES = [entry for peer in PRESENT for entry in peer.runs]
ONE_START = sum(entry.kind == ONE_START for entry in ENTRIES)
ROWS = len(ROBOTS) * ONE_START
# Where npm installs axe-core, in this folder or for all.
FOLDERS = (Path(__file__).parents[2], Path("/usr/lib"), Path("/usr/local/lib"))
PLACES = [folder / "node_modules/axe-core/axe.min.js" for folder in FOLDERS]
AXE = [place for place in PLACES if place.is_file()]
# What a page keeps in place of the clipboard, which a test may not touch.
CLIPBOARD = """window.copied = [];
Object.defineProperty(navigator, "clipboard",
                      {value: {writeText: async text => { window.copied.push(text); }}});"""


def of_full_length(make):
    """Records of a run with most peers on every robot, and of every solver on nine cloths."""
    generator = np.random.default_rng(0)
    for robot in ROBOTS:
        for peer in PRESENT:
            for entry in peer.runs:
                chance = generator.uniform(0.2, 0.9)
                changed = {"solved": generator.random(120) < chance, "claims": np.ones(120, int)}
                changed |= {"seconds": generator.uniform(1, 9, 120) * 1e-5 / chance}
                changed |= {name: generator.random(120) for name in ("position", "rotation")}
                changed |= {"stratum": np.arange(120) % 2, "beyond": np.zeros(120)}
                made = make.raced(peer.label_of(entry), entry.kind, robot=robot, **changed)
                yield made.__class__(**{**vars(made), "size": 120.0})
    for peer in ABSENT:
        entry = peer.runs[-1]  # with restarts: in another table than the one that is tried
        yield make.lacking(peer.label_of(entry), entry.kind, f"{peer.package} is not installed")
    for stiffness in (1e2, 1e3, 1e4):
        for i, peer in enumerate(catalogue.cloth_peers()):
            sizes, error = (20, 40, 80), (0.5, 1e-4, 10.0**-i)
            seconds = (1e-3, 2e-3, (1 + i) * 1e-3)
            yield make.worked(peer.title, stiffness, sizes, seconds, error)


@pytest.fixture(scope="module")
def address(tmp_path_factory, records, make):
    """The address of a page as of a run at full length."""
    folder = tmp_path_factory.mktemp("page")
    others = [r for r in records if not r.measured.get("entrant")]
    kept = [r for r in others if not r.problem.startswith(("robots/", "peers/one step"))]
    scales = [make.record(FINISHED, "ik", "", notes={"scale": "quick"})]
    RecordFile(folder).append([*kept, *of_full_length(make), *scales])
    beside = {"robots_by_robot", "cloth_peers_step", "timing_kinematics"}
    layouts = [layout for section in SECTIONS for layout in section.layouts]
    drawn = [draw for layout in layouts if layout.name in beside for draw in layout.figures]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "all_figures", lambda: drawn)  # the others take long, and are folded
        return report.write(folder).page.as_uri()


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    """A browser for all tests of this file."""
    if not CHROMIUM:
        pytest.skip("the page is looked at in Chromium, which is not installed")
    browser = Browser(tmp_path_factory.mktemp("profile"))
    browser.before_every_page(CLIPBOARD)
    yield browser
    browser.close()


@pytest.fixture
def browser(chromium, address):
    """The page, opened at a desk; in the end nothing was asked for and nothing went wrong."""
    chromium.open(address, *DESK)
    yield chromium
    said = ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded")
    assert [event for event in chromium.events if event.get("method") in said] == []
    asked = [event["params"]["request"]["url"] for event in chromium.events
             if event.get("method") == "Network.requestWillBeSent"]  # fmt: skip
    assert [url for url in asked if url.partition("#")[0] not in (address, "about:blank")] == []


@pytest.fixture
def table(browser):
    """The page with the table open that is tried."""
    browser.run(f"""new Promise(done => {{
        addEventListener("hashchange", () => done(), {{once: true}});
        location.hash = "{MAIN}"; }})""")
    return browser


def texts(browser, selector):
    """The texts of all elements that a selector finds and that are seen."""
    return browser.run(f"""[...document.querySelectorAll({json.dumps(selector)})]
        .filter(e => e.offsetParent).map(e => e.textContent.trim())""")


def column(browser, j, table=MAIN):
    return texts(browser, f'[id="{table}"] tbody tr > :nth-child({j})')


def click(browser, selector):
    browser.run(f"document.querySelector({json.dumps(selector)}).click()")


def check(browser, name, table=MAIN):
    """Check or uncheck a box of a menu by its label."""
    browser.run(f"""[...document.querySelectorAll('[id="{table}"] .menu label')]
        .find(label => label.textContent.trim() === {json.dumps(name)}).firstChild.click()""")


def address_of(browser):
    return browser.run("decodeURIComponent(location.hash)")


VISIBLE_WORDS = (
    r"document.body.innerText.split(/\s+/).filter(word => /[\p{L}\d]/u.test(word)).length"
)
# Numbers of the map count as words; the figures of this page are left out.
MOST_WORDS = 2600


@pytest.mark.parametrize("size", [DESK, PHONE], ids=["desk", "phone"])
def test_the_first_screen_answers_and_shows_a_map_and_a_player(browser, size):
    """On a phone the sentences come first, and the map below them is as high as its rows."""
    browser.resize(*size)
    pictures = (".map", ".motion canvas", ".motion-time") if size == DESK else ()
    for part in ("h1", "#verdict", ".findings .answer", *pictures):
        end = browser.run(f"""[...document.querySelectorAll('{part}')]
            .find(e => e.offsetParent).getBoundingClientRect().bottom""")
        assert 0 < end <= size[1], part
    message = browser.run("document.querySelector('#answers').innerText")
    for words in (
        "Plumbob finds out which",
        "1 of 1 comparisons of the reference with Pinocchio, MuJoCo and closed forms hold",
        "spring forces",
        "50.0 % of its tolerance",
        "the best other solver",
        "Where others win",
        "a <b>slide</b> rule",
        "Quick run: 60 targets of each kind",
        f"Not installed: {ABSENT[0].name}, ",
    ):
        assert words in message
    assert browser.run("document.querySelector('.findings').innerText").count(" fastest") <= 3


@pytest.mark.parametrize("size", [DESK, PHONE], ids=["desk", "phone"])
def test_the_page_is_short_and_never_scrolls_sideways(browser, size):
    browser.resize(*size)
    wide, high = browser.run("[document.documentElement.scrollWidth, document.body.scrollHeight]")
    assert wide <= size[0]
    assert high <= 15 * 900 if size == DESK else high <= 25 * 844
    assert browser.run(VISIBLE_WORDS) <= MOST_WORDS
    browser.run("document.querySelectorAll('details').forEach(fold => { fold.open = true; })")
    assert browser.run("document.documentElement.scrollWidth") <= size[0]


def test_a_switch_shows_one_start_or_restarts_on_the_whole_page(table):
    """In the map, in the figures and in the tables; a second switch in the chapter follows."""
    for value, other in (("restarts", "one-start"), ("one start", "restarts")):
        click(table, f'[name=starts2][value="{value}"]')
        assert table.run("document.querySelector('[name=starts]:checked').value") == value
        (caption,) = texts(table, ".map caption")
        assert caption.startswith(f"Targets solved [%], n = 120 on each robot, {value}")
        assert texts(table, f"figure.{other}") == []
        names = {entry.kind: [] for entry in ENTRIES}
        for peer in PRESENT:
            for entry in peer.runs:
                names[entry.kind].append(peer.label_of(entry))
        assert sorted(set(column(table, 3))) == sorted(names[value])
    click(table, "[value=time]")
    assert "Time, geometric mean [µs], 100 ms where not solved" in texts(table, ".map caption")[0]


def test_a_robot_of_the_map_leads_to_its_rows_the_best_first(browser):
    browser.run("""new Promise(done => {
        addEventListener("hashchange", () => done(), {once: true});
        [...document.querySelectorAll(".map a")].find(a => a.text === "the UR5").click(); })""")
    assert set(column(browser, 1)) == {"the UR5"}
    shares = [float(text.split()[0]) for text in column(browser, 4)]
    assert len(shares) == ONE_START
    ranked = shares[
        : -sum(peer.is_loop for peer in PRESENT)
    ]  # our loops on other engines come last
    assert ranked == sorted(ranked, reverse=True)


def test_a_table_is_cut_until_all_rows_are_asked_for(browser):
    before = texts(browser, '[id="cloth_peers_step"] tbody tr')
    assert len(before) == pages.MAX_ROWS
    click(browser, '[id="cloth_peers_step"] .more')
    assert len(texts(browser, '[id="cloth_peers_step"] tbody tr')) > len(before)
    assert texts(browser, '[id="cloth_peers_step"] .more') == []


def test_every_claim_is_a_dot_left_of_its_tolerance(browser):
    found = browser.run("""[...document.querySelectorAll(".dots a")].map(a =>
        [a.ariaLabel, parseFloat(a.style.left), document.getElementById(a.hash.slice(1)).id])""")
    assert found == [["spring forces: 50.0 % of its tolerance", pytest.approx(96.2, abs=0.1),
                      "check:spring-forces-held-ours"]]  # fmt: skip


def test_a_box_that_scrolls_has_a_bar_and_shaded_edges(browser):
    browser.resize(*PHONE)
    looks = browser.run("""[...document.querySelectorAll(".scroll")].map(getComputedStyle)
        .map(look => [look.scrollbarWidth, look.backgroundImage.split("gradient").length - 1])""")
    assert len(looks) > 20
    assert {tuple(look) for look in looks} == {("thin", 4)}


def test_on_a_phone_every_name_is_complete_and_a_wide_map_says_that_it_scrolls(browser):
    browser.resize(*PHONE)
    cut = browser.run("""[...document.querySelectorAll(".map th")].filter(head =>
        head.scrollWidth > head.clientWidth + 1 || head.scrollHeight > head.clientHeight + 1)
        .map(head => head.textContent)""")
    assert cut == []
    box, rows = "document.querySelector('.scroll.maps')", "getBoundingClientRect().bottom"
    assert browser.run(f"[...{box}.querySelectorAll('tr')].at(-1).{rows} <= {box}.{rows}")
    browser.run("document.querySelector('.map').style.minWidth = '60rem'")
    for left, hint in ((1, '"Scroll sideways → "'), (9999, "none")):
        browser.run(f"{box}.scrollLeft = {left}")
        after = f"getComputedStyle({box}.querySelector('caption'), '::after').content"
        assert browser.run(f"new Promise(done => setTimeout(() => done({after}), 300))") == hint


def test_the_line_below_a_table_leads_to_how_it_was_measured(browser):
    link = browser.run("""(() => { const link = document.querySelector("article .note a");
        link.click();
        return new Promise(done => setTimeout(() => done(link.hash), 300)); })()""")
    assert link == "#measured:robots_overall"
    (text,) = texts(browser, f'[id="{link[1:]}"]')
    assert "Settings of solvers are chosen on the robots for tuning" in text
    assert "Answers are evaluated" in text


def test_a_table_is_scrolled_by_keys(table):
    table.resize(*PHONE)
    table.run(f"""document.querySelector('[id="{MAIN}"] .scroll').focus()""")
    table.press("ArrowRight")
    left = f"""new Promise(done => setTimeout(done, 500)).then(
        () => document.querySelector('[id="{MAIN}"] .scroll').scrollLeft)"""
    assert table.run(left) > 0


def test_every_chapter_has_one_figure_and_one_table_of_seven_columns(browser):
    for section in SECTIONS:
        inside = f"#{section.name} > "
        assert len(texts(browser, f"{inside}article table caption")) == 1, section.name
        assert len(texts(browser, f"{inside}.folds > details")) <= 7
        assert len(texts(browser, f"{inside}article thead tr:last-child th")) <= 7
    assert browser.run("document.querySelectorAll('table').length") > 20


def test_a_click_sorts_and_says_so(table):
    head = f'[id="{MAIN}"] thead tr:last-child th:nth-child(3)'
    order = column(table, 3)
    for said, key in (("ascending", False), ("descending", True), ("none", None)):
        click(table, f"{head} button")
        assert table.run(f"document.querySelector('{head}').ariaSort") == said
        names = column(table, 3)
        assert names == (order if key is None else sorted(order, key=str.casefold, reverse=key))


def test_numbers_sort_as_numbers_and_what_is_missing_comes_last(browser):
    click(browser, '[id="cloth_peers_step"] thead tr:last-child th:nth-child(5) button')
    found = browser.run("""[...document.querySelectorAll('[id="cloth_peers_step"] tbody tr')]
        .map(row => row.cells[4].dataset.v || "")""")  # fmt: skip
    assert len(found) > 20
    errors = browser.run("""[...document.querySelectorAll('[id="cloth_peers_step"] tbody tr')]
        .map(row => row.cells[6].dataset.v || "")""")  # fmt: skip
    assert len(errors) == len(found)
    shown = [float(value) for value in found if value]
    assert shown == sorted(shown)
    assert not any(found[len(shown) :])


def test_a_key_sorts_and_escape_closes_a_menu(table):
    table.run(f"""document.querySelector('[id="{MAIN}"] thead button').focus()""")
    table.press("Enter")
    assert "sort=0" in address_of(table)
    click(table, f'[id="{MAIN}"] .bar > summary')
    table.run(f"""document.querySelector('[id="{MAIN}"] .menu summary').focus()""")
    table.press("Enter")
    assert table.run("document.querySelectorAll('.menu[open]').length") == 1
    table.run("document.querySelector('.menu[open] input').focus()")
    table.press("Escape")
    assert table.run("document.querySelectorAll('.menu[open]').length") == 0
    assert table.run("document.activeElement.tagName") == "SUMMARY"


def test_rows_are_filtered_by_solver_and_problem_and_counted(table):
    check(table, "the UR5")
    assert set(column(table, 1)) == {"the UR5"}
    check(table, "ikpy")
    check(table, "pink")
    assert sorted(column(table, 3)) == ["ikpy", "pink"]
    assert texts(table, f'[id="{MAIN}"] .status') == [f"2 of {len(ROBOTS) * len(ENTRIES)} rows"]


def test_columns_are_chosen_and_the_first_stays_in_sight(table):
    before = len(column(table, 1)), len(texts(table, f'[id="{MAIN}"] thead tr:last-child th'))
    check(table, "set-up [ms]")
    assert "set-up [ms]" in texts(table, f'[id="{MAIN}"] thead tr:last-child th')
    assert len(texts(table, f'[id="{MAIN}"] thead tr:last-child th')) == before[1] + 1
    table.resize(*PHONE)
    left = table.run(f"""(() => {{ const box = document.querySelector('[id="{MAIN}"] .scroll');
        box.scrollLeft = 300;
        const at = cell => cell.getBoundingClientRect().left - box.getBoundingClientRect().left;
        const [first, , solver, share] = box.querySelector("tbody tr").cells;
        return [box.scrollLeft, ...[first, solver, share].map(at)];
    }})()""")  # fmt: skip
    assert left[0] == 300
    assert left[1] == pytest.approx(0, abs=1)
    assert left[2] > 50  # the solver stays beside it
    assert left[3] < left[2]  # the numbers go on below it


def test_a_view_is_kept_in_the_address_and_comes_back(table):
    check(table, "the UR5")
    check(table, "set-up [ms]")
    click(table, f'[id="{MAIN}"] thead tr:last-child th:nth-child(3) button')
    rows, heads = column(table, 3), texts(table, f'[id="{MAIN}"] thead tr:last-child th')
    kept = table.run("location.href")
    table.open(kept, *DESK)
    assert column(table, 3) == rows
    assert texts(table, f'[id="{MAIN}"] thead tr:last-child th') == heads
    click(table, f'[id="{MAIN}"] .bar > button:nth-last-of-type(1)')
    assert len(column(table, 3)) == ROWS
    assert address_of(table) == f"#{MAIN}"


@pytest.mark.parametrize("nonsense", ["#x", "#%", "#participants?sort=99&columns=a", "#:?by0=%zz"])
def test_an_address_of_nonsense_is_harmless(browser, address, nonsense):
    browser.open(address + nonsense, *DESK)
    assert len(column(browser, 3, "robots_overall")) == min(ONE_START, pages.MAX_ROWS)


def test_a_link_to_a_row_opens_its_fold_and_marks_it(browser, address):
    row = "robots_by_robot:the-ur5-restarts-trac-ik-5-ms"
    browser.open(f"{address}#{row}", *DESK)
    found = browser.run("""(() => { const row = document.querySelector("[aria-current]");
        const box = row.getBoundingClientRect();
        const isSeen = box.top > 0 && box.bottom < innerHeight;
        return [row.id, row.closest("details").open, isSeen]; })()""")
    assert found == [row, True, True]
    command = "plumbob bench ik --solver 'TRAC-IK, 5 ms' --problem robots/UR5"
    assert texts(browser, ".chosen code") == [command]
    click(browser, ".chosen button")
    assert browser.run("window.copied") == [command]


def test_every_row_is_linked_by_mouse_and_by_keys(table):
    table.run(f"""document.querySelector('[id="{MAIN}"] .link').focus()""")
    table.press("ArrowDown")
    table.press("Enter")
    chosen = table.run("document.querySelector('[aria-current]').id")
    assert chosen == table.run(f"document.querySelectorAll('[id=\"{MAIN}\"] tbody tr')[1].id")
    assert address_of(table) == f"#{chosen}"


def test_what_is_shown_is_copied_in_three_forms(table):
    check(table, "the UR5")
    check(table, "pink")
    for i in (1, 2, 3):
        click(table, f'[id="{MAIN}"] .bar > button:nth-of-type({i})')
    markdown, latex, csv = table.run("window.copied")
    heads = texts(table, f'[id="{MAIN}"] thead tr:last-child th')
    lines = markdown.splitlines()
    assert len(lines) == 3
    assert lines[0] == f"| {' | '.join(heads)} |"
    assert lines[2].startswith("| the UR5 | pink | ")
    assert r"\toprule" in latex
    assert re.search(r"\nthe UR5 & pink & .*\\%.* \\\\\n", latex)
    rows = csv.splitlines()
    assert rows[0].startswith("robots,solver,solved_hits,solved_total,solved_low,solved_high,")
    assert rows[1].startswith("the UR5,pink,")
    assert len(rows) == 2


@pytest.mark.skipif(not shutil.which("pdflatex"), reason="no TeX is installed")
def test_all_that_is_copied_as_latex_compiles(browser, tmp_path):
    browser.run("""(() => {
        for (const fold of document.querySelectorAll(".folds > details")) fold.open = true;
        return new Promise(done => setTimeout(done, 300)); })()""")
    browser.run("""document.querySelectorAll(".bar > button").forEach(button => {
        if (button.textContent === "Copy LaTeX") button.click(); })""")
    tables = browser.run("window.copied")
    assert len(tables) > 20
    body = "\n\n".join(f"{{\\tiny {table}}}" for table in tables)
    head = r"\documentclass{article}\usepackage{booktabs}"
    text = rf"{head}\begin{{document}}{body}\end{{document}}"
    (tmp_path / "all.tex").write_text(text, encoding="utf-8")
    told = ["pdflatex", "-halt-on-error", "-interaction=nonstopmode", "all.tex"]
    done = subprocess.run(told, cwd=tmp_path, capture_output=True, timeout=120)
    assert done.returncode == 0, done.stdout.decode(errors="replace")[-1500:]


def test_the_best_is_bold_and_ties_are_marked(table):
    marked = table.run("""[...document.querySelectorAll('[id="robots_by_robot"] td.best')]
        .map(cell => [getComputedStyle(cell).fontWeight, cell.classList.contains("tie"),
                      getComputedStyle(cell, "::before").content])""")  # fmt: skip
    assert {weight for weight, _, _ in marked} == {"700"}
    assert all((sign == '"="') == tie for _, tie, sign in marked)
    assert {tie for _, tie, _ in marked} == {True, False}


def test_numbers_are_aligned_and_shares_have_bars_and_intervals(table):
    cells = table.run(f"""[...document.querySelectorAll('[id="{MAIN}"] tbody tr')]
        .filter(row => !row.hidden).map(row => [row.cells[3].textContent,
            row.cells[3].style.getPropertyValue("--b"), row.cells[6].textContent])""")
    for share, bar, ratio in cells:
        rate, low, high = map(
            float, re.fullmatch(r"([\d.]+) % \(([\d.]+)–([\d.]+)\)", share).groups()
        )
        assert low <= rate <= high
        assert float(bar) == pytest.approx(rate, abs=0.06)
        assert "." in ratio or ratio.endswith("\u2007")
    points = {len(ratio.replace("\u2008", ".").partition(".")[2]) for *_, ratio in cells}
    assert len(points) == 1


NAMELESS = """[...document.querySelectorAll(
    'a, button, summary, input, [role=region], nav, table, th')]
  .filter(e => !(e.ariaLabel || e.textContent.trim() || e.labels?.[0]?.textContent.trim()))
  .map(e => e.outerHTML.slice(0, 80))"""
# Texts that differ too little from what is behind them, by WCAG's contrast ratio.
PALE = """(() => {
  const pen = Object.assign(document.createElement("canvas"), {width: 1, height: 1})
    .getContext("2d", {willReadFrequently: true});
  const rgba = colour => {
    pen.clearRect(0, 0, 1, 1);
    pen.fillStyle = colour;
    pen.fillRect(0, 0, 1, 1);
    return [...pen.getImageData(0, 0, 1, 1).data];
  };
  const light = colour => rgba(colour).slice(0, 3).map(x => x / 255)
    .map(x => x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4)
    .reduce((sum, x, i) => sum + x * [0.2126, 0.7152, 0.0722][i], 0.05);
  const behind = e => {
    const colour = getComputedStyle(e).backgroundColor;
    return rgba(colour)[3] < 255 && e.parentElement ? behind(e.parentElement) : colour;
  };
  const texts = [...document.querySelectorAll("body *:not(svg *, script, th.same)")].filter(e =>
    e.checkVisibility() && [...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim()));
  return texts.filter(e => {
    const [a, b] = [light(getComputedStyle(e).color), light(behind(e))];
    return Math.max(a, b) / Math.min(a, b) < 4.5;
  }).map(e => e.outerHTML.slice(0, 100));
})()"""
LANDMARKS = """[...document.querySelectorAll('[role=region], nav, section[aria-label]')]
    .map(e => e.ariaLabel)"""
UNFOLDED = """
    document.querySelectorAll('details:not(.menu)').forEach(fold => { fold.open = true; });
    new Promise(done => setTimeout(done, 300))"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_controls_and_headings_have_names_and_texts_contrast(browser, scheme):
    browser.send("Emulation.setEmulatedMedia",
                 features=[{"name": "prefers-color-scheme", "value": scheme}])  # fmt: skip
    browser.run(UNFOLDED)
    assert browser.run(NAMELESS) == []
    assert browser.run(PALE) == []
    landmarks = browser.run(LANDMARKS)
    assert len(landmarks) == len(set(landmarks)) > 20
    levels = browser.run(
        "[...document.querySelectorAll('h1, h2, h3, h4')].map(head => +head.tagName[1])"
    )
    assert levels.count(1) == 1
    assert levels[0] == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))
    browser.send("Emulation.setEmulatedMedia", features=[])


@pytest.mark.skipif(not AXE, reason="axe-core is not installed (npm install axe-core)")
def test_axe_finds_nothing_with_all_folds_open(browser):
    browser.run(UNFOLDED)
    browser.run(AXE[0].read_text(encoding="utf-8") + ";0")
    found = browser.run("""axe.run(document, {resultTypes: ["violations"]}).then(result =>
        result.violations.map(rule => [rule.id, rule.nodes[0].html.slice(0, 100)]))""")
    assert found == []


def test_the_tree_of_accessibility_has_tables_with_headers(browser):
    tree = browser.send("Accessibility.getFullAXTree")["nodes"]
    roles = {node["role"]["value"] for node in tree if not node["ignored"]}
    for role in ("table", "columnheader", "rowheader", "caption", "status", "main", "navigation"):
        assert role in roles or role.capitalize() in roles, role


def test_without_its_script_every_table_can_be_read(browser, address):
    browser.send("Emulation.setScriptExecutionDisabled", value=True)
    try:
        browser.open(address, *DESK)
        tree = browser.send("Accessibility.getFullAXTree")["nodes"]
        named = {node.get("name", {}).get("value", "") for node in tree}
        # a column that is folded where there is a script
        assert "time, geometric mean, 95 % low [µs]" in named
    finally:
        browser.send("Emulation.setScriptExecutionDisabled", value=False)


def test_a_request_would_be_refused(browser, address):
    """The guard against requests can fail: what the page forbids is seen to be forbidden."""
    refused = browser.run("""new Promise(done => {
        addEventListener("securitypolicyviolation", event => done(event.violatedDirective));
        fetch("https://example.org").catch(() => {}); })""")  # fmt: skip
    assert refused == "connect-src"
    browser.events.clear()


def test_scripts_and_page_are_small(address):
    assert len((pages.SCRIPT + motion.SCRIPT).encode()) <= 16 * 1024
    assert len(Path(address.removeprefix("file://")).read_bytes()) < 3_000_000
