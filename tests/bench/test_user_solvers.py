"""Solvers that users enter: in tables and figures beside the others, kept, and told apart."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from plumbob.bench.experiments import blocks
from plumbob.bench.experiments.arm import residuals_chart
from plumbob.bench.experiments.chain import iterations_chart
from plumbob.bench.experiments.cloth_peers import truth_chart
from plumbob.bench.figures.sketch import drawn
from plumbob.bench.measure import timing
from plumbob.bench.measure.record import RecordFile
from plumbob.bench.page.sections import tables
from plumbob.bench.peers import opening
from plumbob.bench.peers.sources import commit_of, digest_of
from plumbob.bench.peers.user_chain import joint_positions
from plumbob.bench.problems import models
from plumbob.bench.problems.evaluate import Evaluator
from plumbob.bench.problems.robots import ROBOTS, robot
from plumbob.bench.tables.results import Results, printable
from plumbob.cli.main import run_command
from plumbob.cli.selection import MeasurementRequest, choose
from plumbob.reference import Skeleton, forward_kinematics
from plumbob.reference.formats import mjcf, urdf
from plumbob.verify.connections import open_connection

PAGE = Path(__file__).parents[2] / "docs" / "bench.md"
IK, CLOTH, ROBOT, PROBLEMS = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
FACTS = {"task": "chain", "stratum": "near", "entrant": True}
ONES = {"residual": [0.0], "iterations": [1], "bend": [0.0], "excess": [0.0], "distance": [1.0]}
CHAIN = (
    ONES | {f"history_{name}": [1.0, 0.1] for name in ("low", "median", "high")} | {"reach": 1.0}
)
SMALL = ["--quick", "--targets", "2", "--problem", "chain/near"]
EXPLICIT = ("--solver", "My symplectic Euler", "--solver", "Plumbob symplectic Euler")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the solvers of the page, and nobody's entry points."""
    monkeypatch.setattr(opening, "installed", list)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_ik.py").write_text(IK, encoding="utf-8")
    (tmp_path / "my_cloth.py").write_text(CLOTH, encoding="utf-8")
    return tmp_path


def bench(*words):
    return run_command(["bench", *words, "-o", "out"])


def records(solver=None):
    found = [printable(one) for one in RecordFile("out").read().records if one.suite != "finished"]
    return [one for one in found if solver in (None, one.solver)]


def made(suite):
    """The tables of a suite, by name, with that of entrants, which stands beside the robots."""
    return {table.name: table for table in tables(Results(records()), {suite, "ik"})}


def cells(table):
    return [str(cell) for row in table.rows for cell in row]


def test_an_ik_solver_of_fifteen_lines_stands_in_tables_and_figures(folder, capsys):
    code = bench("ik", *SMALL, "--problem", "published/fabrik/reachable",
                 "--problem", "chain/beyond", "--with", "my_ik.py", "--solver", "My FABRIK",
                 "--solver", "ccd", "--solver", "fabrik")  # fmt: skip
    assert code == 0
    (near,) = [one for one in records("My FABRIK") if one.problem == "chain/near"]
    assert near.settings["version"] == "0.1"
    assert near.measured["entrant"] is True
    assert near.measured["door"] == "my_ik.py"
    assert len(near.measured["digest"]) == 12
    assert near.conditions["solver_commit"] == ""
    assert (near.measured["residual"] <= 1e-4).all()
    assert near.measured["solved"].all()
    for solver in ("My FABRIK", "ccd", "fabrik"):  # so that its time can stand beside ours
        (record,) = [one for one in records(solver) if one.problem == "chain/near"]
        assert record.measured["seconds"].shape == (3, 1), solver
        assert (record.measured["seconds"] > 0.0).all()
    shown = made("ik")
    for name in ("accuracy", "q1_beyond_reach", "published_ik", "entered"):
        assert "My FABRIK" in cells(shown[name]), name
    for name in ("accuracy", "q1_beyond_reach", "published_ik"):  # nobody else counted them
        for row in shown[name].rows:
            claims = [cell for cell in row if str(cell).endswith("claimed")]
            assert bool(claims) == ("My FABRIK" in row), (name, row)
    for draw in (residuals_chart, iterations_chart):
        assert "My FABRIK" in drawn(draw(Results(records()))).svg
    shows = iterations_chart(Results(records())).shows
    assert shows.endswith("Users’ solvers claim their iterations.")
    printed = capsys.readouterr().out
    assert re.search(r"My FABRIK ranks \d of 3", " ".join(printed.split()))


@pytest.mark.slow
def test_a_cloth_solver_of_fifteen_lines_stands_in_tables_and_figures(folder):
    """An explicit one takes no implicit step, so it stands in the table of motions only."""
    motion = ("--problem", "peers/motion/k1000")
    assert bench("cloth", "--quick", *motion, "--with", "my_cloth.py", *EXPLICIT) == 0
    for name in ("cloth_peers_motion", "entered"):
        assert "My symplectic Euler" in cells(made("cloth")[name]), name
    assert "My symplectic Euler" not in cells(made("cloth")["cloth_peers_step"])
    assert "My symplectic Euler" in drawn(truth_chart(Results(records()))).svg
    # The same method is the same to rounding, in every number but the times.
    ours, theirs = (
        next(one for one in records(name) if one.problem == "peers/motion/k1000")
        for name in ("Plumbob symplectic Euler", "My symplectic Euler")
    )
    np.testing.assert_allclose(ours.measured["error"], theirs.measured["error"], rtol=1e-6)


def test_a_slow_solver_gets_the_first_targets_and_a_rank_on_these(
    folder, capsys, monkeypatch, in_this_process
):
    """It is measured although another solver is named."""
    worker = in_this_process()
    monkeypatch.setattr(timing, "worker_process", lambda: worker)
    monkeypatch.setattr(timing, "_LEAST_SECONDS", 0.0)
    monkeypatch.setattr(timing, "_TARGET_SECONDS", 0.0)
    asked = ("ik", *SMALL, "--with", "my_ik.py", "--solver", "ccd")
    assert bench(*asked) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert re.search(r"My FABRIK ranks 1 of 2, .* of 1 target, the first of each problem", printed)
    (mine,), (ours,) = records("My FABRIK"), records("ccd")
    assert mine.measured["seconds"].shape == (1, 1)
    assert [len(record.measured["residual"]) for record in (mine, ours)] == [1, 2]
    assert "slow: its first 1 of 2 targets" in cells(made("ik")["accuracy"])
    assert bench("ik", *SMALL, "--solver", "fabrik") == 0
    assert "Over all problems most targets" in made("ik")["accuracy"].summary.sentence
    assert bench(*asked) == 0
    assert "0 measured, 2 already on record" in capsys.readouterr().out


def test_the_digest_and_the_commit_cover_imported_files(folder):
    """A file of its folder that it imports belongs to it."""
    path, part = folder / "my_ik.py", folder / "mine" / "one.py"
    path.write_text("import mine.one\n" + IK, encoding="utf-8")
    part.parent.mkdir()
    digests = [part.write_text(f"x = {x}\n") and digest_of(str(path)) for x in (1, 2)]
    assert digests[0] != digests[1]
    git = ["git", "-C", str(folder), "-c", "user.name=n", "-c", "user.email=e"]
    for words in (["init", "-q"], ["add", "my_ik.py", "mine"], ["commit", "-qm", "one"]):
        subprocess.run([*git, *words], check=True)
    assert re.fullmatch(r"[0-9a-f]{40}", commit_of(str(path)))
    part.write_text("x = 3\n")
    assert re.fullmatch(r"[0-9a-f]{40} with changes", commit_of(str(path)))


PROGRAM = """
import json, sys
for line in sys.stdin:
    asked = json.loads(line)
    answer = {"id": asked["id"]}
    if asked["task"] == "greeting":
        answer |= {"protocol": 1, "tasks": ["inverse_kinematics"], "name": "My program"}
    else:
        answer |= {"local_rotations": asked["local_rotations"], EXTRA}
    print(json.dumps(answer), flush=True)
"""


@pytest.mark.sample("round trip")
@pytest.mark.parametrize(("extra", "remark"), [('"seconds": 1e-7', ""), ("", "round trip")])
def test_a_program_is_timed_by_its_own_clock_or_by_round_trips(folder, extra, remark):
    (folder / "program.py").write_text(PROGRAM.replace("EXTRA", extra), encoding="utf-8")
    words = ["bench", "ik", *SMALL, "--solver", "My program", "-o", "out"]
    assert run_command([*words, "--", sys.executable, str(folder / "program.py")]) == 0
    (record,) = records("My program")
    assert remark in record.measured["remark"]
    assert (record.measured["seconds"] < 1e-6).all() == bool(extra)


def test_positions_that_stretch_links_or_move_the_root_are_no_answer():
    skeleton, straight = Skeleton([-1, 0, 1], np.eye(3)), np.eye(3).cumsum(axis=0)
    kept = joint_positions(skeleton, {"positions": straight}, None)
    np.testing.assert_array_equal(kept, straight)
    for wrong in (2.0 * straight, straight + 1e-3, np.full((3, 3), np.nan)):
        with pytest.raises(ValueError, match="do not keep the links' lengths or the root"):
            joint_positions(skeleton, {"positions": wrong}, None)


def entrants(*words):
    return opening.open_solvers(opening.addresses(words), ["ik"])


def test_names_are_made_distinct_or_refused(folder):
    """A name of ours or of a peer gets the address behind it."""
    for name in ("CCD", "TRAC-IK, 5 ms"):
        assert [e.name for e in entrants(f"{name}=my_ik.py")] == [f"{name} (my_ik.py)"]
    (folder / "other.py").write_text(IK)
    with pytest.raises(ValueError, match=r"'My FABRIK' twice, my_ik\.py and other\.py"):
        entrants("my_ik.py", "other.py")
    assert [e.name for e in entrants("my_ik.py", "New=other.py")] == ["My FABRIK", "New"]


@pytest.mark.sample("script")
@pytest.mark.parametrize("name", ["<script>alert(1)</script>", "\ud800", "x" * 100])
def test_a_hostile_name_can_be_shown_anywhere(folder, name, make):
    (folder / "hostile.py").write_text(IK.replace('"My FABRIK"', ascii(name)))
    (one,) = entrants("hostile.py")
    assert one.name.isprintable()
    assert 0 < len(one.name) <= 60
    record = make.record(
        "ik", "chain/near", one.name, {"tolerance": 1e-4}, facts=FACTS, arrays=CHAIN
    )
    RecordFile("out").append([record])
    (record,) = records()
    assert record.solver == one.name
    assert "<script>" not in drawn(residuals_chart(Results([record]))).svg


def test_each_method_has_rows_of_its_own(folder):
    (folder / "two.py").write_text(
        IK.replace('"version"', '"methods": ["ccd", "fabrik"], "version"')
        + "def fabrik(**k):\n    return inverse_kinematics(**k)\nccd = fabrik\n"
    )
    (one,) = entrants("two.py")
    assert one.titles == {"ccd": "My FABRIK, ccd", "fabrik": "My FABRIK, fabrik"}


class Installed:
    """An entry point of an installed package."""

    name, dist = "mine", None

    def __init__(self, value):
        self.value = value


def test_an_entry_point_takes_part_by_itself_and_a_broken_one_harms_nobody(
    folder, monkeypatch, capsys
):
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    points = [Installed("my_ik"), Installed("nothing_here:Solver")]
    monkeypatch.setattr(opening.importlib.metadata, "entry_points", lambda group: points)
    assert bench("ik", "--list", "--quick") == 0
    told = capsys.readouterr()
    assert re.search(r"\n  My FABRIK +0.1, entered, mine\n", told.out)
    assert "takes no part" in told.err


@pytest.mark.slow
def test_a_robot_solver_is_run_with_one_start_and_with_restarts(folder):
    (folder / "robot.py").write_text(ROBOT)
    bench("ik", "--quick", "--targets", "10", "--problem", "robots/ur5", "--with", "robot.py",
          "--solver", "Mine")  # fmt: skip
    by = {one.solver: one for one in records()}
    once, again = (by[name] for name in ("Mine", "Mine, 20 restarts"))
    assert once.measured["solved"].sum() >= 1
    assert again.measured["solved"].sum() > once.measured["solved"].sum()
    assert not (once.measured["claims"].astype(bool) & ~once.measured["solved"]).any()


def test_a_seed_draws_other_targets_and_is_on_record(folder):
    words = ("--quick", "--targets", "3", "--problem", "chain/near", "--solver", "ccd")
    distances = []
    for seed in ((), ("--seed", "7")):
        assert bench("ik", *words, *seed) == 0
        distances += [tuple(one.measured["distance"]) for one in records("ccd")]
    assert distances[0] != distances[1]
    assert bench("ik", *words, "--seed", "-1") == 2
    for seed, expected in {None: 1986, 7: 7}.items():
        request = MeasurementRequest(problems=["robots/fetch"], seed=seed)
        scale = choose(["ik"], "quick", request).scale
        fetch = [one for one in blocks("ik", scale) if one.problem == "robots/fetch"]
        assert {one.settings["seed"] for one in fetch} == {expected}


@pytest.mark.parametrize("name", [name for name in ROBOTS if name != "character"])
def test_the_link_of_the_tool_is_where_poses_are_evaluated(name):
    """The link `tool` of its URDF is where the bench evaluates poses, at any coordinates."""
    from plumbob.bench.peers.user_robot import robot_inputs
    from plumbob.bench.problems.evaluate import evaluator_of
    from plumbob.verify.kinematics.robot_models import tool_pose
    from plumbob.verify.task import TASKS

    inputs = robot_inputs(robot(name))
    (field,) = [field for field in TASKS["robot_inverse_kinematics"].inputs if field.name == "urdf"]
    assert field.about.endswith("its tool the link `tool`")
    model = urdf.parse(inputs["urdf"]).articulation
    for q in robot(name).draw(np.random.default_rng(3), 5):
        positions, _ = evaluator_of(name).forward(q)
        pose = forward_kinematics(model, q)
        np.testing.assert_allclose(
            pose.positions[model.names.index("tool")], positions[0], atol=1e-12
        )
        np.testing.assert_allclose(tool_pose(inputs, q).positions, positions[0], atol=1e-12)


def test_a_solver_is_closed_after_its_greeting(folder, monkeypatch):
    closed, solver = [], open_connection(str(folder / "my_ik.py"))
    close = solver.close
    monkeypatch.setattr(solver, "close", lambda: closed.append(close()))
    monkeypatch.setattr(opening, "open_connection", lambda *_: solver)
    entrants("my_ik.py")
    assert closed == [None]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--solver", "levenberg"], "did you mean 'levenberg_marquardt'?"),
        (["--problem", "chain/naer"], "did you mean 'chain/near'?"),
        (["--robot", "ur6"], "did you mean 'ur5'?"),
        (["--solver", "qqq"], "expected one of 'Anderson CCD', 'DART', "),
        (["--problem", "qqq"], "'Fetch', 'Franka Panda', 'KUKA iiwa14'"),
        (["--robot", "qqq"], "expected one of baxter, character, fetch"),
        (["--targets", "0"], "'--targets': Input should be greater than or equal to 1"),
        (
            ["--solver", "ccd", "--robot", "ur5"],
            "expected one that is asked ur5 in ik, got ccd; `plumb",
        ),
    ],
)
def test_a_misspelt_name_gets_a_suggestion(folder, capsys, words, said):
    assert bench("ik", "--quick", *words) == 2
    assert said in capsys.readouterr().err


@pytest.mark.slow
def test_a_dry_run_measures_nothing_and_knows_how_long_it_takes(folder, capsys):
    asked = ("ik", *SMALL, "--with", "my_ik.py")
    assert bench(*asked, "--dry-run") == 0
    told = capsys.readouterr().out
    assert "9 to measure, 0 already" in told
    assert "Total: time unknown, without compilation" in told
    assert "about" not in told
    assert not Path("out").exists()
    bench(*asked, "--solver", "ccd")
    capsys.readouterr()
    bench(*asked, "--dry-run")
    told = capsys.readouterr().out
    assert "7 to measure, 2 already" in told
    assert "and the unknown time of" not in told
    assert {record.solver for record in records()} == {"ccd", "My FABRIK"}


@pytest.mark.slow
def test_problems_of_a_python_file_stand_in_the_same_tables(folder, capsys):
    (folder / "my_problems.py").write_text(PROBLEMS, encoding="utf-8")
    words = ("--problem", "my_problems.py", "--with", "my_ik.py", "--solver", "My FABRIK")
    assert bench("ik", "--quick", *words, "--solver", "ccd") == 0
    assert {(r.problem, r.solver) for r in records()} == {
        ("chain/tentacle", "ccd"), ("chain/tentacle", "My FABRIK"),
    }  # fmt: skip
    assert [row[0] for row in made("ik")["accuracy"].rows] == ["tentacle", "tentacle"]
    assert all((r.measured["residual"] <= 1e-4).mean() > 0.5 for r in records())
    (folder / "my_problems.py").write_text(PROBLEMS.replace("0.3, 0.3", "0.2, 0.2"))
    capsys.readouterr()
    assert bench("ik", "--quick", *words, "--dry-run") == 0
    assert "tentacle is another problem now" in " ".join(capsys.readouterr().out.split())


URDF = """<robot name="r"><link name="b"/><link name="l1"/><link name="l2"/><link name="t"/>
<joint name="j1" type="revolute"><parent link="b"/><child link="l1"/>
<origin xyz="0 0 .3" rpy=".1 .2 .3"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="j2" type="continuous"><parent link="l1"/><child link="l2"/><origin xyz=".4 0 0"/>
<axis xyz="0 1 0"/></joint>
<joint name="j3" type="fixed"><parent link="l2"/><child link="t"/>
<origin xyz=".3 0 .1" rpy="1 0 0"/></joint></robot>"""


MJCF = """<mujoco><compiler angle="radian"/><worldbody><body name="a" pos="0 0 .3" euler=".1 .2 0">
<joint name="j1" axis="0 0 1" range="-2 2" limited="true"/>
<body name="t" pos=".4 0 .1"><joint name="j2" axis="0 1 0" range="-1 1" limited="true"/>
</body></body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    ("text", "reader", "upper"), [(URDF, urdf, [2.0, 2.0 * np.pi]), (MJCF, mjcf, [2.0, 1.0])]
)
def test_a_model_becomes_a_chain_with_the_kinematics_of_the_file(folder, text, reader, upper):
    path = folder / f"mine.{'urdf' if reader is urdf else 'xml'}"
    path.write_text(text)
    robot = models.robot(path, "mine", None)
    assert robot.upper.tolist() == upper
    q, model = np.array([0.4, -0.9]), reader.read(path).articulation
    found, rest = (Evaluator(robot).forward(x)[0] for x in (q, 0.0 * q))
    full = np.zeros(model.coordinate_count)
    hinges = [j for j, kind in enumerate(model.kinds) if kind == "hinge"]
    full[[model.coordinates_of(j).start for j in hinges]] = q
    expected = forward_kinematics(model, full)
    np.testing.assert_allclose(found[0], expected.positions[-1], atol=1e-12)
    assert np.linalg.norm(found[0] - rest[0]) > 0.1


def test_a_slide_is_refused_by_its_name(folder):
    path = folder / "slides.urdf"
    axis, limit = '<axis xyz="0 1 0"/>', '<limit lower="0" upper="1" effort="1" velocity="1"/>'
    path.write_text(URDF.replace("continuous", "prismatic").replace(axis, axis + limit))
    with pytest.raises(ValueError, match="expected hinges to 't', got a slide"):
        models.robot(path, "slides", None)


TURNS = "Zrotation Xrotation Yrotation"
END = f"CHANNELS 3 {TURNS}\nEnd Site\n{{\nOFFSET 0 1 0\n}}\n}}\n"
BVH = f"""HIERARCHY
ROOT hip
{{
OFFSET 0 1 0
CHANNELS 6 Xposition Yposition Zposition {TURNS}
JOINT spine
{{
OFFSET 0 2 0
CHANNELS 3 {TURNS}
JOINT head
{{
OFFSET 0 1 0
{END}}}
JOINT leg
{{
OFFSET 1 0 0
{END}}}
MOTION
Frames: 1
Frame Time: 0.01
{" ".join("0" * 15)}
"""


def test_a_bvh_becomes_targets_that_its_joints_can_reach(folder):
    path = folder / "walk.bvh"
    path.write_text(BVH)
    targets = models.skeleton(path, "walk", "head", count=50).targets
    assert targets.skeleton.offsets[1:].tolist() == [[0.0, 2.0, 0.0], [0.0, 1.0, 0.0]]
    assert targets.starts.shape == (50, 3, 4)
    distances = np.linalg.norm(targets.targets - targets.skeleton.offsets[0], axis=1)
    assert (distances <= 3.0 + 1e-9).all()
    assert (distances >= 1.0 - 1e-9).all()
    assert np.ptp(distances) > 1.0
    with pytest.raises(ValueError, match="effector: expected one of hip"):
        models.skeleton(path, "walk", "tail")


@pytest.mark.slow
def test_a_folder_of_models_is_measured_by_ours_and_by_entrants(folder):
    (folder / "models").mkdir()
    (folder / "models" / "mine.urdf").write_text(URDF)
    (folder / "models" / "readme.txt").write_text("nothing")
    (folder / "robot.py").write_text(ROBOT)
    bench("ik", "--quick", "--targets", "10", "--problem", "models", "--with", "robot.py",
          "--solver", "Mine", "--solver", "Plumbob LM, first phase")  # fmt: skip
    found = {(one.problem, one.solver): one for one in records()}
    for solver in ("Mine", "Plumbob LM, first phase"):
        assert found["robots/mine", solver].measured["solved"].size == 6
        assert found["unreachable/mine", solver].measured["solved"].sum() == 0
    assert found["robots/mine", "Plumbob LM, first phase"].measured["solved"].any()


@pytest.mark.parametrize(
    ("option", "name", "text", "said"),
    [
        ("--with", "bad.py", "def f(:", "SyntaxError"),
        ("--with", "bad.py", "x = 1", "expected functions named as some of"),
        ("--with", "bad.py", "raise SystemExit(3)", "SystemExit"),
        ("--with", "bad.py", "def forward_kinematics(a):\n    pass", "suites for users' solvers"),
        ("--with", "bad.py", None, "bad.py, which does not exist"),
        ("--problem", "bad.py", "def f(:", "SyntaxError"),
        ("--problem", "bad.py", "x = 1", "functions without arguments, got none"),
        ("--problem", "bad.py", "def f():\n    raise OSError('gone')", "OSError: gone"),
        ("--problem", "bad.py", "def f():\n    return {'parents': [-1]}", "missing 2"),
        ("--problem", "bad.py", "def f():\n    return {'colour': 1}", "argument 'colour'"),
        ("--problem", "bad.py", "def f():\n    return 3", "'int' object is not a mapping"),
        ("--problem", "bad.py", PROBLEMS.replace("[0, 8]", "[0, 9]"), "hammock: pinned"),
        ("--problem", "bad.py", PROBLEMS.replace("(20, 3)", "20"),
         "targets: expected shape (target, 3)"),
        ("--problem", "bad.urdf", "<robot>", "bad.urdf"),
        ("--problem", "other.xml", "<html/>", "expected a <mujoco>"),
        ("--problem", "bad.obj", "f 1 2 3", "expected a folder or .py, .urdf"),
    ],
)  # fmt: skip
def test_an_invalid_solver_or_problem_is_refused_in_one_sentence(
    folder, capsys, option, name, text, said
):
    if text:
        (folder / name).write_text(text)
    assert bench("ik", "--quick", option, name) == 2
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1
    assert not Path("out").exists()
