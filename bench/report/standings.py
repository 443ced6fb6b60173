"""Ranks of the user's solvers: targets solved, errors, and times relative to others."""

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

# The most cloths with a sentence of their own.
MAX_CLOTHS = 3


class Headline(NamedTuple):
    """An answer in a line, with a detail and the name of its table.

    For a solver of the user's the chapter is empty, the question its name and task, the answer its
    rank.
    """

    chapter: str
    question: str
    answer: str
    detail: str
    table: str


def standings(results: Results) -> list[Headline]:
    """Return the ranks of the user's solvers task by task, then their failures."""
    chains = [r for r in results.all("ik", task=chain.CHAIN) if r.facts["stratum"] != chain.BEYOND]
    ranks = [*_target_ranks("chain of balls", "accuracy", by_robot(chains))]
    for start in STARTS:
        ranks += _target_ranks(f"robots, {start}", "robots_overall", fields_of(results, start))
    steps = points(results, cloth_peers.ONE_STEP)
    motions = [point for point in points(results, cloth_peers.MOTION) if point.is_whole]
    ranks += _cloth_ranks("step", "error", "error {}", steps)
    ranks += _cloth_ranks("motion", "true", "{} m from the truth", motions)
    headlines = [*_failures(results, "ik"), *_failures(results, "cloth"), *ranks]
    return sorted(headlines, key=lambda headline: not headline.answer.startswith("rank"))


def _failures(results: Results, suite: str) -> Iterator[Headline]:
    """Yield the first failure of each solver, and on how many problems it failed."""
    doors: dict[str, list[Record]] = {}
    for record in results.all(suite, failed=True, entrant=True):
        doors.setdefault(str(record.facts.get("door")), []).append(record)
    for records in doors.values():
        if sentences := [f"{r.problem}: {why}" for r in records if (why := r.failed or r.trouble)]:
            question = f"{min((record.solver for record in records), key=len)}, suite {suite}"
            answer = f"trouble on {len(sentences)} of {counted(len(records), 'problem')}"
            yield Headline("", question, answer, sentences[0], "entered")


def _target_ranks(task: str, table: str, fields: dict[str, list[Score]]) -> Iterator[Headline]:
    """Yield the ranks of solvers among the solvers that finished the same targets."""
    scores = [score for field in fields.values() for score in field]
    for solver in dict.fromkeys(s.solver for s in scores if s.records[0].facts.get("entrant")):
        problems = {score.robots for score in scores if score.solver == solver}
        rows = {row.solver: row for row in together(problems, fields)}
        yield Headline("", f"{solver}, {task}", *_rank(rows[solver], rows), table)


def _rank(row: Score, rows: Mapping[str, Score]) -> tuple[str, str]:
    """Return the rank of a solver, and details: share solved, best share, relative times."""
    order, first = row.success
    details = [solved(row.share, "targets")]
    if not row.is_ranked or not row.share.hits:
        return f"not ranked, {row.limits or 'solves nothing'}", details[0]
    if row.solver not in first:
        best = rows[order[0]].share
        details.append(f"{_full_name(order[0])}: {100 * best.hits / best.total:.3g} %")
    if len(order) > 1:
        rivals = _fastest([solver for solver in row.time.order if solver != row.solver])
        speeds = [speed(ratio_of_times(rows[rival], row), rival) for rival in rivals]
        details.append(f"{listed(speeds)}, failures penalised")
    place = 1 if row.solver in first else order.index(row.solver) + 1
    tie = " (tie)" if row.solver in first and len(first) > 1 else ""
    return f"rank {place} {of_finishers(len(order), len(rows))}{tie}", "; ".join(details)


def of_finishers(finished: int, count: int) -> str:
    """Return "of 5 solvers" or, if fewer finished, "among the 4 of 5 solvers that finished"."""
    solvers = counted(count, "solver")
    among_finished = f"among the {finished} of {solvers} that finished"
    return f"of {solvers}" if finished == count else among_finished


def solved(share: metrics.Share, noun: str) -> str:
    """Return the share of solved targets or poses, with its interval."""
    low, high = (f"{round(100 * x, 1):g}" for x in (share.low, share.high))
    rate = f"{100 * share.hits / share.total:.3g} %"
    return f"{rate} of {words(share.total)} {noun} solved ({low}–{high})"


def _fastest(rivals: Sequence[str]) -> list[str]:
    """Return the first rival, and the first of Plumbob's solvers if that is another."""
    own = [solver for solver in rivals if is_ours(solver)]
    return list(dict.fromkeys((*rivals[:1], *own[:1])))


def speed(ratio: metrics.PairedRatio, rival: str) -> str:
    """Return how much faster a solver is than a rival, by the ratio of the rival's time to its."""
    mean, low, high, _ = ratio
    if low < 1.0 < high:
        return f"as fast as {_full_name(rival)} ({words(low)}–{words(high)})"
    adverb = "faster" if mean >= 1.0 else "slower"
    if mean < 1.0:
        mean, low, high = 1.0 / mean, 1.0 / high, 1.0 / low
    interval = f" ({words(low)}–{words(high)})" if low < high else ""
    return f"{words(mean)} times {adverb} than {_full_name(rival)}{interval}"


def _full_name(solver: str) -> str:
    """Return a solver's label, with "Plumbob" before the labels of ours that lack it."""
    is_clear = not is_ours(solver) or label(solver).startswith(registry.PLUMBOB)
    return label(solver) if is_clear else f"{registry.PLUMBOB} {label(solver)}"


def _cloth_ranks(task: str, error: str, phrase: str, field: Sequence[Point]) -> Iterator[Headline]:
    """Yield the ranks of solvers by their errors, cloth by cloth."""
    for solver in dict.fromkeys(p.solver for p in field if p.record.facts.get("entrant")):
        cloths = dict.fromkeys(point.cloth for point in field if point.solver == solver)
        by_cloth = [[point for point in field if point.cloth == cloth] for cloth in cloths]
        ranks, details = zip(
            *(_cloth_rank(c, solver, error, phrase) for c in by_cloth), strict=True
        )
        span = "–".join(dict.fromkeys((str(min(ranks)), str(max(ranks)))))
        count = max(len({point.solver for point in points}) for points in by_cloth)
        question = f"{solver}, {task} of {counted(len(cloths), 'cloth')}"
        detail = "; ".join(details[:MAX_CLOTHS])
        yield Headline("", question, f"rank {span} of {count}", detail, f"cloth_peers_{task}")


def _cloth_rank(field: Sequence[Point], solver: str, error: str, phrase: str) -> tuple[int, str]:
    """Return a solver's rank, and its error and time relative to solvers with an error as small."""
    errors = np.array([float(f"{point.values[error]:.2e}") for point in field])  # as displayed
    seconds = np.array([point.values["seconds"] for point in field])
    solvers = np.array([point.solver for point in field])
    own_error = errors[solvers == solver].min()
    near = errors <= own_error
    times = {rival: seconds[near & (solvers == rival)].min() for rival in solvers[near].tolist()}
    own_time = times.pop(solver)
    rivals = _fastest(sorted(times, key=lambda rival: times[rival]))
    ratios = [times[rival] / own_time for rival in rivals]
    speeds = [
        speed(metrics.PairedRatio(r, r, r, 1), s) for r, s in zip(ratios, rivals, strict=True)
    ]
    result = f"{phrase.format(words(own_error))} in {words_in(own_time, 'ms')}"
    detail = f"{field[0].cloth}: {result}, {listed(speeds) or 'nobody else as near'}"
    return 1 + len(set(solvers[errors < own_error])), detail
