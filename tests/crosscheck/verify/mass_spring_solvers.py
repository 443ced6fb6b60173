"""Solvers of the mass-spring tasks for the tests: the dense model with chosen faults."""

from plumbob.crosscheck.verify.functions import FunctionContestant
from plumbob.crosscheck.verify.greeting import PROTOCOL, Greeting, Step
from plumbob.crosscheck.verify.self_test import (
    CONVERGED,
    DECLARED,
    LINEARISED,
    LOCAL_GLOBAL,
    SYMPLECTIC,
    Stepper,
)
from plumbob.crosscheck.verify.verify import verify

__all__ = [
    "CONVERGED", "DECLARED", "LINEARISED", "LOCAL_GLOBAL", "SYMPLECTIC", "Stepper", "named",
    "report",
]  # fmt: skip


def report(function, task="mass_spring_step", step=None, **greeting):
    """Return the report on a function."""
    hello = Greeting(PROTOCOL, (task,), step=step or Step(), **greeting)
    return verify(FunctionContestant({task: function}, hello)).tasks[0]


def named(found):
    """Return the faults that the diagnosis names, all classes together."""
    return {key for one in found.diagnosis.explanations for key in one.faults}
