"""Where solvers of the user's stand: their ranks, what they solve, their times beside others'."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..experiments import chain, cloth_peers
from ..experiments.cloth_peers.readings import Point, points
from ..experiments.robots.readings import (
    STARTS,
    Score,
    by_robot,
    fields_of,
    ratio_of_times,
    together,
)
from ..figures.chart import is_ours
from ..harness import metrics
from ..harness.record import Record
from ..peers import registry
from ..tables.columns import words_in
from ..tables.results import Results, counted, label, listed
from ..tables.table import words

# So many cloths have a sentence of their own.
CLOTHS = 3


class Headline(NamedTuple):
    """An answer in a line, by how much it is so, and the table in which it can be read.

    A solver of the user's has no chapter; its name and task are asked, and its rank is the answer.
    """

    chapter: str
    asked: str
    answer: str
    detail: str
    table: str


def standings(results: Results) -> list[Headline]:
    """Return where each solver of the user's stands, task by task, ranks before what went wrong."""
    chains = [r for r in results.all("ik", task=chain.CHAIN) if r.facts["stratum"] != chain.BEYOND]
    ranked = [*_on_targets("chain of balls", "accuracy", by_robot(chains))]
    for start in STARTS:
        ranked += _on_targets(f"robots, {start}", "robots_overall", fields_of(results, start))
    steps = points(results, cloth_peers.ONE_STEP)
    motions = [point for point in points(results, cloth_peers.MOTION) if point.is_whole]
    ranked += _on_cloths("step", "error", "error {}", steps)
    ranked += _on_cloths("motion", "true", "{} m from the truth", motions)
    headlines = [*_troubles(results, "ik"), *_troubles(results, "cloth"), *ranked]
    return sorted(headlines, key=lambda headline: not headline.answer.startswith("rank"))


def _troubles(results: Results, suite: str) -> Iterator[Headline]:
    """Yield what first went wrong with a solver, and on how many problems something did."""
    records: dict[str, list[Record]] = {}
    for record in results.all(suite, failed=True, entrant=True):
        records.setdefault(str(record.facts.get("door")), []).append(record)
    for mine in records.values():
        if sentences := [f"{r.problem}: {why}" for r in mine if (why := r.failed or r.trouble)]:
            asked = f"{min((record.solver for record in mine), key=len)}, suite {suite}"
            rank = f"trouble on {len(sentences)} of {counted(len(mine), 'problem')}"
            yield Headline("", asked, rank, sentences[0], "entered")


def _on_targets(task: str, table: str, fields: dict[str, list[Score]]) -> Iterator[Headline]:
    """Yield the ranks of solvers among those that finished all of their targets."""
    scores = [score for field in fields.values() for score in field]
    for solver in dict.fromkeys(s.solver for s in scores if s.records[0].facts.get("entrant")):
        problems = {score.robots for score in scores if score.solver == solver}
        rows = {row.solver: row for row in together(problems, fields)}
        yield Headline("", f"{solver}, {task}", *_rank(rows[solver], rows), table)


def _rank(row: Score, rows: Mapping[str, Score]) -> tuple[str, str]:
    """Return the rank of a solver among others, and details."""
    order, first = row.success
    details = [solved(row.share, "targets")]
    if not row.is_ranked or not row.share.hits:
        return f"not ranked, {row.limits or 'solves nothing'}", details[0]
    if row.solver not in first:
        best = rows[order[0]].share
        details.append(f"{_written(order[0])}: {100 * best.hits / best.total:.3g} %")
    if len(order) > 1:
        details.append(_times(row, rows))
    place = 1 if row.solver in first else order.index(row.solver) + 1
    tie = " (tie)" if row.solver in first and len(first) > 1 else ""
    return f"rank {place} {of_finishers(len(order), len(rows))}{tie}", "; ".join(details)


def of_finishers(finished: int, count: int) -> str:
    """Return of how many solvers something is said, of how many that took part."""
    solvers = counted(count, "solver")
    return f"of {solvers}" if finished == count else f"of the {finished} of {solvers} that finished"


def solved(share: metrics.Share, noun: str) -> str:
    """Return how many targets, or poses, are solved, with the interval."""
    low, high = (f"{round(100 * x, 1):g}" for x in (share.low, share.high))
    rate = f"{100 * share.hits / share.total:.3g} %"
    return f"{rate} of {words(share.total)} {noun} solved ({low}–{high})"


def _times(row: Score, rows: Mapping[str, Score]) -> str:
    """Return how much faster or slower a solver is than the fastest of the others and of ours."""
    rivals = _fastest([solver for solver in row.time.order if solver != row.solver])
    speeds = [speed(ratio_of_times(rows[rival], row), rival) for rival in rivals]
    return f"{listed(speeds)}, misses penalised"


def _fastest(rivals: Sequence[str]) -> list[str]:
    """Return the first of some solvers, and the first of ours if that is another."""
    ours = [solver for solver in rivals if is_ours(solver)]
    return list(dict.fromkeys((*rivals[:1], *ours[:1])))


def speed(ratio: metrics.PairedRatio, rival: str) -> str:
    """Return how much faster than a rival a solver is, by the ratio of the rival's times to its."""
    mean, low, high, _ = ratio
    if low < 1.0 < high:
        return f"as fast as {_written(rival)} ({words(low)}–{words(high)})"
    word = "faster" if mean >= 1.0 else "slower"
    if mean < 1.0:
        mean, low, high = 1.0 / mean, 1.0 / high, 1.0 / low
    interval = f" ({words(low)}–{words(high)})" if low < high else ""
    return f"{words(mean)} times {word} than {_written(rival)}{interval}"


def _written(solver: str) -> str:
    """Return how a solver is written beside those of others."""
    is_clear = not is_ours(solver) or label(solver).startswith(registry.PLUMBOB)
    return label(solver) if is_clear else f"{registry.PLUMBOB} {label(solver)}"


def _on_cloths(task: str, name: str, phrase: str, field: Sequence[Point]) -> Iterator[Headline]:
    """Yield the ranks of solvers by how near they come to the answer, cloth by cloth."""
    for solver in dict.fromkeys(p.solver for p in field if p.record.facts.get("entrant")):
        cloths = dict.fromkeys(point.cloth for point in field if point.solver == solver)
        by_cloth = [[point for point in field if point.cloth == cloth] for cloth in cloths]
        ranks, details = zip(*(_on_cloth(c, solver, name, phrase) for c in by_cloth), strict=True)
        span = "–".join(dict.fromkeys((str(min(ranks)), str(max(ranks)))))
        count = max(len({point.solver for point in points}) for points in by_cloth)
        asked = f"{solver}, {task} of {counted(len(cloths), 'cloth')}"
        detail = "; ".join(details[:CLOTHS])
        yield Headline("", asked, f"rank {span} of {count}", detail, f"cloth_peers_{task}")


def _on_cloth(field: Sequence[Point], solver: str, name: str, phrase: str) -> tuple[int, str]:
    """Return the rank of a solver, and its error and time beside those that come as near."""
    errors = np.array([float(f"{point.values[name]:.2e}") for point in field])  # as written
    seconds = np.array([point.values["seconds"] for point in field])
    solvers = np.array([point.solver for point in field])
    least = errors[solvers == solver].min()
    near = errors <= least
    times = {rival: seconds[near & (solvers == rival)].min() for rival in solvers[near].tolist()}
    own = times.pop(solver)
    rivals = _fastest(sorted(times, key=lambda rival: times[rival]))
    speeds = [speed(metrics.PairedRatio(r, r, r, 1), s) for s in rivals for r in (times[s] / own,)]
    rank = 1 + len(set(solvers[errors < least]))
    result = f"{phrase.format(words(least))} in {words_in(own, 'ms')}"
    return rank, f"{field[0].cloth}: {result}, {listed(speeds) or 'nobody else as near'}"
