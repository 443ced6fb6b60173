"""One ranking: tables, maps, charts, sentences and the list of others' wins print the same."""

import re
from dataclasses import replace

import numpy as np
import pytest
from table_cells import by_solver

from plumbob.bench.experiments import timing
from plumbob.bench.experiments.robots import MEAN, budgets, over_all, robot_by_robot
from plumbob.bench.figures.robot_map import SOLVED, TIME, robot_maps
from plumbob.bench.page import headlines
from plumbob.bench.page.page_tables import page_table
from plumbob.bench.page.sections import SECTIONS
from plumbob.bench.page.wins import wins_in
from plumbob.bench.ranking.rankings import rankings
from plumbob.bench.tables.layout import provenance
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.table import percent, words

RIVAL, LOOP = "A rival", "our closed loop on Pinocchio"
LAYOUTS = {layout.name: layout for section in SECTIONS for layout in section.layouts}
# Tables that mark the best of their columns; published figures are ranked against nobody.
RANKED = (
    *("accuracy", "branches", "cloth_convergence", "cloth_peers_motion", "cloth_peers_step"),
    *("cloth_proofs", "q3_jitter", "robot_tasks", "robots_by_robot"),
    *("robots_overall", "robots_unreachable", "timing_cloth", "timing_ik", "timing_jacobians"),
    *("timing_kinematics",),
)
# Numbers of which the least is best.
LEAST = (
    *("seconds", "error", "residual", "position", "distance", "largest_angle", "mean_angle"),
    *("drift", "factor", "refactor", "solve", "memory"),
)
TIMES = 20  # so many targets or sweeps for each on record: few prove nothing


def varied(record, factor, is_solved, solver):
    """The record of a solver that is better or worse by a factor on more targets."""
    measured = {}
    count = np.size(record.measured.get("solved", record.measured.get("residual", ())))
    has_targets = record.suite in ("ik", "robot_tasks") and count > 1
    for name, number in record.numbers().items():
        number = factor * number if name in LEAST and number.dtype.kind == "f" else number
        number = np.full_like(number, is_solved) if name == "solved" else number
        if has_targets and number.ndim and number.shape[-1] == count:
            number = np.tile(number, TIMES)
        elif record.suite == "timing" and name == "seconds":
            number = np.tile(number, (TIMES, 1))
        measured[name] = number if number.ndim else number.item()
    size = record.size * (TIMES if has_targets else 1)
    return replace(record.with_measured(**measured), solver=solver, size=size)


def visible(layout, results):
    return {c.title for c in layout(results).columns if c.best and not c.folded}


def test_the_tables_with_rankings_are_those_tried_here(records):
    results = Results(records)
    names = {name for name, layout in LAYOUTS.items() if visible(layout, results)}
    assert names - {"cloth_liu_2013"} == set(RANKED)


@pytest.mark.parametrize("name", RANKED)
def test_a_planted_rival_is_listed_from_every_table_that_ranks(records, name):
    """In the table itself: once only robots, cloths and timings were listed."""
    layout = LAYOUTS[name]
    own = solvers_of(layout(Results(records)))
    ours = [varied(r, 1e3, False, r.solver) for r in records if r.solver in own]
    rival = [varied(r, 1e-3, True, RIVAL) for r in records if r.solver in own]
    planted = Results([*ours, *rival])
    lines = [line for line in wins_in(layout(planted)) if line.sentence.startswith(f"{RIVAL} ")]
    assert {line.table for line in lines} == {name}
    everywhere = headlines.overview(planted).wins
    assert {line.sentence for line in lines} <= {line.sentence for line in everywhere}
    assert not list(wins_in(layout(Results(ours))))


def solvers_of(table):
    """The first of our solvers in the rankings of a table."""
    return {r.own.solver for r in rankings(table) if r.own}


def test_our_loops_are_shown_and_ranked_nowhere(make):
    records = [make.solving(s, hits) for s, hits in ((LOOP, 199), ("pink", 150), ("mink", 20))]
    table = over_all(Results(records))
    assert by_solver(table, "mark")[LOOP] == "our loop on another engine"
    assert not any(LOOP in r.first for r in rankings(table))
    found = headlines.headlines(Results(records))
    best = [h.sentence for h in found if h.question.startswith("Most")]
    assert best[0].endswith(" is mink with 10 %; our loops on other engines are not ranked.")


@pytest.fixture
def timed_in_part(make):
    """60 targets, of which 24 are timed; the order by these is that of no other place."""

    def run(solver, hits, timed_hits):
        solved = np.zeros(60, dtype=bool)
        solved[:timed_hits] = solved[24 : 24 + hits - timed_hits] = True
        record = make.solving(solver, 0, count=60, solved=solved)
        return record.with_measured(seconds=record.measured["seconds"][:, :24])

    return Results([run("a", 58, 22), run("Plumbob LM, first phase", 50, 24), run("b", 40, 10)])


def test_map_chart_table_and_sentence_show_the_same_shares_in_the_same_order(timed_in_part):
    """Of 60 targets and of the 24 timed ones, a map and a chart once showed opposite orders."""
    shares = by_solver(over_all(timed_in_part), "solved (95 % interval)")
    order = sorted(shares, key=lambda solver: -shares[solver].hits)
    texts = {solver: percent(s.hits / s.total, s.total) for solver, s in shares.items()}
    assert texts == {"a": "96.7", "Plumbob LM, first phase": "83.3", "b": "66.7"}
    assert all(f"= {texts[solver]} %" in words(shares[solver]) for solver in shares)
    page = " ".join(cell.text for row in page_table("", over_all(timed_in_part), []).rows
                    for cell in row.cells)  # fmt: skip
    assert all(f">{text} %<" in page for text in texts.values())
    shown = next(m for m in robot_maps(timed_in_part) if m.quantity == SOLVED)
    assert [(row.solver, row.cells[0].text) for row in shown.rows] == [
        (solver, texts[solver]) for solver in order
    ]
    assert "n = 60" in shown.caption
    chart = budgets("one start", timed_in_part).data
    (panel,) = chart.panels
    assert chart.title.endswith("(n = 60, 24 timed)")
    ends = {curve.solver: f"{curve.y[-1]:.1f}" for curve in panel.series}
    assert ends == texts
    assert {c.solver: c.high[-1] for c in panel.series} == pytest.approx(
        {solver: 100 * share.high for solver, share in shares.items()}
    )
    lines = {h.question.split(",")[0]: h.sentence for h in headlines.headlines(timed_in_part)}
    assert "within 1,000 µs a solves 96.7 % of the poses" in lines["Solved within a time"]
    assert "(n = 60, 24 timed)" in lines["Solved within a time"]
    assert f"a solves the most poses: {texts['a']} % of 60;" in lines["Most poses solved"]


def test_times_of_the_map_are_those_of_the_table_for_the_same_targets(timed_in_part):
    """Once medians of different targets stood beside each other."""
    means = by_solver(robot_by_robot(timed_in_part), f"{MEAN} [µs]")
    shown = next(m for m in robot_maps(timed_in_part) if m.quantity == TIME)
    assert "n = 24 on each robot" in shown.caption
    assert "100 ms where not solved" in shown.caption
    for row in shown.rows:
        number, is_thousands = re.fullmatch(r"([\d.]+)(k?)", row.cells[0].text).groups()
        size = float(number) * (1e3 if is_thousands else 1.0)
        assert size == pytest.approx(means[row.solver], rel=0.06)  # two digits


def test_a_clean_sweep_of_one_kind_is_told_beside_the_other_kind(make):
    """It once was half of all comparisons."""
    kinds = {"one pose a call": ("Pinocchio", "MuJoCo"), "9 poses a call": ("MuJoCo", "Pinocchio")}
    rounds = np.linspace(1e-6, 1.1e-6, 27).reshape(9, 3)
    records = [
        make.timed(solver, 1.0, group=group, work=work).with_measured(seconds=(1 + i) * rounds)
        for work, solvers in kinds.items()
        for group in ("arm", "leg", "hand")
        for i, solver in enumerate(solvers)
    ]
    table = timing.kinematics(Results(records))
    each = "Pinocchio on 3 of 3 comparisons (one pose a call)"
    many = "MuJoCo on 3 of 3 comparisons (many poses a call)"
    assert f"the fastest is {each} and {many}." in table.summary.sentence
    (line,) = headlines.headlines(Results(records))
    assert line.sentence == (
        "In forward kinematics, one pose a call, Pinocchio is the fastest on 3 of 3 cases, 2.0 "
        "times faster than the best other engine, MuJoCo; many poses a call, MuJoCo is the fastest "
        "on 3 of 3 cases, 2.0 times faster than the best other engine, Pinocchio."
    )


def test_a_motion_tells_its_frames_and_who_computes_in_single_precision(make):
    near = {"error": [np.inf, 5e-3, 1e-3], "frames": [2]}
    solvers = ("Newton engine, semi-implicit", "Plumbob symplectic Euler")
    records = [make.fell(solver, **near, seconds=[1e-4, 1e-3 * (1 + i), 1.0])
               for i, solver in enumerate(solvers)]  # fmt: skip
    (line,) = headlines.headlines(Results(records))
    assert line.question == "Fastest in a motion of 2 frames within 1 % of the truth"
    assert line.sentence.endswith("; each runs on one core, Newton engine in single precision.")


def test_targets_and_rounds_are_told_apart(make):
    """Rounds of a benchmark were once the n of a table."""
    rounds = [make.timed("MuJoCo", 1e-6), make.timed("Pinocchio", 1e-6)]
    assert provenance(rounds).startswith("3 rounds; ")
    solves = make.solving("a", 3, count=4).with_measured(seconds=np.ones((5, 4)))
    assert provenance([solves]).startswith("4 targets, 5 rounds; ")
    assert provenance([*rounds, solves]).startswith("4 targets, 3 to 5 rounds; ")
