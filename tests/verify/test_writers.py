"""Faults of each family pass every writer, and no writer costs the verdict."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from plumbob.verify.door import saved
from plumbob.verify.door.question import Question
from plumbob.verify.functions import FunctionContestant
from plumbob.verify.judgement import Verdict
from plumbob.verify.screen import files, json_file, junit, page, terminal
from plumbob.verify.screen.files import Files
from plumbob.verify.screen.words import Presentation, speaker
from plumbob.verify.self_test import subjects
from plumbob.verify.verify import verify


@cache
def faulty():
    """Return the subjects of the self-test with a fault by their names."""
    return {f"{subject.family}, {subject.name}": subject for subject in subjects() if subject.fault}


def rounded(subject):
    """Judge a subject whose answers are the last bit off: the explanation has a distance."""

    def function(**inputs):
        answer = subject.function(**inputs)
        return {name: value * (1.0 + 2.0**-52) for name, value in answer.items()}

    function.__signature__ = getattr(subject.function, "__signature__", None)
    contestant = FunctionContestant({subject.task: function}, subject.greeting)
    return verify(contestant)


@pytest.mark.sample("6")
@pytest.mark.parametrize("number", range(12))
def test_faults_of_each_family_pass_every_writer(number, tmp_path):
    """Every 127th fault: the list goes through all families."""
    report = rounded(list(faulty().values())[127 * number])
    (task,) = report.tasks
    explanations = task.diagnosis.explanations
    path = saved.save(task, tmp_path, 0, False)
    if task.verdict > Verdict.RIGHT_EXCEPT:
        assert saved.load(path).name == task.smallest_failure.case.name
    for language in ("en", "zh"):
        say = speaker(language)
        context = Presentation(
            say, language, ["my.py"], {(task.task, task.method): path} if path else {}
        )
        screen = "".join("".join(terminal.lines(report, context)).split())
        record = json.loads(json_file.text(report, say), parse_constant=pytest.fail)["tasks"][0]
        assert [one["faults"] for one in record["explanations"]] == [
            list(one.faults) for one in explanations
        ]
        for one, written in zip(explanations, record["explanations"], strict=True):
            assert (written["share"], written["distance"]) == (one.share, one.distance)
            assert written["text"] == say(one.sentence)
        root = ET.fromstring(junit.text(report, say).encode())
        html = page.render(report, context)
        if explanations:
            told = say(explanations[0].sentence)
            assert "".join(told.split())[:40] in screen
            assert told in "".join(root.itertext())
            assert told[:20].replace("'", "&#39;") in html


@pytest.fixture(scope="module")
def judged():
    return rounded(faulty()["forces, gravity g/m"])


@pytest.fixture
def report(judged, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    Path("out").mkdir()
    return judged


def raises(*_):
    raise TypeError("Encoding objects of type sphinx is unsupported\nsecond line")


@pytest.mark.parametrize("writer", ["json_file", "junit", "page", "saved"])
def test_a_failing_writer_costs_no_verdict(writer, report, monkeypatch, capsys):
    names = {"json_file": "text", "junit": "text", "page": "render", "saved": "save"}
    monkeypatch.setattr(getattr(files, writer), names[writer], raises)
    context = Presentation(speaker("en"), "en", ["my.py"])
    code = Files(None, None, None, Path("out")).write(report, Question(), context)
    out, err = capsys.readouterr()
    assert code == 1  # a mistake of ours in a file leaves the exit code to the verdict
    assert "mass_spring_forces" in out
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
        report, Question(), Presentation(speaker("en"), "en", ["my.py"])
    )
    out, err = capsys.readouterr()
    assert code == 2
    assert "Gravity is divided by the mass" in out
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
        report, Question(), Presentation(speaker("en"), "en", ["my.py"])
    )
    assert order == ["verdict.json", "verdict.xml", "index.html", "screen"]


def test_numbers_of_numpy_are_written_like_any_other(report):
    (task,) = report.tasks
    found = replace(task.diagnosis.explanations[0], distance=np.float64(1e-16))
    task = replace(task, diagnosis=replace(task.diagnosis, explanations=(found,)))
    record = json.loads(json_file.text(replace(report, tasks=[task]), speaker("en")))
    assert record["tasks"][0]["explanations"][0]["distance"] == 1e-16
