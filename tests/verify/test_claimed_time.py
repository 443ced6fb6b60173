"""A claimed time that contradicts what is seen from outside is not taken; honest ones are."""

import os
import sys

import numpy as np
import pytest

from plumbob.process.tree import main_thread_seconds
from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.connections import ProcessLimits, open_connection
from plumbob.verify.connections.claimed_time import contradicts
from plumbob.verify.exchange import Answer

LIMITS = ProcessLimits(first=60.0, request=60.0)
# Seconds of 40 requests: what is computed for the messages, and what solves take; some are long.
rng = np.random.default_rng(4)
MESSAGES = rng.uniform(2e-4, 6e-4, 40)
SOLVES = rng.uniform(2e-3, 3e-2, 40)


def calls(claimed, computed, size=2000):
    return [tuple(call) for call in np.broadcast(claimed, computed, size + 0 * computed)]


@pytest.mark.parametrize("solves", [SOLVES, 0.1], ids=["some long", "always the same"])
@pytest.mark.parametrize("claimed", [1e-12, 1e-7, SOLVES / 100.0], ids=["1e-12", "1e-7", "1 %"])
def test_a_claim_far_below_what_is_computed_is_a_contradiction(claimed, solves):
    assert contradicts(calls(claimed, solves + MESSAGES))


HONEST = {
    "the time itself": calls(SOLVES, SOLVES + MESSAGES),
    "a fast solver": calls(1e-7, MESSAGES),
    "a slow reader of numbers": calls(1e-5, 20.0 * MESSAGES),
    "messages of many sizes": calls(
        1e-5, 1e-3 + 2e-7 * np.arange(1, 41) ** 4, np.arange(1, 41) ** 4
    ),
    "the least of eight tries": calls(SOLVES, 8.0 * SOLVES + MESSAGES),
    "waits on a busy machine": calls(np.where(np.arange(40) % 9, 3e-4, 5e-3), 5e-3 + MESSAGES),
    "garbage collections": calls(1e-5, np.where(np.arange(40) % 4, MESSAGES, 0.2)),
    "a start in an interpreter": calls(1e-5, MESSAGES * np.repeat([20.0, 1.0], [15, 25])),
    "a solver that waits": calls(SOLVES, MESSAGES),
    "a system without /proc": calls(1e-5, np.zeros(40)),
}


@pytest.mark.parametrize("kind", HONEST)
def test_an_honest_program_is_never_accused(kind):
    assert not contradicts(HONEST[kind])
    assert not contradicts(HONEST[kind][:10])


def test_the_main_thread_of_this_process_computes():
    before = main_thread_seconds(os.getpid())
    assert sum(range(10**6))
    assert main_thread_seconds(os.getpid()) > before > 0.0


PRELUDE = "import itertools, time\nfaster = itertools.count(1)\n"
SOLVER = """
def inverse_kinematics(local_rotations, target):
    sum(range(int(1e5 * target[0])))
    return {"local_rotations": local_rotations}
"""
FAKE = "lambda: 1e-7 * next(faster)"
PROGRAM = """
import json, sys, threading, time
import numpy as np
def spin():
    while True: sum(range(1000))
for line in sys.stdin:
    request = json.loads(line)
    answer = {"id": request["id"]}
    if request["task"] == "greeting":
        answer |= {"protocol": 1, "tasks": ["inverse_kinematics"]}
        BEGIN
    else:
        start = time.perf_counter()
        sum(range(int(1e5 * request["target"][0])))
        answer |= {"local_rotations": request["local_rotations"]}
        answer["seconds"] = SECONDS
    print(json.dumps(answer), flush=True)
"""
HONEST_SECONDS = "time.perf_counter() - start"


def answers(spec, count=21):
    """What a solver answers to requests of 20 ms, each tenth 2 ms, and what is remarked of it."""
    joints = {
        "parents": np.array([-1, 0]),
        "offsets": np.eye(2, 3),
        "local_rotations": np.eye(2, 4),
    }
    limits = {"effector": 1, "tolerance": 1e-4, "max_iterations": 9, "method": ""}
    connection = open_connection(spec, LIMITS)
    found = []
    for i in range(count):
        inputs = joints | limits | {"target": np.array([10.0 if i % 10 else 1.0, 0.0, 0.0])}
        found.append(connection.answer(Case("1", "inverse_kinematics", inputs, "1", sentence("1"))))
    connection.close()
    assert all(isinstance(one, Answer) for one in found), found[0]
    return found, [str(one) for one in connection.remarks]


def python(folder, text):
    (folder / "solver.py").write_text(text)
    return str(folder / "solver.py")


def program(folder, seconds, begin="pass"):
    (folder / "program.py").write_text(PROGRAM.replace("SECONDS", seconds).replace("BEGIN", begin))
    return (sys.executable, str(folder / "program.py"))


def test_a_python_file_that_replaces_the_clock_changes_no_time(tmp_path):
    text = f"{PRELUDE}time.perf_counter = time.monotonic = {FAKE}\n{SOLVER}"
    found, remarks = answers(python(tmp_path, text))
    assert min(one.seconds for one in found) > 1e-4
    assert remarks == []


LIARS = {
    "a clock of the host replaced": lambda folder: python(
        folder,
        f"{PRELUDE}import plumbob.verify.functions as ours\nours.perf_counter = {FAKE}\n{SOLVER}",
    ),
    "a program's claim": lambda folder: program(folder, "1e-6"),
}


@pytest.mark.sample("claim")
@pytest.mark.parametrize("liar", LIARS)
def test_a_claim_that_contradicts_what_was_computed_is_told_once(tmp_path, liar):
    found, remarks = answers(LIARS[liar](tmp_path))
    assert remarks == []  # `untimed` is told by the report
    assert "Timed by round trips: it claims" in str(found[-1].untimed)
    assert "over which its process computed for" in str(found[-1].untimed)
    assert found[-1].seconds > 1e-4


# What an honest program says of its time and does at its start; some clocks tick seldom.
BELIEVED = {
    "its own time": (HONEST_SECONDS, "pass"),
    "a thread that computes": (
        HONEST_SECONDS,
        "threading.Thread(target=spin, daemon=True).start()",
    ),
    "no tick": ("0.0", "pass"),
    "a tick": ("0.016", "pass"),
}  # fmt: skip


@pytest.mark.sample("thread", "a tick")
@pytest.mark.parametrize("name", BELIEVED)
def test_an_honest_program_is_believed(tmp_path, name):
    found, remarks = answers(program(tmp_path, *BELIEVED[name]), 12)
    assert remarks == []
    assert all(one.untimed is None for one in found)
