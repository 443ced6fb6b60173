"""Faulty and honest solvers, each judged by `plumbob verify`."""

from collections.abc import Iterator
from functools import partial

from plumbob.verify.self_test import HONEST, Subject, attempt, subjects

from ...harness.block import Block, Measured, Scale
from .values import TrialValues

# A quick run tries every twentieth fault and every fourth honest solver: each takes seconds, and
# those programs that iterate in Python half a minute.
STRIDE, HONEST_STRIDE = 20, 4
SLOW_FAMILIES, SLOW_TASKS = ("limits",), ("robot_inverse_kinematics", "robot_track")


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield the solvers, a block each."""
    is_full = scale.is_as_short_as("full")
    for i, subject in enumerate(subjects()):
        is_slow = subject.family in SLOW_FAMILIES or subject.task in SLOW_TASKS
        stride = HONEST_STRIDE if subject.family == HONEST else STRIDE
        if is_full or (i % stride == 0 and not is_slow):
            name = f"{subject.family}/{subject.task}/{subject.name}"
            is_faulty = bool(subject.fault)
            facts = {"title": subject.name, "family": subject.family, "faulty": is_faulty}
            yield Block("self_test", name, "verify", partial(judge, subject), facts=facts)


def judge(subject: Subject) -> Measured:
    """Judge a solver; return whether its fault is caught and named, and by which laws."""
    trial = attempt(subject)
    verdict = trial.verdict.name.replace("_", " ")
    facts = {"verdict": verdict, "laws": sorted(trial.laws)}
    return Measured(TrialValues(trial.caught, trial.named, trial.passed), facts=facts)
