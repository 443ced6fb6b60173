"""Findings that several tasks share."""

from collections.abc import Iterable

import numpy as np

from plumbob.reference.arguments import FloatArray, distinct_texts

from ..contestant import Answer, Asked, Failure
from ..greeting import Greeting
from ..judgement import Finding, Verdict
from ..sentence import Sentence, sentence

HOLDS = sentence("It holds.")


class Findings:
    """What was found about one answer."""

    def __init__(self, greeting: Greeting) -> None:
        self.greeting = greeting
        self._found: list[Finding] = []

    def add(self, finding: Finding) -> None:
        """Note one."""
        self._found.append(finding)

    def extend(self, findings: Iterable[Finding]) -> None:
        """Note several."""
        self._found.extend(findings)

    @property
    def broken(self) -> bool:
        """Whether what was found leaves nothing more to judge."""
        return any(one.verdict is Verdict.BROKEN for one in self._found)

    @property
    def all(self) -> tuple[Finding, ...]:
        """All of them."""
        return tuple(self._found)


def bounded(
    law: str,
    error: float,
    tolerance: float,
    unit: str,
    told: Sentence,
    *,
    verdict: Verdict = Verdict.WRONG,
    where: int | None = None,
) -> Finding:
    """Return the finding that an error is within its tolerance, or the verdict if it is not."""
    if error <= tolerance:
        return Finding(law, Verdict.RIGHT, float(error), tolerance, unit, HOLDS, where)
    return Finding(law, verdict, float(error), tolerance, unit, told, where)


def no_numbers(law: str, values: FloatArray, tolerance: float) -> Finding:
    """Return the finding that some values of joints are NaN or infinite."""
    joint = int(np.argmin(np.isfinite(values)))
    told = sentence("The answer of joint {joint} is not a number.", joint=joint)
    return Finding(law, Verdict.BROKEN, np.inf, tolerance, "", told, joint)


def unit(lengths: FloatArray, tolerance: float) -> Finding:
    """Return how far quaternions are off unit length; they are normalised after that."""
    off = np.abs(lengths - 1.0)
    joint = int(np.argmax(off))
    told = sentence(
        "The quaternion of joint {joint} has the length {length}, not 1; normalise after each "
        "product.",
        joint=joint,
        length=distinct_texts(lengths[joint], 1.0)[0],
    )
    return bounded(
        "unit quaternions", off[joint], tolerance, "", told, verdict=Verdict.RIGHT_BUT, where=joint
    )


def angles(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the angles [rad] between unit quaternions, q and -q being one rotation."""
    apart = np.minimum(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))
    return 4.0 * np.arcsin(np.minimum(0.5 * apart, 1.0))


def digits(error: float, size: float) -> float:
    """Return how many digits are correct, at most 16."""
    if not np.isfinite(error):
        return 0.0
    return float(np.clip(-np.log10(max(error, 1e-300) / size), 0.0, 16.0))


def repeated(one: Asked, size: float, greeting: Greeting) -> list[Finding]:
    """Return whether the same request got the same answer again."""
    if isinstance(one.again, Failure) or not isinstance(one.answer, Answer):
        if isinstance(one.answer, Answer):
            told = sentence("Asked again, it gave no answer.")
            return [Finding("equal answers", Verdict.BROKEN, np.inf, 0.0, "", told)]
        return []
    apart = max(
        (_apart(value, one.again.values.get(name)) for name, value in one.answer.values.items()),
        default=0.0,
    )
    tolerance = 16.0 * greeting.epsilon * max(size, 1.0)  # threads may add up in another order
    told = sentence(
        "Asked the same again, it answers something else, {error:.2g} away: state left over, or "
        "memory that nobody has filled.",
        error=apart,
    )
    return [bounded("equal answers", apart, tolerance, "", told)]


def _apart(one: object, other: object) -> float:
    a, b = np.asarray(one, dtype=float), np.asarray(other, dtype=float)
    if a.shape != b.shape or (np.isnan(a) != np.isnan(b)).any():
        return np.inf
    return float(np.abs(np.nan_to_num(a) - np.nan_to_num(b)).max(initial=0.0))


def remarks(answer: Answer) -> list[Finding]:
    """Return what was odd about an answer; a changed model spoils every later request."""
    return [
        Finding(
            "untouched inputs",
            Verdict.WRONG if spoils(told) else Verdict.RIGHT_BUT,
            1.0, 0.0, "", told,
        )
        for told in answer.remarks
    ]  # fmt: skip


def spoils(remark: Sentence) -> bool:
    """Return whether a remark says that the skeleton itself was changed."""
    return remark.values.get("name") in ("offsets", "parents")
