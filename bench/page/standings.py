"""Ranks of the user's solvers: targets solved, errors, and times relative to others."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..experiments import chain, cloth_peers
from ..experiments.cloth_peers import Point, points
from ..measure import metrics
from ..measure.record import FIRST_TARGETS
from ..peers import catalogue
from ..problems.chains import BEYOND
from ..ranking import scores
from ..tables.columns import words_in
from ..tables.results import Results, counted, grouped, label, listed
from ..tables.table import percent, words

# The most cloths with a sentence of their own.
MAX_CLOTHS = 3


class Headline(NamedTuple):
    """A question, its answer in a complete sentence, and the name of the table with the numbers.

    The chapter is a chapter of the page, "" for a solver of the user's. A sentence is understood
    without the question, which is a heading of a few words.
    """

    chapter: str
    question: str
    sentence: str
    table: str


def standings(results: Results) -> list[Headline]:
    """Return the ranks of the user's solvers task by task, then their failures."""
    chains = [r for r in results.all("ik", task=chain.CHAIN) if r.values.stratum != BEYOND]
    ranks = [*_target_ranks("chain of balls", "accuracy", scores.by_robot(chains))]
    for start in scores.STARTS:
        groups = scores.in_groups(scores.fields_of(results, start))
        for group, fields in groups.items():
            robots = f"robots ({group})" if len(groups) > 1 else "robots"
            ranks += _target_ranks(f"{robots}, {start}", "robots_overall", fields)
    steps = points(results, cloth_peers.ONE_STEP)
    motions = [point for point in points(results, cloth_peers.MOTION) if point.is_whole]
    ranks += [*_cloth_ranks("step", steps), *_cloth_ranks("motion", motions)]
    headlines = [*_failures(results, "ik"), *_failures(results, "cloth"), *ranks]
    return sorted(headlines, key=lambda headline: " ranks " not in headline.sentence)


def _failures(results: Results, suite: str) -> Iterator[Headline]:
    """Yield the first failure of each solver, and on how many problems it failed."""
    entered = results.all(suite, failed=True, entrant=True)
    for records in grouped(entered, lambda record: str(record.measured.get("door"))).values():
        if sentences := [f"{r.problem}: {why}" for r in records if (why := r.failed or r.trouble)]:
            name = min((record.solver for record in records), key=len)
            problems = f"{len(sentences)} of {counted(len(records), 'problem')}"
            sentence = f"{name} had trouble on {problems}; the first is {sentences[0].rstrip('.')}."
            yield Headline("", f"{name}, suite {suite}", sentence, "entered")


def _target_ranks(
    task: str, table: str, fields: dict[str, list[scores.Score]]
) -> Iterator[Headline]:
    """Yield the ranks of solvers among the solvers that finished the same targets."""
    entries = [score for field in fields.values() for score in field]
    for solver in dict.fromkeys(s.solver for s in entries if s.records[0].is_user_solver):
        problems = {score.robots for score in entries if score.solver == solver}
        equal_fields = {r: scores.on_targets_of(solver, field) for r, field in fields.items()}
        rows = {row.solver: row for row in scores.together(problems, equal_fields)}
        yield Headline("", f"{solver}, {task}", _rank(rows[solver], rows), table)


def _rank(row: scores.Score, rows: Mapping[str, scores.Score]) -> str:
    """Return a sentence on a solver: its rank, share solved, the best share, relative times."""
    order, first = row.success
    share = f"it solves {in_percent(row.share)} of {counted(row.share.total, 'target')}"
    if any(FIRST_TARGETS in record.measured for record in row.records):
        share += ", the first of each problem because the solver is slow"
    if not row.is_ranked or not row.share.hits:
        why = f"it is marked “{row.limits}”" if row.limits else "it solves no target"
        return f"{row.solver} is not ranked: {why}."
    if row.solver not in first:
        share += f", the best solver, {full_name(order[0])}, {in_percent(rows[order[0]].share)}"
    if len(order) > 1:
        rivals = _fastest([solver for solver in row.time.order if solver != row.solver])
        ratios = {rival: scores.ratio_of_times(rows[rival], row) for rival in rivals}
        speeds = [speed(ratio, rival) for rival, ratio in ratios.items() if ratio.value > 0.0]
        share += f"; where both solve, it is {listed(speeds)}" if speeds else ""
    place = 1 if row.solver in first else order.index(row.solver) + 1
    tie = f", in a tie of {len(first)}" if row.solver in first and len(first) > 1 else ""
    unfinished = len(rows) - len(order)
    unranked = f" ({counted(unfinished, 'solver')} not ranked)" if unfinished else ""
    return f"{row.solver} ranks {place} of {len(order)}{tie}{unranked}: {share}."


def in_percent(share: metrics.Share) -> str:
    """Return a share as in the tables: "96.7 %"."""
    return f"{percent(share.hits / share.total, share.total)} %"


def full_name(solver: str) -> str:
    """Return how a solver is written in a sentence: "pink (20 restarts)", "Plumbob LM (ours)"."""
    name, *details = label(solver).split(", ")
    details += ["ours"] * (catalogue.is_ours(solver) and name != "ours")
    return f"{name} ({', '.join(details)})" if details else name


def best_rival(solver: str, order: Sequence[str]) -> str:
    """Return the first solver of other authors than a solver's, "" if there is none."""
    authors = catalogue.engine_of(solver)
    return next((rival for rival in order if catalogue.engine_of(rival) != authors), "")


def _fastest(order: Sequence[str]) -> list[str]:
    """Return the first solver, and the first of Plumbob's solvers if different."""
    rivals = [solver for solver in order if not catalogue.is_loop(solver)]
    return list(dict.fromkeys((*rivals[:1], *list(filter(catalogue.is_ours, rivals))[:1])))


def factor(ratio: float) -> str:
    """Return a factor in two digits or more: "4.0", "15" or "1.04"."""
    return f"{ratio:.{0 if ratio >= 10 else 1 if ratio >= 1.1 else 2}f}"


def span(numbers: Sequence[float]) -> str:
    """Return the least and the greatest factor: "1.3 to 1.9"."""
    return " to ".join(dict.fromkeys(map(factor, metrics.extent(np.array(numbers)))))


def speed(ratio: metrics.Interval, rival: str) -> str:
    """Return how much faster a solver is than a rival, by the ratio of the rival's time to its."""
    mean, low, high = ratio
    if low <= 1.0 <= high:
        return f"as fast as {full_name(rival)} within chance"
    adverb = "faster" if mean >= 1.0 else "slower"
    return f"{factor(max(mean, 1.0 / mean))} times {adverb} than {full_name(rival)}"


def _cloth_ranks(task: str, field: Sequence[Point]) -> Iterator[Headline]:
    """Yield the ranks of solvers by their errors, cloth by cloth."""
    for solver in dict.fromkeys(p.solver for p in field if p.record.is_user_solver):
        cloths = dict.fromkeys(point.cloth for point in field if point.solver == solver)
        by_cloth = [[point for point in field if point.cloth == cloth] for cloth in cloths]
        ranks, details = zip(*(_cloth_rank(points, solver) for points in by_cloth), strict=True)
        span = "–".join(dict.fromkeys((str(min(ranks)), str(max(ranks)))))
        count = max(len({point.solver for point in points}) for points in by_cloth)
        question = f"{solver}, {task} of {counted(len(cloths), 'cloth')}"
        sentence = f"{solver} ranks {span} of {count}: {'; '.join(details[:MAX_CLOTHS])}."
        yield Headline("", question, sentence, f"cloth_peers_{task}")


def _cloth_rank(field: Sequence[Point], solver: str) -> tuple[int, str]:
    """Return a solver's rank, and its error and time relative to solvers with an error as small."""
    errors = np.array([float(f"{point.error:.2e}") for point in field])  # as displayed
    seconds = np.array([point.seconds for point in field])
    solvers = np.array([point.solver for point in field])
    own_error = errors[solvers == solver].min()
    near = errors <= own_error
    times = {rival: seconds[near & (solvers == rival)].min() for rival in solvers[near].tolist()}
    own_time = times.pop(solver)
    rivals = _fastest(sorted(times, key=lambda rival: times[rival]))
    ratios = [times[rival] / own_time for rival in rivals]
    speeds = [speed(metrics.Interval(r, r, r), s) for r, s in zip(ratios, rivals, strict=True)]
    result = f"error {words(own_error)} in {words_in(own_time, 'ms')}"
    detail = f"on {field[0].cloth} {result}, {listed(speeds) or 'no other solver as near'}"
    return 1 + len(set(solvers[errors < own_error])), detail
