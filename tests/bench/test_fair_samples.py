"""Fair samples: every solver of a table is scored over the same targets, however slow it is."""

import numpy as np
import pytest

from plumbob.bench.experiments.robots import tables as robots
from plumbob.bench.figures.sketch import drawn
from plumbob.bench.harness.results import Results
from plumbob.bench.tables.table import best_cells

KIND = "one start"
ONE = robots.OF_KIND[KIND]
MANY = 120


def column(table, heading):
    index = [c.heading for c in table.columns].index(heading)
    return [row[index] for row in table.rows]


def shares(table, heading):
    return [(share.hits, share.total) for share in column(table, f"{heading} (95 % interval)")]


@pytest.fixture
def run(make):
    """What makes a record of the first `begun` of all targets, `hits` of them solved."""

    def made(solver, hits, begun=MANY, size=MANY, seconds=1e-4, robot="arm", **more):
        solved = np.arange(begun) < hits
        arrays = {
            "solved": solved, "claimed": solved.astype(int), "stratum": np.arange(begun) % 2,
            "seconds": np.full(begun, seconds), "position": np.where(solved, 1e-9, 0.5),
            "rotation": np.zeros(begun), "beyond": np.zeros(begun),
        } | {name: np.resize(values, begun) for name, values in more.items()}  # fmt: skip
        return make.raced(solver, KIND, robot=robot, size=size, **arrays)

    return made


@pytest.fixture
def cut(run):
    """A solver that leads its first three targets, and one that solves most of all."""
    return Results([run("slow", 2, begun=3, seconds=0.5), run("steady", 60)])


def test_a_solver_cut_by_its_budget_is_scored_over_all_targets_and_says_so(cut):
    table = ONE.success(cut)
    assert shares(table, "solved") == [(60, MANY), (2, MANY)] or shares(table, "solved") == [
        (2, MANY), (60, MANY),
    ]  # fmt: skip
    assert set(column(table, "mark")) == {"", "cut at 3 of 120"}
    assert "not ranked" in table.shows


def test_a_solver_cut_by_its_budget_never_leads(cut):
    for table in (ONE.success(cut), ONE.budgets(cut), ONE.profiles(cut)):
        said = " ".join(table.summary.points)
        assert "steady" in said, table.name
        assert "slow" not in said, table.name
    table = ONE.success(cut)
    best = {(row, table.columns[j].title) for row, j in best_cells(table)}
    row = column(table, "solver").index("steady")
    assert {at for at, _ in best} <= {row}


def test_strata_curves_and_profiles_count_what_was_never_begun(cut):
    table = ONE.strata(cut)
    row = column(table, "solver").index("slow")
    assert shares(table, "joint space")[row] == (1, MANY // 2)
    assert shares(table, "space")[row] == (1, MANY // 2)
    table = ONE.budgets(cut)
    assert column(table, "within 100 ms [%]")[column(table, "solver").index("steady")] == 50.0
    table = ONE.profiles(cut)
    row = column(table, "solver").index("slow")
    assert table.rows[row][-1] == pytest.approx(0.0)  # 5,000 times the fastest
    assert len(table.rows) == 2


def test_records_of_other_targets_are_marked_and_not_ranked(run):
    results = Results([run("few", 30, begun=30, size=30), run("a", 90), run("b", 80)])
    table = ONE.success(results)
    assert sorted(column(table, "mark")) == ["", "", "other targets, 30"]
    assert "few" not in " ".join(table.summary.points)
    assert "few" not in column(ONE.profiles(results), "solver")


def test_beyond_a_limit_missed_wrong_claim_and_no_answer_are_apart(run):
    arrays = {
        "position": [1e-9, 1e-9, 0.5, 0.5, np.nan, 1e-9],
        "beyond": [0.0, 0.3, 0.0, 0.9, np.nan, 0.0],
        "claimed": [1, 1, 1, 0, 0, 1],
        "rotation": [0.0, 0.0, 0.0, 0.0, np.nan, 0.9],
    }
    (row,) = ONE.outcomes(Results([run("a", 1, begun=6, size=8, **arrays)])).rows
    assert row[2:] == (1, 1, 2, 1, 0, 1, 2, 8)


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
    made = make.raced("a", KIND, size=int(begun + never), **arrays)
    (row,) = ONE.outcomes(Results([made])).rows
    assert sum(row[2:-1]) == row[-1] == begun + never
    assert row[2] == np.count_nonzero(arrays["solved"])
    assert row[3] == np.count_nonzero(near & (arrays["beyond"] > 1e-6))


def test_a_solvers_own_false_claims_stand_in_the_main_table(run):
    table = ONE.success(Results([run("a", 100, claimed=[1])]))
    (heading,) = [c for c in table.columns if c.title == "claimed but not so"]
    assert not heading.folded
    assert column(table, "claimed but not so") == [20]


@pytest.mark.parametrize("name", robots.Tables._fields)
def test_no_more_than_six_columns_are_shown_unasked(run, name):
    table = getattr(ONE, name)(Results([run("a", 100)]))
    limit = 8 if name in ("outcomes", "profiles") else 6  # these are no main tables
    assert sum(not c.folded for c in table.columns) <= limit


def test_a_headline_names_the_ties_its_interval_and_its_n(run):
    points = ONE.success(Results([run("a", 118), run("b", 117), run("c", 60)])).summary.points
    assert points[0].startswith("the arm: a, in a tie with b, 118/120 = 98.3 % (94.1–99.5); ")
    points = ONE.success(Results([run("a", 118), run("c", 60)])).summary.points
    assert points[0].startswith("the arm: a, 118/120 = 98.3 % (94.1–99.5); ")


def test_times_lead_only_where_the_same_targets_tell_them_apart(run, rng):
    hard = 1e-4 * rng.lognormal(0.0, 2.0, MANY)
    fast, slow = run("fast", MANY, seconds=1.0), run("slow", MANY)
    fast.arrays["seconds"], slow.arrays["seconds"] = hard, 1.05 * hard
    (point,) = ONE.success(Results([slow, fast])).summary.points
    assert "least time fast, " in point
    slow.arrays["seconds"] = rng.permutation(hard)
    (point,) = ONE.success(Results([slow, fast])).summary.points
    assert "in a tie with" in point.partition("least time")[2]


@pytest.fixture
def missed(make):
    """What makes a record of three targets out of reach, of either kind."""

    def made(solver, position, beyond=(0.0,) * 3, kind=KIND):
        arrays = {
            "solved": [False] * 3, "claimed": [0] * 3, "stratum": [0] * 3, "seconds": [1e-4] * 3,
            "rotation": [1.0] * 3, "position": position, "beyond": beyond,
            "bound": [0.1, 0.1, 0.1],
        }  # fmt: skip
        return make.raced(solver, kind, "unreachable", size=3, **arrays)

    return made


def test_out_of_reach_the_best_known_answer_is_that_of_any_solver_within_limits(missed):
    results = Results([
        missed("a", [0.5, 0.5, 0.5]),
        missed("b", [0.4, 0.6, 0.5], beyond=[0.3, 0.0, 0.0]),
        missed("c", [0.9, 0.9, 0.2], kind="restarts"),
    ])  # fmt: skip
    table = ONE.unreachable(results)
    assert column(table, "beyond the best known, median [m]") == pytest.approx([0.0, 0.2])
    assert column(table, "beyond the best known, largest [m]") == pytest.approx([0.3, 0.3])
    assert column(table, "beyond the lower bound, median [m]") == pytest.approx([0.4, 0.45])
    assert column(table, "answers within limits") == [3, 2]


def test_over_all_robots_every_target_counts_once(run):
    table = ONE.overall(Results([run("a", 118), run("a", 60, robot="leg"), run("b", 119),
                                 run("b", 20, robot="leg")]))  # fmt: skip
    assert column(table, "over") == ["all 2 robots"] * 2
    assert shares(table, "solved") == [(178, 240), (139, 240)]
    # 178 of 1e-4 s and 62 of the penalty of 0.1 s, each and the result shifted by 1e-5 s
    mean = np.exp((178 * np.log(1.1e-4) + 62 * np.log(0.10001)) / 240) - 1e-5
    assert column(table, "time, geometric mean [µs]")[0] == pytest.approx(1e6 * mean, rel=1e-12)
    low, high = (column(table, f"time, 95 % {end} [µs]")[0] for end in ("from", "to"))
    assert low < 1e6 * mean < high
    (point,) = table.summary.points
    assert point.startswith("all 2 robots: a, 178/240 = 74.2 % (68.3–79.3); least time a, ")
    assert point.endswith("n = 240)")
    assert column(table, "mark") == ["most solved, least time", ""]


def test_solvers_are_compared_over_robots_that_all_of_them_take(run):
    table = ONE.overall(Results([run("a", 100), run("a", 9, robot="leg"), run("b", 120)]))
    rows = list(zip(column(table, "over"), column(table, "solver"), strict=True))
    assert rows == [("all 2 robots", "a"), ("the arm", "a"), ("the arm", "b")]
    assert table.summary.points[1].startswith("the arm: b, 120/120")


def test_who_is_cut_on_one_robot_is_not_ranked_over_all(cut, run):
    table = ONE.overall(Results([*cut.records, run("fine", 50)]))
    row = column(table, "solver").index("slow")
    assert column(table, "mark")[row] == "cut at 3 of 120"
    assert shares(table, "solved")[row] == (2, MANY)
    assert "slow" not in table.summary.points[0]
    assert row in table.unranked


def test_a_tie_over_all_robots_is_marked_as_one(run):
    table = ONE.overall(Results([run("a", 118), run("b", 117), run("c", 20)]))
    marks = dict(zip(column(table, "solver"), column(table, "mark"), strict=True))
    assert "most solved (tie)" in marks["a"]
    assert "most solved (tie)" in marks["b"]
    assert marks["c"] == ""


def test_the_map_has_a_field_for_each_robot_that_a_solver_takes(run):
    results = Results([run("a", MANY), run("a", MANY, robot="leg"),
                       run("b", MANY, seconds=1e-2)])  # fmt: skip
    table = ONE.map(results)
    assert [row[0] for row in table.rows] == ["a", "b"]
    assert [share and share.hits for share in table.rows[1][1:3]] == [MANY, None]
    assert column(table, "the arm, times the least time") == pytest.approx([1.0, 100.0])
    assert column(table, "the leg, times the least time")[1] is None
    (draw,) = ONE.map.figures
    svg = drawn(draw(results)).svg
    assert svg.count(">100<") == 4  # three shares of 100 %, and 100 times the least time
    assert draw(Results([])) is None
    assert table.summary.sentence.endswith("(n = 240 targets of 2 robots):")
    assert table.summary.points == ("a: on 2", "b: on 1")


def test_the_map_marks_who_was_cut_short(cut):
    table = ONE.map(cut)
    cuts = dict(zip(column(table, "solver"), column(table, "cut on"), strict=True))
    assert cuts == {"slow": "the arm", "steady": ""}
    (draw,) = ONE.map.figures
    assert drawn(draw(cut)).svg.count("*<") == 2
    assert table.summary.points == ("steady: on 1",)
