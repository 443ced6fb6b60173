"""Kernels compiled beside the first checks of the main job."""

import os
import subprocess
import sys

import pytest

from plumbob.bench.measure import compile_ahead

FIRST_SOLVES = """
from plumbob import ImplicitEuler, scenes, solve_ik
from plumbob.reference.backend.compilation import on_compile

labels = []
with on_compile(lambda label, begins: labels.append(label)):
    solve_ik(*scenes.lab_arm(), [0.3, 0.0, 0.4], solver="ccd")
    cloth, state = scenes.lab_cloth()
    ImplicitEuler(cloth, h=1 / 60, solver="newton").step(state)
print(labels)
"""


def test_the_process_ends_with_the_block(monkeypatch, tmp_path):
    sleeper = tmp_path / "python"
    sleeper.write_text("#!/bin/sh\nexec sleep 60\n")
    sleeper.chmod(0o755)
    processes, start = [], subprocess.Popen
    monkeypatch.setattr(sys, "executable", str(sleeper))
    monkeypatch.setattr(
        subprocess,
        "Popen",
        lambda *args, **options: processes.append(start(*args, **options)) or processes[0],
    )
    with pytest.raises(KeyboardInterrupt), compile_ahead.compiling_ahead():
        raise KeyboardInterrupt
    assert processes[0].returncode is not None


@pytest.mark.slow
def test_later_processes_find_the_kernels_compiled(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-m", compile_ahead.__name__]
    subprocess.run(command, env=environment, check=True)
    run = subprocess.run([sys.executable, "-c", FIRST_SOLVES], env=environment, check=True,
                         capture_output=True, text=True)  # fmt: skip
    assert run.stdout == "[]\n"
