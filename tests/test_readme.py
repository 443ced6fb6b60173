import csv
import itertools
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import translate as catalogue

from plumbob.cli import main as cli
from plumbob.text.language import translator
from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.exchange import Answer
from plumbob.verify.greeting import Greeting
from plumbob.verify.judgement import (
    CaseJudgement,
    Diagnosis,
    Explanation,
    Finding,
    Report,
    TaskReport,
    Verdict,
)
from plumbob.verify.message import decode_greeting
from plumbob.verify.screen import json_file

README = Path(__file__).parents[1] / "README.md"
CHINESE = README.with_name("README.zh-CN.md")
PAGES = sorted((README.parent / "docs").glob("*.md"))
PROGRAMS = [page for page in PAGES if "```python" in page.read_text(encoding="utf-8")]


def snippets(language, page=README):
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


def blocks(page):
    """The Python blocks of a page, each with the text block that follows it, if one does.

    A block that begins with the name of a file in a comment is that file, and is written.
    """
    text = page.read_text(encoding="utf-8")
    files = re.compile(r"```\w+\n(# (\w+\.\w+)\n.*?)```\n", re.DOTALL)
    for content, name in files.findall(text):
        Path(name).write_text(content, encoding="utf-8")
    programs = files.sub("", text)
    return re.findall(r"```python\n(.*?)```\n(?:\n```text\n(.*?)```)?", programs, re.DOTALL)


@pytest.mark.sample(without=["show"])
@pytest.mark.parametrize("page", PROGRAMS, ids=lambda page: page.stem)
def test_the_blocks_of_a_page_are_one_program_that_prints_what_it_says(
    page, capsys, monkeypatch, tmp_path
):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": page.stem}
    for code, printed in blocks(page):
        exec(compile(code, str(page), "exec"), names)
        assert capsys.readouterr().out == printed


@pytest.mark.slow
def test_the_solver_of_the_page_on_pictures_is_drawn(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    page = README.parent / "docs" / "show.md"
    assert blocks(page) == []
    command = snippets("sh", page)[-1].split()
    assert cli.run_command(command[1:]) == 0
    assert capsys.readouterr().out == f"{command[-1]}\n"


def verified(*names):
    """Return the exit code and the record of `plumbob verify` on a file of the working folder."""
    command = [sys.executable, "-m", "plumbob", "verify", *names, "--json", "verdict.json"]
    run = subprocess.run(command, capture_output=True, check=False, timeout=300)
    return run.returncode, json.loads(Path("verdict.json").read_text(encoding="utf-8"))


def flat(text):
    """A text without white space, since screens and pages break their lines elsewhere."""
    return re.sub(r"\s+", "", text)


@pytest.mark.slow
def test_the_solver_of_the_readme_is_right_and_its_mistake_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = snippets("python")[0]
    line = "turned = multiply(r[parents[joint]] * [1, -1, -1, -1], turned)"
    shown = {page: flat(page.read_text(encoding="utf-8")) for page in (README, CHINESE)}
    Path("my_ik.py").write_text(code, encoding="utf-8")
    exit_code, report = verified("my_ik.py")
    assert exit_code == 0
    for task, text in itertools.product(report["tasks"], shown.values()):
        assert flat(f"{task['task']} {task['method']}") in text
        assert f"{task['passed']}/{len(task['cases'])}" in text
    assert line in code
    Path("my_ik.py").write_text(code.replace(line, "pass"), encoding="utf-8")
    exit_code, report = verified("my_ik.py")
    assert exit_code == 1
    (explanation,) = report["tasks"][1]["explanations"]
    words = explanation["text"].partition("] ")[2]
    assert words in catalogue.templates()
    for page, language in ((README, "en"), (CHINESE, "zh")):
        assert flat(f"[{explanation['codes'][0]}] {translator(language)(words)}") in shown[page]


def test_the_mistake_that_the_readme_shows_is_in_the_catalogue(capsys):
    shown = README.read_text(encoding="utf-8")
    ((code, cause),) = re.findall(r"\[(PB-[A-Z]+-\d+)\] ([^.]+)\.", shown)
    assert cli.run_command(["explain", *cause.split()]) == 0
    assert flat(code + cause) in flat(capsys.readouterr().out)
    assert f"[{code}]" in CHINESE.read_text(encoding="utf-8")


def test_the_first_program_for_students_is_right(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert blocks(README.parent / "docs" / "student.md") == []
    exit_code, report = verified("my_points.py")
    assert (exit_code, report["verdict"]) == (0, "right")


def test_the_summary_for_lecturers_has_a_row_of_each_submission(tmp_path, monkeypatch):
    """Files of the verdict are missing where a submission could not be started."""
    monkeypatch.chdir(tmp_path)
    task = {
        "task": "resample", "method": "", "verdict": "right", "digits": None, "passed": 16,
        "explanations": [],
    }  # fmt: skip
    for name in ("lee", "kim"):
        Path("verdicts", name).mkdir(parents=True)
    Path("verdicts/lee/verdict.json").write_text(json.dumps({"tasks": [task]}))
    Path("verdicts/lee.txt").write_text("resample  RIGHT")
    Path("verdicts/kim.txt").write_text("plumbob: solver: it did not start")
    (code,) = snippets("python", README.parent / "docs" / "lecturer.md")
    exec(code, {})
    rows = list(csv.reader(Path("summary.csv").read_text().splitlines()))[1:]
    assert rows == [
        ["kim", "", "", "none", "", "", "plumbob: solver: it did not start"],
        ["lee", "resample", "", "right", "", "16", ""],
    ]


def test_both_pages_show_the_same_program():
    codes = [re.sub("#.*", "", snippets("python", page)[0]) for page in (README, CHINESE)]
    assert codes[0] == codes[1]


@pytest.mark.parametrize("page", [README, CHINESE], ids=["en", "zh"])
def test_the_python_interface_runs_as_printed(page, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for code in snippets("python", page)[1:]:
        exec(compile(code, str(page), "exec"), {})
    assert capsys.readouterr().out.count("CONVERGED") == 2


def test_the_readme_is_one_screen_to_read():
    text = README.read_text(encoding="utf-8")
    prose = re.sub(r"```.*?```|<!-- Written.*?of what.*?-->", "", text, flags=re.DOTALL)
    assert len(prose.split()) <= 600


@pytest.mark.parametrize("page", [README, CHINESE, *PAGES], ids=lambda page: page.name)
def test_every_file_that_a_page_names_exists(page):
    text = page.read_text(encoding="utf-8")
    linked = [page.parent / link for link in re.findall(r"\]\(([^)#:]+)\)", text)]
    folders = re.findall(r"`(?!report|build)([a-z_]+/[a-z_/.]*)`", text) if page in PAGES else []
    named = linked + [README.parent / path for path in folders]
    assert [path for path in named if not path.exists()] == []


def test_no_page_installs_plumbob_from_an_index():
    """There is no package of this name; extras are in quotes, since zsh reads brackets."""
    for page in (README, CHINESE, *PAGES):
        lines = re.findall(r"pip install ([^\n`#]*)", page.read_text(encoding="utf-8"))
        wrong = [line for line in lines if re.search(r"(?<![./\w])plumbob|(?<!')\.\[", line)]
        assert wrong == [], page


def test_every_make_target_that_is_named_exists():
    targets = set(
        re.findall(r"^([a-z-]+):", (README.parent / "Makefile").read_text(), re.MULTILINE)
    )
    for page in (README, CHINESE):
        named = set(re.findall(r"make ([a-z-]+)  ", page.read_text(encoding="utf-8")))
        assert named <= targets
        assert {"report", "test"} <= set(re.findall(r"make ([a-z-]+)", page.read_text("utf-8")))


def options(capsys):
    """Return the options of `plumbob verify` that its help names."""
    assert cli.run_command(["verify", "--help"]) == 0
    return set(re.findall(r"--[a-z-]+", capsys.readouterr().out))


def test_every_option_of_verify_that_a_page_shows_exists(capsys):
    known = options(capsys)
    for page in (README, CHINESE, README.parent / "docs" / "verify.md"):
        lines = re.findall(r"plumbob verify [^\n`]*", page.read_text(encoding="utf-8"))
        shown = {option for line in lines for option in re.findall(r" (--[a-z-]+)", line)}
        assert shown - {"--flag"} <= known, page
        assert shown, page


def test_every_greeting_that_a_page_shows_is_understood():
    greetings = [
        (page.stem, json.loads(block))
        for page in PAGES
        for block in snippets("json", page)
        if page.stem != "protocol" and '"tasks"' in block
    ]
    assert "engine_developer" in dict(greetings)
    for _, fields in greetings:
        assert decode_greeting(fields).tasks == tuple(fields["tasks"])


def keys(value):
    """Every key of records within records."""
    for inner in value if isinstance(value, list) else []:
        yield from keys(inner)
    for name, inner in value.items() if isinstance(value, dict) else []:
        yield name
        yield from keys(inner)


def test_the_page_of_verify_describes_every_key_and_option(capsys):
    text = (README.parent / "docs" / "verify.md").read_text(encoding="utf-8")
    finding = Finding("a law", Verdict.WRONG, 1.0, 0.0, "m", sentence("It is off."))
    case = Case("one", "energy", {}, "x", sentence("It is all."))
    judged = CaseJudgement(case, Answer({}, 1e-3), (finding,), {})
    why = Diagnosis((Explanation(("a fault",), sentence("Mend it."), 1.0, 0.0),))
    report = Report(Greeting(1, ("energy",)), [TaskReport("energy", "", [judged], why)], 0)
    for name in keys(json_file.record(report, str)):
        assert f"`{name}`" in text or f"`{name}[]`" in text, name
    assert {option for option in options(capsys) if option not in text} == {"--help", "--output"}
