"""No writer costs the verdict."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_discipline import own_rotation, use_small_disciplines

from plumbob.verify.connections.command import CaseOptions
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Greeting
from plumbob.verify.screen import files, json_file, terminal
from plumbob.verify.screen.files import Files
from plumbob.verify.screen.words import Presentation, speaker
from plumbob.verify.verify import verify


@pytest.fixture
def report(monkeypatch, tmp_path):
    """A report on a wrong solver of a small discipline, in a folder of its own."""
    use_small_disciplines(monkeypatch)
    monkeypatch.chdir(tmp_path)
    Path("out").mkdir()
    task = "forward_kinematics"
    return verify(FunctionConnection({task: own_rotation}, Greeting(1, (task,))))


def raises(*_):
    raise TypeError("Encoding objects of type sphinx is unsupported\nsecond line")


@pytest.mark.parametrize("writer", ["json_file", "junit", "page", "saved"])
def test_a_failing_writer_costs_no_verdict(writer, report, monkeypatch, capsys):
    names = {"json_file": "text", "junit": "text", "page": "render", "saved": "save"}
    monkeypatch.setattr(getattr(files, writer), names[writer], raises)
    context = Presentation(speaker("en"), "en", ["my.py"])
    code = Files(None, None, None, Path("out")).write(report, CaseOptions(), context)
    out, err = capsys.readouterr()
    assert code == 1  # a mistake of ours in a file leaves the exit code to the verdict
    assert "forward_kinematics" in out
    assert err.startswith("plumbob: out/")
    assert err.count("\n") == 1
    assert "TypeError: Encoding objects of type sphinx" in err
    wanted = {"json_file": "verdict.json", "junit": "verdict.xml", "page": "index.html"}
    lost = {wanted.get(writer)}
    names = set(wanted.values())
    assert {path.name for path in Path("out").glob("*.*")} == names - lost


def test_a_case_that_cannot_be_saved_costs_no_verdict(report, capsys):
    Path("plumbob_failures").write_text("a file")
    code = Files(None, None, None, None).write(
        report, CaseOptions(), Presentation(speaker("en"), "en", ["my.py"])
    )
    out, err = capsys.readouterr()
    assert code == 2
    assert "Its own rotation is applied" in out
    assert "--rerun" not in out
    assert err == "plumbob: plumbob_failures could not be written: File exists\n"


def test_files_are_written_though_nobody_reads_the_screen(report, monkeypatch):
    order = []

    def closed(*_):
        order.append("screen")
        raise SystemExit(1) from BrokenPipeError()

    monkeypatch.setattr(terminal, "show", closed)
    monkeypatch.setattr(Path, "write_text", lambda path, *_, **__: order.append(path.name))
    Files(None, None, None, Path("out")).write(
        report, CaseOptions(), Presentation(speaker("en"), "en", ["my.py"])
    )
    assert order == ["verdict.json", "verdict.xml", "index.html", "screen"]


def test_numbers_of_numpy_are_written_like_any_other(report):
    (task,) = report.tasks
    found = replace(task.diagnosis.explanations[0], distance=np.float64(1e-16))
    task = replace(task, diagnosis=replace(task.diagnosis, explanations=(found,)))
    record = json.loads(json_file.text(replace(report, tasks=[task]), speaker("en")))
    assert record["tasks"][0]["explanations"][0]["distance"] == 1e-16
