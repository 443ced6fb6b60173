"""Sentences to print in English or translated: a literal template and its fields."""

import difflib
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

# Of a longer name only the beginning is compared [characters].
_LONGEST_NAME = 100
# What GitHub and Azure obey on a line of a log: the first at its beginning, the second anywhere.
_COMMAND = re.compile(r"^ ?( *)(?=::)|(?<=#)(?=#\w*\[)")


class Sentence(NamedTuple):
    """A template with named fields, and their values: numbers, names or sentences."""

    template: str
    values: Mapping[str, object]

    def text(self, translate: Callable[[str], str] = str) -> str:
        """Return the words, the template and all sentences within it translated."""
        values = {
            name: value.text(translate) if isinstance(value, Sentence) else value
            for name, value in self.values.items()
        }
        return translate(self.template).format(**values)

    def __str__(self) -> str:
        return self.text()


def sentence(template: str, /, **values: object) -> Sentence:
    """Return a sentence: `sentence("{joint} is {distance:.2g} m off", joint=..., distance=...)`."""
    return Sentence(template, values)


def with_code(code: str, words: Sentence) -> Sentence:
    """Return the sentence of a fault behind the fault's code."""
    return sentence("[{code}] {what}", code=code, what=words)


def without_repetition(words: Sentence, texts: set[str]) -> Sentence:
    """Return a sentence in which faults with their sentence in `texts` have their code alone.

    New sentences are added to `texts`.
    """
    code = words.values.get("code")
    if words.template == with_code("", words).template:
        if words.text() in texts:
            return sentence("[{code}], as above.", code=code)
        texts.add(words.text())
    return Sentence(words.template, {
        name: without_repetition(value, texts) if isinstance(value, Sentence) else value
        for name, value in words.values.items()
    })  # fmt: skip


def codes_in(words: Sentence) -> tuple[str, ...]:
    """Return the codes of the faults that a sentence names, each once, in the order of the text."""
    codes = [code for key, code in words.values.items() if key == "code" and isinstance(code, str)]
    for part in words.values.values():
        codes += codes_in(part) if isinstance(part, Sentence) else ()
    return tuple(dict.fromkeys(codes))


def did_you_mean(value: object, options: Iterable[str]) -> str:
    """Return a question after the nearest option, or "" if none is near."""
    simple = {option.replace("_", "").lower(): option for option in options}
    word = str(value)[:_LONGEST_NAME].replace("_", "").replace("-", "").lower()
    near = difflib.get_close_matches(word, simple, n=1, cutoff=0.6)
    return f"; did you mean {simple[near[0]]}?" if near else ""


def visible(text: str) -> str:
    """Return one line in which whatever does not print is written as an escape, as in Python."""
    spaced = " ".join(text.split())
    if spaced.isprintable():
        return spaced
    return "".join(
        letter if letter.isprintable() else letter.encode("unicode_escape").decode()
        for letter in spaced
    )


def harmless(line: str) -> str:
    """Return a line of a screen in which no CI service finds a command, such as `::error`."""
    return _COMMAND.sub(r"\1\\", line)


def all_visible(value: Any) -> Any:
    """Return a value with every text in it, keys of mappings included, made visible."""
    if isinstance(value, str):
        return visible(value)
    if isinstance(value, Mapping):
        return {all_visible(key): all_visible(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [all_visible(inner) for inner in value]
    return value
