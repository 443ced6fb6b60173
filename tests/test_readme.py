import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from plumbob.crosscheck.verify import catalogue
from plumbob.crosscheck.verify.case import Case
from plumbob.crosscheck.verify.contestant import Answer
from plumbob.crosscheck.verify.greeting import Greeting
from plumbob.crosscheck.verify.judgement import (
    CaseJudgement,
    Diagnosis,
    Explanation,
    Finding,
    Report,
    TaskReport,
    Verdict,
)
from plumbob.crosscheck.verify.language import translator
from plumbob.crosscheck.verify.output import json_file
from plumbob.crosscheck.verify.sentence import sentence
from plumbob.reference import Skeleton, forward_kinematics, rotation

README = Path(__file__).parents[1] / "README.md"
CHINESE = README.with_name("README.zh-CN.md")
PAGES = sorted((README.parent / "docs").glob("*.md"))
PROGRAMS = [page for page in PAGES if "```python" in page.read_text(encoding="utf-8")]


def snippets(language, page=README):
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


def blocks(page):
    """The Python blocks of a page, each with the text block that follows it, if one does."""
    text = page.read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```\n(?:\n```text\n(.*?)```)?", text, re.DOTALL)


@pytest.mark.parametrize("page", PROGRAMS, ids=lambda page: page.stem)
def test_the_blocks_of_a_page_are_one_program_that_prints_what_it_says(
    page, capsys, monkeypatch, tmp_path
):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": page.stem}
    for code, printed in blocks(page):
        exec(compile(code, str(page), "exec"), names)
        assert capsys.readouterr().out == printed


def test_the_python_interface_runs_as_printed(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for code in snippets("python"):
        exec(compile(code, str(README), "exec"), {})
    printed = capsys.readouterr().out
    assert printed.count("CONVERGED") == 3
    assert "The target is not reached: the effector is 1 m off." in printed
    assert "of the displacement |y - x*|: 1.0 pins off by [m]: 0.0" in printed
    assert (tmp_path / "heart.bvh").stat().st_size > 0


def test_the_code_in_chinese_runs_and_is_right(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    kinematics, interface, laws = snippets("python", CHINESE)
    names = {}
    exec(compile(kinematics, str(CHINESE), "exec"), names)
    rng = np.random.default_rng(7)
    arm = Skeleton([-1, 0, 1, 1], rng.normal(size=(4, 3)))
    local = rotation.random(rng, 4)
    pose = forward_kinematics(arm, local)
    theirs = names["forward_kinematics"](arm.parents, arm.offsets, local)
    for found, expected in zip(theirs, (pose.positions, pose.rotations), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)
    exec(compile(interface, str(CHINESE), "exec"), {})
    assert capsys.readouterr().out.count("CONVERGED") == 2
    exec(compile(laws, str(CHINESE), "exec"), names)
    assert callable(names["test_my_kinematics"])


LINKS = [
    (page, link)
    for page in (README, CHINESE, *PAGES)
    for link in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8"))
]


@pytest.mark.parametrize(("page", "link"), LINKS)
def test_every_file_that_is_linked_exists(page, link):
    assert (page.parent / link).exists()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_path_that_a_page_names_exists(page):
    named = re.findall(r"`([a-z_]+/[a-z_/.]*)`", page.read_text(encoding="utf-8"))
    assert [path for path in named if not (README.parent / path).exists()] == []


@pytest.mark.parametrize("picture", sorted((README.parent / "docs").glob("*.svg")))
def test_pictures_of_pages_are_small(picture):
    assert picture.stat().st_size < 100_000


def test_every_make_target_that_is_named_exists():
    targets = set(
        re.findall(r"^([a-z-]+):", (README.parent / "Makefile").read_text(), re.MULTILINE)
    )
    for page in (README, CHINESE):
        named = set(re.findall(r"make ([a-z-]+)  ", page.read_text(encoding="utf-8")))
        assert named <= targets
        assert {"report", "test"} <= named


def options():
    """The options of `plumbob verify` that its help names."""
    command = [sys.executable, "-m", "plumbob", "verify", "--help"]
    run = subprocess.run(command, capture_output=True, text=True, check=True, cwd=README.parent)
    return set(re.findall(r"--[a-z-]+", run.stdout))


def test_every_option_of_verify_that_a_page_shows_exists():
    known = options()
    for page in (README, CHINESE, README.parent / "docs" / "verify.md"):
        lines = re.findall(r"plumbob verify [^\n`]*", page.read_text(encoding="utf-8"))
        shown = {option for line in lines for option in re.findall(r" (--[a-z-]+)", line)}
        assert shown - {"--flag"} <= known, page
        assert len(shown) >= 3, page


FAULT = (
    "Your CCD multiplies the world rotation d onto the local one on the left, Q := d Q: the "
    "parent's inverse is missing. Use Q := conj(R_parent) d R_parent Q."
)


@pytest.mark.parametrize(("page", "language"), [(README, "en"), (CHINESE, "zh")])
def test_the_screen_that_a_page_shows_says_what_verify_says(page, language):
    assert FAULT in catalogue.templates()
    text = re.sub(r"\s+", "", page.read_text(encoding="utf-8"))
    assert re.sub(r"\s+", "", translator(language)(FAULT)) in text


def keys(value):
    """Every key of records within records."""
    for inner in value if isinstance(value, list) else []:
        yield from keys(inner)
    for name, inner in value.items() if isinstance(value, dict) else []:
        yield name
        yield from keys(inner)


def test_the_page_of_verify_describes_every_key_and_option():
    text = (README.parent / "docs" / "verify.md").read_text(encoding="utf-8")
    finding = Finding("a law", Verdict.WRONG, 1.0, 0.0, "m", sentence("It is off."))
    case = Case("one", "energy", {}, "x", sentence("It is all."))
    judged = CaseJudgement(case, Answer({}, 1e-3), (finding,), {})
    why = Diagnosis((Explanation(("a fault",), sentence("Mend it."), 1.0, 0.0),))
    report = Report(Greeting(1, ("energy",)), [TaskReport("energy", "", [judged], why)], 0)
    for name in keys(json_file.record(report, str)):
        assert f"`{name}`" in text or f"`{name}[]`" in text, name
    assert {option for option in options() if option not in text} == {"--help", "--output"}
