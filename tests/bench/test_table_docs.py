"""What the page on tables shows can be run as it stands."""

import re
import shlex
from pathlib import Path

import pytest

from plumbob.bench.measure.record import RecordFile
from plumbob.cli import main as cli

PAGE = Path(__file__).parents[2] / "docs" / "tables.md"
BLOCKS = re.findall(r"```sh\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
COMMANDS = [line for block in BLOCKS for line in block.splitlines() if line]


@pytest.mark.parametrize("line", COMMANDS)
def test_every_command_of_the_page_on_tables_runs(line, capsys, tmp_path, monkeypatch, records):
    monkeypatch.chdir(tmp_path)
    for folder in ("report", "results/laptop"):
        RecordFile(tmp_path / folder).append(records)
    words = shlex.split(line, comments=True)
    assert words[0] == "plumbob"
    assert cli.run_command(words[1:]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert out
    if "-o" in words:
        assert (tmp_path / words[words.index("-o") + 1]).stat().st_size > 0
