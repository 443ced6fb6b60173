"""Published tables of solvers, and the same set-up here."""

from collections.abc import Sequence

from ...tables.columns import folded, text
from ...tables.layout import Layout
from ...tables.table import Cell, Column, Summary, listing, words
from ..robots.tables import RULE
from . import problem as published
from .readings import Comparison, comparisons


def _here(comparison: Comparison, name: str = "value") -> Cell:
    """Return a number measured here, or a bound of its interval, None where that is unknown."""
    value = getattr(comparison.here, name, None)
    return value if value == value else None


def _summary(comparisons: Sequence[Comparison]) -> Summary:
    both = (one for one in comparisons if one.published is not None and one.here)
    return listing("Here, and as published:", map(_point, both))


def _point(one: Comparison) -> str:
    low, high = _here(one, "low"), _here(one, "high")
    interval = "" if low is None else f"{words(low)}–{words(high)}, "
    mark = f", {one.mark}" if one.mark else ""
    return (
        f"{one.problem}, {one.solver}: {one.quantity} {words(_here(one))} "
        f"({interval}n = {words(one.targets)}), published {words(one.published)}{mark}"
    )


published_ik = Layout(
    "What did others measure, and what do we?",
    "published_ik",
    "Published tables of inverse kinematics, and the same set-up here",
    subjects=comparisons,
    columns=(
        text("table", lambda one: one.table),
        text("problem", lambda one: one.problem),
        text("solver", lambda one: one.solver),
        text("quantity", lambda one: one.quantity),
        Column("published", read=lambda one: one.published),
        Column("here", read=_here),
        text("mark", lambda one: one.mark),
        *folded(
            [
                Column("here, 95 % from", read=lambda one: _here(one, "low")),
                Column("here, 95 % to", read=lambda one: _here(one, "high")),
                Column("targets here", read=lambda one: one.targets),
                text("source", lambda one: one.source),
            ]
        ),
    ),
    shows="TRAC-IK: full poses at "
    f"{words(published.TRAC_IK_TOLERANCE)} m and rad in each of 6 components, "
    "every search from the middle of the limits, at most 5 ms for TRAC-IK; times of all targets, "
    "those that failed included. Robotics Toolbox: random poses and starts, one search of at most "
    f"{words(published.TOOLBOX_ITERATIONS)} iterations; infeasible is what the search does not "
    "solve. The published searches look at no limits, nor do the toolbox’s here; “not solved "
    "within the limits” counts answers beyond them as not solved. FABRIK: iterations for one "
    "target, ten joints, no limits; here a target out of reach is recognised as such by geometry "
    f"where the chain is straight. {RULE}",
    measured="TRAC-IK: published with 10,000 reachable random poses on a machine of its time; here "
    "evaluated by MuJoCo at the norm of three such components; the PR2’s continuous joints have "
    "two revolutions in either direction. Robotics Toolbox: published with 10,000 poses, the "
    "tutorial’s own Python loops (Haviland and Corke 2022; the rates of its other commits differ "
    "by some tenths); here the toolbox’s compiled ones, and ours; half the squared error within "
    f"{words(published.TOOLBOX_HALF_SQUARE)}. FABRIK: published with 20 runs in MATLAB, read in a "
    "secondary source; chain, target and tolerance are not stated there. Here a guess: "
    f"{published.FABRIK_LINKS} links of {published.FABRIK_LENGTH} m from straight, "
    f"{published.FABRIK_RUNS} seeded directions, targets at "
    f"{' and '.join(map(str, published.FABRIK_DISTANCES.values()))} m, "
    f"to {words(published.FABRIK_TOLERANCE)} m.",
    summary=_summary,
)

LAYOUTS = (published_ik,)
