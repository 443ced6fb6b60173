"""The command `plumbob verify`: three doors, exit codes, files, and what misuse is told."""

import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from small_discipline import SMALL, use_small_disciplines

from plumbob.cli import main as cli
from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.connections import saved

RIGHT = """
import numpy as np

def rotated(q, v):
    w, u = q[0], q[1:]
    return v + 2.0 * np.cross(u, np.cross(u, v) + w * v)

def product(a, b):
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.array([w, *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])

def forward_kinematics(parents, offsets, local_rotations):
    positions, rotations = [], []
    for parent, offset, local in zip(parents, offsets, local_rotations):
        if parent < 0:
            positions.append(offset)
            rotations.append(local)
        else:
            rotations.append(product(rotations[parent], local))
            positions.append(positions[parent] + rotated(rotations[PLACE], offset))
    return np.array(positions)
"""
SOLVERS = {
    "right.py": RIGHT.replace("PLACE", "parent"),
    "wrong.py": RIGHT.replace("PLACE", "-1"),
    "broken.py": "def forward_kinematics(parents):\n    raise RuntimeError('no <b>luck</b>')\n",
    "syntax.py": "def forward_kinematics(:\n",
}
# Speaks the protocol and answers every request with the request's offsets.
PROGRAM = """
import json, sys
for line in sys.stdin:
    asked = json.loads(line)
    answer = {"id": asked["id"]}
    if asked["task"] == "greeting":
        answer |= {"protocol": 1, "tasks": ["forward_kinematics"], "name": " ".join(sys.argv[1:])}
    else:
        answer["positions"] = asked["offsets"]
    print(json.dumps(answer), flush=True)
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Run every test in a folder of solvers, by disciplines of four cases, in English."""
    monkeypatch.chdir(tmp_path)
    for name in ("LC_ALL", "LC_MESSAGES", "LANG"):
        monkeypatch.delenv(name, raising=False)
    use_small_disciplines(monkeypatch)
    for name, text in SOLVERS.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "program.py").write_text(PROGRAM)
    return tmp_path


def plumbob(capsys, *arguments):
    """The exit code, stdout and stderr of `plumbob verify`."""
    code = cli.run_command(["verify", *map(str, arguments)])
    return code, *capsys.readouterr()


# What the screen says, by the verdict.
WORDS = {
    "right": "forward_kinematics  RIGHT ",
    "wrong": "applied to a joint's own offset. (explains 100%",
    "broken": "RuntimeError in line 3 of",
}
SURROGATES = {
    "right": SOLVERS["right.py"],
    "wrong": SOLVERS["wrong.py"],
    "broken": SOLVERS["broken.py"].replace("luck", r"\udcff luck \ud800"),
}


@pytest.mark.parametrize("verdict", SURROGATES)
def test_a_python_file_gets_its_verdict_and_all_files(capsys, folder, verdict):
    """Names of files and what a solver says hold halves of pairs; UTF-8 has no bytes for them."""
    greeting = 'PLUMBOB = {"name": "Mine \\ud800", "version": "1\\udcff"}\n'
    (folder / "solver\udcff.py").write_text(greeting + SURROGATES[verdict])
    code, out, err = plumbob(capsys, "solver\udcff.py", "-o", "out\udcff")
    assert code == (0 if verdict == "right" else 1)
    passed = 4 if verdict == "right" else 0
    last = f"forward_kinematics: {verdict.upper()}, {passed}/4 cases passed"
    assert last in err.splitlines()  # a busy machine may print a line on its search behind it
    assert f"forward_kinematics  {verdict.upper()} " in out
    assert WORDS[verdict] in " ".join(out.split()) or WORDS[verdict] in out
    assert out.encode()
    place = Path("out\udcff")
    stored = json.loads((place / "verdict.json").read_text())
    assert stored["verdict"] == verdict
    assert stored["solver"]["name"] == "Mine \\ud800"
    assert ET.parse(place / "verdict.xml").getroot().get("tests") == "4"
    assert r"Mine \ud800" in (place / "index.html").read_text()
    if verdict != "right":
        assert json.loads((place / "failures" / "forward_kinematics.json").read_text())["answer"]


def test_a_program_stands_behind_two_hyphens_with_its_own_options(capsys):
    code, out, _ = plumbob(
        capsys, "--json", "a.json", "--", sys.executable, "program.py", "--lang", "zh", "--fast"
    )
    assert code == 1
    assert "--lang zh --fast" in out
    assert f"forward_kinematics.json -- {sys.executable} program.py --lang zh --fast" in out
    assert json.loads(Path("a.json").read_text())["solver"]["name"] == "--lang zh --fast"


# The time of each request [s], while the reference takes 1e-5 s; the speed, or why there is none.
TIMES = {
    "1e-6": "10 times faster",
    "None": "Not timed: only the round trips of requests are known",
    "0": 'Not timed: "seconds" is 0 in all answers.',
}


@pytest.mark.parametrize(("seconds", "words"), TIMES.items())
def test_only_the_programs_own_time_is_compared_with_the_reference(capsys, folder, seconds, words):
    setting = f'answer["seconds"] = {seconds}'
    text = PROGRAM.replace('answer["positions"]', f'{setting}; answer["positions"]')
    (folder / "timed.py").write_text(text)
    _, out, _ = plumbob(capsys, "-o", "out", "--", sys.executable, "timed.py")
    result = json.loads(Path("out/verdict.json").read_text())
    (task,) = result["tasks"]
    page = Path("out/index.html").read_text()
    if "faster" in words:
        times = ([c[key] for c in task["cases"]] for key in ("seconds", "reference_seconds"))
        own, reference = map(sum, times)
        assert task["slowdown"] == pytest.approx(own / reference) == pytest.approx(0.1)
        assert f"  {words}\n" in out
        assert "Not timed" not in out
        assert f"<td>{words}</td>" in page
        return
    assert task["slowdown"] is None
    assert all(case["seconds"] in (None, 0, 1e-6) for case in task["cases"])
    assert "  not timed\n" in out
    assert words in " ".join(out.split())
    assert any(words in remark for remark in result["remarks"])
    assert "<td>not timed</td>" in page
    assert not any(f" x {rate}" in text for rate in ("slower", "faster") for text in (out, page))


def test_answers_are_judged_in_files(capsys, folder):
    code, out, _ = plumbob(
        capsys, "--export-cases", "cases", "--task", "forward_kinematics", "--seed", "3"
    )
    assert code == 0
    assert "4 cases are in cases" in out
    assert "plumbob verify --answers cases" in out
    code, out, _ = plumbob(capsys, "--answers", "cases")
    assert code == 1
    assert "forward_kinematics  BROKEN" in out
    for path in (folder / "cases").glob("*/*/request.json"):
        asked = json.loads(path.read_text())
        case = Case("", asked["task"], {k: np.array(v) for k, v in asked.items() if k != "task"},
                    "", sentence(""))  # fmt: skip
        expected = SMALL["forward_kinematics"].right(case)["positions"]
        answer = {"positions": expected.tolist()}
        (path.parent / "answer.json").write_text(json.dumps(answer))
    code, out, _ = plumbob(capsys, "--answers", "cases")
    assert "forward_kinematics  RIGHT" in out
    assert code == 0


def test_a_failing_case_is_saved_and_asked_again(capsys, folder):
    plumbob(capsys, "wrong.py:forward_kinematics", "--seed", "5")
    path = folder / "plumbob_failures" / "forward_kinematics.json"
    stored = json.loads(path.read_text())
    assert stored["name"] == "forward_kinematics, pose 0"
    assert stored["request"]["task"] == "forward_kinematics"
    assert len(stored["request"]["offsets"]) == 2
    assert np.shape(stored["answer"]["positions"]) == np.shape(stored["expected"]["positions"])
    code, out, _ = plumbob(capsys, "wrong.py", "--rerun", path)
    assert code == 1
    assert "0/1" in out
    assert f"--rerun {path} wrong.py" in out
    code, out, _ = plumbob(capsys, "right.py", "--rerun", path)
    assert code == 0
    assert "1/1" in out


def test_a_case_is_asked_again_after_those_that_it_follows():
    cases = SMALL["forward_kinematics"].cases(None, "", 0, False)
    like = Case("like", "energy", {}, "", sentence(""), facts={"like": cases[3].name, "n": 1})
    one = saved.SavedCase("energy", "", 0, False, "like")
    wanted = saved.cases_of(one, [*cases, like])
    assert [case.name for case in wanted] == [cases[0].name, cases[3].name, "like"]
    with pytest.raises(ValueError, match="'gone' of energy is not asked of this solver any more"):
        saved.cases_of(saved.SavedCase("energy", "", 0, False, "gone"), cases)


def test_the_locale_chooses_the_language_of_the_screen_and_of_all_files(
    capsys, folder, monkeypatch
):
    monkeypatch.setenv("LANG", "zh_CN.UTF-8")
    code, out, _ = plumbob(capsys, "wrong.py", "-o", "out")
    assert code == 1
    assert "判定" in out
    written = {path.name for path in (folder / "out").iterdir()}
    assert written == {"index.html", "verdict.json", "verdict.xml", "failures"}
    assert '<html lang="zh-CN">' in (folder / "out" / "index.html").read_text()
    assert ET.parse(folder / "out" / "verdict.xml").getroot().get("failures") == "4"
    assert not (folder / "plumbob_failures").exists()
    assert "需要一个 Python 文件" in plumbob(capsys)[2]
    assert "需要一个 Python 文件" not in plumbob(capsys, "--lang", "en")[2]


def test_tasks_are_listed_with_what_they_ask(capsys):
    code, out, _ = plumbob(capsys, "--list")
    assert code == 0
    assert "forward_kinematics(parents, offsets, local_rotations)" in out
    assert "Returns some of: positions, rotations" in out
    code, out, _ = plumbob(capsys, "--list", "--task", "mass_spring_step")
    assert "[tension_only] (spring): true: the spring resists no compression" in out
    assert "forward_kinematics" not in out


def test_template_is_written_once_with_its_next_commands(capsys, folder):
    code, out, _ = plumbob(capsys, "--template", "cpp")
    assert code == 0
    for words in ("Build: g++ -std=c++17 -O2 solver.cpp", "Then: plumbob verify -- ./solver"):
        assert words in out
    assert "Then: plumbob verify solver.py" in plumbob(capsys, "--template", "python")[1]
    (folder / "solver.cpp").unlink()
    (folder / "plumbob.hpp").write_text("mine")
    code, out, err = plumbob(capsys, "--template", "cpp")
    assert (code, out) == (2, "")
    assert "plumbob.hpp is here already" in err
    assert (folder / "plumbob.hpp").read_text() == "mine"
    assert not (folder / "solver.cpp").exists()


MISUSE = {
    "no solver": ([], "plumbob verify --template python writes a starter"),
    "nothing behind --": (["--"], "expected a Python file, module:object, or -- and a program"),
    "two solvers": (["a.py", "b.py"], "plumbob verify -- a.py b.py"),
    "no such file": (["gone.py"], "gone.py, which does not exist"),
    "no such module": (["gone:x"], "gone"),
    "no such program": (["--", "./gone"], "There is no command ./gone."),
    "syntax": (["syntax.py"], "SyntaxError in line 1 of syntax.py"),
    "task": (["right.py", "--task", "energy"], "expected one that the solver offers"),
    "task of the list": (["--list", "--task", "fk"], "expected one of forward_kinematics"),
    "language": (["right.py", "--lang", "fr"], "lang: expected one of en, zh"),
    "time": (["right.py", "--time-limit", "0"], "time-limit: expected seconds above 0"),
    "memory": (["right.py", "--memory-limit", "0"], "--memory-limit"),
    "rerun": (["right.py", "--rerun", "right.py"], "expected a case that verify saved"),
    "rerun of nothing": (["right.py", "--rerun", "gone.json"], "gone.json"),
    "answers": (["--answers", "."], "expected a folder of exported cases"),
    "answers and solver": (["--answers", ".", "right.py"], "got right.py as well"),
    "output": (["right.py", "--json", "."], "expected a file, got a folder"),
    "output folder": (["right.py", "-o", "right.py"], "right.py"),
    "self-test of a task": (["--self-test", "--task", "energy"], "expected no task or solver"),
    "option": (["right.py", "--jsn", "a"], "--json"),
}


@pytest.mark.parametrize(("arguments", "words"), MISUSE.values(), ids=MISUSE)
def test_misuse_exits_2_with_one_sentence(capsys, folder, arguments, words):
    before = set(folder.iterdir())
    code, out, err = plumbob(capsys, *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("plumbob: ")
    assert err.count("\n") == 1
    assert words in err
    assert {path for path in folder.iterdir() if path.name != "__pycache__"} <= before


LAWS = """
from plumbob.testing import laws
import right, wrong
import pytest
from small_discipline import use_small_disciplines

use_small_disciplines(pytest.MonkeyPatch())
test_right = laws(right)
test_wrong = laws(forward_kinematics=wrong.forward_kinematics, seed=1)
"""


ROOT = str(Path(cli.__file__).parents[2])
CODE = "from plumbob.cli.main import main; main()"


def run_python(*arguments, **options):
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT}/tests:."}
    environment |= options.pop("environment", {})
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    command = [sys.executable, *arguments]
    return subprocess.run(command, text=True, env=environment, timeout=120, **options)


def test_laws_run_under_plain_pytest(folder):
    (folder / "test_mine.py").write_text(LAWS)
    run = run_python("-m", "pytest", "-p", "no:cacheprovider", "-rA", "test_mine.py")
    assert run.returncode == 1, run.stdout
    for words in [
        "4 failed, 4 passed",
        "PASSED test_mine.py::test_right[forward_kinematics forward_kinematics, pose 0]",
        "positions differ by",
        "Its own rotation is applied to a joint's own offset.",
    ]:
        assert words in run.stdout
    assert "raceback" not in run.stdout


def test_only_laws_need_pytest(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "pytest", None)  # as if it were not installed
    monkeypatch.delitem(sys.modules, "plumbob.testing", raising=False)
    monkeypatch.delitem(sys.modules, "plumbob.verify.pytest_laws", raising=False)
    from plumbob.testing import laws

    code, out, _ = plumbob(capsys, "--list")
    assert (code, "forward_kinematics(" in out) == (0, True)
    message = "laws: expected pytest to be installed; pip install pytest"
    with pytest.raises(ImportError, match=message):
        laws(forward_kinematics=print)


@pytest.mark.slow
def test_letters_that_a_terminal_lacks_cost_no_output():
    ascii_terminal = {"PYTHONIOENCODING": "ascii"}
    run = run_python("-c", CODE, "verify", "--list", "--lang", "zh", environment=ascii_terminal)
    assert (run.returncode, run.stderr) == (0, "")
    assert "forward_kinematics(parents, offsets, local_rotations)" in run.stdout


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["right.py", "wrong.py"])
def test_full_disk_behind_the_screen_costs_no_file(folder, solver):
    with Path("/dev/full").open("w") as full:
        run = run_python("-c", CODE, "verify", solver, "-o", "out", stdout=full)
    message = "plumbob: /dev/stdout could not be written: No space left on device\n"
    assert run.returncode == 2
    assert run.stderr.splitlines(keepends=True)[-1] == message
    verdict = json.loads((folder / "out" / "verdict.json").read_text())["verdict"]
    assert f"{verdict}.py" == solver
    assert (folder / "out" / "verdict.xml").exists()
