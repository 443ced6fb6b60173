"""How many of many targets are missed."""

from collections.abc import Sequence

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...harness.results import Results, label, settings
from ...tables.columns import text
from ...tables.layout import Layout
from ...tables.table import INTERVAL, Column, Summary, words

Group = list[Record]


def _groups(results: Results) -> list[Group]:
    """Return the parts of each robot and solver."""
    groups: dict[tuple[str, str], Group] = {}
    for record in results.all("many_targets"):
        groups.setdefault((record.title, record.solver), []).append(record)
    return list(groups.values())


def _total(group: Group, name: str) -> int:
    return sum(int(record.arrays[name]) for record in group)


def _missed(group: Group) -> metrics.Share:
    hits = np.zeros(_total(group, "targets"), dtype=bool)
    hits[: len(hits) - _total(group, "solved")] = True
    return metrics.share(hits)


def _largest(group: Group, name: str) -> float:
    return max(float(record.arrays[name]) for record in group)


def _summary(groups: Sequence[Group]) -> Summary:
    def sentence(group: Group) -> str:
        missed = _missed(group)
        most = words(100.0 * missed.high)
        return (
            f"{group[0].title}: {label(group[0].solver)} missed {missed.hits:,} of "
            f"{missed.total:,} targets, which is at most {most} % (95 %)."
        )

    return Summary(" ".join(map(sentence, groups)))


many_targets = Layout(
    "How rare are failures?",
    "many_targets",
    "Many targets within reach: how many are missed",
    subjects=_groups,
    columns=(
        text("robot", lambda group: group[0].title),
        text("solver", lambda group: label(group[0].solver)),
        Column("targets", read=lambda group: _total(group, "targets")),
        Column("missed", note=INTERVAL, read=_missed),
        Column("falsely claimed", read=lambda group: _total(group, "false")),
        Column("farthest solved", "µm", read=lambda group: _largest(group, "position"), factor=1e6),
    ),
    shows="A target is missed if the answer, by MuJoCo’s kinematics, is not within tolerance of "
    "the pose or not within the limits; falsely claimed if the solver says it is.",
    measured=lambda groups: (
        "Targets are poses of random joint angles, uniform within the limits, from starts of the "
        f"same kind; {settings([r for g in groups for r in g], 'tolerance')} m and "
        f"{settings([r for g in groups for r in g], 'tolerance_rotation')} rad."
    ),
    summary=_summary,
)

LAYOUTS = (many_targets,)
