"""The judge tried on what is known: faults that it must name, solvers that it must not accuse."""

from collections.abc import Iterable, Iterator

from ..self_test import HONEST, Trial
from ..sentence import Sentence, sentence
from .words import Say


def lines(trials: Iterable[Trial], say: Say) -> Iterator[str]:
    """Yield a line a family of solvers, then what did not pass, then the sum."""
    families: dict[str, list[Trial]] = {}
    for trial in trials:
        families.setdefault(trial.subject.family, []).append(trial)
    for family, members in families.items():
        yield say(_told(family, members))
    failed = [one for members in families.values() for one in members if not one.passed]
    for one in failed:
        yield say(sentence(
            "Not passed: {family}, {name}. Verdict {verdict}, laws broken: {laws}.",
            family=one.subject.family, name=one.subject.name, verdict=one.verdict.name,
            laws=", ".join(sorted(one.laws)) or "0",
        ))  # fmt: skip
    if failed:
        yield say(sentence("{n} of all did not pass.", n=len(failed)))
    else:
        yield say(sentence("Every fault is caught and named, and nobody right is accused."))


def _told(family: str, members: list[Trial]) -> Sentence:
    if family == HONEST:
        accused = sum(not one.passed for one in members)
        return sentence("{n} honest solvers tried, {accused} accused.", n=len(members),
                        accused=accused)  # fmt: skip
    return sentence(
        "{family}: {n} faults planted, {caught} caught by a law, {named} named.",
        family=family,
        n=len(members),
        caught=sum(one.caught for one in members),
        named=sum(one.named for one in members),
    )
