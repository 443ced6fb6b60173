"""Tables on robots: every solver of a table is scored over the same targets, however slow."""

import re
from dataclasses import replace

import numpy as np
import pytest

from plumbob.bench.experiments.published.tables import published_ik
from plumbob.bench.experiments.robots.figures import FIGURES
from plumbob.bench.experiments.robots.tables import (
    outcomes,
    over_all,
    participants,
    robot_by_robot,
    unreachable,
)
from plumbob.bench.figures.sketch import drawn
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.table import best_cells
from plumbob.bench.tables.writers import markdown

ONE, AGAIN = "one start", "restarts"
MANY = 120
SCORES = (over_all, robot_by_robot, outcomes)


def column(table, heading):
    index = [c.heading for c in table.columns].index(heading)
    return [row[index] for row in table.rows]


def by_solver(table, heading):
    return dict(zip(column(table, "solver"), column(table, heading), strict=True))


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


def test_success_counts_the_evaluation_says_and_times_count_failures(make):
    table = robot_by_robot(Results([make.raced("a", ONE)]))
    (row,) = table.rows
    assert row[:3] == ("the arm", ONE, "a")
    assert shares(table, "solved") == {"a": (2, 4)}
    assert column(table, "time, median [µs]") == pytest.approx([100.0])
    assert column(table, "time, mean [µs]") == pytest.approx([302.5])
    assert column(table, "position residual, largest [m]") == [1e-7]
    assert column(table, "rotation residual, median [rad]") == pytest.approx([5.05e-7])
    assert column(table, "false successes") == [1]
    assert column(table, "set-up [ms]") == [250.0]


def test_a_solver_that_says_nothing_is_not_said_to_lie_and_none_solved_leaves_no_residual(make):
    changed = {"claimed": [-1] * 4, "solved": [False] * 4, "position": [np.nan] * 4}
    table = robot_by_robot(Results([make.raced("a", ONE, **changed)]))
    assert column(table, "false successes") == [None]
    assert column(table, "position residual, largest [m]") == [None]
    table = unreachable(Results([make.raced("a", ONE, "unreachable", **changed)]))
    assert column(table, "distance to target, median [m]") == [None]


@pytest.mark.parametrize("layout", SCORES, ids=lambda layout: layout.name)
def test_one_start_and_restarts_are_never_compared(run, layout):
    """The best from one start is marked, though one that starts again is better."""
    records = [run("a", 90, start=ONE), run("b", 20, start=ONE)]
    records += [run("c", 110, start=AGAIN), run("d", 20, start=AGAIN)]
    table = layout(Results(records))
    assert [row[1:3] for row in table.rows] == [(ONE, "a"), (ONE, "b"), (AGAIN, "c"), (AGAIN, "d")]
    assert {i for i, _ in best_cells(table)} >= {0, 2}
    for point in table.summary.points:
        assert not ({"a", "b"} & set(re.findall(r"\b[a-d]\b", point))
                    and {"c", "d"} & set(re.findall(r"\b[a-d]\b", point)))  # fmt: skip


def test_a_solver_cut_by_its_budget_is_scored_over_all_targets_and_never_leads(cut):
    for layout in (over_all, robot_by_robot):
        table = layout(cut)
        assert shares(table, "solved") == {"steady": (60, MANY), "slow": (2, MANY)}
        assert by_solver(table, "mark") == {
            "slow": "cut at 3 of 120", "steady": "most solved, least time"
        }  # fmt: skip
        assert "not ranked" in table.shows
        (point,) = table.summary.points
        assert "steady" in point
        assert "slow" not in point
        assert {row for row, _ in best_cells(table)} <= {column(table, "solver").index("steady")}


def test_strata_and_curves_count_what_was_never_begun(cut, make):
    table = outcomes(cut)
    assert shares(table, "solved, joint space")["slow"] == (1, MANY // 2)
    assert shares(table, "solved, space")["slow"] == (1, MANY // 2)
    hard = make.raced("a", ONE, solved=[True, False, True, True])
    assert outcomes(Results([hard])).summary.points[-1] == (
        "one start, strata from the hardest: space 1/2 = 50 % (9.5–90.5), "
        "joint space 2/2 = 100 % (34.2–100)"
    )
    curves = {
        sketch.name: {one.solver: one.y[-1] for one in sketch.data.panels[0].series}
        for figure in FIGURES[2:]
        if (sketch := figure(cut))
    }
    assert curves["budget_one_start"] == pytest.approx({"slow": 100 * 2 / MANY, "steady": 50.0})
    assert curves["profile_one_start"] == pytest.approx({"slow": 100 * 2 / 60, "steady": 100.0})


def test_records_of_other_targets_are_marked_and_not_ranked(run):
    results = Results([run("few", 30, begun=30, size=30), run("a", 90), run("b", 80)])
    table = robot_by_robot(results)
    assert by_solver(table, "mark")["few"] == "other targets, 30"
    assert "few" not in " ".join(table.summary.points)
    profile = FIGURES[4](results)
    assert [one.solver for one in profile.data.panels[0].series] == ["a", "b"]


def test_beyond_a_limit_missed_wrong_claim_and_no_answer_are_apart(run):
    arrays = {
        "position": [1e-9, 1e-9, 0.5, 0.5, np.nan, 1e-9],
        "beyond": [0.0, 0.3, 0.0, 0.9, np.nan, 0.0],
        "claimed": [1, 1, 1, 0, 0, 1],
        "rotation": [0.0, 0.0, 0.0, 0.0, np.nan, 0.9],
    }
    (row,) = outcomes(Results([run("a", 1, begun=6, size=8, **arrays)])).rows
    assert row[3:11] == (1, 1, 2, 1, 0, 1, 2, 8)


@pytest.mark.parametrize("seed", range(25))
def test_the_outcomes_add_up_to_all_targets(make, seed):
    rng = np.random.default_rng(seed)
    begun, never = rng.integers(1, 12), rng.integers(0, 6)
    answered = rng.random(begun) < 0.8
    arrays = {
        "position": np.where(answered, rng.choice([1e-9, 1e-3, 0.5], begun), np.nan),
        "rotation": np.where(answered, rng.choice([0.0, 0.5], begun), np.nan),
        "beyond": np.where(answered, rng.choice([0.0, 1e-7, 0.2], begun), np.nan),
        "claimed": rng.integers(-1, 2, begun),
    }
    near = (arrays["position"] <= 1e-3) & (arrays["rotation"] <= 1e-3)
    arrays |= {"solved": near & (arrays["beyond"] <= 1e-6)}
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
def test_who_leads_and_who_ties_is_said_with_interval_and_marked(run, others, leads):
    records = [run("a", 118), *(run(s, hits) for s, hits in zip("bcdef", others, strict=False))]
    table = over_all(Results(records))
    share = "118/120 = 98.3 % (94.1–99.5); "
    assert table.summary.points[0].startswith(f"the arm, one start: {leads}{share}")
    ties = [solver for solver, mark in by_solver(table, "mark").items() if "solved (tie)" in mark]
    assert len(ties) == (leads.count("tie") and 1 + sum(hits > 60 for hits in others))
    assert not [c for c in table.columns if c.title == "false successes" and c.folded]


def test_times_lead_only_where_the_same_targets_tell_them_apart(run, rng):
    hard = 1e-4 * rng.lognormal(0.0, 2.0, MANY)
    fast, slow = run("fast", MANY, seconds=1.0), run("slow", MANY)
    fast.arrays["seconds"], slow.arrays["seconds"] = hard, 1.05 * hard
    (point,) = robot_by_robot(Results([slow, fast])).summary.points
    assert "least time fast, " in point
    slow.arrays["seconds"] = rng.permutation(hard)
    (point,) = robot_by_robot(Results([slow, fast])).summary.points
    assert "in a tie with" in point.partition("least time")[2]


@pytest.fixture
def missed(make):
    """What makes a record of three targets out of reach, of either kind."""

    def made(solver, position, beyond=(0.0,) * 3, start=ONE):
        arrays = {
            "solved": [False] * 3, "claimed": [0] * 3, "stratum": [0] * 3, "seconds": [1e-4] * 3,
            "rotation": [1.0] * 3, "position": position, "beyond": beyond,
            "bound": [0.1, 0.1, 0.1],
        }  # fmt: skip
        return make.raced(solver, start, "unreachable", size=3, **arrays)

    return made


def test_out_of_reach_the_best_known_answer_is_that_of_any_solver_within_limits(missed):
    results = Results([
        missed("a", [0.5, 0.5, 0.5]),
        missed("b", [0.4, 0.6, 0.5], beyond=[0.3, 0.0, 0.0]),
        missed("c", [0.9, 0.9, 0.2], start=AGAIN),
    ])  # fmt: skip
    table = unreachable(results)
    assert column(table, "distance above best, median [m]")[:2] == pytest.approx([0.0, 0.2])
    assert column(table, "distance above best, largest [m]")[:2] == pytest.approx([0.3, 0.3])
    assert column(table, "distance above lower bound, median [m]")[:2] == pytest.approx([0.4, 0.45])
    assert column(table, "answers within limits") == [3, 2, 3]


def test_claims_out_of_reach_are_named(make):
    far = {"solved": [False] * 4, "position": [0.5, 0.7, np.nan, 0.6]}
    liar = make.raced("a", ONE, "unreachable", **far)
    table = unreachable(Results([liar]))
    assert column(table, "false successes") == [3]
    assert column(table, "distance to target, largest [m]") == [0.7]
    assert column(table, "answers within limits") == [3]
    assert table.summary.points == ("the arm, a: 3/4 = 75 % (30.1–95.4)",)
    honest = make.raced("a", ONE, "unreachable", claimed=[0] * 4, **far)
    mute = make.raced("b", ONE, "unreachable", claimed=[-1] * 4, **far)
    assert unreachable(Results([honest, mute])).summary.sentence == (
        "No solver that makes claims claims a target that is out of reach (n = 4). "
        "These make no claims: b."
    )


def test_over_all_robots_every_target_counts_once(run):
    table = over_all(Results([run("a", 118), run("a", 60, robot="leg"), run("b", 119),
                              run("b", 20, robot="leg")]))  # fmt: skip
    assert column(table, "robots") == ["all 2 robots"] * 2
    assert shares(table, "solved") == {"a": (178, 240), "b": (139, 240)}
    # 178 of 1e-4 s and 62 of the penalty of 0.1 s, each and the result shifted by 1e-5 s
    mean = np.exp((178 * np.log(1.1e-4) + 62 * np.log(0.10001)) / 240) - 1e-5
    time = "time, geometric mean"
    assert column(table, f"{time} [µs]")[0] == pytest.approx(1e6 * mean, rel=1e-12)
    low, high = (column(table, f"{time}, 95 % {end} [µs]")[0] for end in ("low", "high"))
    assert low < 1e6 * mean < high
    (point,) = table.summary.points
    assert point.startswith(
        "all 2 robots, one start: a, 178/240 = 74.2 % (68.3–79.3); least time a, "
    )
    assert point.endswith("n = 240)")
    assert column(table, "mark") == ["most solved, least time", ""]


def test_solvers_are_compared_over_robots_that_all_of_them_take(run):
    robots = ("arm", "leg", "hand")
    records = [run("a", 100, robot=robot) for robot in robots]
    records += [run("b", 90, robot=robot) for robot in robots[:2]] + [run("c", 120)]
    table = over_all(Results(records))
    rows = list(zip(column(table, "robots"), column(table, "solver"), strict=True))
    assert rows == [("all 3 robots", "a"), ("all but the hand", "a"), ("all but the hand", "b"),
                    *(("the arm", solver) for solver in "abc")]  # fmt: skip
    assert table.summary.points[-1].startswith("the arm, one start: c, 120/120")


def test_who_is_cut_on_one_robot_is_not_ranked_over_all(run):
    records = [run(solver, 50, robot=robot) for solver in "ab" for robot in ("arm", "leg")]
    records += [run("slow", 100), run("slow", 2, begun=3, robot="leg")]
    table = over_all(Results(records))
    assert by_solver(table, "mark")["slow"] == "cut at 123 of 240"
    assert column(table, "solver").index("slow") in table.unranked
    assert "slow" not in table.summary.points[0]


def test_the_map_has_a_field_for_each_robot_that_a_solver_takes(run, cut):
    results = Results([run("a", MANY), run("a", MANY, robot="leg"),
                       run("b", MANY, seconds=1e-2)])  # fmt: skip
    table = robot_by_robot(results)
    assert column(table, "time relative to fastest") == pytest.approx([1.0, 100.0, 1.0])
    heat_map = FIGURES[0]
    svg = drawn(heat_map(results)).svg
    assert (
        svg.count(">100<") == 4
    )  # three shares of 100 %, and a time of 100 relative to the fastest
    assert drawn(heat_map(cut)).svg.count("*<") == 2  # both fields of who was cut short
    assert [figure(Results([])) for figure in FIGURES] == [None] * 6


def test_who_is_missing_or_cannot_is_listed_with_the_reason(make):
    entrant = make.entered(make.raced("Mine", ONE, robot="leg"))
    refused = make.lacking("Mine", ONE, "not asked for this robot")
    refused.settings["version"] = "1"
    results = Results([
        make.raced("Plumbob LM", ONE), make.raced("Plumbob LM, 100 restarts", AGAIN, robot="leg"),
        make.lacking("pink", ONE, "pink is not installed"), entrant, refused,
    ])  # fmt: skip
    table = participants(results)
    assert by_solver(table, "version") == {
        "Plumbob LM": "1.2", "pink": "not installed", "Mine": "1.0"
    }  # fmt: skip
    assert list(by_solver(table, "robots").values()) == ["all 2 robots", "", "the leg"]
    assert by_solver(table, "remark")["Mine"] == "every robot: not asked for this robot"
    assert table.summary.sentence.startswith("2 of 3 that were asked took part; not asked: Pinoc")
    assert table.summary.points == ("the arm: 7 joints, pose of hand",
                                    "the leg: 7 joints, pose of hand")  # fmt: skip
    measured = column(robot_by_robot(results), "solver")
    assert measured == ["Plumbob LM", "Mine", "Plumbob LM, 100 restarts"]


def test_the_paces_beside_the_records_tell_whether_robots_were_timed_in_peace(make):
    def measured(paces):
        records = [make.raced(solver, ONE) for solver in "abc"]
        for record, pace in zip(records, paces, strict=True):
            record.conditions["pace"] = pace
        return robot_by_robot(Results(records)).measured

    assert "steady within the 5 %" in measured([1e-4, 1.01e-4, 1e-4])
    assert "too noisy for the 5 %" in measured([1e-4, 1.5e-4, 1e-4])
    assert "noisy" not in robot_by_robot(Results([make.raced("a", ONE)])).measured


def published(results, problem, quantity):
    """The rows on a problem and a quantity: solver, published, here, mark."""
    rows = published_ik(results).rows
    return [(row[2], *row[4:7]) for row in rows if (row[1], row[3]) == (problem, quantity)]


@pytest.mark.parametrize(("size", "share", "mark"), [(2, 50.0, ""), (4, 25.0, "cut at 2 of 4")])
def test_published_numbers_stand_beside_those_measured_here(make, size, share, mark):
    """Targets that were never begun count as not solved."""
    results = Results([replace(record, size=size) for record in make.republished()])
    assert published(results, "ur5", "solved [%]") == [
        ("KDL", 35.89, None, ""),
        ("KDL with restarts", 88.71, None, ""),
        ("TRAC-IK, 5 ms", 99.62, share, mark),
    ]
    infeasible = ("ik_LM, NR", 11.0, 100.0 - share, mark)
    assert published(results, "ur5", "declared infeasible [%]") == [infeasible]
    assert published(results, "reachable", "iterations, mean") == [("FABRIK", 15.5, 5.0, "")]
    assert published(results, "unreachable", "iterations, largest") == [("FABRIK", None, 6.0, "")]
    text = markdown(published_ik(results))
    assert "jhavl/dkt at 1155dcb" in text
    assert "TRAC-IK README, v1.1.0" in text
    assert published_ik(results).summary.points[0].endswith(mark)
