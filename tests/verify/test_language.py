"""Every sentence of `verify` has a translation with the same fields, and gettext reads it."""

import gettext

import pytest
import translate as catalogue

from plumbob.text.language import LANGUAGES, language_of, translator
from plumbob.text.sentence import sentence

TRANSLATED = [name for name in LANGUAGES if LANGUAGES[name]]
TEMPLATES = catalogue.templates()


def entries(language):
    stored = catalogue.read(catalogue.path_of(language, ".po"))
    return {message.id: message.string for message in stored if message.id}


@pytest.mark.parametrize("language", TRANSLATED)
def test_every_sentence_is_translated(language):
    known = entries(language)
    missing = [f"{place}: {text}" for text, place in TEMPLATES.items() if not known.get(text)]
    assert missing == [], "run `make messages` and translate what it adds"


@pytest.mark.parametrize("language", TRANSLATED)
def test_a_translation_has_the_fields_of_its_template(language):
    for text, translation in entries(language).items():
        assert catalogue.fields(translation) == catalogue.fields(text), text


@pytest.mark.parametrize("language", TRANSLATED)
def test_the_compiled_catalogue_is_that_of_the_text(language):
    with catalogue.path_of(language, ".mo").open("rb") as file:
        compiled = gettext.GNUTranslations(file)
    known = {**entries(language), "": compiled.gettext("")}
    assert compiled._catalog == known, "run `make messages`"


@pytest.mark.parametrize("language", TRANSLATED)
def test_the_text_is_as_it_would_be_written(language):
    """But for its head, which names the version of Babel."""
    stored = catalogue.path_of(language, ".po")
    written = catalogue.to_po(catalogue.renewed(catalogue.read(stored), TEMPLATES))
    # The order of entries is that of functions in files, which may change.
    entries = [sorted(text.strip().split(b"\n\n")[1:]) for text in (written, stored.read_bytes())]
    assert entries[0] == entries[1], "run `make messages`"


def test_a_template_that_is_no_literal_is_refused():
    good = 'sentence("a {b}", b=1)\nsentence("two "\n"parts")\nsentence("c" if d else "e")'
    assert list(catalogue.literal_templates(good, "x")) == ["a {b}", "two parts", "c", "e"]
    for bad in ("sentence(words)", 'sentence(f"{a}")', 'sentence("a" + b)', "sentence()"):
        with pytest.raises(ValueError, match="x:1: expected a literal template"):
            list(catalogue.literal_templates(bad, "x"))


@pytest.mark.parametrize(
    ("text", "expected"),
    [("{why}", False), ("[N/m]", False), ("", False), ("{a:.2g} m", True), ("RIGHT", True)],
)
def test_only_templates_with_words_need_a_translation(text, expected):
    assert catalogue.has_words(text) is expected


@pytest.mark.parametrize(
    ("environment", "language"),
    [
        ({}, "en"),
        ({"LANG": "zh_CN.UTF-8"}, "zh"),
        ({"LANG": "zh"}, "zh"),
        ({"LANG": "de_DE.UTF-8"}, "en"),
        ({"LANG": "zh_CN.UTF-8", "LC_MESSAGES": "en_GB.UTF-8"}, "en"),
        ({"LANG": "en_US", "LC_MESSAGES": "", "LC_ALL": "zh_TW"}, "zh"),
        ({"LC_ALL": "C.UTF-8"}, "en"),
    ],
)
def test_the_locale_chooses_the_language(environment, language):
    assert language_of(environment=environment) == language


@pytest.mark.parametrize("option", ["zh", "zh-CN", "zh_CN", "zh_CN.UTF-8", "ZH"])
def test_the_option_takes_a_language_with_its_country(option):
    assert language_of(option, {"LANG": "en_GB.UTF-8"}) == "zh"


def test_sentences_within_sentences_are_translated():
    inner = sentence("exit code {code}", code=3)
    told = sentence("It ended without an answer: {how}.", how=inner)
    assert told.text(translator("zh")) == "它没有作答就结束了：退出码 3。"
    assert told.text(translator("en")) == "It ended without an answer: exit code 3."


def test_a_language_that_is_unknown_is_refused():
    with pytest.raises(ValueError, match="lang: expected one of en, zh, got 'fr'"):
        language_of("fr")
