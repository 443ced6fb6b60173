"""How long forward kinematics, solves and steps take, beside the engines and a plain copy."""

from collections.abc import Sequence
from functools import partial

from ...tables.columns import at, folded, text, words_in
from ...tables.layout import Layout
from ...tables.results import PRECISION, leaders, steadiness
from ...tables.table import Column, Summary, words
from . import figures, readings
from .case import PLAIN
from .readings import Timed

COPY_SENTENCE = (
    " A plain copy is a loop that reads and writes as many bytes, in memory as near as theirs. It "
    "is a yardstick and no lower bound: caches may serve other work better."
)


def _columns(unit: str, works: Sequence[Timed]) -> tuple[Column, ...]:
    copies = (
        Column("times a plain copy", read=lambda timed: timed.of_copy),
        Column("bandwidth of the copy", "GB/s", read=lambda timed: timed.bandwidth),
    )
    return (
        text("work", lambda timed: timed.record.title),
        text("by", lambda timed: timed.record.solver),
        Column("median", unit, read=lambda timed: timed.timing.median, best="least"),
        Column("95 % interval of the median, ±", "%", read=lambda timed: timed.precision),
        Column("of our compiled time", read=lambda timed: timed.of_ours),
        text("mark", lambda timed: timed.mark),
        *folded(
            [
                Column("10th percentile", unit, read=at(1, lambda timed: timed.timing)),
                Column("90th percentile", unit, read=at(2, lambda timed: timed.timing)),
                Column("rounds", read=lambda timed: timed.timing.rounds),
                *(copies if any(timed.copy for timed in works) else ()),
            ]
        ),
    )


def _summary(unit: str, works: Sequence[Timed]) -> Summary:
    """Say who takes how long for what, plain Python left out, a point for each group of works."""
    rivals: dict[tuple[str, str], list[Timed]] = {}
    for timed in works:
        place = timed.record.details.group, timed.record.details.work
        rivals.setdefault(place, []).extend([timed] * (timed.record.solver != PLAIN))
    groups: dict[str, list[str]] = {}
    for (group, work), of in rivals.items():
        groups.setdefault(group, []).append(f"{work}: {_times(unit, of)}")
    noise = readings.noise(works)
    warning = f"{steadiness(noise)} " if noise > PRECISION else ""
    points = (f"{group} – {'; '.join(sentences)}" for group, sentences in groups.items())
    sentence = "Medians with their 95 % interval, plain Python left out:"
    return Summary(warning + sentence, tuple(points))


def _times(unit: str, works: Sequence[Timed]) -> str:
    times = ", ".join(f"{readings.written(t.record.solver)} {_time(t, unit)}" for t in works)
    multiple = works[0].of_copy if works else None
    beside = "" if multiple is None else f" ({words(multiple)} times a plain copy)"
    return f"{times}{beside}{_first(works)}"


def _time(timed: Timed, unit: str) -> str:
    width = "" if timed.precision is None else f" ± {round(100 * timed.precision, 1):g} %"
    return f"{words_in(timed.timing.median, unit)}{width}"


def _first(works: Sequence[Timed]) -> str:
    """Say who is first of several, or who ties."""
    ranking = readings.ranked_by_time([timed.record for timed in works])
    if ranking is None:
        return " – timed apart, and not ranked" if len(works) > 1 else ""
    return f" – first: {leaders(ranking)}"


def _how(works: Sequence[Timed]) -> str:
    return (
        "One core unless all are named, after a first call that may compile; each time is a call’s "
        "divided by what it does. All that is compared alternates in an order drawn by a seed, "
        "sweep after sweep; the interval is of the medians of sweeps, by order statistics, and two "
        "tie unless Fisher’s randomisation test of their differences, sweep by sweep, gives less "
        f"than 5 %. {steadiness(readings.noise(works))}"
    ).rstrip()


def _layout(question: str, subject: str, title: str, unit: str, shows: str) -> Layout:
    return Layout(
        question,
        f"timing_{subject}",
        title,
        subjects=partial(readings.timed, subject),
        columns=partial(_columns, unit),
        shows=lambda works: shows + (COPY_SENTENCE if any(timed.copy for timed in works) else ""),
        measured=_how,
        summary=partial(_summary, unit),
        figures=(figures.TIMINGS[subject],),
    )


kinematics = _layout(
    "Forward kinematics",
    "kinematics",
    "Time of forward kinematics, for one pose",
    "ns",
    "All joints’ positions and rotations. We check and normalise the quaternions given and "
    "return arrays; an engine’s results stay inside it. The copy reads as many bytes as the "
    "rotations given have and writes as many as positions and rotations have, by a compiled "
    "loop into memory that is there already; its bandwidth counts that memory is read before "
    "it is written.",
)
inverse_kinematics = _layout(
    "Inverse kinematics",
    "ik",
    "Time of inverse kinematics, for one solve of the ten-ball chain",
    "µs",
    "The same targets, random starts and tolerance as in the table of success. Beside our "
    "Levenberg-Marquardt stands the same method as one Python loop on three kinematics.",
)
cloth = _layout(
    "A step of the cloth",
    "cloth",
    "Time of a cloth step, for one frame",
    "µs",
    "MuJoCo starts from a state that it has saved, and its results stay inside it. The copy beside "
    "local/global iterations moves what their triangular solves read: the factor’s nonzeros, twice "
    "an iteration.",
)


LAYOUTS = (kinematics, inverse_kinematics, cloth)
