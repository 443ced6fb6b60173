"""The table of known faults of kinematics solvers."""

import tomllib
from pathlib import Path

from plumbob.text.sentence import Sentence, with_code

TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def sentences_of(part: str) -> dict[str, Sentence]:
    """Return the sentences of a table's faults with their codes, by their short names."""
    return {
        key: with_code(entry["code"], Sentence(entry["sentence"], {}))
        for key, entry in TABLE[part].items()
    }
