"""The sentences of changed lines."""

import re
from collections.abc import Mapping, Sequence
from itertools import takewhile

from plumbob.text.sentence import Sentence, sentence, with_code

from ..dictionary.entry import Entry
from ..fault_programs import NOTES
from .mutants import Mutant
from .right_programs import FAULTS, KINDS

# Longer lines are cut to what differs, with so many letters before and after.
LINE, AROUND = 60, 20


def changes_in_words(
    mutants: Mapping[str, Mutant | Entry], keys: Sequence[str], count: int = 1
) -> Sentence:
    """Return the sentence of the likeliest changes, in up to two functions, of equal answers.

    These lines are the likeliest of `count` changes.
    """
    ordered = sorted(
        (mutants[key] for key in keys),
        key=lambda m: (KINDS.index(m.kind), abs(len(m.right) - len(m.wrong)), len(m.wrong)),
    )
    mutant = ordered[0]
    entry = FAULTS[mutant.kind]
    right, wrong = excerpts(mutant.right, mutant.wrong)
    if wrong:
        words = sentence(
            "{what} Where a right program has `{right}`, your answers are as if yours had "
            "`{wrong}`; names in it may differ.",
            what=Sentence(entry["sentence"], {}), right=right, wrong=wrong,
        )  # fmt: skip
    else:
        words = sentence(
            "{what} Your answers are as if the line `{right}` of a right program were missing in "
            "yours; names in it may differ.",
            what=Sentence(entry["sentence"], {}), right=right,
        )  # fmt: skip
    for other in ordered:
        if wrong and other.kind == mutant.kind and other.function != mutant.function:
            right, wrong = excerpts(other.right, other.wrong)
            words = sentence("{one} Or, as well, `{wrong}` in the place of `{right}`.",
                             one=words, right=right, wrong=wrong)  # fmt: skip
            break
    for note in NOTES.values():
        if any(text in mutant.right for text in note["texts"]):
            words = sentence("{words} {note}", words=words, note=Sentence(note["sentence"], {}))
    if count > 1:
        words = sentence("{words} This is one of {count} changes that give the same answers.",
                         words=words, count=count)  # fmt: skip
    return with_code(entry["code"], words)


def excerpts(right: str, wrong: str) -> tuple[str, str]:
    """Return two lines, of long lines only the difference and some letters around.

    `x = x` reads an input: its value alone is returned, and the value in its place.
    """
    if reading := re.fullmatch(r"(\w+) = \1", right):
        right, wrong = reading[1], wrong.removeprefix(f"{reading[1]} = ")
    if max(len(right), len(wrong)) <= LINE or not wrong:
        return right, wrong
    before = _common_length(right, wrong)
    after = _common_length(right[before:][::-1], wrong[before:][::-1])
    start = max(0, right.rfind(" ", 0, max(0, before - AROUND)) + 1)

    def excerpt(line: str) -> str:
        end = line.find(" ", len(line) - after + AROUND)
        end = len(line) if end < 0 else end
        return f"{'… ' * (start > 0)}{line[start:end]}{' …' * (end < len(line))}"

    return excerpt(right), excerpt(wrong)


def _common_length(first: str, second: str) -> int:
    """Return the number of letters with which both texts begin."""
    pairs = zip(first, second, strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))
