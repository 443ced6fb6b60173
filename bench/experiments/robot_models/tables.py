"""Robots and characters: how closely engines that read the same files agree with the reference."""

from collections.abc import Iterator, Sequence
from functools import partial
from operator import methodcaller

from ...tables.columns import folded, text
from ...tables.layout import Layout
from ...tables.results import counted, settings
from ...tables.table import Column, Summary, words
from .readings import QUANTITIES, Comparison, comparisons, largest


def _measured(comparisons: Sequence[Comparison]) -> str:
    files, robots = (
        settings((r for c in comparisons if c.is_file == of for r in c.records), "configurations")
        for of in (True, False)
    )
    return (
        f"{files or 'No'} random configurations of each file and {robots or 'none'} of each robot, "
        "within the limits; links and joints are matched by name."
    )


def _summary(comparisons: Sequence[Comparison]) -> Summary:
    files = [comparison for comparison in comparisons if comparison.is_file]
    valid = [record for file in files for record in file.valid]
    worst = [words(largest(valid, quantity)) for quantity in QUANTITIES]
    sentence = (
        f"Over {counted(sum(bool(f.valid) for f in files), 'file')} positions differ by at most "
        f"{worst[0]} of the extent, rotations by {worst[1]}, Jacobians by {worst[2]}:"
    )
    return Summary(sentence * bool(valid), tuple(_points(comparisons)))


def _points(comparisons: Sequence[Comparison]) -> Iterator[str]:
    """Yield how many files each engine reads, and how far engines of peers place robots."""
    files = [record for c in comparisons if c.is_file for record in c.records]
    for engine in dict.fromkeys(record.solver for record in files):
        mine = [record for record in files if record.solver == engine]
        read = [record for record in mine if record.values]
        different = sum(bool(record.details.cause) for record in read)
        otherwise = f", {words(different)} of them otherwise than MuJoCo's documentation says"
        count = f"{words(len(read))} of {counted(len(mine), 'file')} read"
        yield f"{engine}: {count}{otherwise * bool(different)}"
    robots = [r for c in comparisons if not c.is_file for r in c.records if r.values]
    for engine in dict.fromkeys(record.solver for record in robots):
        mine = [record for record in robots if record.solver == engine]
        positions, rotations = (words(largest(mine, name)) for name in QUANTITIES[:2])
        yield (
            f"{engine} on the bench’s robots: effectors within {positions} m and {rotations} in a "
            "rotation matrix"
        )


def _positions(of_files: bool, comparison: Comparison) -> float | None:
    return comparison.largest("positions") if comparison.is_file == of_files else None


readers = Layout(
    "Do other engines read the same robots and characters?",
    "readers",
    "Robots and characters, as engines read them",
    columns=(
        text("robot", lambda comparison: comparison.records[0].title),
        text("engines", lambda comparison: comparison.engines),
        Column("freedoms", read=lambda comparison: comparison.size("freedoms")),
        *(
            Column(title, unit, group="largest difference", read=read)
            for title, unit, read in (
                ("positions, of the extent", "", partial(_positions, True)),
                ("positions", "m", partial(_positions, False)),
                ("rotations", "", methodcaller("largest", "rotations")),
                ("Jacobians", "", methodcaller("largest", "jacobians")),
            )
        ),
        text("remark", lambda comparison: comparison.remark),
        *folded(
            [
                Column("links", read=lambda comparison: comparison.size("links")),
                Column("moving joints", read=lambda comparison: comparison.size("joints")),
            ]
        ),
    ),
    subjects=comparisons,
    shows="The reference reads each file itself. For files, differences are the largest of all "
    "links in all configurations; positions are measured against the extent of the links, "
    "Jacobians against that and one radian. An engine that is known to place links elsewhere "
    "is left out of the numbers, and the cause is given. For the bench’s own robots, each engine "
    "of a peer reads the same text as the reference, and the differences are of the effectors. "
    "Rotations are compared entry by entry as matrices; rounding in double precision leaves 1e-15.",
    measured=_measured,
    summary=_summary,
)

LAYOUTS = (readers,)
