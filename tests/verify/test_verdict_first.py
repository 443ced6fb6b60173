"""A verdict stands before its cause is sought: an error, a limit or Ctrl-C costs the name alone."""

import importlib
import signal
import subprocess
import sys
import time

import msgspec
import pytest

from plumbob.verify import cause_search
from plumbob.verify.cause_search import CauseSearch, NoSearch, SearchLimit
from plumbob.verify.connections.command import CaseOptions
from plumbob.verify.disciplines import DISCIPLINES
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Greeting
from plumbob.verify.screen.files import WRONG, Files
from plumbob.verify.screen.words import Presentation, speaker
from plumbob.verify.verify import verify

FILES = ("verdict.json", "verdict.xml", "index.html")
MISTAKEN = """
def mass_spring_forces(masses, gravity, **_):
    return {"forces": 7.0 * masses[:, None] * gravity}
"""
# The stages of a search: by name, the module that calls each.
STAGES = {
    "look_up": "plumbob.verify.one_line.search",
    "with_changed_line": "plumbob.verify.verify",
    "_with_cause": "plumbob.verify.verify",
}


def fails(*_, **__):
    raise KeyError("a mistake of ours")


def hangs(*_, **__):
    while True:
        pass


def is_interrupted(*_, **__):
    raise KeyboardInterrupt


MISHAPS = {
    fails: "The search for the cause failed (KeyError: 'a mistake of ours')",
    hangs: "The search for the cause ended after",
    is_interrupted: "The search for the cause was interrupted.",
}


def wrong_forces(masses, gravity, **_):
    return {"forces": 7.0 * masses[:, None] * gravity}


@pytest.mark.sample("look_up", "_with_cause-fails")
@pytest.mark.parametrize("mishap", MISHAPS)
@pytest.mark.parametrize("stage", STAGES)
def test_a_search_that_ends_early_costs_the_name_alone(
    stage, mishap, monkeypatch, tmp_path, capsys
):
    if mishap is hangs and not hasattr(signal, "setitimer"):
        pytest.skip("no timers of processor time here")
    monkeypatch.setattr(cause_search, "SECONDS", 0.5 if mishap is hangs else 60.0)
    if stage == "_with_cause":  # the last stage, whatever lines are searched before
        verify_module = importlib.import_module(STAGES[stage])
        monkeypatch.setattr(verify_module, "with_changed_line", lambda report, *_, **__: report)
    monkeypatch.setattr(importlib.import_module(STAGES[stage]), stage, mishap)
    greeting, published = Greeting(1, ("mass_spring_forces",)), []
    connection = FunctionConnection({"mass_spring_forces": wrong_forces}, greeting)
    report = verify(connection, publish=published.append)
    assert [part.verdict for part in published] == [report.verdict]
    context = Presentation(speaker("en"), "en", ("mine.py",))
    assert Files(None, None, None, tmp_path).write(report, CaseOptions(), context) == WRONG
    screen = " ".join(capsys.readouterr().out.split())
    assert "mass_spring_forces WRONG" in screen
    assert MISHAPS[mishap] in screen
    for name in FILES:
        assert (tmp_path / name).stat().st_size
    assert MISHAPS[mishap] in (tmp_path / "verdict.json").read_text().replace("\\u0027", "'")


# A judge that takes its time, and a search that is killed after a while.
KILLED = """
import os, time
from plumbob.cli import verify
from plumbob.verify.disciplines import DISCIPLINES
verify.LINE_PAUSE = 0.4
forces = DISCIPLINES["mass_spring_forces"]
def judge(*arguments):
    time.sleep(1.2)
    return forces.judge(*arguments)
def diagnose(_):
    time.sleep(1.2)
    os._exit(9)
DISCIPLINES["mass_spring_forces"] = forces._replace(judge=judge, diagnose=diagnose)
from plumbob.cli.main import main
main(["verify", "mine.py", "-o", "out"])
"""


def test_a_pipe_gets_lines_and_a_killed_search_leaves_the_verdict_in_all_files(tmp_path):
    (tmp_path / "mine.py").write_text(MISTAKEN)
    words = [sys.executable, "-c", KILLED]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 9
    assert done.stderr.count("s: judging mass_spring_forces\n") >= 2
    assert "s: mass_spring_forces: searching for the cause (at most 20 CPU s)" in done.stderr
    assert "mass_spring_forces: WRONG, " in done.stderr
    verdict = msgspec.json.decode((tmp_path / "out/verdict.json").read_bytes())
    assert verdict["verdict"] == "wrong"
    assert "written before the end: 1 of 1 tasks" in " ".join(verdict["remarks"])
    assert all((tmp_path / "out" / name).stat().st_size for name in FILES)


@pytest.mark.usefixtures("verdict_alone")
def test_a_judge_that_fails_at_a_task_keeps_the_other_verdicts(monkeypatch, tmp_path, capsys):
    functions = {"energy": lambda **_: {"total": 1.0}, "mass_spring_forces": wrong_forces}
    monkeypatch.setitem(DISCIPLINES, "energy", DISCIPLINES["energy"]._replace(judge=fails))
    context = Presentation(speaker("en"), "en", ("mine.py",))

    def code_of(*tasks):
        report = verify(FunctionConnection(functions, Greeting(1, tasks)))
        return Files(None, None, None, tmp_path).write(report, CaseOptions(), context)

    assert code_of("energy", "mass_spring_forces") == WRONG  # the verdict that stands
    screen = " ".join(capsys.readouterr().out.split())
    assert "energy: No verdict: the judge itself failed (KeyError: 'a mistake of ours')" in screen
    assert "mass_spring_forces WRONG" in screen
    assert code_of("energy") == 3
    assert "the judge itself failed" in " ".join(capsys.readouterr().out.split())


@pytest.mark.usefixtures("verdict_alone")
def test_a_screen_that_cannot_be_drawn_leaves_the_verdict(monkeypatch, tmp_path, capsys):
    functions = {"mass_spring_forces": wrong_forces}
    report = verify(FunctionConnection(functions, Greeting(1, tuple(functions))))
    module = importlib.import_module("plumbob.verify.screen.terminal")
    monkeypatch.setattr(module, "show", fails)
    context = Presentation(speaker("en"), "en", ("mine.py",))
    assert Files(None, None, None, tmp_path).write(report, CaseOptions(), context) == WRONG
    printed = capsys.readouterr()
    assert "mass_spring_forces: WRONG, " in printed.out
    assert "could not be written: KeyError: 'a mistake of ours'" in printed.err


def test_a_stage_that_has_ended_is_not_followed_by_another():
    search, calls = CauseSearch(), []
    assert search.run(lambda: calls.append("first") or 1, 0) == 1
    assert search.run(lambda: 1 / 0, 0) == 0
    assert "ZeroDivisionError" in str(search.end)
    assert search.run(lambda: calls.append("second") or 1, 0) == 0
    assert calls == ["first"]
    assert NoSearch().run(lambda: calls.append("third") or 1, 0) == 0
    assert calls == ["first"]


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers of processor time here")
def test_a_search_is_limited_in_processor_time_and_not_in_waiting(monkeypatch):
    monkeypatch.setattr(cause_search, "SECONDS", 0.2)
    with cause_search._limited():
        time.sleep(0.4)  # the machine may be busy with something else
    with pytest.raises(SearchLimit), cause_search._limited():
        hangs()
    assert signal.getitimer(signal.ITIMER_PROF) == (0.0, 0.0)
