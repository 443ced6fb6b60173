"""The first screen's answers: who leads by what, what ties, who was absent, at which scale."""

from dataclasses import replace

import numpy as np
import pytest

from plumbob.bench.experiments.timing import tables as timing
from plumbob.bench.harness import metrics
from plumbob.bench.harness.record import FINISHED
from plumbob.bench.peers import registry
from plumbob.bench.report import headlines
from plumbob.bench.tables.layout import source
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.table import words

N = 200
ACCURATE, FASTEST = "Most accurate, one start", "Fastest, one start"


@pytest.fixture
def run(make):
    """What makes a record of N targets, the first so many of them solved."""

    def made(solver, solved, seconds=1e-5, **more):
        return make.solving(solver, solved, seconds=seconds, **more)

    return made


def headline(records, question, chapter="kinematics"):
    (found,) = [h for h in headlines.headlines(Results(records))
                if (h.question, h.chapter) == (question, chapter)]  # fmt: skip
    return found


def test_the_most_accurate_leads_alone_only_where_chance_would_not_do_as_much(run):
    far = [run("a", 190), run("b", 100)]
    answer, detail = headline(far, ACCURATE)[2:4]
    assert answer == "a"
    assert detail.startswith("95 % of 200 poses solved (91–97.3) on the arm, ")
    near = [run("a", 190), run("b", 188), run("c", 20)]
    assert headline(near, ACCURATE).answer == "Tie: a and b"
    assert headline([*near, run("d", 189)], ACCURATE).answer == "Tie: 3 solvers"


def test_a_solver_cut_short_is_not_ranked(run):
    cut = run("slow", 3, seconds=[1.0, 1.0, 1.0])
    records = [run("a", 150), run("b", 20), cut]
    for question in (ACCURATE, FASTEST):
        answer, detail = headline(records, question)[2:4]
        assert answer == "a"
        assert " on the arm, " in detail
        assert detail.endswith("among the 2 of 3 solvers that finished")
        assert "slow" not in detail
    assert headlines.headlines(Results([records[0], cut])) == []


def test_solvers_are_compared_on_robots_on_which_most_of_them_can_be(run):
    records = [run(s, 150, robot=r) for s in ("a", "b") for r in ("arm", "ur5", "hand")]
    assert "of 600 poses solved" in headline(records, ACCURATE).detail
    chains = [run("c", 199, robot=r) for r in ("arm", "ur5")]
    detail = headline([*records, *chains], ACCURATE).detail
    assert "of 400 poses solved" in detail
    assert detail.endswith(", of 3 solvers")
    arms = [run("d", 199, robot="arm")]
    assert headline([*records, *chains, *arms], ACCURATE).detail.endswith(
        "on the arm, of 4 solvers")  # fmt: skip


def test_one_start_and_restarts_have_headlines_of_their_own(run):
    """The best from one start is not the best where solvers may start again."""
    records = [run("a", 190), run("b", 20)]
    records += [run(s, n, kind="restarts") for s, n in (("a, again", 20), ("b, again", 199))]
    assert headline(records, ACCURATE).answer == "a"
    restarts = headline(records, "Most accurate, restarts")
    assert (restarts.answer, restarts.table) == ("b, again", "robots_overall")


def test_a_solver_of_the_user_leads_where_it_is_the_best(run):
    """The first screen favours nobody: not even Plumbob."""
    mine = run("Mine", 199, 1e-6)
    mine.facts["entrant"] = True
    records = [run("Plumbob LM", 100, 1e-3), mine, run("pink", 90, 1e-3)]
    assert headline(records, ACCURATE).answer == headline(records, FASTEST).answer == "Mine"


def test_a_solver_that_solves_nothing_ties_with_nobody(run):
    """On few targets chance tells six solved from none as little as from six."""
    records = [run(s, n, np.full(6, 1e-3), size=6) for s, n in (("a", 3), ("b", 0))]
    assert headline(records, ACCURATE).answer == headline(records, FASTEST).answer == "a"


def test_the_fastest_leads_by_a_factor_with_its_interval_and_count(run):
    spread = np.geomspace(1.0, 1.2, N)
    records = [run("a", N, 1e-3 * spread), run("b", N, 4e-3 * spread[::-1])]
    answer, detail = headline(records, FASTEST)[2:4]
    assert answer == "a"
    # 4, but for the shift of 10 µs
    assert detail == "3.97 times faster than b (3.91–4.03) on the arm, failures penalised"


def test_who_is_no_faster_beyond_chance_ties(run):
    noise = np.exp(np.random.default_rng(0).normal(0.0, 1.0, (2, N)))
    records = [run(s, N, 1e-5 * of) for s, of in zip("ab", noise, strict=True)]
    answer, detail = headline(records, FASTEST)[2:4]
    assert answer.startswith("Tie: ")
    assert detail.startswith("too near to tell")


def test_a_solver_that_fails_fast_is_not_the_fastest(run):
    records = [run("a", 190, 1e-4), run("hasty", 5, 1e-6), run("b", 190)]
    assert headline(records, FASTEST).answer == "b"


def in_sweeps(make, solver, rounds):
    made = make.timed(solver, 1.0)
    return replace(made, arrays=made.arrays | {"seconds": rounds})


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
    found = headline(records, "Forward kinematics", "speed")
    if factor == 1.0:
        assert "in a tie with" in point
        assert found.answer.startswith("Tie: ")
        assert found.detail == "too near to tell on 1 case"
    else:
        assert point.endswith("first: Pinocchio")
        medians = [row[table.columns.index(median_of(table))] for row in table.rows]
        ratio = words(medians[1] / medians[0])
        assert found[2:4] == ("Pinocchio", f"{ratio} times faster than the next on 1 of 1 case")


def median_of(table):
    return next(column for column in table.columns if column.title == "median")


def test_nobody_leads_among_those_that_were_timed_apart(make):
    rounds = np.linspace(1e-6, 1.1e-6, 27).reshape(9, 3)
    records = [in_sweeps(make, s, f * rounds) for s, f in (("Pinocchio", 1), ("MuJoCo", 9))]
    apart = [replace(r, facts={**r.facts, "together": r.solver}) for r in records]
    assert headline(records, "Forward kinematics", "speed").answer == "Pinocchio"
    assert headline(apart, "Forward kinematics", "speed").detail == "too near to tell on 1 case"


def test_without_rivals_there_is_no_headline(make):
    """Plain Python and the memory bound are no rivals of Plumbob."""
    names = (registry.PLAIN.name, registry.LIMIT_NAME, "Plumbob, compiled")
    for records in (
        [make.timed(name, 1e-7) for name in names],
        [make.worked("Plumbob Newton", error=(1e-3, 1e-9))],
    ):
        assert headlines.headlines(Results(records)) == []
    assert headlines.overview(Results([])) == (None, [], "", [], [])


def test_a_cloth_is_solved_by_those_that_converge_and_first_by_an_engine(make):
    newton = make.worked("Plumbob Newton", error=(1e-3, 1e-9), seconds=(1e-3, 2e-3))
    records = [
        newton,
        make.worked("Plumbob L-BFGS", error=(1e-3, 1e-7), seconds=(1e-3, 3e-3)),
        make.worked("MuJoCo Euler", error=(0.5, 0.4)),
    ]
    tie = headline(records, "Most steps solved", "cloth")
    assert tie.answer == "Tie: Plumbob Newton and Plumbob L-BFGS"
    assert tie.detail.startswith("to 1e-6 on 1 of 1 cloth")
    question = "Fastest to 1e-6", "cloth"
    alone = headline(records, *question).detail
    assert "only one of 2 engines" in alone
    converged = make.worked("MuJoCo discrete", error=(0.5, 1e-8), seconds=(1e-3, 8e-3))
    factor = "4.00 times faster than the next on 1 of 1 cloth"
    assert headline([*records, converged], *question)[2:4] == ("Plumbob", factor)
    stiff = [replace(make.worked(r.solver, 1e4), arrays=r.arrays) for r in records]
    detail = headline([*records, converged, *stiff], *question).detail
    assert detail == f"{factor} and {alone}".replace("of 1 cloth", "of 2 cloths")
    mine = make.worked("Mine", error=(1e-3, 1e-9), seconds=(1e-4, 2e-4))
    assert headline([newton, mine], *question).answer == "Mine"


def test_the_verdict_names_the_claim_with_the_narrowest_margin(make):
    wide, narrow = make.claim("wide"), make.claim("narrow")
    narrow.arrays["difference"] = np.array(9e-13)
    found = headlines.verdict(Results([wide, narrow, make.claim("broken", held=False)]))
    assert found == headlines.ClaimCount(2, 3, "narrow", pytest.approx(0.9))
    assert headlines.verdict(Results([])) is None


def test_peers_without_a_measurement_are_absent_or_were_not_asked(make, run):
    records = [run("pink", 1), run("Plumbob LM", 1), make.lacking("mink", "one start", "")]
    missing = make.record("cloth", "peers/all", "mujoco", facts={"task": "missing"})
    results = Results([*records, make.worked("Plumbob Newton"), missing])
    assert headlines.absent(results) == ["mink", "MuJoCo (cloth)"]
    found = headlines.not_asked(results)
    assert not {"pink", "Plumbob LM", "mink"} & set(found)
    assert "TRAC-IK" in found
    engines = dict.fromkeys(peer.engine for peer in registry.cloth_peers())
    assert [name for name in found if name.endswith("(cloth)")] == [
        f"{engine} (cloth)" for engine in engines if engine not in (registry.PLUMBOB, "MuJoCo")
    ]
    assert headlines.absent(Results([])) == headlines.not_asked(Results([])) == []


def test_the_scale_gives_the_number_of_targets_if_there_are_records(make, run):
    quick = make.record(FINISHED, "ik", "", notes={"scale": "quick"})
    scale = headlines.scale(Results([quick, run("a", 1)]))
    assert scale == "Quick run: 100 targets a stratum"


def test_a_paired_ratio_holds_the_factor_and_a_single_pair_leaves_it_open():
    found = metrics.paired_ratio(np.array([2.0, 8.0, np.nan]), np.array([1.0, 2.0, 1.0]))
    assert found.mean == pytest.approx(np.sqrt(8.0))
    assert found.low < 1.0 < found.high
    assert found.pairs == 2
    assert metrics.paired_ratio(np.array([2.0]), np.array([1.0])) == (2.0, 0.0, np.inf, 1)
    many = metrics.paired_ratio(np.full(50, 3.0), np.ones(50))
    assert many.low == pytest.approx(3.0)


def test_a_row_says_what_measures_it_again(make, run):
    record = run("Pinocchio’s closed loop", 1)
    command = "plumbob bench ik --solver 'Pinocchio’s closed loop' --problem robots/arm"
    assert source(record).command == command
    assert source((record, 3)).command == command
    many = [run(name, 1) for name in "abcd"]
    assert source(many).command == "plumbob bench ik --problem robots/arm"
    assert source(make.lacking("pink", "one start", "not installed")).command == ""
    assert source("no record").command == ""
