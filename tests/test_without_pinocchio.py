"""Where Pinocchio has no wheel its claims are not checked, and everything else works.

The judge imports no engine: tests/test_layout.py keeps `verify` from importing `crosscheck`.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# Python imports this file first, in every process: Pinocchio is not installed.
SITE = """
import importlib.metadata, sys

sys.modules["pinocchio"] = None
distributions = importlib.metadata.distributions
importlib.metadata.distributions = lambda **query: (
    () if query.get("name") == "pin" else distributions(**query)
)
"""
# The claims need nothing that Windows lacks.
CHECK_WITHOUT_POSIX = """
import signal, sys

sys.modules |= dict.fromkeys(("fcntl", "grp", "pwd", "resource"))
del signal.SIGHUP, signal.SIGKILL, signal.setitimer
from plumbob.cli import main as cli

cli.main(["check", sys.argv[1]])
"""
PROGRAM = """
import json, sys
from plumbob.cli import main as cli

for line in json.loads(sys.argv[1]):
    code = cli.run_command(line)
    print(f"\\n{code}")
    print("END", flush=True)
"""
URDF = """
<robot name="arm"><link name="base"/><link name="arm"/>
<joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/>
<origin xyz="0 0 1"/><axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
</joint></robot>"""
NOT_CHECKED = "not checked: Pinocchio has no wheel here"
CLAIMS = ["joint positions, Pinocchio", "joint positions, MuJoCo"]
BENCH = ["bench", "--quick", "--targets", "2", "-o", "out"]
CHECKED = ["--problem", CLAIMS[0], "--problem", CLAIMS[1]]
COMMANDS = {
    "check": ["check", *CLAIMS],
    "list": ["check", "--list"],
    "files": ["check", "--files", "arm.urdf"],
    "blocks of all suites": ["bench", "--list"],
    "bench of claims": [*BENCH, "check", *CHECKED],
    "bench": [*BENCH, "ik", "--problem", "robots/ur5", "--solver", "Plumbob LM"],
    "report": ["report", "out"],
}


def run(folder, program, argument):
    """Return a process without Pinocchio that has ended."""
    environment = {**os.environ, "PYTHONPATH": f"{folder}:{ROOT}", "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.run(
        [sys.executable, "-c", program, argument], cwd=folder, env=environment, timeout=600,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("without")
    (folder / "sitecustomize.py").write_text(SITE)
    (folder / "arm.urdf").write_text(URDF)
    return folder


@pytest.fixture(scope="module")
def results(folder):
    """Return the exit code and the output of each command, by its name."""
    output = run(folder, PROGRAM, json.dumps(list(COMMANDS.values()))).stdout
    parts = [part.rstrip().rpartition("\n") for part in output.split("END\n")[:-1]]
    assert len(parts) == len(COMMANDS), output
    endings = [(int(code), text) for text, _, code in parts]
    return dict(zip(COMMANDS, endings, strict=True))


def test_its_claims_are_not_checked_and_others_are(results):
    code, output = results["check"]
    lines = output.splitlines()
    assert code == 0
    assert NOT_CHECKED in next(line for line in lines if CLAIMS[0] in line)
    assert lines[-1] == f"1 of 1 claims held; 1 {NOT_CHECKED}"
    assert CLAIMS[0] in results["list"][1]


def test_files_are_read_by_the_other_engine(results):
    code, output = results["files"]
    assert code == 0
    assert "MuJoCo agrees" in output
    assert output.splitlines()[-1] == f"Pinocchio: {NOT_CHECKED}"


def test_the_bench_measures_and_reports(results, folder):
    for name in ("blocks of all suites", "bench of claims", "bench", "report"):
        assert results[name][0] == 0, results[name][1]
    records = list(map(json.loads, (folder / "out" / "records.jsonl").read_text().splitlines()))
    assert "robots/ur5" in {r["problem"] for r in records if "solved" in r["measured"]}
    assert {r["measured"].get("arbiter", "MuJoCo") for r in records} == {"MuJoCo"}
    table = (folder / "out" / "tables" / "check.csv").read_text()
    assert f'"{CLAIMS[0]}",{NOT_CHECKED}' in table
    assert "1 of 1 claims held" in (folder / "out" / "index.html").read_text()


def test_claims_need_nothing_that_windows_lacks(folder):
    process = run(folder, CHECK_WITHOUT_POSIX, CLAIMS[1])
    assert process.returncode == 0, process.stdout
    assert "1 of 1 claims held" in process.stdout
