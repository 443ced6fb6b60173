"""The lab's third question: motions without jitter, and what they cost."""

from collections.abc import Sequence
from typing import NamedTuple

from ...harness import metrics
from ...harness.record import Record
from ...presentation.results import Results, label, settings
from ...presentation.tables import Cell, Column, Summary, Table, words
from . import COHERENT, COLD, CURVE, DRIFT, WARM

MODES = (COLD, WARM, COHERENT)
SUITE = "tracking"
# The step that closes a curve counts as no larger than others if it is so but for this share.
SAME = 0.01


class Case(NamedTuple):
    """One curve followed by one solver in all modes."""

    cold: Record
    warm: Record
    coherent: Record


def _cases(results: Results) -> list[Case]:
    """Return the curves that were followed in all modes."""
    found = []
    for cold in results.all(SUITE, task=CURVE, mode=COLD):
        others = [
            results.one(SUITE, cold.problem, cold.solver, mode=mode) for mode in (WARM, COHERENT)
        ]
        if others[0] is not None and others[1] is not None:
            found.append(Case(cold, others[0], others[1]))
    return found


def jitter(results: Results) -> Table:
    """Return Q3: by which angles joints rotate from frame to frame."""
    cases = _cases(results)
    return Table(
        "q3_jitter",
        "How far joints rotate from frame to frame",
        (
            Column("curve", words=True),
            Column("solver", words=True),
            Column("frames"),
            *(Column(f"{mode}, {what}", "°") for what in ("largest", "mean") for mode in MODES),
            *(Column(f"{mode}, last to first", "°") for mode in (WARM, COHERENT)),
        ),
        tuple(_jitter_row(case) for case in cases),
        shows="The angle by which a joint rotates between neighbouring frames: of a ball the "
        "geodesic one, of a hinge the change of its coordinate. The largest is over all frames and "
        "joints, the mean over both; the step from the last frame back to the first stands apart.",
        measured="Each curve is closed and followed once. Cold: every frame solved from the start "
        "pose; warm: every frame from the solution before it; coherent: all frames changed "
        "together from there until the sum of all squared angles, the one that closes the curve "
        "among them, is least.",
        summary=_jitter_summary(cases),
    )


def _jitter_row(case: Case) -> tuple[Cell, ...]:
    return (
        case.cold.title, label(case.cold.solver), int(case.cold.arrays["residual"].size),
        *(_largest(record) for record in case), *(_mean(record) for record in case),
        *(_seam(record) for record in case[1:]),
    )  # fmt: skip


def _largest(record: Record) -> float:
    return metrics.degrees(metrics.spread(record.arrays["largest_angle"][:-1]).largest)


def _mean(record: Record) -> float:
    return metrics.degrees(metrics.mean(record.arrays["mean_angle"][:-1]))


def _seam(record: Record) -> float:
    return metrics.degrees(float(record.arrays["largest_angle"][-1]))


def _jitter_summary(cases: Sequence[Case]) -> Summary:
    if not cases:
        return Summary()
    smoother = sum(_largest(case.coherent) < _largest(case.warm) for case in cases)
    limit = 1.0 + SAME
    closed = sum(_seam(case.coherent) <= limit * _largest(case.coherent) for case in cases)
    worst = [max((case[i] for case in cases), key=_largest) for i in range(len(MODES))]
    return Summary(
        "Of the many solutions take, for all frames together, those that change least from each to "
        "the next. The largest rotation of a joint is then smaller than with warm starts in "
        f"{smoother} of {len(cases)} cases, and in {closed} the step from the last frame back to "
        "the first is no larger than others. The largest of all:",
        tuple(
            f"{mode}: {words(_largest(record))}° ({record.title}, {label(record.solver)})"
            for mode, record in zip(MODES, worst, strict=True)
        ),
    )


def price(results: Results) -> Table:
    """Return how closely the curves are followed, and in how many iterations."""
    cases = _cases(results)
    return Table(
        "q3_price",
        "What a smooth motion costs",
        (
            Column("curve", words=True),
            Column("solver", words=True),
            *(Column(f"{mode}, within tolerance") for mode in MODES),
            *(Column(f"{mode}, largest path error", "m") for mode in MODES),
            *(Column(f"{mode}, mean iterations") for mode in MODES),
            Column("of these over all frames at once"),
        ),
        tuple(_price_row(case) for case in cases),
        shows="The path error is the distance from the effector to its point on the curve. An "
        "iteration over all frames at once counts as one of each frame.",
        measured="Residuals recomputed by forward kinematics of the answers, whatever the solver "
        f"says. Frames are solved to {settings([c.cold for c in cases], 'tolerance')} m in at most "
        f"{settings([c.cold for c in cases], 'max_iterations')} iterations, a coherent motion is "
        "then on its path to rounding; a frame that is not reached is drawn to its point.",
        summary=_price_summary(cases),
    )


def _price_row(case: Case) -> tuple[Cell, ...]:
    return (
        case.cold.title, label(case.cold.solver),
        *(_within(record) for record in case),
        *(metrics.spread(record.arrays["residual"]).largest for record in case),
        *(metrics.mean(record.arrays["iterations"]) for record in case),
        _together(case),
    )  # fmt: skip


def _within(record: Record) -> metrics.Share:
    return metrics.share(record.arrays["residual"] <= record.settings["tolerance"])


def _together(case: Case) -> int:
    """Return the iterations over all frames: what even the frame with the fewest more has more."""
    more = case.coherent.arrays["iterations"] - case.warm.arrays["iterations"]
    return int(metrics.extent(more)[0])


def _price_summary(cases: Sequence[Case]) -> Summary:
    if not cases:
        return Summary()
    steps = [_together(case) for case in cases]
    shares = [[_within(record) for record in case] for case in cases]
    hits = [sum(share[i].hits for share in shares) for i in range(len(MODES))]
    total = sum(share[0].total for share in shares)
    return Summary(
        f"All frames are changed together {words(min(steps))} to {words(max(steps))} times. Of "
        f"{words(total)} frames are within tolerance:",
        tuple(f"{mode}: {words(count)}" for mode, count in zip(MODES, hits, strict=True)),
    )


def drift(results: Results) -> Table:
    """Return how far the pose drifts away from one repetition to the next."""
    pairs = []
    for warm in results.all(SUITE, task=DRIFT, mode=WARM):
        coherent = results.one(SUITE, warm.problem, warm.solver, mode=COHERENT)
        if coherent is not None:
            pairs.append((warm, coherent))
    return Table(
        "q3_drift",
        "How far the arm is from its first pose after each repetition",
        (
            Column("solver", words=True),
            *(
                Column(f"{mode}, after {counted}", "°")
                for mode in (WARM, COHERENT)
                for counted in ("one repetition", "two", "three")
            ),
        ),
        tuple(
            (
                label(warm.solver),
                *(metrics.degrees(turn) for record in (warm, coherent) for turn in _drift(record)),
            )
            for warm, coherent in pairs
        ),
        shows="The largest angle between a joint’s first rotation and the one it has when the tip "
        "is back at the first point.",
        measured="The lab’s arm draws the heart three times without a break. The coherent motion "
        "is closed: its last frame leads back to its first, so that after the third repetition "
        "it has returned by construction.",
        summary=_drift_summary(pairs),
    )


def _drift(record: Record) -> list[float]:
    return [float(turn) for turn in record.arrays["drift"]]


def _drift_summary(pairs: Sequence[tuple[Record, Record]]) -> Summary:
    if not pairs:
        return Summary()
    warm = [metrics.degrees(_drift(record)[-1]) for record, _ in pairs]
    closed = max(metrics.degrees(max(_drift(record))) for _, record in pairs)
    return Summary(
        f"With warm starts the arm is {words(min(warm))} to {words(max(warm))}° from its first "
        f"pose after three repetitions; the closed coherent motion at no time more than "
        f"{words(closed)}°.",
    )
