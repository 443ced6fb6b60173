"""The language of sentences: English, or a language with a gettext catalogue."""

import gettext
import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path

LOCALES = Path(__file__).with_name("locale")
DOMAIN = "plumbob"
# The languages by their names in `--lang`, with catalogues; English needs none.
LANGUAGES = {"en": "", "zh": "zh_CN"}
# The first non-empty variable decides, as in POSIX.
_VARIABLES = ("LC_ALL", "LC_MESSAGES", "LANG")


def language_of(option: str | None = None, environment: Mapping[str, str] = os.environ) -> str:
    """Return the language of an option, or else of the locale; either may name a country: zh_CN.

    English stands in for a locale without a catalogue.

    Raises:
        ValueError: if the option names a language without a catalogue.
    """
    locale = next((environment[name] for name in _VARIABLES if environment.get(name)), "")
    name = re.split("[-_.]", option or locale)[0].lower()
    if option and name not in LANGUAGES:
        raise ValueError(f"lang: expected one of {', '.join(LANGUAGES)}, got {option!r}")
    return name if name in LANGUAGES else "en"


def translator(language: str) -> Callable[[str], str]:
    """Return a function to translate templates; templates without a translation stay unchanged."""
    catalogue = gettext.translation(
        DOMAIN, LOCALES, [LANGUAGES[language] or language], fallback=True
    )
    return lambda template: catalogue.gettext(template) if template else ""
