"""Solvers of which is known what is wrong with them, judged one by one."""

from collections.abc import Iterator
from functools import partial

from plumbob.crosscheck.verify.self_test import HONEST, Subject, attempt, subjects

from ...harness.block import Block, Measured, Scale
from .values import TrialValues

# At less than full length every so manieth fault is tried, and all honest solvers.
EVERY = 5


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield the subjects, a block each."""
    every = 1 if scale.is_as_short_as("full") else EVERY
    for i, subject in enumerate(subjects()):
        if subject.family == HONEST or i % every == 0:
            name = f"{subject.family}/{subject.task}/{subject.name}"
            facts = {
                "title": subject.name,
                "family": subject.family,
                "faulty": bool(subject.fault),
            }
            yield Block("self_test", name, "verify", partial(judged, subject), facts=facts)


def judged(subject: Subject) -> Measured:
    """Judge a subject; keep whether it is caught and named, and by which laws."""
    trial = attempt(subject)
    return Measured(
        TrialValues(trial.caught, trial.named, trial.passed),
        facts={"verdict": trial.verdict.name.replace("_", " "), "laws": sorted(trial.laws)},
    )
