"""The language that sentences are told in: English, or one that has a gettext catalogue."""

import gettext
import os
from collections.abc import Callable, Mapping
from pathlib import Path

LOCALES = Path(__file__).with_name("locale")
DOMAIN = "plumbob"
# The names that `--lang` takes, and the catalogue of each; English needs none.
LANGUAGES = {"en": "", "zh": "zh_CN"}
# The first of these that says something decides, as POSIX has it.
_VARIABLES = ("LC_ALL", "LC_MESSAGES", "LANG")


def language_of(environment: Mapping[str, str] = os.environ) -> str:
    """Return the language that the locale asks for, English where there is no catalogue for it."""
    locale = next((environment[name] for name in _VARIABLES if environment.get(name)), "")
    name = locale.replace("-", "_").split("_")[0].split(".")[0].lower()
    return name if name in LANGUAGES else "en"


def translator(language: str) -> Callable[[str], str]:
    """Return a function that translates templates, those without a translation unchanged."""
    if language not in LANGUAGES:
        raise ValueError(f"lang: expected one of {', '.join(LANGUAGES)}, got {language!r}")
    catalogue = gettext.translation(
        DOMAIN, LOCALES, [LANGUAGES[language] or language], fallback=True
    )
    return lambda template: catalogue.gettext(template) if template else ""
