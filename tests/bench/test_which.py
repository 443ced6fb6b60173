"""Which solver to choose for a robot: rows in order, advice by the records, and the command."""

import numpy as np
import pytest

from plumbob.bench.page.which import solvers_on_robot
from plumbob.bench.peers import catalogue, opening
from plumbob.bench.peers.peer import RESTARTS
from plumbob.bench.tables.results import Results
from plumbob.cli.main import run_command

OURS = "Plumbob LM, first phase"

ARM = """<robot name="arm"><link name="base"/><link name="a"/><link name="b"/><link name="c"/>
<joint name="1" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2"/></joint>
<joint name="2" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<origin xyz="0.4 0 0"/><limit lower="-2" upper="2"/></joint>
<joint name="3" type="{kind}"><parent link="b"/><child link="c"/><axis xyz="1 0 0"/>
<origin xyz="0.3 0 0"/><limit lower="-2" upper="2"/></joint></robot>"""


MINE = """import numpy as np

PLUMBOB = {"name": "Mine", "version": "1"}


def robot_inverse_kinematics(start):
    return {"q": np.array(start), "converged": False}
"""


def table_of(*records):
    return solvers_on_robot(Results(records), "arm.urdf")


def test_a_solver_has_a_row_with_its_best_settings_and_the_best_is_first(make):
    pink = next(peer for peer in catalogue.PEERS if peer.title == "pink")
    again = pink.label_of(pink.first(RESTARTS))
    times = np.r_[np.full(190, 1e-5), np.full(10, 1e-3)]
    table = table_of(
        make.solving("mink", 60, seconds=1e-3),
        make.solving(OURS, 80, seconds=times),
        make.solving("Plumbob LM, 14 restarts", 200, "restarts", seconds=times),
        make.solving(again, 200, "restarts", seconds=2e-3),
    )
    solvers, solved, medians, p95, *_ = zip(*table.rows, strict=True)
    assert solvers == ("Plumbob LM (ours)", "pink", "mink")
    assert solved == pytest.approx((100.0, 100.0, 30.0))
    assert medians == pytest.approx((10.0, 2e3, 1e3))
    assert p95[0] == pytest.approx(1e6 * np.quantile(times, 0.95))
    assert table.title == "arm.urdf, 7 joints to hand: 200 targets"
    assert table.summary.sentence == (
        "Choose Plumbob LM (14 restarts, ours): it solves 100 % of the targets with a median of "
        "10.0 µs, the fastest of 2 that solve the most within chance."
    )


def test_every_solver_is_good_for_something_that_fits_a_line_of_80_letters():
    uses = [peer.use for peer in catalogue.PEERS]
    assert all(0 < len(use) <= 29 for use in uses)
    assert len(set(uses)) == len(uses)


def test_the_advice_is_for_whoever_is_best(make):
    best = make.solving("pink", 200, seconds=1e-3)
    ours, loop = (
        make.solving(OURS, 100),
        make.solving("our closed loop on Pinocchio", 200),
    )
    said = table_of(best, ours, loop).summary.sentence
    assert said.startswith("Choose pink: it solves 100 % of the targets, more than any other,")
    nobody = table_of(make.solving("pink", 0)).summary.sentence
    assert nobody == "No solver reaches a target: does --link name the link that you mean?"


@pytest.mark.parametrize(
    ("hits", "choice"), [(200, "mink"), (198, "mink"), (190, "pink"), (150, "pink")]
)
def test_of_solvers_that_tie_the_fastest_is_advised_and_no_other(make, hits, choice):
    """Of 200 targets chance explains two fewer, by McNemar's test with p = 0.5, but not ten."""
    records = [make.solving("pink", 200, seconds=2e-3), make.solving("mink", hits, seconds=1e-3)]
    for entries in (records, records[::-1]):
        summary = table_of(*entries).summary.sentence
        assert summary.startswith(f"Choose {choice}: ")
        assert ("more than any other" in summary) == (choice == "pink")
        assert ("the fastest of 2 that" in summary) == (choice == "mink")


@pytest.fixture
def folder(tmp_path, monkeypatch, in_this_process):
    """A folder with an arm and one whose last joint slides, where only Plumbob is installed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(opening, "installed", list)
    monkeypatch.setattr(catalogue, "PEERS", catalogue.PEERS[:1])
    monkeypatch.setattr("plumbob.bench.measure.timing.worker_process",
                        in_this_process)  # fmt: skip
    for name, kind in (("arm", "revolute"), ("slider", "prismatic")):
        (tmp_path / f"{name}.urdf").write_text(ARM.format(kind=kind))
    (tmp_path / "my_robot.py").write_text(MINE)
    (tmp_path / "my_ik.py").write_text(MINE.replace("robot_inverse", "inverse"))
    return tmp_path


def test_the_command_tries_60_targets_prints_a_line_a_solver_and_advises(folder, capsys):
    assert run_command(["which", "arm.urdf", "--link", "c"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "arm.urdf, 3 joints to c: 60 targets"
    assert any(line.startswith("Plumbob LM (ours) ") for line in lines)
    assert lines[-1].startswith("Choose Plumbob LM")
    files = ["arm.urdf", "my_ik.py", "my_robot.py", "slider.urdf"]
    assert sorted(path.name for path in folder.iterdir()) == files
    assert run_command(["which", "arm.urdf", "--format", "csv"]) == 0
    assert capsys.readouterr().out.startswith("solver,solved_percent,median_us,")


def test_the_users_solver_has_one_row_among_the_others(folder, capsys):
    assert run_command(["which", "arm.urdf", "--with", "my_robot.py", "--format", "csv"]) == 0
    _, *rows = capsys.readouterr().out.splitlines()
    assert [row.split(",")[0] for row in rows] == ["Plumbob LM (ours)", "Mine"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["no.urdf"], "ROBOT: expected a file, got no.urdf, which does not exist"),
        (["my_ik.py"], "ROBOT: expected a file of type .urdf or .xml or .mjcf, got my_ik.py"),
        (["arm.urdf", "--with", "my_ik.py"], "with: expected a solver with "
                                             "robot_inverse_kinematics, got my_ik.py"),
        (["arm.urdf", "--link", "x"], "--link: expected one of base, a, b, c, got 'x'"),
        (["slider.urdf"], "slider.urdf: expected hinges to 'c', got a slide; --link names the link "
                          "that must reach the targets"),
        (["arm.urdf", "--format", "xls"], "unknown format 'xls': expected one of md, tex, csv, "
                                          "html"),
    ],
)  # fmt: skip
def test_misuse_exits_2_with_one_sentence(folder, capsys, arguments, message):
    assert run_command(["which", *arguments]) == 2
    assert capsys.readouterr() == ("", f"plumbob: {message}\n")
