"""The line that a terminal shows while a kernel is compiled."""

import os
import pty
import subprocess
import sys

import pytest

from plumbob import compile_notice

PROGRAM = """
import numpy as np
from plumbob import compile_notice
compile_notice.install()
compile_notice.install()
compile_notice.DELAY = 0.05
from plumbob.reference import forward_kinematics, scenes
forward_kinematics(*scenes.lab_arm())
"""
LINE = "compiling forward_kinematics, once"


def run(cache, root):
    """What a fresh process writes on stderr, a terminal."""
    ours, theirs = pty.openpty()
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    command = [sys.executable, "-c", PROGRAM]
    subprocess.run(command, stderr=theirs, env=environment, cwd=root, check=True, timeout=120)
    os.write(theirs, b"end")
    shown = os.read(ours, 10_000).decode()
    os.close(ours)
    os.close(theirs)
    return shown.removesuffix("end").splitlines()


def test_a_terminal_says_once_what_is_compiled(tmp_path, request):
    root = request.config.rootpath
    assert run(tmp_path, root) == [LINE]
    assert run(tmp_path, root) == []


@pytest.mark.parametrize(
    ("delay", "is_terminal", "lines"),
    [(0.0, True, [LINE]), (100.0, True, []), (0.0, False, [])],
    ids=["slow", "compiled sooner", "pipe"],
)
def test_only_a_terminal_is_told_and_only_of_slow_ones(
    monkeypatch, capsys, delay, is_terminal, lines
):
    monkeypatch.setattr(compile_notice, "DELAY", delay)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_terminal, raising=False)
    compile_notice._on_compile("forward_kinematics", True)
    (timer,) = compile_notice._timers.values()
    if not delay:
        timer.join(60.0)
    compile_notice._on_compile("forward_kinematics", False)
    assert timer.finished.is_set()
    assert capsys.readouterr().err.splitlines() == lines
