"""Tables of experiments show the numbers of the records, and their sentences follow them."""

import ast
import csv
import io
import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from table_cells import column, rows

from plumbob import bench
from plumbob.bench.experiments import SUITES, check, cloth, timing
from plumbob.bench.experiments.arm import accuracy
from plumbob.bench.experiments.chain import beyond_reach, rivals
from plumbob.bench.experiments.closed_curves import jitter
from plumbob.bench.experiments.cloth_peers import SOLVED
from plumbob.bench.page.sections import SECTIONS, tables
from plumbob.bench.tables.latex import escaped
from plumbob.bench.tables.results import Results, label
from plumbob.bench.tables.table import best_cells, words
from plumbob.bench.tables.writers import comma_separated, markdown


def test_without_records_every_table_is_empty_but_for_its_captions():
    made = tables(Results([]))
    assert [(table.rows, table.summary.sentence) for table in made] == [((), "")] * len(made)
    assert len({table.name for table in made}) == len(made)
    assert all(table.shows and table.measured for table in made)
    assert all(0 < len(table.note) <= 130 for table in made)  # a line on the page
    for table in made:
        assert not re.search(r"[a-z] [–.,;]|every th|  ", table.measured), table.measured


def test_every_number_in_csv_is_one(records):
    for table in tables(Results(records)):
        for row in list(csv.reader(io.StringIO(comma_separated(table))))[1:]:
            assert not [cell for cell in row if cell.startswith(("np.", "array"))], table.name


def test_every_letter_of_ours_can_be_typeset(records):
    for table in tables(Results(records)):
        texts = [column.heading for column in table.columns]
        texts += [table.title, table.shows, table.measured, table.summary.sentence]
        assert not [text for text in texts if r"\textbackslash" in escaped(text)], table.name


# Numbers of names, of mathematics, of statistics (`metrics.CONFIDENCE`) and of papers.
FACTS = re.compile(
    r"Q[123]\.|UR5|PR2|RK4|\((?:[^()]* )?20\d\d\)|(?:Lasenby|Corke) 20\d\d|2(?:\.828)? / ω|y = 0"
    r"|[Bb]oth are 1 at the start|each of 6 components|1e-15|0/|\b95 %|\b5 % level|\b[19]0th\b"
    r"|^Published: 6,561|published with (?:10,000|20 runs)|table 1$|at most 5 ms for TRAC-IK"
    r"|float64|25 digits|an error of 1 is that"
)
SHOWING = ("tables", "figures", "readings", "headlines", "sections")
SOURCES = sorted(
    path
    for path in Path(bench.__file__).parent.rglob("*.*")
    if path.suffix in {".py", ".toml"}
    if path.stem in SHOWING or path.parent.name == "experiments"
)


def phrases(path):
    """The strings of a file that have several words, docstrings and columns left out."""
    if path.suffix == ".toml":
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        parts = [tables[name] for name in tables.keys() - {"columns", "folded", "figures"}]
        for texts in [*parts, *tables.get("figures", {}).values()]:
            yield from (" ".join(t.split()) for t in texts.values() if isinstance(t, str))
        return
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text.partition("# What is shown.")[2] or text)
    bodies = [node.body for node in ast.walk(tree) if isinstance(getattr(node, "body", 0), list)]
    docs = {id(body[0].value) for body in bodies if body and isinstance(body[0], ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            yield node.value if " " in node.value else ""


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: f"{path.parent.name}-{path.name}")
def test_no_setting_is_typed_into_a_sentence(path):
    """A number in a text comes from the constant that the measurement uses, or is a fact."""
    assert [text for text in phrases(path) if re.search(r"\d", FACTS.sub("", text))] == []


def test_a_missed_claim_is_named_in_table_and_answer(make):
    table = check.verdicts(Results([make.claim(), make.claim("damper forces", held=False)]))
    assert column(table, "verdict") == ["held", "MISSED: they differ"]
    basis = "(2 against Pinocchio or MuJoCo, 0 against closed forms and invariants)"
    assert table.summary.sentence.startswith(f"1 of 2 claims held {basis}")
    assert table.summary.points == ("Missed: damper forces",)


def test_chains_are_counted_as_straight_only_if_they_are(make):
    table = beyond_reach(Results([make.beyond("ccd", 0.5), make.beyond("fabrik", 1e-9)]))
    assert column(table, "off the line, largest [m]") == [0.5, 1e-9]
    assert table.summary.points == ("CCD: 1/2 = 50 % (9.5–90.5)", "FABRIK: 2/2 = 100 % (34.2–100)")


def test_targets_without_a_solution_are_not_printed_as_infinite(make):
    def unanswered(record, *names, count=1):
        ends = [math.inf] * count
        cut = {name: [*record.measured[name][:-count], *ends] for name in names}
        return record.with_measured(**{name: np.array(numbers) for name, numbers in cut.items()})

    records = [
        unanswered(make.beyond(solver, 0.004), "residual", "bend", "excess", count=count)
        for solver, count in (("ccd", 1), ("mine", 2))
    ]
    records += [unanswered(make.reached("near", "mine"), "residual")]
    records += [make.worked("Plumbob Newton", error=(math.inf, math.inf))]
    made = {table.name: table for table in tables(Results(records))}
    q1, infinite = made["q1_beyond_reach"], ["no answer"]
    assert column(q1, "targets without a solution") == [1, 2]
    assert list(map(words, column(q1, "off the line, largest [m]"))) == infinite * 2
    assert list(map(words, column(made["accuracy"], "residual, largest [m]"))) == infinite
    assert column(made["cloth_peers_step"], "smallest error") == ["diverged"]
    for table in made.values():
        text = markdown(table)
        assert not re.search(r"\binf(inite)?\b|no answer [m%µ]|not a number", text), table.name


def test_means_of_iterations_are_compared_on_problems_that_both_solved(records):
    table = rivals(Results(records))
    assert column(table, "problem") == ["arm, circle", "arm, beyond", "chain, near"]
    assert column(table, "CCD / FABRIK, means") == [2.5, 1.0, 1.0]


@pytest.mark.parametrize(
    ("ccd", "fabrik", "counts"),
    [(range(4, 14), range(3, 13), "1100"), (range(3, 13), range(4, 14), "0110"),
     (range(4, 14), np.roll(range(4, 14), 5), "0101")],
)  # fmt: skip
def test_iterations_are_fewer_only_where_the_same_targets_say_so(make, ccd, fabrik, counts):
    pair = {"ccd": ccd, "fabrik": fabrik}.items()
    records = [make.beyond(s, 0.0).with_measured(iterations=np.array([*c])) for s, c in pair]
    numbers = re.findall(r"\d+", rivals(Results(records)).summary.sentence)
    assert "".join(numbers[:4]) == counts  # fewer by FABRIK, problems, fewer by CCD, ties
    assert numbers[4] == "10"


@pytest.mark.parametrize(
    ("ccd", "fabrik", "first"), [(1, 3, "CCD, in a tie with FABRIK"), (20, 3, "FABRIK")]
)
def test_the_most_targets_met_are_ranked_by_chance(make, ccd, fabrik, first):
    records = [
        make.drawn(solver, False, 1.0).with_measured(
            residual=np.where(np.arange(40) < count, 1.0, 1e-9)
        )
        for solver, count in (("ccd", ccd), ("fabrik", fabrik))
    ]
    summary = accuracy(Results(records)).summary
    assert summary.sentence.endswith(f"solved by {first}.")
    assert summary.points[0].startswith(f"CCD: {40 - ccd}/40 = ")


def test_jitter_is_the_largest_angle_in_degrees_beside_price_and_drift(make):
    records = make.followed("ccd", cold=1.0, warm=0.5, nearest=0.25)
    table = jitter(Results(records + make.drifted("ccd")))
    (row,) = rows(table)
    for mode, degrees in (("cold", 180 / math.pi), ("warm", 90 / math.pi)):
        assert row[f"largest rotation, {mode} [°]"] == pytest.approx(degrees)
        assert row[f"mean rotation, {mode} [°]"] == pytest.approx(degrees / 4)
    assert row["closing rotation, nearest [°]"] == pytest.approx(math.degrees(0.125))
    assert row["mean iterations, nearest"] == 11
    assert row["within tolerance, nearest"].hits == 3
    drifts = [row[f"drift, {mode}, after {i} [°]"] for mode in ("warm", "nearest")
              for i in (1, 2, 3)]  # fmt: skip
    assert [round(drift) for drift in drifts] == [6, 11, 17, 0, 0, 0]
    assert "smaller in 1 of 1 cases; the nearest" in table.summary.sentence
    assert table.summary.sentence.endswith("smaller still in 1.")
    cold, *_ = table.summary.points
    assert cold == "cold: 57.3° (arm, circle, CCD); 2 of 3 frames"
    assert jitter(Results(records[:2])).rows == ()  # not followed in all modes


def test_jitter_that_grows_is_not_counted_as_smoother(make):
    table = jitter(Results(make.followed("ccd", cold=0.1, warm=0.1, nearest=1.0)))
    assert "smaller in 0 of 1 cases" in table.summary.sentence
    assert table.summary.sentence.endswith("smaller still in 0.")


def test_success_is_counted_by_the_residual_not_by_the_solver(records):
    table = accuracy(Results(records))
    shares = column(table, "within tolerance (95 % interval)")
    assert [(share.hits, share.total) for share in shares] == [(2, 3)] * 4 + [(2, 2)] * 3
    assert max(column(table, "residual, largest [m]")) == 3e-4


def test_convergence_counts_iterations_and_drift(records):
    table = cloth.convergence(Results(records))
    counts, few = table.summary.points
    assert counts == "lab cloth, stiffness × 1: local/global 2 and Newton 2"
    assert few.endswith("the cloth drifts by 0.200 m, 10.0 % of its path")
    for count in ("1 iteration", "10 iterations"):
        assert column(table, f"steps of {count}, drift relative to the path [%]")[0] == 10.0
    assert SOLVED in table.summary.sentence


def test_iterations_that_do_not_suffice_are_said_so(make):
    made = make.sample("stepped", solver="newton")
    short = made.with_measured(error=np.array([1.0, 0.5]))
    table = cloth.convergence(Results([short]))
    assert "Newton more than 1" in table.summary.points[0]
    assert column(table, "iterations to 1e-4") == [None]


def test_times_are_medians_beside_ours(records):
    table = timing.kinematics(Results(records))
    assert column(table, "median [ns]") == pytest.approx([1000.0, 2000.0])
    assert column(table, "relative to compiled") == [0.5, None]


def swept(make, solver, seconds, noise=0.01):
    """Nine sweeps of three rounds, and how noisy the machine was."""
    made = make.timed(solver, 1.0)
    rounds = np.repeat(np.asarray(seconds)[:, None], 3, axis=1)
    return made.with_measured(seconds=rounds, noise=noise)


def test_times_are_shown_with_the_interval_of_their_sweeps_and_ties_are_called_so(make, rng):
    drift = rng.lognormal(0.0, 0.5, 9)
    ours, rival = (
        swept(make, "Plumbob, compiled", 1e-6 * drift),
        swept(make, "MuJoCo", 2e-6 * drift),
    )
    table = timing.kinematics(Results([ours, rival]))
    known = column(table, "95 % interval of the median, ± [%]")
    assert known[0] == pytest.approx(known[1])
    assert known[0] == pytest.approx(
        50.0 * (np.sort(drift)[7] - np.sort(drift)[1]) / np.median(drift)
    )
    (point,) = table.summary.points
    assert point.endswith("first: Plumbob")
    apart = rival.with_measured(together="another run")
    (point,) = timing.kinematics(Results([ours, apart])).summary.points
    assert point.endswith("not ranked")
    again = swept(make, "MuJoCo", 1e-6 * rng.permutation(drift))
    (point,) = timing.kinematics(Results([ours, again])).summary.points
    assert "in a tie with" in point


def test_rows_that_are_only_shown_are_never_first_and_remarks_have_the_numbers_on_record(make):
    """The share of setting qpos follows from two times; an error is the record's own."""
    given = {"MuJoCo": 4e-6, "MuJoCo, qpos set before": 1e-6, "Plumbob, compiled": 3e-6}
    records = [swept(make, solver, np.full(9, seconds)) for solver, seconds in given.items()]
    table = timing.kinematics(Results(records))
    remarks = dict(zip(column(table, "implementation"), column(table, "remark"), strict=True))
    assert remarks["MuJoCo"] == "qpos[:] = q takes 75 %"
    assert remarks["MuJoCo, qpos set before"] == remarks["Plumbob, compiled"] == ""
    assert {table.rows[i][1] for i, _ in best_cells(table)} == {"Plumbob, compiled"}
    assert table.summary.points[0].endswith("first: Plumbob")
    inexact = records[0].with_measured(error=4.5e-11)
    (remark,) = column(timing.kinematics(Results([inexact])), "remark")
    assert remark == "error 4.5e-11"


@pytest.mark.parametrize(("noise", "mark"), [(0.049, ""), (0.12, "noisy")])
def test_a_machine_too_noisy_for_the_precision_aimed_at_is_said_to_be_so(make, noise, mark):
    table = timing.kinematics(Results([swept(make, "MuJoCo", np.ones(9), noise)]))
    assert column(table, "remark") == [mark]
    assert ("too noisy for a precision of 5 %" in table.measured) == bool(mark)
    assert ("The machine was too noisy" in table.summary.sentence) == bool(mark)


def test_a_plain_copy_stands_in_a_column_and_is_called_no_limit(make):
    """Work that caches serve better takes half of its time: that is below no bound."""
    copy = make.timed("limit: copying as many bytes", 1e-6)
    table = timing.kinematics(Results([make.timed("Plumbob, compiled", 5e-7), copy]))
    assert column(table, "implementation") == ["Plumbob, compiled"]
    assert column(table, "relative to a plain copy") == pytest.approx([0.5])
    assert "(0.500 times a plain copy)" in table.summary.points[0]
    assert "limit" not in markdown(table) + label(copy.solver)


def test_a_failed_block_gives_no_row(make):
    failed = make.record("arm", "arm/beyond", "ccd", notes={"failed": "ValueError: no"})
    assert beyond_reach(Results([failed])).rows == ()


def test_every_suite_has_a_chapter_and_its_tables_are_some_of_all():
    assert {e.suite for section in SECTIONS for e in section.experiments} == set(SUITES)
    every = [table.name for table in tables(Results([]))]
    some = [table.name for table in tables(Results([]), ["check"])]
    assert "check" in some
    assert "participants" not in some
    assert [table.name for table in tables(Results([]), SUITES)] == every


def test_the_two_laws_of_dampers_are_listed_with_their_order(make):
    table = cloth.dampers(Results([make.two_dampers((0.04, 0.02, 0.01))]))
    assert column(table, "h [ms]") == [20.0, 10.0, 5.0]
    assert column(table, "observed order") == [None, 1.0, 1.0]
    assert table.summary.points == ("stiffness × 1: 0.0400 at 20.0 ms, 0.0100 at 5.00 ms",)
