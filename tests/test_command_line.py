"""The command line: what it prints, what it exits with, and what it never does."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import command_names
import numpy as np
import pytest

from plumbob.bench.measure.record import Record, RecordFile
from plumbob.cli import bench, terminal
from plumbob.cli import main as cli
from plumbob.cli.help_text import epilog
from plumbob.crosscheck.claims import CLAIMS
from plumbob.crosscheck.verdict import ClaimVerdict


@pytest.fixture(autouse=True)
def empty_folder(tmp_path, monkeypatch):
    """Run every test in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def main_job(monkeypatch):
    """The calls of the main job, which is not done."""
    calls = []
    monkeypatch.setattr(bench, "main_job", lambda *arguments: calls.append(arguments) or 0)
    return calls


def plumbob(capsys, *arguments):
    """The exit code, stdout and stderr of a command line."""
    code = cli.run_command(list(arguments))
    return code, *capsys.readouterr()


MISUSE = {
    "command": (["chek"], "Did you mean 'check'?"),
    "option": (["bench", "--fersh"], "--fresh"),
    "option of the main job": (["--fersh"], "--fresh"),
    "suite": (["bench", "clot"], "did you mean 'cloth'?"),
    "claim unlike any": (["check", "qqq"], "'joint positions, Pinocchio', 'joint rot"),
    "claim": (["check", "spring force"], "did you mean 'spring forces'?"),
    "scene": (["show", "hart"], "did you mean 'heart'?"),
    "scene unlike any": (["show", "qqq"], "expected one of arm, cloth, circle"),
    "solver": (["show", "heart", "--solver", "jacobi"], "expected one of ccd, fabrik"),
    "suffix": (["show", "heart", "-o", "heart.png"], "expected one of .html, .svg"),
    "suffix of a cloth": (["show", "cloth", "-o", "cloth.bvh"], "expected one of .html, .svg"),
    "no scene": (["show"], "SCENE"),
    "no records": (["report"], "no records in report"),
    "options before the command": (["--output", "x", "report"], "behind the command: report"),
    "too much": (["report", "now"], "now"),
    "no files": (["check", "--files"], "--files: expected folders or files, got none"),
    "no such folder": (["check", "--files", "here"], "here: there is no such file or folder"),
    "nothing to read": (["check", "--files", "."], "expected URDF, MJCF or BVH files, got none"),
}


@pytest.mark.parametrize(("arguments", "sentence"), MISUSE.values(), ids=MISUSE)
def test_misuse_exits_2_with_one_sentence(capsys, main_job, empty_folder, arguments, sentence):
    code, out, err = plumbob(capsys, *arguments)
    assert code == 2
    assert out == ""
    assert err.startswith("plumbob: ")
    assert err.count("\n") == 1
    assert sentence in err
    assert main_job == []
    assert not (empty_folder / "report" / "records.jsonl").exists()


def a_record(solver="ccd", **more):
    """A record that a report can be made of."""
    facts = {"subject": "kinematics", "group": "x", "work": "one pose a call"}
    return Record("timing", "kinematics/x/one pose a call", solver, {"operations": 1},
                  {**facts, "seconds": np.ones((1, 5)), "moved": 0.0, **more})  # fmt: skip


def obstruct(path, kind):
    """Put something at a path that is neither a folder nor a file that ends."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "folder":
        path.mkdir()
    else:
        path.write_text("a file")


COMMANDS = [[], ["bench", "check"], ["bench", "--fresh"], ["report"]]
OBSTRUCTED = [(command, "out", kind) for command in COMMANDS for kind in ("pipe", "device", "file")]
OBSTRUCTED += [
    (command, path, kind)
    for kind in ("pipe", "device", "folder")
    for command, path in [
        *((command, "out/records.jsonl") for command in COMMANDS),
        *((["report"], f"out/{path}") for path in
          ("index.html", "tables/check.md", "figures/timing_kinematics.svg")),
        *((["show", "heart"], path) for path in ("heart.svg", "heart.bvh", "heart.html")),
    ]
]  # fmt: skip


@pytest.mark.parametrize(("command", "path", "kind"), OBSTRUCTED)
def test_a_path_of_another_kind_exits_2_and_is_named(capsys, empty_folder, command, path, kind):
    if path.startswith("out/") and "records" not in path:
        RecordFile("out").append([a_record()])
    obstruct(empty_folder / path, kind)
    output = path if "show" in command else "out"
    code, _, err = plumbob(capsys, *command, "-o", output)
    expected = "folder" if path == "out" else "file"
    assert (code, err) == (2, f"plumbob: {path}: expected a {expected}, got a {kind}\n")


def test_a_folder_of_superseded_records_says_so(capsys):
    RecordFile("out").append([a_record(superseded="other settings")])
    code, _, err = plumbob(capsys, "report", "out")
    assert (code, err.count("\n")) == (2, 1)
    assert "no records in out: all are superseded" in err


def test_a_figure_that_cannot_be_drawn_costs_itself_and_a_sentence(capsys, monkeypatch):
    def fail(*_):
        raise ValueError("arange: cannot compute length")

    from plumbob.bench.figures import sketch

    monkeypatch.setattr(sketch, "_draw", fail)
    monkeypatch.setattr(sketch, "_cache", type(sketch._cache)())
    RecordFile("out").append([a_record()])
    code, out, err = plumbob(capsys, "report", "out")
    assert (code, err) == (0, "")
    assert "The figure timing_kinematics cannot be drawn (ValueError: arange: cannot" in out
    assert "ccd" in Path("out", "tables", "timing_kinematics.csv").read_text()


@pytest.mark.parametrize("name", ["a\x1b[2Jb", "a\udcffb", "a\nb"])
def test_a_path_of_hostile_letters_is_said_in_one_line(capsys, name):
    code, _, err = plumbob(capsys, "report", "-o", name)
    assert code == 2
    assert err.count("\n") == 1
    assert err.rstrip("\n").isprintable()


@pytest.mark.parametrize(
    "arguments",
    [
        ["bench", "arm", "--dry-run", "-o"],
        ["--output"],
        ["report", "-o"],
        ["report"],
        ["records", "drop", "--suite", "arm"],
        ["records", "merge", "out", "--into"],
    ],
)
@pytest.mark.parametrize("name", ["", " ", "a\nb"])
def test_a_folder_without_a_name_is_misuse_and_nothing_is_written(
    capsys, main_job, arguments, name
):
    """An empty path would be the working folder, whose records would be dropped or replaced."""
    for folder in (".", "out"):
        RecordFile(folder).append([a_record()])
    files = {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()}
    code, _, err = plumbob(capsys, *arguments, name)
    assert (code, err.count("\n")) == (2, 1)
    assert "expected a name without control characters, got" in err
    assert {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()} == files


READERS = {"help": ["--help"], "claims": ["check", "--list"], "complaint": ["chek"]}


@pytest.mark.sample(every=2)
@pytest.mark.parametrize("arguments", READERS.values(), ids=READERS)
@pytest.mark.parametrize("buffered", ["", "1"])
def test_a_reader_that_leaves_ends_it_without_a_word(arguments, buffered):
    """Nor is it taken for a claim that is missed, which is 1."""
    read, write = os.pipe()
    os.close(read)
    script = f"from plumbob.cli.main import main; main({arguments})"
    both = arguments == READERS["complaint"]
    done = subprocess.run(
        [sys.executable, "-c", script], stdout=write, stderr=write if both else subprocess.PIPE,
        env={**os.environ, "PYTHONUNBUFFERED": buffered}, cwd=Path(cli.__file__).parents[2],
        check=False,
    )  # fmt: skip
    os.close(write)
    assert done.returncode == 141
    assert both or done.stderr == b""


def test_the_main_job_says_first_what_it_does_and_where(capsys, monkeypatch, empty_folder):
    calls = []
    monkeypatch.setattr(bench, "run_suites", lambda suites, *_, **__: calls.append(suites) or 1)
    monkeypatch.setattr(bench, "write_report", lambda *_: 0)
    code, out, _ = plumbob(capsys, "--output", "here")
    assert code == 1
    ((first, *_, last),) = calls
    assert (first, last) == ("check", "scale")
    assert {*calls[0]} == {*bench.SUITES}
    assert all(text in out for text in ("Pinocchio and MuJoCo", "here/index.html", "minute"))


@pytest.mark.parametrize("arguments", [[], ["bench", "arm"], ["check", "spring forces"]])
def test_ctrl_c_exits_130_and_a_bench_says_what_is_kept(capsys, monkeypatch, arguments):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    for name in ("plumbob.cli.bench.run_suites", "plumbob.crosscheck.claims.run_claims"):
        monkeypatch.setattr(name, interrupted)
    code, _, err = plumbob(capsys, *arguments)
    kept = "" if "check" in arguments else "; finished measurements are kept"
    assert (code, err) == (130, f"plumbob: interrupted{kept}\n")


def judged(missed):
    """Stand for `run_claims`, with every claim missed or held."""

    def run_claims(names, progress=None):
        return [ClaimVerdict(CLAIMS[name], 3, 1e-3, 1.0, missed) for name in names]

    return run_claims


@pytest.mark.parametrize(("missed", "count"), [("they differ", 0), ("", 1)])
def test_a_missed_claim_exits_1_and_one_that_holds_0(capsys, monkeypatch, missed, count):
    monkeypatch.setattr("plumbob.crosscheck.claims.run_claims", judged(missed))
    code, out, _ = plumbob(capsys, "check", "spring forces")
    assert code == 1 - count
    assert f"{count} of 1 claims held" in out
    assert ("MISSED: spring forces (they differ)" in out) == bool(missed)
    assert len(plumbob(capsys, "check", "--list")[1].splitlines()) == len(CLAIMS)


BODY = '<body name="b"><geom size="0.1"/><joint name="j"/>{}</body>'.format
CHARACTER = "<mujoco><worldbody>{}</worldbody></mujoco>".format


@pytest.fixture
def robots(empty_folder, monkeypatch):
    """A folder of files, read without a process of their own."""
    from plumbob.crosscheck.robots import files
    from plumbob.process import child as child_process

    monkeypatch.setattr(
        child_process.CallProcess, "call", lambda self, function, *given: function(*given)
    )
    monkeypatch.setattr(files, "known_deviations", lambda *_: [])
    folder = empty_folder / "robots"
    (folder / "arms").mkdir(parents=True)
    (folder / "arms" / "arm|1.urdf").write_text('<robot name="r"><link name="a"/></robot>')
    (folder / "b.xml").write_text(CHARACTER(BODY("")))
    (folder / "c.xml").write_text(CHARACTER('<body name="a"><composite/></body>'))
    (folder / "d.xml").write_text("<other/>")
    (folder / "e.xml").write_text("<mujocoinclude/>")
    return folder


def test_files_are_checked_and_counted(capsys, robots):
    code, out, err = plumbob(capsys, "check", "--files", "robots")
    assert (code, err) == (0, "")
    assert re.search(r"^robots/arms/arm\|1.urdf \(URDF\): \w+ agrees \(0\); \w+ agr", out, re.M)
    assert re.search(
        r"^robots/c.xml \(MJCF\): .*\n  Pinocchio: not read by us: c.xml, li", out, re.M
    )
    assert (
        "In 3 files no reading disagrees; 1 is a part that others include, 1 XML file is of" in out
    )
    assert re.search(r"^MJCF +Pinocchio +2 +1 +0 +1 ", out, re.MULTILINE)


def test_files_that_differ_exit_1(capsys, robots):
    """MuJoCo, which does not read the file, confirms no reading."""
    text = CHARACTER(BODY("<frame><joint name='k'/></frame>")).replace("size", "colour")
    (robots / "b.xml").write_text(text)
    code, out, _ = plumbob(capsys, "check", "--files", "robots/b.xml", "robots/arms")
    assert code == 1
    assert re.search(r"^robots/b.xml \(MJCF\): Pinocchio differs \(", out, re.MULTILINE)
    assert "In 2 files 1 reading disagrees; 0 are parts that others include, 0 XML files are" in out


@pytest.mark.parametrize("command", command_names.COMMANDS)
def test_help_has_examples_in_columns_and_does_nothing(capsys, main_job, empty_folder, command):
    """It names no type of Python, and no line of it is an unfinished phrase."""
    code, out, _ = plumbob(capsys, *command.split(), "--help")
    assert code == 0
    assert "Examples:\n    plumbob" in out
    assert not re.search(r"<[a-zA-Z]|\[\[|\{|\.\.\.\.|  (Of|For|That|Else) ", out)
    examples = re.findall(r"^    (plumbob \S.*?)  +\S", out[out.index("Examples:") :], re.MULTILINE)
    assert all(len(example) <= 40 for example in examples)
    assert main_job == []
    assert list(empty_folder.iterdir()) == []


def test_help_imports_no_engine_no_reference_and_no_matplotlib():
    script = (
        "import sys, plumbob.cli.main as cli; cli.run_command(['--help']);"
        "print(sorted({name.partition('.')[0] for name in sys.modules}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    loaded = set(eval(done.stdout.splitlines()[-1]))
    assert "typer" in loaded
    assert not loaded & {"numpy", "numba", "scipy", "mujoco", "pinocchio", "matplotlib"}
    assert not loaded & {"reference", "crosscheck", "rich"}


def test_from_measuring_to_the_page(capsys, empty_folder, monkeypatch):
    """A suite is measured, kept on record, not measured again, and reported."""
    monkeypatch.setattr(terminal, "PAUSE", 600.0)  # no progress lines on a busy machine
    code, out, err = plumbob(capsys, "bench", "arm", "--quick", "-o", "out")
    assert (code, err) == (0, "")
    count = int(out.split()[0])
    assert count > 0
    assert f"{count} measured, 0 already on record" in out
    code, out, _ = plumbob(capsys, "bench", "arm", "--quick", "-o", "out")
    assert f"0 measured, {count} already on record" in out
    part = ["--fresh", "--problem", "arm/circle"]
    code, out, _ = plumbob(capsys, "bench", "arm", "--quick", *part, "-o", "out")
    assert re.search(r"^[1-9]\d* measured, 0 already on record", out)
    code, out, err = plumbob(capsys, "report", "-o", "out")
    assert (code, err) == (0, "")
    assert re.search("(?s)Missing: Not run: check, .*`plumbob bench check .*` measures", out)
    page = (empty_folder / "out" / "index.html").read_text()
    assert "FABRIK needs fewer iterations than CCD" in page
    assert [path.name for path in empty_folder.iterdir()] == ["out"]


def test_a_motion_is_written_for_animation_programs(capsys, empty_folder):
    """A closed curve, whose last frame is beside the first."""
    from plumbob.reference.formats import bvh

    code, out, err = plumbob(capsys, "show", "heart", "-o", "heart.bvh")
    assert (code, out, err) == (0, "heart.bvh\n", "")
    motion = bvh.read(empty_folder / "heart.bvh")
    tips = motion.pose().positions[:, -1]
    assert motion.frame_time * len(tips) == pytest.approx(5.0)
    assert np.ptp(tips, axis=0).max() > 0.5
    assert np.linalg.norm(tips[0] - tips[-1]) < 0.05


NUMBA = {
    "no compiler, bench": (
        ["bench", "arm", "--quick"],
        "NUMBA_DISABLE_JIT=1",
        2,
        "plumbob: NUMBA_DISABLE_JIT: expected it unset where times are measured, got it set\n",
    ),
    "no threads": (
        ["check", "spring forces"],
        "NUMBA_NUM_THREADS=0",
        2,
        "plumbob: NUMBA_NUM_THREADS: expected a number that numba takes: "
        "Number of threads specified must be > 0.\n",
    ),
}


@pytest.mark.sample("no threads")
@pytest.mark.parametrize(("arguments", "variable", "code", "err"), NUMBA.values(), ids=NUMBA)
def test_variables_of_numba_cost_no_traceback(empty_folder, arguments, variable, code, err):
    name, value = variable.split("=")
    root = str(Path(cli.__file__).parents[2])
    done = subprocess.run(
        [sys.executable, "-m", "plumbob", *arguments], cwd=empty_folder, check=False, text=True,
        capture_output=True, env={**os.environ, "PYTHONPATH": root, name: value},
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (code, err)
    assert not list(empty_folder.rglob("records.jsonl"))


def test_an_example_in_the_help_of_bench_finds_what_it_names(capsys, empty_folder):
    line = next(line for line in epilog("bench").splitlines() if "--robot" in line)
    code, out, _ = plumbob(capsys, *shlex.split(line)[1:], "--dry-run")
    assert (code, "Plumbob LM" in out) == (0, True)
