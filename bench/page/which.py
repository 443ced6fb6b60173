"""Which solver to choose for a robot: a row for each solver, and a sentence of advice."""

from collections.abc import Sequence
from dataclasses import replace

from ..measure import metrics
from ..peers import catalogue, packages
from ..problems.robots import REACHABLE
from ..ranking.scores import Score, by_robot
from ..tables.columns import text, words_in
from ..tables.results import Results, counted, grouped, listed
from ..tables.table import Column, Summary, Table, cells
from .standings import full_name, in_percent


def solvers_on_robot(results: Results, name: str) -> Table:
    """Return a row for each solver with its best settings, the best first, and advice as summary.

    `results` are of one robot of this name. A better solver solves more targets, or as many with a
    smaller median time. Times are of all targets, solved or not.

    Raises:
        ValueError: if no solver could be tried.
    """
    fields = list(by_robot(results.all("ik", task=REACHABLE)).values())
    if not fields:
        raise ValueError("robot: expected one that an installed solver takes, got none such")
    entries = sorted(fields[0], key=lambda score: (-score.share.hits, _median(score)))
    rows = [group[0] for group in grouped(entries, _title).values()]
    columns = (
        text("solver", _title),
        Column("solved", "%", read=lambda score: score.share.hits / score.share.total),
        Column("median", "µs", read=_median),
        Column("95 %", "µs", read=lambda score: metrics.spread(score.seconds).p95),
        text("best use", lambda score: _peers().get(score.solver, ("", ""))[1]),
        replace(text("settings", lambda score: score.solver), folded=True),
    )
    details = rows[0].records[0].values
    link = details.effectors[0].partition("_")[2] or details.effectors[0]
    title = f"{name}, {counted(details.joints, 'joint')} to {link}: {rows[0].total} targets"
    missing = tuple(filter(None, _missing(set(map(_title, rows)))))
    summary = Summary(advice(entries), missing)
    return Table("which", title, columns, cells(columns, rows), summary=summary)


def advice(entries: Sequence[Score]) -> str:
    """Return which solver to choose: the fastest of the solvers tied with the best."""
    first = [e for e in entries if e.solver in e.success.first and e.share.hits]
    if not first:
        return "No solver reaches a target: does --link name the link that you mean?"
    best = min(first, key=_median)
    share = f"it solves {in_percent(best.share)} of the targets"
    time = f"with a median of {words_in(_median(best), 'µs')}"
    solvers = len(set(map(_title, first)))
    if solvers == 1:
        return f"Choose {full_name(best.solver)}: {share}, more than any other, {time}."
    rivals = f"the fastest of {solvers} that solve the most within chance"
    return f"Choose {full_name(best.solver)}: {share} {time}, {rivals}."


def _median(score: Score) -> float:
    return metrics.spread(score.seconds).median


def _peers() -> dict[str, tuple[str, str]]:
    """Return title and use of registered solvers, by the names of their settings in records."""
    return {
        peer.label_of(entry): (peer.title, peer.use)
        for peer in catalogue.PEERS for entry in peer.runs
    }  # fmt: skip


def _title(score: Score) -> str:
    """Return a solver's name without its settings."""
    title = _peers().get(score.solver, (catalogue.title_of(score.solver),))[0]
    return f"{title} (ours)" if catalogue.is_ours(score.solver) else title


def _missing(present: set[str]) -> Sequence[str]:
    """Return sentences on installed solvers without a result, and on solvers not installed."""
    installed = [peer.title for peer in catalogue.PEERS if peer.is_installed]
    refused = [title for title in installed if not {title, f"{title} (ours)"} & present]
    absent = [peer.title for peer in catalogue.PEERS if not peer.is_installed]
    return (
        f"Without a result here: {listed(refused)}." * bool(refused),
        f"Not installed: {listed(absent)}; `{packages.peers_command()}` adds them." * bool(absent),
    )
