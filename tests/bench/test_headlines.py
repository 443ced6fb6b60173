"""The first screen's answers: who leads by what, who else wins, who was absent, which scale."""

import re
from dataclasses import replace

import numpy as np
import pytest

from plumbob.bench.experiments import timing
from plumbob.bench.measure import metrics
from plumbob.bench.measure.record import FINISHED
from plumbob.bench.page import headlines
from plumbob.bench.page.standings import in_percent
from plumbob.bench.peers import catalogue
from plumbob.bench.ranking.scores import STARTS, overall
from plumbob.bench.tables.layout import source
from plumbob.bench.tables.results import Results

OURS = "Plumbob LM, first phase"
WRITTEN = "Plumbob LM (first phase, ours)"

N = 200
KINEMATICS = "Fastest in forward kinematics"
NOBODY = "In forward kinematics, no engine is the fastest beyond chance (1 case)."
MOST, FASTEST = "Most poses solved, yours, one start", "Fastest, yours, one start"


@pytest.fixture
def run(make):
    """What makes a record of N targets, the first so many of them solved."""

    def made(solver, solved, seconds=1e-5, **more):
        return make.solving(solver, solved, seconds=seconds, **more)

    return made


def sentence(records, question):
    (found,) = [h for h in headlines.headlines(Results(records)) if h.question == question]
    return found.sentence


def wins(records):
    return [win.sentence for win in headlines.wins_of_others(Results(records))]


@pytest.mark.parametrize(("first", "second"), [(OURS, "pink"), ("pink", OURS)])
def test_the_best_and_the_best_other_are_named_and_ours_are_marked(run, first, second):
    """Plumbob takes part like everyone else; where another beats it, a sentence of its own."""
    marked = {OURS: f"{WRITTEN}"}
    best, other = marked.get(first, first), marked.get(second, second)
    records = [run(first, 190, 1e-4), run(second, 100, 1e-4)]
    assert sentence(records, MOST) == (
        f"On the arm, from one start, {best} solves the most poses: 95 % of 200; the best other "
        f"solver is {other} with 50 %."
    )
    more = f"pink solves more than {WRITTEN}, one start, yours, on 1 of 1 case (the arm), by 45 "
    tables = ("Robots: all robots and strata together", "Each robot: success, time and accuracy")
    for table in tables:
        line = f"{more}percentage points (“solved” in “{table}”)."
        assert (line in wins(records)) == (first == "pink")
    assert (wins(records) == []) == (first != "pink")


def test_only_what_chance_would_not_do_as_much_leads_or_wins(run):
    near = [run("a", 190), run(OURS, 188), run("c", 20)]
    assert sentence(near, MOST).endswith(f" {WRITTEN} with 94 %, a tie within chance.")
    assert sentence([*near, run("d", 189)], MOST).endswith(", and 3 solvers tie within chance.")
    assert wins(near) == []
    again = [*near, run(f"{OURS}, plain call", 189)]
    assert sentence(again, MOST).endswith(", a tie within chance.")


def test_of_solvers_that_solve_as_much_the_fastest_is_named_first(run):
    """Not the host, whose records are the first."""
    records = [run(OURS, N, 2e-4), run("mink", N, 3e-4), run("pink", N, 1e-4)]
    assert sentence(records, MOST) == (
        f"On the arm, from one start, pink and {WRITTEN} solve the most poses: each 100 % of "
        "200, and 3 solvers tie within chance."
    )


def test_the_share_within_a_time_counts_the_timed_poses_that_are_solved_in_it(run):
    """Half of ours are solved in 20 µs, the rest in 0.2 ms; pink is slower and solves fewer."""
    times = np.where(np.arange(N) % 2, 2e-5, 2e-4)
    records = [run(OURS, N, seconds=times), run("pink", 150, seconds=6e-4), run("slow", N, 1.0)]
    assert sentence(records, "Solved within a time, yours, one start") == (
        f"On the arm, from one start, within 100 µs {WRITTEN} solves 50 % of the poses and pink, "
        f"the best other solver, 0 %; within 1,000 µs {WRITTEN} solves 100 % of the poses and "
        "pink, the best other solver, 75 % (n = 200)."
    )


def test_the_most_solved_share_of_several_seeds_is_their_mean_with_its_span(make):
    """Targets of the seeds alternate, six strata at a time: the second seed has none solved."""
    solved = np.arange(240) // 6 % 2 == 0
    strata = [f"kind {k}" for k in range(6)]
    records = [
        replace(record.with_measured(strata=strata), settings={**record.settings, "seeds": 2})
        for record in (
            make.solving("a", 240, count=240, solved=solved),
            make.solving("b", 24, count=240),
        )
    ]  # fmt: skip
    assert "a solves the most poses: 50 % of 240, 0 to 100 by seed;" in sentence(records, MOST)
    (row,) = (score for score in overall(Results(records)) if score.solver == "a")
    assert row.shares_by_seed == [1.0, 0.0]
    assert row.mean_times_by_seed == pytest.approx([1e-3, 0.1])


def test_our_loop_on_an_engine_and_our_other_solvers_are_nobodys_rivals(run):
    loop, again = "our closed loop on Pinocchio", "Plumbob LM, 14 restarts"
    records = [
        run(OURS, 150),
        run(again, 140),
        run(loop, 130),
        run("pink", 20),
    ]
    for question in (MOST, FASTEST):
        assert "pink" in sentence(records, question)
        assert loop not in sentence(records, question)
    ahead = [run(loop, 199, 1e-6), run(OURS, 20, 1e-3), run("pink", 30, 1e-3)]
    assert sentence(ahead, MOST).startswith("On the arm, from one start, pink solves the most")
    assert not any(loop in win for win in wins(ahead))


def test_solvers_are_compared_where_most_pairs_of_robot_and_solver_are(run):
    records = [run(s, 150, robot=r) for s in ("a", "b") for r in ("arm", "ur5", "hand")]
    ours = [r for r in records if r.problem != "robots/ur5"]
    assert sentence(ours, MOST).startswith("On all 2 robots, from one start, a ")
    assert "of 400" in sentence(ours, MOST)
    one = [run("c", 199, robot="arm")]
    assert "of 400" in sentence([*ours, *one], MOST)  # 2 x 2 pairs against 3
    both = [*one, run("c", 199, robot="hand"), run("d", 10, robot="hand")]
    assert "c solves the most poses: 99.5 % of 400" in sentence([*ours, *both], MOST)


def test_robots_that_no_setting_has_seen_come_first_and_are_never_mixed_with_others(run):
    """Nor are one start and restarts."""
    hits = {"ur5": 190, "ur10": 100, "z1": 100, "character": 3}
    records = [
        run(solver, count, robot=robot, kind=kind)
        for robot, count in hits.items() for solver in ("a", "b") for kind in STARTS
    ]  # fmt: skip
    made = headlines.headlines(Results(records))
    groups = [h.question.split(", ", 1)[1] for h in made if h.question.startswith("Most")]
    assert groups == [f"{g}, {start}" for g in ("held out", "tuning") for start in STARTS[::-1]]
    assert all(h.sentence.startswith("On all 2 robots held out, with restarts, ") for h in made[:3])
    assert "50 % of 400" in made[2].sentence
    assert "95 % of 200" in sentence(records, "Most poses solved, tuning, restarts")


def test_a_solver_of_the_user_leads_where_it_is_the_best(run):
    """The first screen favours nobody: not even Plumbob."""
    mine = run("Mine", 199, 1e-6, mine=True)
    records = [run(OURS, 100, 1e-3), mine, run("pink", 90, 1e-3)]
    for question in (MOST, FASTEST):
        assert ", Mine " in sentence(records, question)
        assert f"{WRITTEN}" in sentence(records, question)
    lines = [win for win in wins(records) if win.startswith("Mine ")]
    assert len(lines) == 5  # shares and times of all robots, of each, and where both solve


def test_a_solver_that_solves_nothing_leads_and_ties_nowhere(run):
    """On few targets chance tells six solved from none as little as from six."""
    records = [run(s, n, np.full(6, 1e-3), size=6) for s, n in (("a", 3), ("b", 0), ("c", 1))]
    assert sentence(records, MOST).endswith("is c with 16.7 %, a tie within chance.")
    assert "b" not in re.findall(r"\b[abc]\b", sentence(records, FASTEST))


def test_the_fastest_leads_by_a_factor_over_the_best_other(run):
    spread = np.geomspace(1.0, 1.2, N)
    records = [run("a", N, 1e-3 * spread), run("b", N, 4e-3 * spread[::-1])]
    assert sentence(records, FASTEST) == (
        "On the arm, from one start, a is the fastest of the solvers that solve the most: it is "
        "4.0 times faster than b, the next."
    )
    hasty = [run("a", 190, 1e-4), run("hasty", 5, 1e-6), run("b", 190)]
    assert ", b is the fastest of the solvers that solve the most" in sentence(hasty, FASTEST)
    noise = np.exp(np.random.default_rng(0).normal(0.0, 1.0, (2, N)))
    near = [run(s, N, 1e-5 * times) for s, times in zip("ab", noise, strict=True)]
    assert "within chance" in sentence(near, FASTEST)


def test_a_miss_costs_no_time_and_a_solver_that_is_faster_where_both_solve_wins(run):
    """A penalty for misses would hide it: Plumbob solves twice as many."""
    records = [
        run(OURS, N, 3e-4),
        run("pink", 100, 1e-4),
        run("mink", 100, 2e-4),
    ]
    assert sentence(records, FASTEST) == (
        f"On the arm, from one start, {WRITTEN} solves more poses than any other solver and "
        "is, where both solve, 3.0 times slower than pink, the fastest other one there."
    )
    assert wins(records) == [
        f"pink is faster than {WRITTEN}, one start, yours, on 1 of 1 case (the arm), by a factor "
        "of 3.0 (“time relative to ours, where both solve” in “Each robot: success, time and "
        "accuracy”)."
    ]


def test_a_share_is_never_rounded_to_all():
    assert in_percent(metrics.Share(99_999, 100_000, 0.9, 1.0)) == "99.999 %"
    assert in_percent(metrics.Share(5, 5, 0.9, 1.0)) == "100 %"


def in_sweeps(make, solver, rounds):
    made = make.timed(solver, 1.0)
    return made.with_measured(seconds=rounds)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("factor", [1.2, 1.0])
def test_headline_and_table_name_the_same_leader_by_the_same_medians(make, factor, seed):
    """A drift that both share hides no difference: only its intervals overlap."""
    rng = np.random.default_rng(seed)
    drift = 1e-6 * rng.lognormal(0.0, 0.5, (9, 1)) * rng.lognormal(0.0, 0.1, (9, 3))
    slower = factor * drift * rng.lognormal(0.0, 0.02, (9, 3))
    records = [in_sweeps(make, "Pinocchio", drift), in_sweeps(make, "Plumbob, compiled", slower)]
    table = timing.kinematics(Results(records))
    (point,) = table.summary.points
    if factor == 1.0:
        assert "in a tie with" in point
        assert sentence(records, KINEMATICS) == NOBODY
        assert wins(records) == []
    else:
        assert point.endswith("first: Pinocchio")
        medians = [row[table.columns.index(median_of(table))] for row in table.rows]
        ratio = f"{medians[1] / medians[0]:.1f}"
        assert sentence(records, KINEMATICS) == (
            f"In forward kinematics, Pinocchio is the fastest on 1 of 1 case, {ratio} times faster "
            "than the best other engine, Plumbob (ours)."
        )
        assert wins(records) == [
            "Pinocchio is faster than Plumbob (compiled, ours), one pose a call, on 1 of 1 case "
            f"(10 balls, one pose a call), by a factor of {ratio} (“median” in “Time of forward "
            "kinematics, for one pose”)."
        ]


def test_of_two_calls_of_ours_the_faster_one_races(make):
    """They tie with nobody but each other."""
    rounds = np.linspace(1e-6, 1.1e-6, 27).reshape(9, 3)
    calls = {"Plumbob, compiled": 1.0, "Plumbob, prepared": 1.0, "Pinocchio": 2.0}
    records = [in_sweeps(make, call, factor * rounds) for call, factor in calls.items()]
    assert "Plumbob (ours) is the fastest on 1 of 1 case, 2.0 times" in sentence(
        records, KINEMATICS
    )
    assert wins(records) == []
    slow = in_sweeps(make, "Plumbob, prepared", 3.0 * rounds)
    records = [records[0], slow, in_sweeps(make, "Pinocchio", 0.5 * rounds)]
    assert "by a factor of 2.0 " in wins(records)[0]


def median_of(table):
    return next(column for column in table.columns if column.title == "median")


def test_without_rivals_there_is_no_headline(make):
    """Plain Python, the memory bound and loops of ours on engines are no rivals of Plumbob."""
    names = (catalogue.PLAIN.name, catalogue.LIMIT_NAME, "Plumbob, compiled")
    engines = ("Pinocchio", "MuJoCo", "Plumbob, compiled")
    for records in (
        [make.timed(name, 1e-7) for name in names],
        [make.timed(name, 1e-7, "ik", "near", "LM") for name in engines],
        [make.worked("Plumbob Newton", error=(1e-3, 1e-9))],
    ):
        assert headlines.headlines(Results(records)) == []
    assert headlines.overview(Results([])) == (None, [], "", [], [], [])


def test_an_engine_races_at_its_default_tolerance(make):
    rounds, step = np.linspace(1e-6, 1.1e-6, 27).reshape(9, 3), ("cloth", "x1", "linearised once")
    factors = {"Plumbob, compiled": 2.0, "MuJoCo": 1.0, "MuJoCo, tolerance 1e-15": 3.0}
    made = {solver: make.timed(solver, 1.0, *step) for solver in factors}
    records = [
        made[solver].with_measured(seconds=factor * rounds) for solver, factor in factors.items()
    ]
    assert sentence(records, "Fastest in a step of a cloth") == (
        "In a step of a cloth, MuJoCo is the fastest on 1 of 1 case, 2.0 times faster than the "
        "best other engine, Plumbob (ours)."
    )
    first = records[2].with_measured(seconds=0.1 * rounds)
    assert sentence([*records[:2], first], "Fastest in a step of a cloth") == sentence(
        records, "Fastest in a step of a cloth"
    )


def test_a_step_is_solved_first_by_an_engine(make):
    newton = make.worked("Plumbob Newton", error=(1e-3, 1e-9), seconds=(1e-3, 2e-3))
    hasty = make.worked("MuJoCo Euler", error=(0.5, 0.4))
    question = "Fastest in a step solved to 1e-4"
    assert headlines.headlines(Results([newton, hasty])) == []  # nobody else solves it
    arrives = make.worked("MuJoCo discrete", error=(0.5, 1e-8), seconds=(1e-3, 8e-3))
    factor = (
        "In a step solved to 1e-4, Plumbob (ours) is the fastest on 1 of 1 cloth, 4.0 times faster "
        "than the best other engine, MuJoCo"
    )
    assert sentence([newton, hasty, arrives], question) == f"{factor}."
    stiff = [make.worked(r.solver, 1e4).with_measured(**r.numbers()) for r in (newton, hasty)]
    assert sentence([newton, arrives, *stiff], question) == (
        factor.replace("1 of 1 cloth", "2 of 2 cloths") + "; no other engine solves 1 of them."
    )
    mine = make.worked("Mine", error=(1e-3, 1e-9), seconds=(1e-4, 2e-4))
    assert ", Mine is the fastest" in sentence([newton, mine], question)
    title = "One implicit step of a falling cloth: time to the minimiser"
    assert wins([newton, mine]) == [
        "Mine is faster than Plumbob Newton (ours) on 1 of 1 cloth (20 × 20, 1,000 N/m), by a "
        f"factor of 10 (“time to {target}” in “{title}”)."
        for target in ("1e-4", "1e-2")
    ]


def test_the_verdict_names_the_claim_with_the_narrowest_margin(make):
    wide, narrow = make.claim("wide"), make.claim("narrow")
    narrow.measured["difference"] = np.array(9e-13)
    found = headlines.verdict(Results([wide, narrow, make.claim("broken", held=False)]))
    assert found == headlines.ClaimCount(2, 3, "narrow", pytest.approx(0.9))
    assert headlines.verdict(Results([])) is None


def test_peers_without_a_measurement_are_absent_or_were_not_asked(make, run):
    records = [
        run("pink", 1),
        run(OURS, 1),
        make.lacking("mink", "one start", ""),
    ]
    missing = make.record("cloth", "peers/all", "mujoco", facts={"task": "missing"})
    results = Results([*records, make.worked("Plumbob Newton"), missing])
    assert headlines.absent(results) == ["mink", "MuJoCo (cloth)"]
    found = headlines.not_asked(results)
    assert not {"pink", "Plumbob LM", "mink"} & set(found)
    assert "TRAC-IK" in found
    engines = dict.fromkeys(peer.engine for peer in catalogue.cloth_peers())
    assert [name for name in found if name.endswith("(cloth)")] == [
        f"{engine} (cloth)" for engine in engines if engine not in (catalogue.PLUMBOB, "MuJoCo")
    ]
    assert headlines.absent(Results([])) == headlines.not_asked(Results([])) == []


def test_a_sentence_on_other_solvers_counts_those_that_were_not_installed(make, run):
    """Of this task: a cloth engine is no solver of robots."""
    records = [run("Plumbob LM", 190), run("pink", 100), make.lacking("mink", "one start", "")]
    missing = make.record("cloth", "peers/all", "mujoco", facts={"task": "missing"})
    absence = "; 1 other was not installed."
    assert sentence([*records, missing], MOST).endswith(f" is pink with 50 %{absence}")
    records += [make.lacking(name, "one start", "") for name in ("DART", "ikpy")]
    assert sentence(records, MOST).endswith("; 3 others were not installed.")
    assert sentence(records[:2], MOST).endswith(" is pink with 50 %.")


def test_the_scale_gives_the_number_of_targets_if_there_are_records(make, run):
    quick = make.record(FINISHED, "ik", "", notes={"scale": "quick"})
    scale = headlines.scale(Results([quick, run("a", 1)]))
    assert scale == "Quick run: 100 targets of each kind"


def test_a_paired_ratio_holds_the_factor_and_a_single_pair_leaves_it_open():
    found = metrics.paired_ratio(np.array([2.0, 8.0, np.nan]), np.array([1.0, 2.0, 1.0]))
    assert found.value == pytest.approx(np.sqrt(8.0))
    assert found.low < 1.0 < found.high
    assert metrics.paired_ratio(np.array([2.0]), np.array([1.0])) == (2.0, 0.0, np.inf)
    many = metrics.paired_ratio(np.full(50, 3.0), np.ones(50))
    assert many.low == pytest.approx(3.0)


def test_a_row_says_what_measures_it_again(make, run):
    record = run("our closed loop on Pinocchio", 1)
    command = "plumbob bench ik --solver 'our closed loop on Pinocchio' --problem robots/arm"
    assert source(record).command == command
    assert source((record, 3)).command == command
    many = [run(name, 1) for name in "abcd"]
    assert source(many).command == "plumbob bench ik --problem robots/arm"
    assert source(make.lacking("pink", "one start", "not installed")).command == ""
    assert source("no record").command == ""


def test_a_solver_cut_short_is_not_ranked(run):
    cut = run("slow", 3, seconds=[1.0, 1.0, 1.0])
    records = [run("a", 150), run("b", 20), cut]
    for question in (MOST, FASTEST):
        assert "slow" not in sentence(records, question)
        assert sentence(records, question).startswith("On the arm, from one start, a solves ")
    assert headlines.headlines(Results([records[0], cut])) == []


def test_the_faster_of_two_comes_first_with_the_ratio_and_its_interval_inverted():
    ratio = metrics.Interval(0.5, 0.4, 0.8)
    first, second, inverted = headlines._in_order("a", "b", ratio)
    assert (first, second, inverted) == ("b", "a", (2.0, 1.25, 2.5))
    assert headlines._in_order("b", "a", inverted) == ("b", "a", inverted)
