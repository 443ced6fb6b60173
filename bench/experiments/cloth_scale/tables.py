"""What factors and steps cost as cloths grow to a million particles."""

from collections.abc import Sequence
from functools import partial

from ...harness.record import Record
from ...tables.columns import folded, least, text
from ...tables.layout import Layout
from ...tables.results import settings
from ...tables.table import Column, Summary, words
from . import readings


def _value(title: str, unit: str, name: str) -> Column:
    return Column(title, unit, read=partial(readings.value, name=name))


def _ratio(title: str, unit: str, name: str, other: str = "particles") -> Column:
    return Column(title, unit, read=partial(readings.ratio, name=name, other=other))


def _summary(records: Sequence[Record]) -> Summary:
    multiples = (
        f"{words(particles)} particles, ours as a multiple of CHOLMOD’s: factor {words(factor)}, "
        f"solve {words(solve)}, memory {words(memory)}"
        for particles, (factor, solve, memory) in readings.beside_cholmod(records).items()
    )
    return Summary(_largest(records), tuple(multiples))


def _largest(records: Sequence[Record]) -> str:
    ours = [record for record in records if record.solver == readings.OURS]
    if not ours:
        return ""
    last = max(ours, key=lambda record: record.details.particles)
    return (
        f"With {words(last.details.particles)} particles {words(last.details.iterations)} "
        f"iterations take {words(readings.value(last, 'step'))} s, as long as "
        f"{words(readings.ratio(last, 'step', 'solve'))} solves, and leave a residual of "
        f"{words(last.values.residual)}."
    )


def _columns(records: Sequence[Record]) -> Sequence[Column]:
    return (
        Column("particles", read=lambda record: record.details.particles),
        text("by", readings.library),
        *least(
            [
                _value("first factor", "s", "factor"),
                _value("again, pattern known", "s", "refactor"),
                _value("solve", "ms", "solve"),
                _value("most memory", "GiB", "memory"),
            ]
        ),
        _ratio("iteration", "ns/particle", "iteration"),
        _ratio("iteration", "plain reads", "iteration", "limit"),
        _value("final residual", "", "residual"),
        *folded(
            [
                _ratio(f"{settings(records, 'iterations')} iterations", "solves", "step", "solve"),
                _ratio("local step", "ns/particle", "local"),
                _ratio("solve", "ns/particle", "solve"),
                _ratio("solve", "ns/nonzero", "solve", "entries"),
                _ratio("nonzeros of L for each", "", "entries"),
            ]
        ),
    )


scale = Layout(
    "What do factors and iterations cost as the cloth grows?",
    "cloth_scale",
    "Factors of M + h² L and local/global iterations as the cloth grows",
    subjects=lambda results: results.all("cloth_scale"),
    columns=_columns,
    shows="The first factor finds an order of elimination; another step length or stiffness "
    "needs only the second. A solve has three right-hand sides. The memory is that of a whole "
    "process, compiler and cloth included, but for a second factor beside the first. A plain read "
    "is a loop over as many bytes as an iteration has to read: the factor twice, the springs, the "
    "particles. It is a yardstick and no lower bound. As a factor outgrows a cache, its nonzeros "
    "cost more. The residual is that after all iterations.",
    measured=lambda records: (
        "The lab’s cloth, with more particles, a stiffness of "
        f"{settings(records, 'stiffness')} N/m and two waves that rise; steps "
        f"of {settings(records, 'h')} s. Each cloth in a process of its own, "
        "on one core but for the springs of the largest, which are summed on all; times are "
        "medians of rounds in which everything is timed once."
    ),
    summary=_summary,
)


LAYOUTS = (scale,)
