"""What a hostile Python file gets from `verify` and from the bench; nothing of it stays.

Elsewhere: programs (`test_hostile_programs`), answers that are none (`test_message`), files of
answers (`test_connections_files`), and mistakes of Python files (`test_connections_python`).
"""

import json
import re
import sys
import tomllib
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from hostile_programs import LIMITS, running

from plumbob.bench.measure import chain_targets as chain
from plumbob.bench.measure import timing
from plumbob.bench.measure.isolation import WorkerProcess
from plumbob.bench.measure.progress import TROUBLE, listening
from plumbob.bench.peers import catalogue
from plumbob.bench.peers.protocol import NoAnswerError
from plumbob.bench.peers.user_solver import UserSolver
from plumbob.bench.problems.chains import TargetsForSkeleton
from plumbob.reference import Skeleton
from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.connections import open_connection
from plumbob.verify.exchange import Answer

TASK = "inverse_kinematics"
TARGETS = np.array([[0.0, 2.0, 1.0], [0.0, 1.0, 2.0]])
POSE = [[1.0, 0.0, 0.0, 0.0]] * 3
SKELETON = {"parents": np.arange(-1, 2), "offsets": np.eye(3), "local_rotations": np.array(POSE)}
# It misbehaves if so many iterations are allowed, and answers rightly else.
HOSTILE, RIGHT = 9, 1

HEAD = """\
import json, os, signal, subprocess, sys, time
kept = []
def right(request):
    return {"local_rotations": request["local_rotations"]}
def misbehave(request):
"""
PYTHON = """
import numpy as np
def inverse_kinematics(**request):
    return misbehave(request) if request["max_iterations"] == 9 else right(request)
"""


class Behaviour(NamedTuple):
    """What a solver does or answers, and its sentence."""

    does: str | dict
    python: str
    bench: str | None = ""  # "" for the sentence of `verify`, None where it is not tried


SILENT = "ended after 1 s of silence"
DEEP = json.loads("[" * 500 + "]" * 500)


def behaviour(answer=None, pose=True, does="", bench="", **others):
    """Return an entry of the table."""
    if answer is not None:
        does = {"local_rotations": POSE} | answer if pose else answer
        if does.get("local_rotations") == "lists in lists":
            does["local_rotations"] = DEEP
    return Behaviour(does, bench=None if bench is False else bench, **others)


TABLE = tomllib.loads(Path(__file__).with_name("hostile_solvers.toml").read_text("utf-8"))
BEHAVIOURS = {name: behaviour(**entry) for name, entry in TABLE.items()}


def source(does, loop):
    """Return a solver; what it answers is written as JSON, which has room for deep lists."""
    does = does if isinstance(does, str) else f"return json.loads({json.dumps(does)!r})"
    return HEAD + "".join(f"    {line}\n" for line in does.splitlines()) + loop


def case(iterations):
    inputs = SKELETON | {"target": np.array([1.0, 1.0, 0.0]), "effector": 2, "tolerance": 1e-4}
    inputs |= {"max_iterations": iterations, "method": ""}
    return Case(f"{iterations}", TASK, inputs, "hostile", sentence("one"))


def outcome(answer):
    """Return what came of a request in words, with remarks."""
    if isinstance(answer, Answer):
        return "; ".join(map(str, ["answer", *answer.remarks]))
    return f"{answer.kind}: {answer.sentence}"


def rows(way, *quick):
    """The rows of a way in, of which few are quick."""
    names = [name for name, row in BEHAVIOURS.items() if getattr(row, way) is not None]
    slow = pytest.mark.slow
    return [pytest.param(name, marks=[slow] if name not in quick else []) for name in names]


@pytest.mark.parametrize("name", rows("python", "replaces the clock", "floods its output"))
def test_a_hostile_python_file_gets_its_sentence(tmp_path, name):
    """The next request is answered."""
    row = BEHAVIOURS[name]
    (tmp_path / "solver.py").write_text(source(row.does, PYTHON))
    patience = 0.5 if row.python.startswith("^hung") else 20.0
    solver = open_connection(str(tmp_path / "solver.py"), LIMITS._replace(request=patience))
    try:
        before, answer, after = (solver.answer(case(n)) for n in (RIGHT, HOSTILE, RIGHT))
    finally:
        solver.close()
    assert outcome(before) == outcome(after) == "answer"
    assert not running(tmp_path)
    assert re.search(row.python, outcome(answer)), outcome(answer)
    remarks = map(str, solver.remarks)
    assert any("left processes running" in remark for remark in remarks) == ("child" in name)
    assert not isinstance(answer, Answer) or answer.seconds > 0.0


@pytest.fixture(scope="module")
def worker():
    impatient = WorkerProcess(60.0, 2.0)
    yield impatient
    impatient.close()


def solved(spec, targets):
    """What the bench measures of an entrant that is asked for targets."""
    (peer,) = catalogue.chain_peers([UserSolver("hostile", "", spec, tasks=(TASK,))])
    skeleton = Skeleton(SKELETON["parents"], SKELETON["offsets"])
    problem = TargetsForSkeleton("", "", skeleton, SKELETON["local_rotations"], targets)
    limits = chain.SolverLimits(1e-4, HOSTILE)
    job = chain.job_of(problem, limits, peer.module, {"method": "", **peer.spec}, "hostile")
    answers = partial(chain.solve_one_by_one, problem, job, limits)
    found = chain.solve_together([chain.ChainJob(answers, job)])[0]
    if "failed" in found:
        raise NoAnswerError(found["failed"])
    return found


@pytest.mark.parametrize("name", rows("bench", "claims -5 iterations"))
def test_a_hostile_entrant_of_the_bench_reaches_nothing_by_it(tmp_path, monkeypatch, worker, name):
    """What is wrong with an answer costs the target; its time is never what it claims."""
    row = BEHAVIOURS[name]
    monkeypatch.setattr(timing, "worker_process", lambda: worker)
    (tmp_path / "solver.py").write_text(source(row.does, PYTHON))
    measure = partial(solved, str(tmp_path / "solver.py"), TARGETS)
    if row.bench == SILENT:
        with pytest.raises(NoAnswerError, match=SILENT):
            measure()
    else:
        words = row.bench or re.sub(r"^\^(answer|\w+: )|\$$", "", row.python)
        _check(measure(), is_right=row.python.startswith("^answer") and not row.bench, words=words)
    worker.close()
    assert not running(tmp_path)


def _check(found, is_right, words):
    """Right answers are kept and timed, others are neither; what is wrong stands in the record."""
    assert not found["solved"].any()
    assert (np.isfinite(found["residual"]) == is_right).all()
    assert ("seconds" in found) == is_right
    told = f"{found['remark']}; {found['trouble']}"
    assert re.search("^; $" if is_right else words, told), told


LIAR = """
for line in sys.stdin:
    request = json.loads(line)
    fields = {"protocol": 1, "tasks": ["inverse_kinematics"], "name": "Liar"}
    if request["task"] != "greeting":
        sum(range(int(1e5 * request["target"][0] ** 2)))
        fields = right(request) | {"seconds": 1e-6}
    print(json.dumps({"id": request["id"], **fields}), flush=True)
"""


@pytest.mark.slow
def test_times_far_below_what_was_computed_are_not_ranked(tmp_path, monkeypatch, worker):
    """Those of the first targets neither, which were claimed before it was seen."""
    monkeypatch.setattr(timing, "worker_process", lambda: worker)
    (tmp_path / "liar.py").write_text(HEAD + "    pass\n" + LIAR)
    targets = np.array([[6.0 + i % 3, 1.0, 1.0] for i in range(12)])
    announced = []
    with listening(announced.append):
        found = solved((sys.executable, str(tmp_path / "liar.py")), targets)
    worker.close()
    assert not running(tmp_path)
    (message,) = [one.message for one in announced if one.state == TROUBLE]
    assert message.startswith("Timed by round trips: it claims 1e-05 s for 10 requests over which")
    assert found["trouble"] == found["remark"] == message
    assert (found["seconds"] > 1e-3).all()
