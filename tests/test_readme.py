import re
from pathlib import Path

import pytest

README = Path(__file__).parents[1] / "README.md"


def snippets(language):
    return re.findall(rf"```{language}\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)


def test_the_python_interface_runs_as_printed(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for code in snippets("python"):
        exec(compile(code, str(README), "exec"), {})
    printed = capsys.readouterr().out
    assert printed.count("CONVERGED") == 3
    assert "The target is not reached: the effector is 1 m off." in printed
    assert "residual of the step: 1.0" in printed
    assert (tmp_path / "heart.bvh").stat().st_size > 0


LINKS = re.findall(r"\]\(([^)#:]+)\)", README.read_text(encoding="utf-8"))


@pytest.mark.parametrize("link", LINKS)
def test_every_file_that_is_linked_exists(link):
    assert (README.parent / link).exists()


def test_every_make_target_that_is_named_exists():
    targets = set(
        re.findall(r"^([a-z-]+):", (README.parent / "Makefile").read_text(), re.MULTILINE)
    )
    named = set(re.findall(r"make ([a-z-]+)  ", README.read_text(encoding="utf-8")))
    assert named <= targets
    assert {"report", "test"} <= named
