"""The lab's third question: motions without jitter, and what they cost."""

from collections.abc import Callable, Sequence
from typing import Any

from ...harness import metrics
from ...harness.record import Record
from ...harness.results import Results, label, settings
from ...tables.columns import folded, greatest, largest, least, text, words_in
from ...tables.layout import Layout
from ...tables.table import Column, Summary, words
from ..arm import figures as arm
from . import COHERENT, COLD, CURVE, DRIFT, WARM

MODES = (COLD, WARM, COHERENT)
SUITE = "tracking"
# The step that closes a curve counts as no larger than others if it is so but for this share.
SAME = 0.01

# One curve followed by one solver: its record in each mode.
Case = dict[str, Record]


def _cases(results: Results, task: str, modes: Sequence[str]) -> list[Case]:
    """Return the curves that were followed in all of these modes."""
    cases = [
        {mode: results.one(SUITE, first.problem, first.solver, mode=mode) for mode in modes}
        for first in results.all(SUITE, task=task, mode=modes[0])
    ]
    return [{m: r for m, r in case.items() if r} for case in cases if all(case.values())]


CURVE_COLUMN = text("curve", lambda case: case[WARM].title)
SOLVER = text("solver", lambda case: label(case[WARM].solver))


def _by_mode(
    what: str, read: Callable[[Record], Any], unit: str = "", modes: Sequence[str] = MODES
) -> list[Column]:
    """Return a column for each mode."""

    def read_in(mode: str) -> Callable[[Case], Any]:
        return lambda case: read(case[mode])

    return [Column(f"{what}, {mode}", unit, read=read_in(mode), group=what) for mode in modes]


def _largest_angle(record: Record) -> float:
    return metrics.spread(record.arrays["largest_angle"][:-1]).largest


def _mean_angle(record: Record) -> float:
    return metrics.mean(record.arrays["mean_angle"][:-1])


def _closing_angle(record: Record) -> float:
    return float(record.arrays["largest_angle"][-1])


def _jitter_summary(cases: Sequence[Case]) -> Summary:
    largest_angles = [[_largest_angle(case[mode]) for mode in MODES] for case in cases]
    smoother = sum(coherent < warm for _, warm, coherent in largest_angles)
    closed = sum(
        _closing_angle(case[COHERENT]) <= (1.0 + SAME) * angles[-1]
        for case, angles in zip(cases, largest_angles, strict=True)
    )
    worst = {mode: max((case[mode] for case in cases), key=_largest_angle) for mode in MODES}
    return Summary(
        "Of the many solutions take, for all frames together, those that change least from each to "
        "the next. The largest rotation of a joint is then smaller than with warm starts in "
        f"{smoother} of {len(cases)} cases, and in {closed} the step from the last frame back to "
        "the first is no larger than others. The largest of all:",
        tuple(
            f"{mode}: {words_in(_largest_angle(record), '°')} ({record.title}, "
            f"{label(record.solver)})"
            for mode, record in worst.items()
        ),
    )


jitter = Layout(
    "Q3. Joints may jitter from frame to frame: how is it avoided?",
    "q3_jitter",
    "How far joints rotate from frame to frame",
    subjects=lambda results: _cases(results, CURVE, MODES),
    columns=(
        CURVE_COLUMN,
        SOLVER,
        Column("frames", read=lambda case: case[WARM].arrays["residual"].size),
        *least(_by_mode("largest", _largest_angle, "°")),
        *folded(_by_mode("mean", _mean_angle, "°")),
        *least(_by_mode("last to first", _closing_angle, "°", (WARM, COHERENT))),
    ),
    shows="The angle by which a joint rotates between neighbouring frames: of a ball the "
    "geodesic one, of a hinge the change of its coordinate. The largest is over all frames and "
    "joints, the mean over both; the step from the last frame back to the first stands apart.",
    measured="Each curve is closed and followed once. Cold: every frame solved from the start "
    "pose; warm: every frame from the solution before it; coherent: all frames changed "
    "together from there until the sum of all squared angles, the one that closes the curve "
    "among them, is least.",
    summary=_jitter_summary,
    figures=(arm.jitter,),
)


def _colds(cases: Sequence[Case]) -> list[Record]:
    return [case[COLD] for case in cases]


def _within(record: Record) -> metrics.Share:
    return metrics.share(record.arrays["residual"] <= record.settings["tolerance"])


def _together(case: Case) -> int:
    """Return the iterations over all frames: what even the frame with the fewest more has more."""
    more = case[COHERENT].arrays["iterations"] - case[WARM].arrays["iterations"]
    return int(metrics.extent(more)[0])


def _price_summary(cases: Sequence[Case]) -> Summary:
    steps = [_together(case) for case in cases]
    total = sum(_within(case[COLD]).total for case in cases)
    hits = {mode: sum(_within(case[mode]).hits for case in cases) for mode in MODES}
    return Summary(
        f"All frames are changed together {words(min(steps))} to {words(max(steps))} times. Of "
        f"{words(total)} frames are within tolerance:",
        tuple(f"{mode}: {words(count)}" for mode, count in hits.items()),
    )


def _drift_after(mode: str, i: int) -> Callable[[Case], Any]:
    return lambda case: case[mode].arrays["drift"][i]


def _drift_summary(pairs: Sequence[Case]) -> Summary:
    warm = [float(pair[WARM].arrays["drift"][-1]) for pair in pairs]
    closed = largest([pair[COHERENT] for pair in pairs], "drift")
    return Summary(
        f"With warm starts the arm is {words_in(min(warm), '°').rstrip('°')} to "
        f"{words_in(max(warm), '°')} from its first pose after three repetitions; the closed "
        f"coherent motion at no time more than {words_in(closed, '°')}."
    )


price = Layout(
    "What does a smooth motion cost?",
    "q3_price",
    "What a smooth motion costs",
    columns=(
        CURVE_COLUMN,
        SOLVER,
        *greatest(_by_mode("within tolerance", _within)),
        *folded(_by_mode("largest path error", lambda r: largest([r], "residual"), "m")),
        *_by_mode("mean iterations", lambda r: metrics.mean(r.arrays["iterations"])),
        Column("of these over all frames at once", read=_together),
    ),
    subjects=lambda results: _cases(results, CURVE, MODES),
    shows="The path error is the distance from the effector to its point on the curve. An "
    "iteration over all frames at once counts as one of each frame.",
    measured=lambda cases: (
        "Residuals recomputed by forward kinematics of the answers, whatever the solver "
        f"says. Frames are solved to {settings(_colds(cases), 'tolerance')} m in at most "
        f"{settings(_colds(cases), 'max_iterations')} iterations, a coherent motion is "
        "then on its path to rounding; a frame that is not reached is drawn to its point."
    ),
    summary=_price_summary,
)


drift = Layout(
    "Does a motion drift as it is repeated?",
    "q3_drift",
    "How far the arm is from its first pose after each repetition",
    subjects=lambda results: _cases(results, DRIFT, (WARM, COHERENT)),
    columns=(
        SOLVER,
        *(
            Column(
                f"{mode}, after {counted}",
                "°",
                read=_drift_after(mode, i),
                best="least",
                group=mode,
            )
            for mode in (WARM, COHERENT)
            for i, counted in enumerate(("one repetition", "two", "three"))
        ),
    ),
    shows="The largest angle between a joint’s first rotation and the one it has when the effector "
    "is back at the first point.",
    measured="The lab’s arm draws the heart three times without a break. The coherent motion "
    "is closed: its last frame leads back to its first, so that after the third repetition "
    "it has returned by construction.",
    summary=_drift_summary,
    compared=0,
)


LAYOUTS = (jitter, price, drift)
