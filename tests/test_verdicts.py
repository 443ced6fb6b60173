"""One table defines every word by which a command judges."""

from pathlib import Path

import pytest

from plumbob.bench.compare.rows import ChangeVerdict
from plumbob.bench.ranking.scores import OUTCOMES
from plumbob.cli import file_readings as files
from plumbob.reference.outcome import Outcome
from plumbob.verify.judgement import Verdict
from plumbob.verify.screen.words import VERDICTS

PAGE = Path(__file__).parents[1] / "docs" / "verdicts.md"
WORDS = {
    "`plumbob verify`": [str(VERDICTS[verdict]) for verdict in Verdict],
    "`plumbob verify --self-test`": ["caught", "named", "accused"],
    "`plumbob check`": ["held", "MISSED", "not checked"],
    "`plumbob check --files`": list(files.OUTCOMES),
    "`plumbob bench`": [*OUTCOMES, "disputed answers"],
    "`plumbob compare`": list(map(str, ChangeVerdict)),
    "`import plumbob`": [outcome.name for outcome in Outcome],
}


def definitions():
    """The words of each command in the table."""
    words, command = {}, ""
    rows = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("|")]
    for row in rows[2:]:
        printed_by, word, meaning, _ = (cell.strip() for cell in row[1:-1].split("|"))
        command = printed_by.partition(",")[0] or command
        assert meaning
        words.setdefault(command, []).append(word)
    return words


@pytest.mark.parametrize("command", WORDS)
def test_the_table_defines_each_word_of_a_command(command):
    assert sorted(definitions()[command]) == sorted(WORDS[command])


def test_the_table_has_no_other_commands():
    assert definitions().keys() == WORDS.keys()
