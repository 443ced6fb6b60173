"""Equalities of all answers, but not of right answers."""

from collections.abc import Set
from typing import Any

import numpy as np

from plumbob.text.sentence import sentence

from .separation import MIN_CASES, TOLERANCE, Statement, words_of

# Right answers differ from an equality if their gap is larger: far more than rounding, so near
# equalities of right answers are not reported.
DIFFERENT = 1e-3


class Equalities:
    """Gaps of equalities in answers, and in right answers, by case."""

    def __init__(self, sound: Set[str] = frozenset()) -> None:
        self._sound = sound  # cases with a right verdict
        # by the equality and the case: whether the answer has the equality, and whether a right
        # answer differs
        self._cases: dict[str, dict[str, tuple[bool, bool]]] = {}

    def add(self, equality: str, case: str, gaps: Any, right_gaps: Any) -> None:
        """Add the gaps of a case, of an element or several."""
        if np.size(gaps):
            holds = bool((np.asarray(gaps) <= TOLERANCE).all())
            differs = bool((np.asarray(right_gaps) > DIFFERENT).any()) and case not in self._sound
            self._cases.setdefault(equality, {})[case] = holds, differs

    def strongest(self) -> list[Statement]:
        """Return the equality that fewest right answers have, if any."""
        statements = filter(None, map(self.statement, self._cases))
        return sorted(statements, key=lambda statement: statement.score)[:1]

    def statement(self, name: str) -> Statement | None:
        """Return an equality of all answers without enough right answers, else None."""
        cases = self._cases.get(name, {})
        count, different = len(cases), sum(differs for _, differs in cases.values())
        if different < MIN_CASES or not all(holds for holds, _ in cases.values()):
            return None
        words = sentence(
            "{equality}: in all {count} answers that tell, and in {others} of the right answers.",
            count=count,
            equality=words_of("equality", name),
            others=count - different,
        )
        return Statement(-float(different), words, is_exact=True)
