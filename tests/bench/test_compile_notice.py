"""The line that a terminal shows while a kernel is compiled."""

import os
import pty
import subprocess
import sys

import pytest

PROGRAM = """
import numpy as np
from plumbob import compile_notice
compile_notice.install()
compile_notice.install()
compile_notice.DELAY = {delay}
from plumbob.reference import forward_kinematics, scenes
forward_kinematics(*scenes.lab_arm())
"""
LINE = "compiling forward_kinematics, once"


def run(cache, delay=0.05):
    """What a fresh process writes on stderr, a terminal."""
    ours, theirs = pty.openpty()
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    command = [sys.executable, "-c", PROGRAM.format(delay=delay)]
    subprocess.run(command, stderr=theirs, env=environment, check=True, timeout=120)
    os.write(theirs, b"end")
    shown = os.read(ours, 10_000).decode()
    os.close(ours)
    os.close(theirs)
    return shown.removesuffix("end").splitlines()


def test_a_terminal_says_once_what_is_compiled(tmp_path):
    assert run(tmp_path) == [LINE]
    assert run(tmp_path) == []


def test_what_is_compiled_sooner_is_not_worth_a_line(tmp_path):
    assert run(tmp_path, delay=100) == []


def test_a_pipe_is_told_nothing(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", PROGRAM.format(delay=0.05)]
    done = subprocess.run(command, capture_output=True, env=environment, check=True, timeout=120)
    assert done.stderr == b""


@pytest.fixture(autouse=True)
def in_the_clone(monkeypatch, request):
    monkeypatch.chdir(request.config.rootpath)
