"""Tables on robots: every solver of a table is scored over the same targets, however slow."""

import re
from dataclasses import replace

import numpy as np
import pytest
from table_cells import by_solver, column, rows

from plumbob.bench.experiments.published import published_ik
from plumbob.bench.experiments.robots import (
    FIGURES,
    outcomes,
    over_all,
    participants,
    robot_by_robot,
    unreachable,
)
from plumbob.bench.figures.robot_map import robot_maps
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.table import best_cells
from plumbob.bench.tables.writers import markdown

ONE, AGAIN = "one start", "restarts"
MANY = 120
SCORES = (over_all, robot_by_robot, outcomes)
MEAN = "time, geometric mean"


def shares(table, heading):
    solvers = by_solver(table, f"{heading} (95 % interval)")
    return {solver: (share.hits, share.total) for solver, share in solvers.items()}


@pytest.fixture
def run(make):
    """What makes a record of the first targets of `MANY`, `hits` of them solved."""

    def made(solver, hits, start=ONE, robot="arm", **more):
        return make.solving(solver, hits, start, robot, **{"count": MANY, "seconds": 1e-4} | more)

    return made


@pytest.fixture
def cut(run):
    """A solver that leads its first three targets, and one that solves most of all."""
    return Results([run("slow", 2, begun=3, seconds=0.5), run("steady", 60)])


def test_success_is_counted_by_the_evaluation_and_times_include_failures(make):
    table = robot_by_robot(Results([make.raced("a", ONE)]))
    (row,) = rows(table)
    assert (row["robots"], row["starts"], row["solver"]) == ("the arm", ONE, "a")
    assert shares(table, "solved") == {"a": (2, 4)}
    expected = {
        "time, median [µs]": 100.0,
        "time, mean [µs]": 302.5,
        "position residual, largest [m]": 1e-7,
        "rotation residual, median [rad]": 5.05e-7,
        "false successes": 1,
        "set-up [ms]": 250.0,
    }
    assert {heading: row[heading] for heading in expected} == pytest.approx(expected)


def test_a_solver_without_claims_has_no_false_successes_and_none_solved_leaves_no_residual(make):
    changed = {"claims": [-1] * 4, "solved": [False] * 4, "position": [np.nan] * 4}
    (row,) = rows(robot_by_robot(Results([make.raced("a", ONE, **changed)])))
    assert row["false successes"] is row["position residual, largest [m]"] is None
    table = unreachable(Results([make.raced("a", ONE, "unreachable", **changed)]))
    assert column(table, "distance to target, median [m]") == [None]


@pytest.mark.parametrize("layout", SCORES, ids=lambda layout: layout.name)
def test_one_start_and_restarts_are_never_compared(run, layout):
    """The best from one start is marked, though one that starts again is better."""
    records = [run("a", 90), run("b", 20), run("c", 110, AGAIN), run("d", 20, AGAIN)]
    table = layout(Results(records))
    assert [row[1:3] for row in table.rows] == [(ONE, "a"), (ONE, "b"), (AGAIN, "c"), (AGAIN, "d")]
    assert {i for i, _ in best_cells(table)} >= {0, 2}
    for point in table.summary.points:
        solvers = set(re.findall(r"\b[a-d]\b", point))
        assert not (solvers & {"a", "b"} and solvers & {"c", "d"})


@pytest.mark.parametrize("layout", SCORES[:2], ids=lambda layout: layout.name)
def test_a_solver_that_did_not_finish_has_no_share_and_never_leads(cut, layout):
    table = layout(cut)
    shares = by_solver(table, "solved (95 % interval)")
    assert shares["slow"] is None
    assert (shares["steady"].hits, shares["steady"].total) == (60, MANY)
    marks = {"slow": "not finished", "steady": "most solved, shortest time"}
    assert by_solver(table, "mark") == marks
    (point,) = table.summary.points
    assert "steady" in point
    assert "slow" not in point
    assert {row for row, _ in best_cells(table)} <= {column(table, "solver").index("steady")}
    (curve,) = FIGURES[3](cut).data.panels[0].series
    assert (curve.solver, curve.y[-1]) == ("steady", pytest.approx(50.0))


def test_a_solver_with_a_time_limit_is_marked_and_not_ranked(run):
    """Its answers depend on how busy the machine is."""
    limited = run("limited", MANY, facts={"time_limited": True})
    table = over_all(Results([limited, run("a", 90), run("b", 20)]))
    assert by_solver(table, "mark")["limited"] == "time-limited"
    assert "limited" not in " ".join(table.summary.points)
    assert column(table, "solver").index("limited") in table.unranked


@pytest.mark.parametrize(
    ("repeats", "mark"),
    [((84, 90, 87), "70.0 to 75.0 % in 3 runs"), ((90, 90, 90), "75.0 % in each of 3 runs")],
)
def test_a_solver_with_a_time_limit_is_listed_with_the_spread_of_its_runs(run, repeats, mark):
    record = run("limited", 90, facts={"time_limited": True})
    record.measured["repeats"] = np.array(repeats)
    marks = by_solver(over_all(Results([record, run("a", 9)])), "mark")
    assert marks["limited"] == f"time-limited, {mark}"


def test_robots_for_tuning_and_robots_held_out_are_never_averaged(run):
    groups = {"arm": "tuning", "leg": "tuning", "hand": "held out"}
    records = [
        run(solver, hits, robot=robot, facts={"group": group})
        for solver, hits in (("a", 100), ("b", 10)) for robot, group in groups.items()
    ]  # fmt: skip
    table = over_all(Results(records))
    assert [(row["robots"], row["solver"]) for row in rows(table)] == [
        *(("all 2 robots for tuning", solver) for solver in "ab"),
        *(("the hand", solver) for solver in "ab"),
    ]
    assert shares(table, "solved") == {"a": (100, MANY), "b": (10, MANY)}  # the last rows
    assert column(robot_by_robot(Results(records)), "group") == [*["tuning"] * 4, *["held out"] * 2]


def test_bold_numbers_are_those_of_the_solvers_that_lead(run):
    """Overlapping intervals once set a solver in bold that the paired test tells from the best."""
    table = over_all(Results([run("a", 100), run("b", 92), run("c", 99)]))
    leads = {i for i, row in enumerate(rows(table)) if "most solved" in row["mark"]}
    titles = [one.title for one in table.columns]
    assert {i for i, j in best_cells(table) if titles[j] == "solved"} == leads
    assert len(leads) == 2


def test_answers_that_the_engines_place_differently_are_counted(run):
    disputed = run("a", 3, count=4)
    disputed.measured["disputed"] = np.array([1, 3])
    assert column(over_all(Results([disputed])), "disputed answers") == [2]


def test_strata_count_the_targets_never_begun(cut, make):
    table = outcomes(cut)
    for stratum in ("joint space", "space"):
        assert shares(table, f"solved, {stratum}")["slow"] == (1, MANY // 2)
    hard = make.raced("a", ONE, solved=[True, False, True, True])
    strata = outcomes(Results([hard])).summary.points[-1]
    assert re.findall(r"((?:joint )?space) (\d/\d)", strata) == [
        ("space", "1/2"),
        ("joint space", "2/2"),
    ]


def test_records_of_other_targets_are_marked_and_not_ranked(run):
    results = Results([run("few", 30, begun=30, size=30), run("a", 90), run("b", 80)])
    table = robot_by_robot(results)
    assert by_solver(table, "mark")["few"] == "other targets, 30"
    assert "few" not in " ".join(table.summary.points)
    assert [one.solver for one in FIGURES[5](results).data.panels[0].series] == ["a", "b"]


@pytest.mark.parametrize("sizes", [(30, 100), (100, 30)])
def test_of_two_sets_of_targets_the_larger_one_counts(run, sizes):
    results = Results([run(str(n), 20, begun=n, size=n) for n in sizes])
    marks = by_solver(robot_by_robot(results), "mark")
    assert marks["30"] == "other targets, 30"
    assert "most solved" in marks["100"]


def test_outcomes_are_told_apart(run):
    arrays = {
        "position": [1e-9, 1e-9, 0.5, 0.5, np.nan, 1e-9],
        "beyond": [0.0, 0.3, 0.0, 0.9, np.nan, 0.0],
        "claims": [1, 1, 1, 0, 0, 1],
        "rotation": [0.0, 0.0, 0.0, 0.0, np.nan, 0.9],
    }
    (row,) = outcomes(Results([run("a", 1, begun=6, size=8, **arrays)])).rows
    assert row[3:11] == (1, 1, 2, 1, 0, 1, 2, 8)


@pytest.mark.parametrize("seed", range(25))
def test_the_outcomes_add_up_to_all_targets(make, seed):
    rng = np.random.default_rng(seed)
    begun, never = rng.integers(1, 12), rng.integers(0, 6)
    answered = rng.random(begun) < 0.8
    choices = {"position": [1e-9, 1e-3, 0.5], "rotation": [0.0, 0.5], "beyond": [0.0, 1e-7, 0.2]}
    arrays = {n: np.where(answered, rng.choice(c, begun), np.nan) for n, c in choices.items()}
    near = (arrays["position"] <= 1e-3) & (arrays["rotation"] <= 1e-3)
    arrays |= {"solved": near & (arrays["beyond"] <= 1e-6), "claims": rng.integers(-1, 2, begun)}
    arrays |= {"seconds": np.ones(begun), "stratum": np.zeros(begun, dtype=int)}
    made = make.raced("a", ONE, size=int(begun + never), **arrays)
    (row,) = outcomes(Results([made])).rows
    assert sum(row[3:10]) == row[10] == begun + never
    assert row[3] == np.count_nonzero(arrays["solved"])
    assert row[4] == np.count_nonzero(near & (arrays["beyond"] > 1e-6))


@pytest.mark.parametrize(
    ("others", "leads"),
    [
        ([60], "a, "),
        ([117, 60], "a, in a tie with b, "),
        ([118] * 5, "a, in a tie with 5 others, "),
    ],
)
def test_leaders_and_ties_are_listed_with_interval_and_marked(run, others, leads):
    records = [run("a", 118), *(run(s, hits) for s, hits in zip("bcdef", others, strict=False))]
    table = over_all(Results(records))
    share = "118/120 = 98.3 % (94.1–99.5); "
    assert table.summary.points[0].startswith(f"the arm, one start: {leads}{share}")
    ties = [solver for solver, mark in by_solver(table, "mark").items() if "solved (tie)" in mark]
    assert len(ties) == (leads.count("tie") and 1 + sum(hits > 60 for hits in others))
    assert not [c for c in table.columns if c.title == "false successes" and c.folded]


def test_times_lead_only_where_the_same_targets_tell_them_apart(run, rng):
    hard = 1e-4 * rng.lognormal(0.0, 2.0, MANY)
    for slower, is_tie in ((1.05 * hard, False), (rng.permutation(hard), True)):
        records = [run("slow", MANY, seconds=slower), run("fast", MANY, seconds=hard)]
        (point,) = robot_by_robot(Results(records)).summary.points
        leader = point.partition("shortest time ")[2]
        assert ("in a tie with" in leader) == is_tie
        assert is_tie or leader.startswith("fast, ")


def test_out_of_reach_the_best_distance_is_that_of_any_solver_within_limits(make):
    def missed(solver, position, beyond=(0.0,) * 3, start=ONE):
        arrays = {"solved": [False] * 3, "claims": [0] * 3, "stratum": [0] * 3}
        arrays |= {"seconds": [1e-4] * 3, "rotation": [1.0] * 3, "bound": [0.1] * 3}
        arrays |= {"position": position, "beyond": beyond}
        return make.raced(solver, start, "unreachable", size=3, **arrays)

    table = unreachable(Results([
        missed("a", [0.5, 0.5, 0.5]),
        missed("b", [0.4, 0.6, 0.5], beyond=[0.3, 0.0, 0.0]),
        missed("c", [0.9, 0.9, 0.2], start=AGAIN),
    ]))  # fmt: skip
    for title, distances in (
        ("best, median", [0.0, 0.2]),
        ("best, largest", [0.3, 0.3]),
        ("lower bound, median", [0.4, 0.45]),
    ):
        assert column(table, f"distance above {title} [m]")[:2] == pytest.approx(distances)
    assert column(table, "answers within limits") == [3, 2, 3]


def test_false_successes_out_of_reach_are_listed(make):
    far = {"solved": [False] * 4, "position": [0.5, 0.7, np.nan, 0.6]}
    table = unreachable(Results([make.raced("a", ONE, "unreachable", **far)]))
    (row,) = rows(table)
    assert row["false successes"] == row["answers within limits"] == 3
    assert row["distance to target, largest [m]"] == 0.7
    assert table.summary.points == ("the arm, a: 3/4 = 75 % (30.1–95.4)",)
    honest = make.raced("a", ONE, "unreachable", claims=[0] * 4, **far)
    mute = make.raced("b", ONE, "unreachable", claims=[-1] * 4, **far)
    sentence = unreachable(Results([honest, mute])).summary.sentence
    assert "No solver reports" in sentence
    assert "(n = 4)" in sentence
    assert sentence.endswith(": b.")


def test_over_all_robots_every_target_counts_once(run):
    records = [run("a", 118), run("a", 60, robot="leg"), run("b", 119), run("b", 20, robot="leg")]
    table = over_all(Results(records))
    assert column(table, "robots") == ["all 2 robots"] * 2
    assert column(table, "mark") == ["most solved, shortest time", ""]
    assert shares(table, "solved") == {"a": (178, 240), "b": (139, 240)}
    # 178 of 1e-4 s and 62 of the penalty of 0.1 s, each and the result shifted by 1e-5 s
    mean = 1e6 * (np.exp((178 * np.log(1.1e-4) + 62 * np.log(0.10001)) / 240) - 1e-5)
    row = rows(table)[0]
    assert row[f"{MEAN} [µs]"] == pytest.approx(mean, rel=1e-12)
    assert row[f"{MEAN}, 95 % low [µs]"] < mean < row[f"{MEAN}, 95 % high [µs]"]
    (point,) = table.summary.points
    share = "178/240 = 74.2 % (68.3–79.3)"
    assert point.startswith(f"all 2 robots, one start: a, {share}; shortest time a, ")
    assert point.endswith("n = 240)")


def test_solvers_are_compared_over_robots_that_all_of_them_take(run):
    robots = ("arm", "leg", "hand")
    records = [run("a", 100, robot=robot) for robot in robots]
    records += [run("b", 90, robot=robot) for robot in robots[:2]] + [run("c", 120)]
    table = over_all(Results(records))
    assert [(row["robots"], row["solver"]) for row in rows(table)] == [
        *(("all 3 robots", "a"), ("all but the hand", "a"), ("all but the hand", "b")),
    ]


def test_a_solver_cut_on_one_robot_is_not_ranked_over_all(run):
    records = [run(solver, 50, robot=robot) for solver in "ab" for robot in ("arm", "leg")]
    records += [run("slow", 100), run("slow", 2, begun=3, robot="leg")]
    table = over_all(Results(records))
    assert by_solver(table, "mark")["slow"] == "not finished"
    assert column(table, "solver").index("slow") in table.unranked
    assert "slow" not in table.summary.points[0]


def test_the_map_has_a_field_for_each_robot_that_a_solver_takes(run, cut):
    records = [run("a", MANY), run("a", MANY, robot="leg"), run("b", MANY, seconds=1e-2)]
    table = robot_by_robot(Results(records))
    assert column(table, "time relative to fastest") == pytest.approx([1.0, 100.0, 1.0])
    texts = [
        [cell and cell.text for cell in row.cells]
        for shown in robot_maps(Results(records))
        for row in shown.rows
    ]
    assert texts == [["100", "100"], ["100", None], ["100", "100"], ["10k", None]]
    assert [shown.has_stars for shown in robot_maps(cut)] == [True, True]
    assert [figure(Results([])) for figure in FIGURES] == [None] * 7


def test_missing_and_refused_solvers_are_listed_with_the_reason(make):
    entrant = make.entered(make.raced("Mine", ONE, robot="leg"))
    refused = make.lacking("Mine", ONE, "not asked for this robot")
    refused.settings["version"] = "1"
    results = Results([
        make.raced("Plumbob LM, first phase", ONE, overhead=2.5e-7),
        make.raced("Plumbob LM, 14 restarts", AGAIN, robot="leg"),
        make.lacking("pink", ONE, "pink is not installed"), entrant, refused,
    ])  # fmt: skip
    table = participants(results)
    versions = {"Plumbob LM": "1.2", "pink": "not installed", "Mine": "1.0"}
    assert by_solver(table, "version") == versions
    assert list(by_solver(table, "robots").values()) == ["all 2 robots", "", "the leg"]
    assert by_solver(table, "harness overhead, median [µs]")["Plumbob LM"] == pytest.approx(0.25)
    assert "made by the bench" in by_solver(table, "entries")["pink"]
    assert "made by the bench" not in by_solver(table, "entries")["Plumbob LM"]
    assert by_solver(table, "remark")["Mine"] == "every robot: not asked for this robot"
    assert table.summary.sentence.startswith("2 of 3 ")
    assert "Pinoc" in table.summary.sentence
    assert [point[:18] for point in table.summary.points] == [
        "the arm: 7 joints,",
        "the leg: 7 joints,",
    ]
    measured = column(robot_by_robot(results), "solver")
    assert measured == ["Plumbob LM, first phase", "Mine", "Plumbob LM, 14 restarts"]


def test_drift_between_turns_is_reported(make):
    """A factor of 2.5 between rows that should be equal went unseen."""
    records = [make.raced(solver, ONE) for solver in "abc"]
    assert "drifted" not in robot_by_robot(Results(records)).measured
    for record, seconds in zip(records, (1e-4, 2.5e-4, 1.1e-4), strict=True):
        record.measured["control"] = np.array([1e-4, seconds])
    assert "drifted by up to a factor of 2.50." in robot_by_robot(Results(records)).measured


@pytest.mark.parametrize(("size", "share", "mark"), [(2, 50.0, ""), (4, None, "not finished")])
def test_published_numbers_stand_beside_those_measured_here(make, size, share, mark):
    table = published_ik(Results([replace(record, size=size) for record in make.republished()]))

    def numbers(problem, quantity):
        chosen = [r for r in rows(table) if (r["problem"], r["quantity"]) == (problem, quantity)]
        return [(r["solver"], r["published"], r["measured"], r["mark"]) for r in chosen]

    assert numbers("ur5", "solved [%]") == [
        ("KDL", 35.89, None, ""),
        ("KDL with restarts", 88.71, None, ""),
        ("TRAC-IK, 5 ms", 99.62, share, mark),
    ]
    infeasible = ("ik_LM, NR", 11.0, share and 100.0 - share, mark)
    assert numbers("ur5", "declared infeasible [%]") == [infeasible]
    assert numbers("reachable", "iterations, mean") == [("FABRIK", 15.5, 5.0, "")]
    assert numbers("unreachable", "iterations, largest") == [("FABRIK", None, 6.0, "")]
    assert "jhavl/dkt at 1155dcb" in markdown(table)
    assert "TRAC-IK README, v1.1.0" in markdown(table)
