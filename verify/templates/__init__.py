"""Starters in seven languages, with the protocol and a place for the user's code."""

import re
import tomllib
from importlib import resources
from typing import NamedTuple


class Language(NamedTuple):
    """What a starter consists of; `languages.toml` says what each field is."""

    files: list[str]
    run: str
    build: str = ""


_FOLDER = resources.files(__name__)
LANGUAGES = {
    name: Language(**entry)
    for name, entry in tomllib.loads(_FOLDER.joinpath("languages.toml").read_text("utf-8")).items()
}
# What stands above the greeting of every starter.
GREETING_FIELDS = _FOLDER.joinpath("greeting_fields.txt").read_text("utf-8")


def template(language: str) -> dict[str, str]:
    """Return the text of each file of a starter by name; ValueError for other languages."""
    if language not in LANGUAGES:
        raise ValueError(f"template: expected one of {', '.join(LANGUAGES)}, got {language!r}")
    fields = GREETING_FIELDS.strip().replace("\n", r"\n\1")
    texts = {name: _FOLDER.joinpath(name).read_text("utf-8") for name in LANGUAGES[language].files}
    marker = re.compile("( *(?://|#) )GREETING_FIELDS")
    return {name: marker.sub(rf"\1{fields}", text) for name, text in texts.items()}
