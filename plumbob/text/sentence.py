"""Sentences to print in English or translated: a literal template and its fields."""

import difflib
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

# Compare only the beginning of longer names [characters].
_LONGEST_NAME = 100


class Sentence(NamedTuple):
    """A template with named fields, and their values: numbers, names or sentences."""

    template: str
    values: Mapping[str, object]

    def text(self, translate: Callable[[str], str] = str) -> str:
        """Return the words, with the template and all inner sentences translated."""
        values = {
            name: value.text(translate) if isinstance(value, Sentence) else value
            for name, value in self.values.items()
        }
        return translate(self.template).format(**values)

    def __str__(self) -> str:
        return self.text()


Say = Callable[[Sentence], str]  # translates a sentence


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
    """Return the codes of the faults in a sentence, each once, in the order of the text."""
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
