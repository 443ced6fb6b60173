"""Programs that answer a skeleton of two joints and do something else to one of three."""

import subprocess
import sys
import time

import numpy as np

from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.connections import ProcessLimits
from plumbob.verify.connections.program import ProgramConnection

# The first request may wait for a busy machine; the others come when the program is warm.
LIMITS = ProcessLimits(
    first=20.0, request=0.5, leave=0.4, memory=250 << 20, line=1 << 20, prints=100
)

PRELUDE = """\
import json, os, resource, signal, subprocess, sys, time
def read():
    line = sys.stdin.readline()
    return json.loads(line) if line else sys.exit()
def say(**fields):
    print(json.dumps(fields), flush=True)
def greet(**fields):
    say(**{"id": read()["id"], "protocol": 1, "tasks": ["forward_kinematics"], **fields})
def right(request):
    say(id=request["id"], positions=[[request["id"], 0, 0]] * len(request["parents"]))
def tick():
    time.sleep(0.01)
"""
LOOP = """
greet()
while True:
    request = read()
    if len(request["parents"]) == 3:
        misbehave(request)
    else:
        right(request)
"""


def program(tmp_path, misbehave, limits=LIMITS, loop=LOOP):
    """A program that does a piece of Python when it is asked for three joints."""
    body = "".join(f"    {line}\n" for line in misbehave.splitlines())
    file = tmp_path / "connection.py"
    file.write_text(f"{PRELUDE}\ndef misbehave(request):\n{body}\n{loop}", encoding="utf-8")
    return ProgramConnection([sys.executable, "-I", "-S", str(file)], limits=limits)


def case(joints):
    inputs = {
        "parents": np.arange(-1, joints - 1),
        "offsets": np.zeros((joints, 3)),
        "local_rotations": np.eye(4)[np.zeros(joints, dtype=int)],
    }
    return Case(f"{joints} joints", "forward_kinematics", inputs, "", sentence("one"))


def running(tmp_path, seconds=2.0):
    """The commands that still run a file of this folder, after a moment to be gone."""
    deadline = time.monotonic() + seconds
    while True:
        listed = subprocess.run(
            ["ps", "-A", "-ww", "-o", "args="], capture_output=True, text=True, check=True
        )
        lines = [line for line in listed.stdout.splitlines() if f"{tmp_path}/" in line]
        if not lines or time.monotonic() > deadline:
            return lines
        time.sleep(0.02)
