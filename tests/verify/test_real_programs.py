"""Programs after the structure of public ones get the verdict and the words that are true."""

import json
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import plumbob.verify.templates

FOLDER = Path(__file__).with_name("real")
STARTERS = Path(plumbob.verify.templates.__file__).parent
TRUTH = tomllib.loads((FOLDER / "truth.toml").read_text("utf-8"))
FIVE = tomllib.loads((FOLDER / "five.toml").read_text("utf-8"))
ARMS = [
    "ccd", "ccd inside", "ccd angle", "ccd early", "ccd constant", "ccd fixed", "ccd single",
    "ccd single inside", "ccd damped mine", "ccd angle early inside", "ccd rootfirst mine",
    "fabrik", "fabrik straight", "fabrik before", "fabrik single", "fabrik reset", "fabrik chain",
    "fabrik constant",
]  # fmt: skip
STEPS = [
    "symplectic", "symplectic single", "symplectic substeps", "explicit", "explicit undamped",
    "positions_first", "linearised", "linearised implicit", "linearised overwritten",
    "linearised heavy", "linearised single", "local_global undamped",
    "local_global fifty undamped",
]  # fmt: skip
PROJECTIONS = [
    "pbd", "pbd reversed", "pbd undeclared", "verlet", "verlet overwritten", "verlet slowed",
    "soft", "soft undeclared", "xpbd", "xpbd substeps",
]  # fmt: skip
HONEST = [
    *(f"right_arms.py FORM={form}" for form in ARMS),
    *(f"right_steps.py FORM={form}" for form in STEPS),
    *(f"right_projections.py FORM={form}" for form in PROJECTIONS),
    *(f"right_trees.js FORM={form}" for form in ("climb", "matrix", "rodrigues", "single")),
    *(f"{program['file']} MISTAKE=0" for program in FIVE.values()),
]
# How a source becomes a program in a folder, by the ending of its name: `{stem}` is its name.
BUILDS = {
    ".cpp": f"g++ -std=c++17 -O1 -I{STARTERS} {{stem}}.cpp -o {{stem}}",
    ".go": "go build -o {stem} {stem}.go plumbob.go",
    ".java": "javac {stem}.java Plumbob.java",
}
RUNS = {".cpp": "./{stem}", ".go": "./{stem}", ".java": "java {stem}", ".js": "node {stem}.js"}


def judge(file, folder, monkeypatch, **environment):
    """Judge a program of the folder `real`; return its report and screen; skip if it cannot run."""
    source = FOLDER / file
    build, run = (
        table.get(source.suffix, "").format(stem=source.stem).split() for table in (BUILDS, RUNS)
    )
    for tool in (words[0] for words in (build, run) if words and "/" not in words[0]):
        if shutil.which(tool) is None:
            pytest.skip(f"no {tool} on this machine")
    shared = ["serve.js", "glm_like.hpp", "plumbob.go", "Plumbob.java"]
    for path in (source, *(root / name for root in (FOLDER, STARTERS) for name in shared)):
        if path.exists():
            shutil.copy(path, folder)
    if build:
        subprocess.run(build, cwd=folder, check=True, timeout=300)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    solver = ["--", *run] if run else [file]
    command = [sys.executable, "-m", "plumbob", "verify", "--json", "verdict.json", *solver]
    done = subprocess.run(
        command, cwd=folder, check=False, capture_output=True, text=True, timeout=900
    )
    assert done.returncode in {0, 1}, done.stderr
    return json.loads((folder / "verdict.json").read_text("utf-8")), done.stdout


def has_words(screen, words):
    """Whether the screen has, of each list of words, one of them."""
    text = " ".join(screen.lower().split())
    return all(any(word.lower() in text for word in forms) for forms in words)


@pytest.mark.sample("nodes", "points")
@pytest.mark.parametrize("name", TRUTH)
def test_a_program_gets_its_verdict_and_its_words(name, tmp_path, monkeypatch):
    truth = TRUTH[name]
    report, screen = judge(truth["file"], tmp_path, monkeypatch)
    assert report["verdict"] == truth["verdict"], screen
    assert has_words(screen, truth["words"]) == truth["explained"], screen


@pytest.mark.slow
@pytest.mark.parametrize("form", HONEST)
def test_no_right_program_is_accused(form, tmp_path, monkeypatch):
    file, _, setting = form.partition(" ")
    report, screen = judge(file, tmp_path, monkeypatch, **dict([setting.split("=")]))
    assert report["verdict"] in {"right", "right_except"}, screen


@pytest.mark.slow
@pytest.mark.parametrize("mistake", "12345")
@pytest.mark.parametrize("name", FIVE)
def test_each_of_five_mistakes_is_seen(name, mistake, tmp_path, monkeypatch):
    report, screen = judge(FIVE[name]["file"], tmp_path, monkeypatch, MISTAKE=mistake)
    codes = [
        code for task in report["tasks"] for text in task["explanations"] for code in text["codes"]
    ]
    assert report["verdict"] in {"wrong", "broken"} or codes, screen  # some cost sweeps only
