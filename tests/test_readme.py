import re
from pathlib import Path

import pytest

README = Path(__file__).parents[1] / "README.md"
PAGES = sorted((README.parent / "docs").glob("*.md"))
PROGRAMS = [page for page in PAGES if "```python" in page.read_text(encoding="utf-8")]


def snippets(language):
    return re.findall(rf"```{language}\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)


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


LINKS = [
    (page, link)
    for page in (README, *PAGES)
    for link in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8"))
]


@pytest.mark.parametrize(("page", "link"), LINKS)
def test_every_file_that_is_linked_exists(page, link):
    assert (page.parent / link).exists()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_path_that_a_page_names_exists(page):
    named = re.findall(r"`([a-z_]+/[a-z_/.]*)`", page.read_text(encoding="utf-8"))
    assert [path for path in named if not (README.parent / path).exists()] == []


@pytest.mark.parametrize("picture", sorted((README.parent / "docs").glob("lab_*.svg")))
def test_pictures_of_pages_are_small(picture):
    assert picture.stat().st_size < 100_000


def test_every_make_target_that_is_named_exists():
    targets = set(
        re.findall(r"^([a-z-]+):", (README.parent / "Makefile").read_text(), re.MULTILINE)
    )
    named = set(re.findall(r"make ([a-z-]+)  ", README.read_text(encoding="utf-8")))
    assert named <= targets
    assert {"report", "test"} <= named
