"""Name the faults of wrong sweeps, and the method that they are of."""

from collections.abc import Sequence
from functools import partial

from ..greeting import Greeting
from ..judgement import Diagnosis
from .fault_search import diagnosis_of
from .faults import SwitchFault
from .sweeps import MIN_SHARE, NAMES, PoseTrial, SweepComparison, is_other_solver, prediction_bound

# The number of faults at once that the recognition of a method allows.
RECOGNISED_FAULTS = 2


def suspected_method(
    trials: Sequence[PoseTrial], greeting: Greeting, base: Sequence[SwitchFault] = ()
) -> str:
    """Return the method that most of the sweeps are of with a fault, or ""."""
    if not trials or all(is_other_solver(trial, greeting) for trial in trials):
        return ""
    for count in range(1, RECOGNISED_FAULTS + 1):
        fits = {method: _best_fit(trials, method, greeting, count, base) for method in NAMES}
        best = max(fits, key=lambda method: fits[method])
        if fits[best][0] == 1.0:
            break
    return best if fits[best][0] >= MIN_SHARE else ""


def _best_fit(
    trials: Sequence[PoseTrial],
    method: str,
    greeting: Greeting,
    max_faults: int,
    base: Sequence[SwitchFault],
) -> tuple[float, int]:
    """Return the share of the sweeps that a faulty textbook reproduces, and minus its faults."""
    exchanges = [trial.comparable for trial in trials]
    bound = partial(prediction_bound, greeting)
    diagnosis = diagnosis_of(method, exchanges, exchanges, bound, max_faults=max_faults, base=base)
    for explanation in diagnosis.explanations[:1]:
        return explanation.share, -len(explanation.faults[0].split(" + "))
    return 0.0, 0


def explained(
    comparison: SweepComparison,
    trials: Sequence[PoseTrial],
    wrong: Sequence[PoseTrial],
    greeting: Greeting,
    max_faults: int,
    base: Sequence[SwitchFault] = (),
) -> Diagnosis:
    """Return the faults, up to so many at once, that reproduce the wrong sweeps among all."""
    if not comparison.method or comparison.damped is not None:
        return Diagnosis(behaviour=comparison.damped)
    exchanges = {trial.case.name: trial.comparable for trial in trials}
    return diagnosis_of(
        comparison.method,
        list(exchanges.values()),
        [exchanges[trial.case.name] for trial in wrong],
        partial(prediction_bound, greeting),
        comparison.behaviour,
        max_faults=max_faults,
        base=base,
    )
