"""What factors and steps cost as cloths grow to a million particles."""

from collections.abc import Sequence

from ...harness.results import settings
from ...tables.columns import folded, least, text
from ...tables.layout import Layout
from ...tables.table import Column, Summary, words
from .readings import OURS, Scaled, cloths, ratios


def _value(title: str, unit: str, name: str) -> Column:
    return Column(title, unit, read=lambda row: row.value(name))


def _ratio(title: str, unit: str, name: str, other: str) -> Column:
    return Column(title, unit, read=lambda row: row.over(name, other))


def _over_particles(title: str, unit: str, name: str) -> Column:
    return Column(title, unit, read=lambda row: row.over(name, row.particles))


def _summary(rows: Sequence[Scaled]) -> Summary:
    multiples = (
        f"{words(particles)} particles, ours as a multiple of CHOLMOD’s: factor {words(factor)}, "
        f"solve {words(solve)}, memory {words(memory)}"
        for particles, (factor, solve, memory) in ratios(rows).items()
    )
    return Summary(_largest(rows), tuple(multiples))


def _largest(rows: Sequence[Scaled]) -> str:
    ours = [row for row in rows if row.record.solver == OURS]
    if not ours:
        return ""
    last = max(ours, key=lambda row: row.particles)
    return (
        f"With {words(last.particles)} particles {words(last.iterations)} iterations take "
        f"{words(last.value('step'))} s, as long as {words(last.over('step', 'solve'))} solves, "
        f"and leave a residual of {words(last.value('residual'))}."
    )


def _columns(rows: Sequence[Scaled]) -> Sequence[Column]:
    count = settings([row.record for row in rows], "iterations")
    return (
        Column("particles", read=lambda row: row.particles),
        text("by", lambda row: row.library),
        *least(
            [
                _value("first factor", "s", "factor"),
                _value("again, pattern known", "s", "refactor"),
                _value("solve", "ms", "solve"),
                _value("most memory", "GiB", "memory"),
            ]
        ),
        _over_particles("iteration", "ns/particle", "iteration"),
        _ratio("iteration", "plain reads", "iteration", "limit"),
        _value("final residual", "", "residual"),
        *folded(
            [
                _ratio(f"{count} iterations", "solves", "step", "solve"),
                _over_particles("local step", "ns/particle", "local"),
                _over_particles("solve", "ns/particle", "solve"),
                _ratio("solve", "ns/nonzero", "solve", "entries"),
                _over_particles("nonzeros of L for each", "", "entries"),
            ]
        ),
    )


scale = Layout(
    "What do factors and iterations cost as the cloth grows?",
    "cloth_scale",
    "Factors of M + h² L and local/global iterations as the cloth grows",
    subjects=cloths,
    columns=_columns,
    shows="The first factor finds an order of elimination; another step length or stiffness "
    "needs only the second. A solve has three right-hand sides. The memory is that of a whole "
    "process, compiler and cloth included, but for a second factor beside the first. A plain read "
    "is a loop over as many bytes as an iteration has to read: the factor twice, the springs, the "
    "particles. It is a yardstick and no lower bound. As a factor outgrows a cache, its nonzeros "
    "cost more. The residual is that after all iterations.",
    measured=lambda rows: (
        "The lab’s cloth, with more particles, a stiffness of "
        f"{settings([row.record for row in rows], 'stiffness')} N/m and two waves that rise; steps "
        f"of {settings([row.record for row in rows], 'h')} s. Each cloth in a process of its own, "
        "on one core but for the springs of the largest, which are summed on all; times are "
        "medians of rounds in which everything is timed once."
    ),
    summary=_summary,
)


LAYOUTS = (scale,)
