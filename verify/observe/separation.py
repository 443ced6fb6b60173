"""Where a quantity is wrong: the feature of all wrong elements, and of no right element.

An element is a joint, a particle or a whole case. A statement needs evidence beyond chance: wrong
and right elements side by side in some cases, and few features for many elements.
"""

import tomllib
from collections.abc import Iterator, Mapping, Sequence, Set
from math import comb, log10
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import BoolArray
from plumbob.text.sentence import Sentence, sentence

# Relative errors up to this are right: above rounding in single precision, which is about 1e-6
# after a dozen operations. Errors of more than BETWEEN times as much are wrong. Errors between the
# two count for neither: a large rounding or a small mistake is possible.
TOLERANCE, BETWEEN = 1e-5, 10.0
# The number of cases with wrong and right elements side by side, or of wrong and of right cases.
# Two coincide too often.
MIN_CASES = 3
# The logarithm of the expected number of separating features for shuffled labels: 1 %. A feature of
# one side alone needs the square of this number, since more features are one-sided.
MAX_CHANCE = -2.0
# Elsewhere a one-sided statement allows at most this share of exceptions: with more a statement
# says little.
MAX_EXCEPTIONS = 0.25
# A quantity of so many elements is reported as right everywhere.
MIN_RIGHT = 10
# Printed alternatives to a statement.
MAX_ALTERNATIVES = 2

# Quantities beyond honest choices: wrong everywhere, these say most.
LAWS = ("agreement", "length", "root_position", "rotation", "position")

_TABLE = tomllib.loads(Path(__file__).with_name("words.toml").read_text(encoding="utf-8"))


def words_of(kind: str, key: str) -> Sentence:
    """Return the words of a feature, a quantity or an equality."""
    return Sentence(_TABLE[kind][key]["sentence"], {})


class JudgedElement(NamedTuple):
    """A joint, a particle or a case, of which a quantity is right or wrong."""

    case: str
    is_wrong: bool
    features: Mapping[str, bool]


class Predicate(NamedTuple):
    """A feature or its negation, and the elements with or without the feature."""

    words: Sentence
    is_negation: bool
    mask: BoolArray


class Statement(NamedTuple):
    """What a table shows: a smaller score is less likely to be chance."""

    score: float  # the logarithm of the number of such statements that chance would make
    sentence: Sentence
    is_exact: bool


class ElementTable:
    """The elements of a quantity; sound cases, with a right verdict, have no wrong element.

    What differs from the usual in a sound case is another honest choice.
    """

    def __init__(self, quantity: str, sound: Set[str] = frozenset(), is_of_cases: bool = False):
        self.quantity, self.is_of_cases = words_of("quantity", quantity), is_of_cases
        self._sound, self.is_law = sound, quantity in LAWS
        self.elements: list[JudgedElement] = []

    def add(
        self,
        case: str,
        errors: Any,
        features: Mapping[str, Any],
        tolerance: float = TOLERANCE,
        is_counted: Any = True,
    ) -> None:
        """Add the elements of a case by their errors; features are arrays or shared by all.

        Uncounted elements are left out, as are errors between right and wrong.
        """
        errors = np.atleast_1d(np.asarray(errors, dtype=float))
        wrong = ~(errors <= BETWEEN * tolerance)  # NaN is wrong
        is_clear = (errors <= tolerance) | (wrong if case not in self._sound else False)
        columns = {name: np.asarray(values).tolist() for name, values in features.items()}
        for i in np.flatnonzero(is_clear & is_counted).tolist():
            row = {name: c[i] if isinstance(c, list) else c for name, c in columns.items()}
            self.elements.append(JudgedElement(case, bool(wrong[i]), row))

    @property
    def wrong_count(self) -> int:
        """Number of wrong elements."""
        return sum(element.is_wrong for element in self.elements)

    @property
    def is_right(self) -> bool:
        """Whether there are enough elements, and all are right."""
        return not self.wrong_count and len(self.elements) >= MIN_RIGHT

    @property
    def is_wrong_everywhere(self) -> bool:
        """Whether there are enough elements, and all are wrong."""
        return len(self.elements) == self.wrong_count >= MIN_RIGHT

    def right_words(self) -> Sentence:
        """Return the quantity with the number of its elements."""
        return sentence("{quantity} ({count})", quantity=self.quantity, count=len(self.elements))


class Findings(NamedTuple):
    """Tables by quantity, statements by equations, and what equations show to be right."""

    tables: dict[str, ElementTable]
    statements: list[Statement]
    right: list[Sentence]
    is_more_wrong: bool = False  # whether tables tell of other mistakes than the statements


def separation(table: ElementTable) -> Statement | None:
    """Return the feature of all wrong elements and no others, else a one-sided feature, else None.

    Joints and particles are compared within the cases of wrong elements: elsewhere a mistake could
    not show.
    """
    wrong_cases = {element.case for element in table.elements if element.is_wrong}
    elements = [e for e in table.elements if table.is_of_cases or e.case in wrong_cases]
    wrong = np.array([element.is_wrong for element in elements], dtype=bool)
    if not elements or wrong.all():
        return None
    groups = _labels(elements, table.is_of_cases)
    if _support(groups, table.is_of_cases) < MIN_CASES:
        return None
    predicates = list(_predicates(elements))
    chance = _log_chance(groups) + log10(max(len(predicates), 1))
    exact = [predicate for predicate in predicates if (predicate.mask == wrong).all()]
    if exact and chance <= MAX_CHANCE:
        return Statement(chance, _exact_words(table.quantity, exact, wrong), is_exact=True)
    if exact or chance > 2.0 * MAX_CHANCE:
        return None
    sides = [side for p in predicates if (side := _one_sided(table.quantity, p, wrong, elements))]
    best = max(sides, key=lambda side: side[0], default=None)
    return None if best is None else Statement(chance / 4.0, best[1], is_exact=False)


def _labels(elements: Sequence[JudgedElement], is_of_cases: bool) -> list[list[bool]]:
    """Return which elements are wrong, by case, or as a single list if each element is a case."""
    labels: dict[str, list[bool]] = {}
    for element in elements:
        labels.setdefault("" if is_of_cases else element.case, []).append(element.is_wrong)
    return list(labels.values())


def _support(groups: Sequence[Sequence[bool]], is_of_cases: bool) -> int:
    """Return the number of cases in which both classes stand, or of the rarer class of cases."""
    if is_of_cases:
        return min(sum(groups[0]), len(groups[0]) - sum(groups[0]))
    return sum(0 < sum(labels) < len(labels) for labels in groups)


def _log_chance(groups: Sequence[Sequence[bool]]) -> float:
    """Return log10 of the chance of a feature to separate labels shuffled within each group."""
    return -sum(log10(comb(len(labels), sum(labels))) for labels in groups)


def _predicates(elements: Sequence[JudgedElement]) -> Iterator[Predicate]:
    """Yield each feature of some elements but not of all, and its negation."""
    shared = [n for n in elements[0].features if all(n in e.features for e in elements)]
    for name in shared:
        mask = np.array([element.features[name] for element in elements], dtype=bool)
        if mask.any() and not mask.all():
            yield Predicate(words_of("feature", name), False, mask)
            yield Predicate(words_of("feature", name), True, ~mask)


def _exact_words(quantity: Sentence, exact: Sequence[Predicate], wrong: BoolArray) -> Sentence:
    counts: dict[str, Any] = {"wrong": int(wrong.sum()), "right": int((~wrong).sum())}
    first = exact[0]
    words = sentence(
        "Wrong everywhere but {place}: {quantity} ({wrong} wrong, {right} right)."
        if first.is_negation
        else "Wrong {place} and nowhere else: {quantity} ({wrong} wrong, {right} right).",
        place=first.words,
        quantity=quantity,
        **counts,
    )
    alternatives = [_stated(predicate) for predicate in exact[1 : 1 + MAX_ALTERNATIVES]]
    if not alternatives:
        return words
    return sentence(
        "{statement} No case tells this from: {alternatives}.",
        statement=words,
        alternatives=joined(alternatives),
    )


def _stated(predicate: Predicate) -> Sentence:
    if predicate.is_negation:
        return sentence("everywhere but {place}", place=predicate.words)
    return predicate.words


def _one_sided(
    quantity: Sentence, predicate: Predicate, wrong: BoolArray, elements: Sequence[JudgedElement]
) -> tuple[float, Sentence] | None:
    """Return a weight and the words if a feature has all wrong elements, or no right element.

    Few elements may be exceptions.
    """
    mask = predicate.mask
    hits, others = int((mask & wrong).sum()), int((mask & ~wrong).sum())
    remaining, missed = int((~mask).sum()), int((~mask & wrong).sum())
    right = int((~wrong).sum())
    values: dict[str, Any] = {"quantity": quantity, "count": hits}
    if not missed and others <= MAX_EXCEPTIONS * right:
        words = sentence(
            "Never wrong {place}: {quantity}. Elsewhere {count} of {total} are wrong."
            if predicate.is_negation
            else "Wrong only {place}: {quantity} ({count} of {total} there).",
            place=predicate.words,
            total=hits + others,
            **values,
        )
        return 1.0 - others / right, words
    cases = {e.case for e, is_hit in zip(elements, mask & wrong, strict=True) if is_hit}
    is_common = hits >= MAX_EXCEPTIONS * wrong.sum() and len(cases) >= MIN_CASES
    if not others and is_common and missed <= MAX_EXCEPTIONS * remaining:
        words = sentence(
            "All {count} {place} are wrong; elsewhere {missed} of {remaining}: {quantity}.",
            place=_stated(predicate),
            missed=missed,
            remaining=remaining,
            **values,
        )
        return hits / float(wrong.sum()), words
    return None


def joined(parts: Sequence[Sentence]) -> Sentence:
    """Return sentences as a list."""
    words = parts[0]
    for part in parts[1:]:
        words = sentence("{first}; {second}", first=words, second=part)
    return words
