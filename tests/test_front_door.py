"""The front door and the examples, which use nothing else."""

import ast
import importlib.metadata
import os
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import plumbob
from plumbob import reference

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
# What each prints if it does what it says.
SAYS = {
    "arm_to_target": ["CONVERGED    tip [", "UNREACHABLE"],
    "compare_step_solvers": ["local_global   CONVERGED", "gauss_newton"],
    "draw_a_heart": ["from rest: 150 frames", "from the last frame: 150 frames"],
    "falling_cloth": ["frame 9: CONVERGED", "lowest 1.4954 m"],
    "robot_with_limits": ["CONVERGED after", "coordinates ["],
}


def test_every_public_name_of_the_reference_is_at_the_front_door():
    assert set(reference.__all__) <= set(plumbob.__all__)
    assert len(set(plumbob.__all__)) == len(plumbob.__all__)
    for name in reference.__all__:
        assert getattr(plumbob, name) is getattr(reference, name)
    for name in plumbob.__all__:
        assert hasattr(plumbob, name)
    assert plumbob.__version__ == importlib.metadata.version("plumbob")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs_and_says_what_it_should(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(path), run_name="__main__")
    printed = capsys.readouterr().out
    for words in SAYS[path.stem]:
        assert words in printed
    if path.stem == "draw_a_heart":
        assert (tmp_path / "heart.bvh").stat().st_size > 0


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_fits_a_screen_and_uses_the_front_door(path):
    source = path.read_text(encoding="utf-8")
    assert len(source.splitlines()) <= 30
    nodes = list(ast.walk(ast.parse(source)))
    names = {alias.name for n in nodes if isinstance(n, ast.Import) for alias in n.names}
    names |= {n.module for n in nodes if isinstance(n, ast.ImportFrom)}
    assert "plumbob" in names
    assert names <= {"plumbob", "numpy"}
    assert ast.get_docstring(ast.parse(source))


SHADOW = 'raise SystemExit("the wrong one")'
SOLVER = """
def forward_kinematics(parents, offsets, local_rotations):
    return offsets
"""


@pytest.mark.slow
def test_a_module_of_the_same_name_where_one_works_is_left_alone(tmp_path):
    """A user's own bench.py neither breaks the import nor stops the judge."""
    for name in ("bench.py", "reference/__init__.py", "verify/__init__.py"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(SHADOW)
    (tmp_path / "solver.py").write_text(SOLVER)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for arguments, code in ((["check", "--list"], 0), (["verify", "solver.py"], 1)):
        run = subprocess.run(
            [sys.executable, "-m", "plumbob", *arguments],
            cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert (run.returncode, "the wrong one" in run.stdout + run.stderr) == (code, False)
    assert "forward_kinematics  WRONG" in run.stdout


def test_a_checkout_without_links_works(tmp_path):
    """Git on Windows may write a link as a text file that holds its target."""
    (tmp_path / "plumbob").mkdir()
    shutil.copy(ROOT / "plumbob" / "__init__.py", tmp_path / "plumbob")
    shutil.copy(ROOT / "plumbob" / "compile_notice.py", tmp_path / "plumbob")
    for folder in ("reference", "crosscheck", "verify", "bench"):
        (tmp_path / "plumbob" / folder).write_text(f"../{folder}")
        (tmp_path / folder).symlink_to(ROOT / folder)
    code = "import plumbob; print(plumbob.__file__, plumbob.solve_ik.__module__)"
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True,
        text=True, check=True,
    )  # fmt: skip
    file = tmp_path / "plumbob" / "__init__.py"
    assert run.stdout.split() == [str(file), "plumbob.reference.inverse_kinematics"]
