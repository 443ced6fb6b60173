"""What the page on comparisons and the recipes for continuous integration say can be run."""

import re
import shlex
from pathlib import Path

import pytest

from plumbob.cli import main as cli

DOCS = Path(__file__).parents[1] / "docs"
SOURCES = [DOCS / "cluster.md", DOCS / "compare.md", DOCS / "gate" / "action.yml"]
COMMANDS = [
    line.strip()
    for source in SOURCES
    for line in source.read_text(encoding="utf-8").splitlines()
    if re.match(r"\s*(\.venv/bin/)?plumbob ", line)
]


def arguments(line):
    """The words behind `plumbob`, with variables as they are and nothing that is the shell's."""
    line = re.sub(r"\$\{ONLY:\+(.*?)\}", r"\1", line.split("||")[0])
    return shlex.split(line, comments=True)[1:]


@pytest.mark.parametrize("line", COMMANDS)
def test_every_command_that_is_shown_has_the_options_it_is_shown_with(capsys, line):
    assert cli.run_command([*arguments(line), "--help"]) == 0
    assert cli.run_command([*arguments(line), "--no-such-option", "--help"]) == 2


def test_the_workflow_gives_the_action_what_it_takes():
    action, workflow = ((DOCS / "gate" / f"{n}.yml").read_text() for n in ("action", "workflow"))
    taken = set(re.findall(r"^  (\w+):$", action.split("runs:")[0], re.MULTILINE))
    given = re.search(r"plumbob-gate\n\s+with:\n((?: {10}\w.*\n)+)", workflow).group(1)
    assert {line.split(":")[0].strip() for line in given.splitlines()} <= taken
    assert set(re.findall(r"inputs\.(\w+)", action)) == taken
    assert "fetch-depth: 0" in workflow
