"""The gate: a wrong digit is seen first, noise is not called a change, a slowdown is."""

import json
import math
import re
import resource
from dataclasses import replace

import numpy as np
import pytest

from plumbob.bench.compare import compare as comparing
from plumbob.bench.compare import times
from plumbob.bench.compare.compare import compare, failing, gate_limits
from plumbob.bench.compare.rows import ORDER, ChangeVerdict, Pair, TimeRatio, by_row
from plumbob.bench.measure import metrics
from plumbob.bench.measure.record import RecordFile
from plumbob.cli import main as cli

KEY = ("timing", "p", "mine", "{}")


def changed(record, **arrays):
    """The record with other arrays."""
    return record.with_measured(**{k: np.array(v) for k, v in arrays.items()})


def verdicts(old, new):
    return [(row.verdict, row.quantity) for row in compare(old, new).rows]


def stopped(rows, **limits):
    """The rows that fail a gate, without the limit behind their sentences."""
    names = {(row.key, row.quantity) for row in failing(rows, limits)}
    return [row for row in rows if (row.key, row.quantity) in names]


def test_a_run_beside_itself_differs_in_nothing(records):
    made = compare(records, records)
    assert {row.verdict for row in made.rows} == {ChangeVerdict.SAME}
    assert len(made.rows) > 30
    assert failing(made.rows, gate_limits("accuracy,time,gone")) == []


@pytest.mark.parametrize(
    ("name", "step", "verdict"),
    [("residual", 1, ChangeVerdict.LESS_RIGHT), ("residual", -1, ChangeVerdict.MORE_RIGHT),
     ("largest_angle", 1, ChangeVerdict.CHANGED)],
)  # fmt: skip
def test_the_last_digit_of_one_number_is_seen_whatever_else_changed(
    records, make, name, step, verdict
):
    one = make.drawn("ccd", False, 1.0)
    values = one.measured[name].copy()
    values[1] = np.nextafter(values[1], step * np.inf)
    slow = make.timed("My solver", 1e-6, work="more")
    new = [changed(one, **{name: values}), changed(slow, seconds=[1.0, 1.1, 1.0, 1.1, 1.0])]
    old = [one, changed(slow, seconds=[1e-3, 1.1e-3, 1e-3, 1.1e-3, 1e-3])]
    rows = compare([*records, *old], [*records, *new]).rows
    found = next(row for row in rows if row.quantity == name)
    assert found.verdict == verdict
    assert found.key[1:3] == ("arm/circle", "ccd")
    assert ChangeVerdict.SLOWER in {row.verdict for row in rows}
    if step > 0:
        assert rows[0] == found
        assert stopped(rows, accuracy=0.0) == [found]


WORSE = {
    "a number that is none": {"position": [1e-9, np.nan, 0.1, 1e-7]},
    "one solved less": {"solved": [False, False, False, True]},
    "an error more": {"position": [1e-9, 0.5, 0.2, 1e-7]},
}


@pytest.mark.parametrize("arrays", WORSE.values(), ids=WORSE)
def test_what_is_worse_is_less_right_and_the_reverse_more(make, arrays):
    old = make.raced("lm", "one start")
    new = changed(old, **arrays)
    (name,) = arrays
    assert verdicts([old], [new])[0] == (ChangeVerdict.LESS_RIGHT, name)
    assert verdicts([new], [old])[0] == (ChangeVerdict.MORE_RIGHT, name)


def test_rows_come_go_and_fail(make):
    a, b = make.drawn("a", False, 1.0), make.drawn("b", False, 1.0)
    failed = replace(b, measured={"task": b.task, "failed": "no engine"})
    assert verdicts([a], [b]) == [(ChangeVerdict.GONE, ""), (ChangeVerdict.NEW, "")]
    assert verdicts([b], [failed])[0] == (ChangeVerdict.LESS_RIGHT, "")
    assert verdicts([failed], [b])[0] == (ChangeVerdict.NEW, "")
    made = compare([a], [b])
    assert comparing.headline(made, []) == "No row is less accurate or slower, but 1 gone"
    for new, lost in ((b, ChangeVerdict.GONE), (failed, ChangeVerdict.LESS_RIGHT)):
        rows = compare([a if new is b else b], [new]).rows
        for gate in ("gone", "solved:1,error:100%", "time:10%"):
            assert [row.verdict for row in failing(rows, gate_limits(gate))] == [lost]
        assert failing(rows, gate_limits("solved:1,time:10%,gone:any")) == []
        assert failing(rows, gate_limits("")) == []


def test_a_run_cut_sooner_is_compared_over_what_both_came_to(make):
    """Whatever the versions of the solver are."""
    old = make.raced("peer", "one start")
    cut = {k: v[:2] if v.ndim else v for k, v in old.numbers().items()}
    new = replace(old.with_measured(**cut), settings={**old.settings, "version": "2"})
    assert {verdict for verdict, _ in verdicts([old], [new])} == {ChangeVerdict.SAME}
    new = changed(new, solved=[True, True])
    assert verdicts([old], [new])[0] == (ChangeVerdict.MORE_RIGHT, "solved")


def test_runs_of_other_sizes_are_not_compared(make):
    old = make.drawn("ccd", False, 1.0)
    assert verdicts([old], [replace(old, size=20)]) == [(ChangeVerdict.UNDECIDED, "")]


@pytest.mark.parametrize(
    ("lost", "verdict"),
    [(0, ChangeVerdict.SAME), (3, ChangeVerdict.UNDECIDED), (30, ChangeVerdict.LESS_RIGHT)],
)
def test_answers_cut_by_a_clock_are_decided_by_chance(make, lost, verdict):
    solved = np.ones(200, dtype=bool)
    facts = {"task": "reachable"}
    old = make.record("ik", "p", "TRAC-IK", {"seconds": 0.005}, {"solved": solved}, facts, size=200)
    solved = solved.copy()
    solved[:lost] = False
    new = replace(old, measured={"task": old.task, "solved": solved, "setup": 0.0})
    assert verdicts([old], [new]) == [(verdict, "solved")]


def rounds(rng, median, count=40, noise=0.05):
    """Times of rounds that follow each other and are alike."""
    steps = rng.normal(size=count)
    for i in range(1, count):
        steps[i] = 0.5 * steps[i - 1] + steps[i]
    return median * np.exp(noise * steps)


def two_runs(make, rng, *, rows=12, drift=0.05, factor=1.0):
    """Two runs of rows and of engines; each row drifts, and the first is slower by a factor."""
    runs = []
    for new in (0, 1):
        solvers = [f"s{i}" for i in range(rows)] + ["Pinocchio"] * 8
        runs.append([
            replace(
                changed(
                    make.timed(solver, 1.0, work=f"w{i}"),
                    seconds=rounds(rng, np.exp(drift / 2 * rng.normal())
                                   * (factor if new and i == 0 else 1.0)),
                ),
            )
            for i, solver in enumerate(solvers)
        ])  # fmt: skip
    return runs


def test_of_twenty_runs_beside_their_like_at_most_one_calls_anything(make):
    rng = np.random.default_rng(5)
    calls = [called_rows(compare(*two_runs(make, rng)).rows) for _ in range(20)]
    assert sum(map(bool, calls)) <= 1


def called_rows(rows):
    """The solvers of the rows that are called faster or slower."""
    times = (ChangeVerdict.FASTER, ChangeVerdict.SLOWER)
    return [row.key[2] for row in rows if row.verdict in times]


def test_a_slowdown_beyond_the_drift_is_called_and_one_within_is_undecided(make):
    rng = np.random.default_rng(1)
    old, new = two_runs(make, rng, drift=0.01, factor=1.2)
    made = compare(old, new)
    assert made.rows[0].verdict == ChangeVerdict.SLOWER
    assert made.rows[0].key[2] == "s0"
    assert made.rows[0].ratio.low < 1.2 < made.rows[0].ratio.high
    assert stopped(made.rows, time=0.1) == made.rows[:1]
    assert failing(made.rows, {"time": 0.1})[0].why.endswith("(1.16 to 1.29) (limit 1.1)")
    assert failing(made.rows, {"time": 0.5}) == []
    assert called_rows(compare(new, old).rows) == ["s0"]
    old, new = two_runs(make, rng, drift=0.3, factor=1.2)
    made = compare(old, new)
    assert made.drift.half_width > 0.2
    assert called_rows(made.rows) == []


def test_times_of_two_machines_or_of_few_rounds_are_not_compared(make):
    old = changed(make.timed("mine", 1.0), seconds=[1.0] * 4)
    made = compare([old], [changed(old, seconds=[2.0] * 4)])
    assert (made.short, [row.verdict for row in made.rows]) == (1, [ChangeVerdict.SAME])
    assert "1 time with fewer than 5 rounds" in comparing.summary(made, [], 200)[-1]
    old = changed(old, seconds=[1.0] * 10)
    stamp = {**old.stamp, "machine": {**old.stamp["machine"], "processor": "abacus"}}
    new = replace(changed(old, seconds=[9.0] * 10), stamp=stamp)
    assert verdicts([old], [new])[0] == (ChangeVerdict.UNDECIDED, "seconds")


def test_pairs_by_lot_call_nothing_by_chance_and_find_a_fifth():
    """The machine drifts by half in the course of the pairs, and is at times three times slower."""
    rng, called, found = np.random.default_rng(7), 0, 0
    rows, count = 15, times.pairs_needed(15)
    for _ in range(20):
        pace = np.exp(np.linspace(0, 0.4, count))[:, None, None]
        noise = 0.03 * rng.standard_t(3, size=(count, rows, 2))
        seconds = pace * np.exp(noise)
        seconds[..., 1][rng.random((count, rows)) < 0.02] *= 3.0
        order = rng.random((count, rows)) < 0.5
        seconds[order] = seconds[order][:, ::-1]
        seconds[:, 0, 1] *= 1.2
        chances = metrics.adjusted(
            [times.ratio_of_pairs(*seconds[:, row].T).chance for row in range(rows)]
        )
        found += chances[0] <= times.ERROR_RATE
        called += (chances[1:] <= times.ERROR_RATE).any()
    assert called <= 2  # of 20 at 5 %: 1, and as many again by chance
    assert found >= 15


def test_the_interval_of_pairs_is_that_of_the_tables():
    """Of ten pairs the 95 % interval leaves out the eight least means of two (Wilcoxon's table)."""
    assert times._signed_rank_quantile(10) == 8
    assert times._signed_rank_quantile(5) == -1
    new = np.exp(np.arange(1.0, 11.0))
    ratio = times.ratio_of_pairs(np.ones(10), new)
    means = sorted((i + j) / 2 for i in range(1, 11) for j in range(i, 11))
    assert np.log([ratio.low, ratio.high]) == pytest.approx([means[8], means[-9]])
    assert ratio.chance == pytest.approx(2 / 2**10)


def test_chances_over_all_rows_are_those_of_holm():
    assert metrics.adjusted([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert metrics.adjusted([]).size == 0


LIMITS = {
    "accuracy": {"accuracy": 0.0, "gone": 0.0},
    "accuracy,time:10%,gone:any": {"accuracy": 0.0, "time": 0.1},
    "time:0.25, gone": {"time": 0.25, "gone": 0.0},
    "accuracy:1e-9": {"accuracy": 1e-9, "gone": 0.0},
    "solved:1,error:100%": {"solved": 0.01, "error": 1.0, "gone": 0.0},
    "solved:0.5%,error:3": {"solved": 0.005, "error": 3.0, "gone": 0.0},
    "time:": {"time": 0.0, "gone": 0.0},
    "gone:any": {},
    "": {},
    **dict.fromkeys(["speed", "time:fast", "time:-1", "gone:1", "time:nan", "time:any"]),
}


@pytest.mark.parametrize(("text", "expected"), LIMITS.items())
def test_limits_are_read_and_what_is_none_is_refused(text, expected):
    if expected is not None:
        assert gate_limits(text) == expected
    else:
        with pytest.raises(ValueError, match="--fail: expected"):
            gate_limits(text)


def test_numbers_of_any_kind_are_compared(make):
    """Integers beyond those of floating point, infinite times, a pace that is none."""
    old = make.record("x", "p", "a", arrays={"i": [2**62], "seconds": [1.0] * 9, "b": [True]},
                      conditions={"pace": "slow"})  # fmt: skip
    new = changed(old, i=[2**62 + 1], seconds=[np.inf] * 9, b=[False])
    assert verdicts([old], [new]) == [
        (ChangeVerdict.CHANGED, "i"),
        (ChangeVerdict.UNDECIDED, "seconds"),
    ]


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_change_is_a_share_of_the_larger_number_and_a_gate_stops_from_there_on(make, factor):
    old = make.drawn("ccd", False, 1.0)
    new = changed(old, largest_angle=factor * old.measured["largest_angle"])
    rows = compare([old], [new]).rows
    (row,) = (row for row in rows if row.quantity == "largest_angle")
    assert (row.verdict, row.change) == (ChangeVerdict.CHANGED, 0.5)
    assert stopped(rows, accuracy=0.5) == [row]
    assert failing(rows, {"accuracy": 0.51}) == []


@pytest.mark.parametrize(
    ("position", "verdict"),
    [
        ([1e-8, 0.4, 0.1, 1e-7], ChangeVerdict.LESS_RIGHT),  # as many are worse as better
        ([1e-8, 0.4, 0.09, 1e-7], ChangeVerdict.MORE_RIGHT),  # one of three is worse
        ([1e-8, 0.6, 0.09, 1e-7], ChangeVerdict.LESS_RIGHT),
    ],
)
def test_answers_are_less_right_where_half_of_those_that_differ_are_worse(make, position, verdict):
    old = changed(make.raced("lm", "one start"), position=[1e-9, 0.5, 0.1, 1e-7])
    row = compare([old], [changed(old, position=position)]).rows[0]
    assert (row.verdict, row.quantity) == (verdict, "position")


@pytest.mark.parametrize(
    ("low", "high", "chance", "verdict"),
    [
        (0.92, 1.09, 1.0, ChangeVerdict.SAME),
        (0.90, 1.09, 1.0, ChangeVerdict.UNDECIDED),  # it may be 1.1 times as fast
        (0.92, 1.11, 1.0, ChangeVerdict.UNDECIDED),
        (1.01, 1.05, times.ERROR_RATE, ChangeVerdict.SLOWER),
        (1.01, 1.05, 1.01 * times.ERROR_RATE, ChangeVerdict.SAME),
    ],
)
def test_times_are_the_same_where_both_ends_of_the_interval_are_within_a_tenth(
    low, high, chance, verdict
):
    ratio = TimeRatio(math.sqrt(low * high), low, high, chance)
    assert times.time_change(KEY, "seconds", ratio, chance).verdict is verdict
    inverse = TimeRatio(1.0 / ratio.ratio, 1.0 / high, 1.0 / low, chance)
    mirrored = ChangeVerdict.FASTER if verdict is ChangeVerdict.SLOWER else verdict
    assert times.time_change(KEY, "seconds", inverse, chance).verdict is mirrored


def test_a_drift_by_the_pace_is_that_between_two_moments(make):
    """Two draws of one distribution differ by the root of two of its deviations."""
    record = make.timed("mine", 1.0)
    logs = np.array([0.0, 0.05, 0.1, 0.3])
    paced = [replace(record, conditions={"pace": float(np.exp(pace))}) for pace in logs]
    rows = {(*KEY[:3], str(k)): Pair(*paced[k : k + 2]) for k in (0, 2)}
    drift = times.machine_drift(rows)
    assert drift.sigma == pytest.approx(math.sqrt(2.0) * np.std(logs, ddof=1))
    assert drift.freedom == 3
    assert compare(paced[:1], paced[3:]).drift.half_width > 0.3
    assert "assumed" in compare([record], [record]).drift.source


def test_of_several_records_of_a_row_the_latest_counts(make):
    first, last = make.drawn("ccd", False, 1.0), make.drawn("ccd", False, 2.0)
    last = replace(last, when="2001" + first.when[4:])
    for order in ((first, last), (last, first)):
        (kept,) = by_row(order).values()
        assert kept is last


@pytest.fixture
def folders(tmp_path, monkeypatch, records, make):
    """Two folders, the second with a digit off and much else gone."""
    monkeypatch.chdir(tmp_path)
    RecordFile("old").append(records)
    bad = changed(make.drawn("ccd", False, 1.0), residual=[1e-5, 2e-5, 3.0000001e-4])
    RecordFile("new").append([bad, *records[len(records) // 2 :]])
    return tmp_path


def plumbob(capsys, *arguments):
    code = cli.run_command(list(arguments))
    return code, *capsys.readouterr()


def test_the_terminal_shows_ten_lines_the_worst_first_and_exits_1(capsys, folders):
    code, out, err = plumbob(capsys, "compare", "old", "new", "--fail", "accuracy,gone:any")
    assert (code, err) == (1, "")
    lines = out.splitlines()
    assert len(lines) <= 10
    assert lines[0] == "STOP: 1 row beyond the limits"
    assert "LESS RIGHT arm/circle, ccd, residual (warm false): 0.0003" in lines[2]
    code, out, _ = plumbob(capsys, "compare", "old", "new")
    assert code == 0
    assert re.match(r"1 row worse, but \d+ gone\n", out)
    assert plumbob(capsys, "compare", "old", "new", "--fail", "time:1000%")[0] == 1
    assert plumbob(capsys, "compare", "old", "old", "--fail", "accuracy,time:0%,gone")[0] == 0


def test_markdown_and_json_hold_what_was_found(capsys, folders):
    files = ["--markdown", "out/comment.md", "--json", "out/rows.json"]
    limits = ["--fail", "accuracy,gone:any"]
    assert plumbob(capsys, "compare", "old", "new", *files, *limits)[0] == 1
    comment = (folders / "out" / "comment.md").read_text()
    assert comment.startswith("# plumbob compare: STOP: 1 row")
    assert "| LESS RIGHT | arm/circle | ccd | warm false | residual |" in comment
    content = json.loads((folders / "out" / "rows.json").read_text())
    assert content["stop"] == 1
    assert [row["verdict"] for row in content["rows"] if row["stops"]] == ["LESS RIGHT"]
    assert sum(content["counts"].values()) == len(content["rows"])
    ranks = [ORDER.index(ChangeVerdict(row["verdict"])) for row in content["rows"]]
    assert ranks == sorted(ranks)


def test_a_gate_says_which_statistic_failed_and_by_how_much(make):
    """To the point for shares and to the factor for errors; within the limit nothing fails."""
    old = [make.solving("a", 59, count=60), make.worked("b", error=(0.5, 1e-4))]
    new = [make.solving("a", 55, count=60), make.worked("b", error=(0.5, 3e-4))]
    rows = compare(old, new, statistics=True).rows
    assert [row.why for row in failing(rows, {"solved": 0.01, "error": 1.0})] == [
        "smallest error grew from 1.0e-4 to 3.0e-4 (limit 2 times)",
        "share solved fell from 98.3 % to 91.7 % (limit 1 point)",
    ]
    assert failing(rows, {"solved": 0.07, "error": 2.5}) == []
    old = [make.solving("a", 100, count=100)]
    for solved, count in ((99, 0), (98, 1)):
        rows = compare(old, [make.solving("a", solved, count=100)], statistics=True).rows
        assert len(failing(rows, gate_limits("solved:1"))) == count
    assert failing(compare(new, old, statistics=True).rows, {"solved": 0.0, "error": 0.0}) == []
    assert not {"share solved", "smallest error"} & {row.quantity for row in compare(old, new).rows}


def test_a_baseline_is_a_run_under_a_name(capsys, folders):
    code, out, _ = plumbob(capsys, "compare", "old", "--save", "v1")
    assert code == 0
    assert "plumbob compare v1 NEW" in out
    RecordFile("old").drop(lambda record: True)
    assert plumbob(capsys, "compare", "v1", "new", "--fail", "accuracy")[0] == 1
    assert plumbob(capsys, "compare", "new", "--save", "v1")[0] == 0  # in place of the other
    assert plumbob(capsys, "compare", "v1", "new", "--fail", "accuracy,gone")[0] == 0


@pytest.mark.parametrize("name", ["..", ".", "", " ", "a/b", "../old", "-x", "a\x1b[2Jb", "a\nb"])
def test_a_baseline_whose_name_is_none_costs_no_record(capsys, folders, name):
    for folder in (".", "old"):
        RecordFile(folder).append(RecordFile("new").read().records)
    files = {path: path.read_bytes() for path in folders.rglob("*.jsonl")}
    code, out, err = plumbob(capsys, "compare", f"--save={name}", "new")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "--save: expected a name without folders or control characters" in err
    assert {path: path.read_bytes() for path in folders.rglob("*.jsonl")} == files


def test_a_baseline_that_cannot_be_written_stays_and_is_said_to_stay(capsys, folders):
    assert plumbob(capsys, "compare", "old", "--save", "v1")[0] == 0
    file = folders / "plumbob_baselines" / "v1" / "records.jsonl"
    saved, (soft, hard) = file.read_bytes(), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
    try:
        code, _, err = plumbob(capsys, "compare", "new", "--save", "v1")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert code == 2
    assert "File too large; what was finished before is on record" in err
    assert file.read_bytes() == saved
    assert not file.with_suffix(".new").exists()


def test_a_baseline_named_as_a_folder_is_compared_by_its_path(capsys, folders):
    assert "plumbob compare plumbob_baselines/old NEW" in plumbob(
        capsys, "compare", "old", "--save", "old"
    )[1]  # fmt: skip


MISUSE = {
    "one folder": (["old"], "expected OLD and NEW, or --rerun REV, got 1 folder"),
    "nothing": ([], "expected OLD and NEW, or --rerun REV, got 0 folders"),
    "both": (["old", "new", "--rerun", "HEAD"], "expected OLD and NEW, or --rerun REV"),
    "no records": (["old", "nowhere"], "no records in nowhere"),
    "limits": (
        ["old", "new", "--fail", "speed"],
        "--fail: expected accuracy or accuracy:SHARE, time:SHARE, solved:POINTS",
    ),
    "suite": (["--rerun", "HEAD", "--suite", "x"], "unknown suite 'x': expected one of check"),
}


@pytest.mark.parametrize(("arguments", "sentence"), MISUSE.values(), ids=MISUSE)
def test_misuse_of_compare_exits_2_with_one_sentence(capsys, folders, arguments, sentence):
    code, out, err = plumbob(capsys, "compare", *arguments)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert sentence in err
