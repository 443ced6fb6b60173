"""The user's solvers come first: where they stand, what they raised, and a bench's last lines."""

import re
import sys
import threading
from dataclasses import replace

import numpy as np
import pytest

from plumbob.bench.measure.record import RecordFile
from plumbob.bench.page import outcome, report
from plumbob.bench.page.sections import tables
from plumbob.bench.page.standings import MAX_CLOTHS, standings
from plumbob.bench.peers import opening
from plumbob.bench.tables.results import Results
from plumbob.cli import terminal
from plumbob.cli.main import run_command

OURS = "Plumbob LM, first phase"
WRITTEN = "Plumbob LM (first phase, ours)"

N = 200


def only(records):
    (standing,) = standings(Results(records))
    return standing


def test_rank_share_and_times_are_those_of_the_records(make):
    """Beside the best and beside ours."""
    mine = make.solving("Mine", 150, seconds=4e-3, mine=True)
    others = [
        make.solving("pink", 190, seconds=1e-3),
        make.solving(OURS, 195, seconds=2e-3),
    ]
    standing = only([*others, mine])
    assert standing.question == "Mine, robots, one start"
    assert standing.sentence.startswith(
        f"Mine ranks 3 of 3: it solves 75 % of 200 targets, the best solver, {WRITTEN}, "
        "97.5 %; where both solve, it is "
    )
    # Of targets that both solve, the times are 4 to 1 and 4 to 2.
    factors = re.findall(r"([\d.]+) times slower than (pink|Plumbob LM)", standing.sentence)
    assert [name for _, name in factors] == ["pink", "Plumbob LM"]
    assert [float(number) for number, _ in factors] == [4.0, 2.0]
    assert standing.table == "robots_overall"


def test_the_best_is_told_by_how_much_it_is_faster(make):
    mine = make.solving("Mine", N, seconds=1e-3, mine=True)
    others = [
        make.solving("pink", 100, seconds=4e-3),
        make.solving(OURS, N, seconds=8e-3),
    ]
    standing = only([*others, mine])
    assert standing.sentence.startswith("Mine ranks 1 of 3, in a tie of 2: it solves 100 % of ")
    assert f"8.0 times faster than {WRITTEN}" in standing.sentence
    assert standings(Results(others)) == []


def test_a_solver_that_is_cut_off_has_no_rank_and_one_that_solves_nothing_neither(make):
    rivals = [make.solving("pink", 100), make.solving("mink", 50)]
    cut = only([*rivals, make.solving("Mine", 3, begun=18, mine=True)])
    assert cut.sentence == "Mine is not ranked: it is marked “not finished”."
    none = only([*rivals, make.solving("Mine", 0, mine=True)])
    assert none.sentence == "Mine is not ranked: it solves no target."


def test_a_slow_solver_is_ranked_on_the_targets_that_it_was_given(make):
    """Others solve more of the later targets, and fewer of the first."""
    slow = make.solving("Mine", 19, begun=20, mine=True, seconds=2e-3, facts={"first_targets": 20})
    rivals = [make.solving("pink", 5, seconds=1e-3), make.solving("mink", 190, seconds=1e-3)]
    standing = only([*rivals, slow])
    assert standing.sentence.startswith("Mine ranks 1 of 3, in a tie of 2: it solves 95 % of 20 ")
    reason = "20 targets, the first of each problem because the solver is slow; where both solve, "
    assert f"{reason}it is 2.0 times slower than mink" in standing.sentence
    (other,) = standings(Results([*rivals, slow, make.solving("Other", 150, mine=True)]))[1:]
    assert other.sentence.startswith("Other ranks 2 of 3 (1 solver not ranked): it solves 75 %")


def chained(make, solver, residuals, seconds, stratum="near", mine=False):
    """A record of the chain, its targets within 1e-4 m solved."""
    made = make.reached(stratum, solver)
    solved = np.asarray(residuals) <= 1e-4
    arrays = {"residual": residuals, "solved": solved}
    arrays["seconds"] = np.full((1, len(residuals)), seconds)
    made = replace(made.with_measured(**arrays), size=float(len(residuals)))
    return make.entered(made) if mine else made


def test_on_chains_ours_are_called_so_and_what_is_beyond_reach_does_not_count(make):
    reached, missed = np.full(20, 1e-5), np.full(20, 1.0)
    records = [
        chained(make, "fabrik", reached, 1e-4),
        chained(make, "lm/MuJoCo", reached, 2e-4),
        chained(make, "Mine", np.r_[reached[:5], missed[:15]], 1e-3, mine=True),
        chained(make, "Mine", missed, 1e-3, "beyond", mine=True),
    ]
    standing = only(records)
    assert standing.question == "Mine, chain of balls"
    assert standing.sentence.startswith(
        "Mine ranks 2 of 2 (1 solver not ranked): it solves 25 % of 20 targets, the best"
    )
    assert "times slower than FABRIK (ours)" in standing.sentence
    assert "LM, MuJoCo" not in standing.sentence  # a loop of ours
    assert standing.table == "accuracy"


def test_on_cloths_a_rank_is_by_the_error_and_a_time_beside_who_comes_as_near(make):
    records = [
        make.worked("Plumbob Newton", error=(1e-3, 1e-9), seconds=(5e-3, 6e-3)),
        make.worked("MuJoCo Euler", error=(0.5, 0.2), seconds=(1e-3, 2e-3)),
        make.entered(make.worked("Mine", error=(0.5, 0.2), seconds=(1e-3, 4e-3))),
    ]
    standing = only(records)
    assert standing.question == "Mine, step of 1 cloth"
    assert standing.sentence == (
        "Mine ranks 2 of 3: on 20 × 20, 1,000 N/m error 0.200 in 4.00 ms, 2.0 times slower than "
        "MuJoCo Euler and 1.2 times faster than Plumbob Newton (ours)."
    )
    alone = only([records[1], make.entered(make.worked("Mine", error=(0.5, 0.1)))])
    assert alone.sentence.startswith("Mine ranks 1 of 2: ")
    assert alone.sentence.endswith("no other solver as near.")


def test_motions_are_ranked_by_the_distance_from_the_truth(make):
    mine = make.fell("Mine", error=[np.inf, 1e-2, 5e-2])
    records = [make.fell("Plumbob Newton"), make.entered(mine)]
    standing = only(records)
    assert standing.question == "Mine, motion of 1 cloth"
    assert standing.sentence.startswith("Mine ranks 1 of 2: ")
    assert "error 0.0100 in 1.00 ms" in standing.sentence


def test_many_cloths_have_few_sentences_and_the_rank_on_all(make):
    stiffnesses = [10.0**k for k in range(2, 7)]
    records = [make.worked("MuJoCo Euler", k, error=(0.1, 0.01)) for k in stiffnesses]
    records += [make.entered(make.worked("Mine", k, error=(0.1, 0.02))) for k in stiffnesses]
    standing = only(records)
    assert standing.question == "Mine, step of 5 cloths"
    assert standing.sentence.startswith("Mine ranks 2 of 2: ")
    assert standing.sentence.count("N/m error ") == MAX_CLOTHS


RAISED = "It raised ValueError in line 3 of mine.py: no, on 4 of 200 targets"


def test_what_a_solver_raised_stands_below_its_ranks_with_how_often(make):
    good = make.solving("Mine", 20, mine=True)
    bad = make.solving(
        "Mine, 20 restarts", 0, mine=True, kind="restarts", facts={"trouble": RAISED}
    )
    rank, trouble, unranked = standings(Results([bad, good]))
    assert rank.sentence.startswith("Mine ranks 1 of 1: ")
    assert trouble.question == "Mine, suite ik"
    first = f"the first is robots/arm: {RAISED}."
    assert trouble.sentence == f"Mine had trouble on 1 of 2 problems; {first}"
    assert unranked.sentence == "Mine, 20 restarts is not ranked: it solves no target."


def test_a_problem_that_could_not_be_measured_is_not_forgotten(make):
    """A record that failed stands in no table."""
    failed = make.entered(make.reached("near", "Mine"))
    words = {"task": failed.task, "entrant": True, "door": "my_ik.py"}
    failed = replace(failed, measured={"failed": "It raised ValueError: no", **words})
    standing = only([failed])
    first = "chain/near: It raised ValueError: no"
    assert standing.sentence == f"Mine had trouble on 1 of 1 problem; the first is {first}."


def run_folder(make, tmp_path):
    """A folder with records of a solver of the user's beside others, on all robots and a cloth."""
    records = [make.solving("Mine", 150, mine=True), make.solving("Mine, 20 restarts", 150,
               kind="restarts", mine=True, facts={"trouble": RAISED})]  # fmt: skip
    for kind in ("one start", "restarts"):
        records += [make.solving(s, 190, kind=kind) for s in ("pink", OURS)]
        records += [make.lacking(f"{peer}, {kind}", kind, "not installed") for peer in "abc"]
    RecordFile(tmp_path).append(records)
    return tmp_path


def test_the_first_screen_of_the_page_begins_with_the_solver_of_the_user(make, tmp_path):
    made = report.write(run_folder(make, tmp_path))
    lines = outcome.outcome(made, 200)
    assert lines[0].startswith("Yours: Mine ranks 3 of 3: ")
    assert any(line.startswith("Right? ") for line in lines)
    page = made.page.read_text("utf-8")
    screen = page[page.index('<section id="answers"') : page.index("</section>")]
    assert screen.index("Mine ranks 3 of 3: ") < screen.index("answers were not checked")
    for standing in standings(Results(RecordFile(tmp_path).read().records)):
        assert f'href="#{standing.table}"' in screen
        assert standing.sentence in screen
    assert RAISED in screen


@pytest.mark.parametrize("width", [80, 120])
def test_a_bench_ends_with_the_solver_of_the_user_and_who_leads(
    make, tmp_path, monkeypatch, capsys, width
):
    monkeypatch.setenv("COLUMNS", str(width))
    terminal.print_ending(["ik"], run_folder(make, tmp_path))
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= {80: 20, 120: 14}[width]  # nine sentences, of which most take two lines
    assert max(map(len, lines)) <= width
    said = " ".join(lines)
    for standing in standings(Results(RecordFile(tmp_path).read().records)):
        assert f"Yours: {standing.sentence}" in said
    assert lines[0].startswith("Yours: Mine ranks 3 of 3: ")
    assert said.index("trouble on 1 of 2 problems") < said.index("Best: On the arm, from one start")


def test_a_bench_without_leaders_ends_with_what_its_tables_say(tmp_path, records, capsys):
    RecordFile(tmp_path).append(records)
    terminal.print_ending(["arm"], tmp_path)
    lines = capsys.readouterr().out.splitlines()
    assert 1 <= len(lines) <= outcome.TABLES + 1
    assert lines[0].startswith("Targets beyond reach: ")


def test_a_pipe_gets_a_line_now_and_then_and_a_terminal_none(monkeypatch, capsys):
    """With count, time left and what is being done."""
    monkeypatch.setattr(terminal, "PAUSE", 1e-3)
    monkeypatch.setattr(terminal, "LONGEST_PAUSE", 1e-3)
    printed = threading.Event()
    monkeypatch.setattr(sys.stderr, "flush", printed.set, raising=False)
    with terminal.progress() as bar, terminal.lines_in_a_pipe(bar):
        bar.add_task("ik: chain/near, Mine", total=12, completed=5, kept=5)
        assert printed.wait(60.0)
    assert capsys.readouterr().err.startswith("5/12, ? left: ik: chain/near, Mine\n")
    threads = threading.active_count()
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with terminal.lines_in_a_pipe(bar):
        assert threading.active_count() <= threads


RAISER = """PLUMBOB = {"name": "My raiser"}


def robot_inverse_kinematics(start, target_position):
    raise ValueError("too far")
"""


def test_a_first_exception_is_printed_at_once_and_then_how_often(tmp_path, monkeypatch, capsys):
    """On standard error before its block is on record; once, though two entries raise it."""
    monkeypatch.setattr(opening, "installed", list)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "raiser.py").write_text(RAISER)
    append, printed_before = RecordFile.append, []

    def note_what_is_printed(file, records):
        printed_before.append(sys.stderr.getvalue())
        append(file, records)

    monkeypatch.setattr(RecordFile, "append", note_what_is_printed)
    code = run_command(["bench", "ik", "--quick", "--targets", "20", "--problem", "robots/ur5",
                        "--with", "raiser.py", "--solver", "My raiser", "-o", "out"])  # fmt: skip
    assert code == 0
    out, err = capsys.readouterr()
    why = "It raised ValueError in line 5 of raiser.py: too far"
    line = f"robots/ur5, My raiser: {why}\n"
    assert line in printed_before[0].replace(", 20 restarts", "")
    assert err.count(why) == 1
    said = " ".join(out.split())
    rank = "My raiser had trouble on 2 of 2 problems"
    assert f"{rank}; the first is robots/ur5: {why}, on 6 of 6 targets." in said
    results = Results(RecordFile("out").read().records)
    made = {table.name: table for table in tables(results, ["ik"])}
    for name, title in (
        ("robots_by_robot", "mark"),
        ("robots_overall", "mark"),
        ("entered", "remark"),
    ):
        (j,) = [j for j, column in enumerate(made[name].columns) if column.title == title]
        assert not made[name].columns[j].folded or name == "entered"
        assert f"{why}, on 6 of 6 targets" in made[name].rows[0][j], name


def test_what_fails_alike_is_said_once_and_counted(tmp_path, monkeypatch, capsys):
    from plumbob.bench.measure import run
    from plumbob.cli.bench import run_suites

    why = {"chain/near": "It raised", "chain/far": "It raised", "robots/all": "It crashed"}
    events = [run.Event(run.FAILED, "ik", f"{at}, Mine", message) for at, message in why.items()]
    monkeypatch.setattr(run, "run", lambda *_: iter(events))
    monkeypatch.setattr(run, "count", lambda *_: len(events))
    assert run_suites(["ik"], "quick", tmp_path, False) == 1
    assert capsys.readouterr().err.splitlines() == [
        "plumbob: ik: chain/near, Mine and 1 more: It raised",
        "plumbob: ik: robots/all, Mine: It crashed",
    ]
