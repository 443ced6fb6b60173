"""The first screen: the best solver, the best other solver, where others win, absent solvers.

Plumbob takes part like everyone else. Who is first, and who ties, is read from the tables and from
the scores behind the tables. Our own Python loops on engines are not ranked.
"""

import itertools
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ..experiments.cloth_peers import (
    MISSING,
    MOTION,
    NEAR,
    ONE_STEP,
    SINGLE_PRECISION,
    SOLVED,
    motion_length,
    points,
)
from ..measure import metrics
from ..measure.record import FINISHED
from ..peers import catalogue
from ..peers.peer import ONE_START, PORTFOLIO, PORTFOLIO_ITERATIONS, RESTARTS
from ..problems.robots import REACHABLE
from ..ranking.rankings import TableRanking, rankings
from ..ranking.scores import STARTS, Score, overall, ratio_of_times, sample
from ..tables.results import Results, counted, grouped, listed, solvers
from ..tables.table import percent, words
from .sections import SECTIONS
from .standings import Headline, best_rival, full_name, in_percent, span, speed, standings
from .wins import wins_of_others

_FROM = {
    ONE_START: "from one start",
    PORTFOLIO: f"with a portfolio of {words(PORTFOLIO_ITERATIONS)} iterations",
    RESTARTS: "with restarts",
}
# Times within which the shares of solved poses are compared [s]: a step of a controller at 1 kHz,
# and a tenth of the step.
_BUDGETS = (1e-4, 1e-3)
# The groups of robots, first the group held out from tuning.
_GROUPS = ("held out", "tuning", "yours")
# Behind the name of an engine among absent solvers.
_IN_CLOTH = " (cloth)"
# What the scales of a run mean.
_SCALES = {"quick": "Quick run: few targets and rounds", "full": "Full run: all targets and rounds"}


class ClaimCount(NamedTuple):
    """How many claims hold, of how many, and which uses the largest share of its tolerance."""

    holding: int
    total: int
    narrowest: str
    used: float


class Overview(NamedTuple):
    """The contents of the first screen; no verdict if the cross-check was not run."""

    verdict: ClaimCount | None
    headlines: list[Headline]
    scale: str
    absent: list[str]
    standings: Sequence[Headline] = ()
    wins: Sequence[Headline] = ()  # of other solvers over ours


def overview(results: Results) -> Overview:
    """Return the contents of the first screen."""
    parts = verdict(results), headlines(results), scale(results), absent(results)
    return Overview(*parts, standings(results), wins_of_others(results))


def verdict(results: Results) -> ClaimCount | None:
    """Return the result of the cross-check, None if not run."""
    claims = [record for record in results.all("check") if record.has_numbers]
    if not claims:
        return None
    used = {r.title: metrics.ratio(r.values.difference, r.values.tolerance) for r in claims}
    narrowest = max(used, key=lambda name: used[name])
    holding = sum(record.values.holds for record in claims)
    return ClaimCount(holding, len(claims), narrowest, used[narrowest])


def headlines(results: Results) -> list[Headline]:
    """Return the best solver and the best other solver of each task, as far as measured.

    Robots held out from tuning come first. A sentence on other solvers counts absent solvers and
    says which solvers are not ranked.
    """
    missing = absent(results)
    engines = sum(name.endswith(_IN_CLOTH) for name in missing)
    absences = {"kinematics": _absence(len(missing) - engines), "cloth": _absence(engines)}
    if any(map(catalogue.is_loop, solvers(results.all("ik", task=REACHABLE)))):
        absences["kinematics"] += "; our loops on other engines are not ranked"
    every = [*_of_robots(results), *_of_races(results)]
    return [_with_remark(headline, absences.get(headline.chapter, "")) for headline in every]


def _absence(count: int) -> str:
    verb = "was" if count == 1 else "were"
    return f"; {counted(count, 'other')} {verb} not installed" if count else ""


def _with_remark(headline: Headline, remark: str) -> Headline:
    """Add a remark to a sentence on other solvers."""
    if not remark or " other " not in headline.sentence:
        return headline
    return headline._replace(sentence=f"{headline.sentence.removesuffix('.')}{remark}.")


def scale(results: Results) -> str:
    """Return the scale of the records: "Quick run: 20 targets of each kind", "" if unknown."""
    names = dict.fromkeys(r.measured.get("scale", "") for r in results.all(FINISHED))
    name = listed(list(filter(None, names)))
    records = results.all("ik", task=REACHABLE)
    counts = {int(r.size) // max(1, len(r.values.strata)) for r in records} - {0}
    targets = listed([words(count) for count in sorted(counts)], "or")
    run = f"{name} run".strip().capitalize()
    if targets:
        return f"{run}: {targets} targets of each kind"
    mixture = "Some suites were measured quickly, others at full length"
    return _SCALES.get(name, mixture) if name else ""


def absent(results: Results) -> list[str]:
    """Return the requested peers that are not installed."""
    records = results.all("ik", task=REACHABLE)
    requested = {record.solver for record in records}
    present = {record.solver for record in records if record.values.version}
    peers = _recorded_names()
    solvers = [peer for peer, names in peers.items() if names & requested and not names & present]
    packages = {record.solver for record in results.all("cloth", task=MISSING)}
    engines = [peer.engine for peer in catalogue.cloth_peers() if peer.package in packages]
    return [*solvers, *(f"{engine}{_IN_CLOTH}" for engine in dict.fromkeys(engines))]


def not_asked(results: Results) -> list[str]:
    """Return the peers without records, where there are records of others."""
    requested = {record.solver for record in results.all("ik", task=REACHABLE)}
    solvers = [
        peer for peer, names in _recorded_names().items() if requested and not names & requested
    ]
    measured = [point for task in (ONE_STEP, MOTION) for point in points(results, task)]
    present = {catalogue.find(point.solver).engine for point in measured}
    engines = dict.fromkeys(peer.engine for peer in catalogue.cloth_peers())
    cloth = [f"{engine}{_IN_CLOTH}" for engine in engines if present and engine not in present]
    missing = absent(results)
    return [*solvers, *(name for name in cloth if name not in missing)]


def _recorded_names() -> dict[str, set[str]]:
    """Return the names of each peer's entries in records, by its title."""
    return {peer.name: set(map(peer.label_of, peer.runs)) for peer in catalogue.PEERS}


def _of_robots(results: Results) -> Iterator[Headline]:
    """Yield the answers on the robots of each group, from the comparison of most solvers."""
    comparisons = grouped(overall(results), lambda score: (score.group, score.start))
    for group, start in itertools.product(_GROUPS, reversed(STARTS)):
        fields = grouped(comparisons.get((group, start), []), lambda score: score.robots).values()
        ranked = [{s.solver: s for s in field if s.is_ranked} for field in fields]
        rows = max(ranked, key=_pairs, default={})
        if len(rows) > 1:
            yield from _robot_headlines(f"{group}, {start}", rows)


def _pairs(rows: dict[str, Score]) -> int:
    """Return how many pairs of a robot and a solver are compared."""
    return sum(len(row.records) for row in rows.values())


def _robot_headlines(kind: str, rows: dict[str, Score]) -> Iterator[Headline]:
    """Yield the solver of the most targets, and the fastest."""
    row = next(iter(rows.values()))
    place = f"On {row.robots}, {_FROM[row.start]}"
    times = [solver for solver in row.time.order if rows[solver].share.hits]
    order = [solver for solver in row.success.order if rows[solver].share.hits]
    untimed = [solver for solver in order if solver not in times]
    order.sort(key=lambda s: (-rows[s].share.hits, [*times, *untimed].index(s)))
    sentences = {"Solved within a time": _solved_in_time({s: rows[s] for s in row.time.order})}
    if order:
        sentences["Fastest"] = _fastest(rows, times, order[0])
        sentences["Most poses solved"] = _most_solved(rows, order[0], best_rival(order[0], order))
    for question, sentence in sentences.items():
        if sentence:
            headline = f"{question}, {kind}", f"{place}, {sentence}."
            yield Headline("kinematics", *headline, "robots_overall")


def _solved_in_time(rows: dict[str, Score]) -> str:
    """Return who solves the largest share of the poses within each budget of time."""
    sentences = []
    for seconds in _BUDGETS:
        shares = {s: float(row.solved_within(np.array([seconds]))[0][0]) for s, row in rows.items()}
        hits = {
            s: (row.timed_solved & (row.seconds <= seconds)).astype(float)
            for s, row in rows.items()
        }
        order = sorted(shares, key=lambda solver: -shares[solver])
        if order and shares[order[0]] and (rival := best_rival(order[0], order)):
            first, total = order[0], rows[order[0]].total
            share, other = (f"{percent(shares[s], total)} %" for s in (first, rival))
            tie = ", a tie within chance" * ({first, rival} <= {*metrics.ranking(hits).first})
            sentences.append(
                f"within {1e6 * seconds:,.0f} µs {full_name(first)} solves {share} of the poses "
                f"and {full_name(rival)}, the best other solver, {other}{tie}"
            )
    return "; ".join(sentences) + f" ({sample([*rows.values()][:1])})" * bool(sentences)


def _most_solved(rows: dict[str, Score], first: str, rival: str) -> str:
    """Return who solves the most poses, the best other solver if any, and how many tie."""
    share, rates = rows[first].share, np.array(rows[first].shares_by_seed)
    low, high = (percent(rate, share.total) for rate in metrics.extent(rates))
    seeds = f", {low} to {high} by seed" if np.ptp(rates) else ""
    solved = f"{in_percent(share)} of {words(share.total)}{seeds}"
    if not rival:
        return f"{full_name(first)} solves the most poses: {solved}"
    equals = [solver for solver in rows[first].success.first if rows[solver].share.hits]
    ties = len(set(map(catalogue.title_of, equals)))
    chance = f", and {ties} solvers tie within chance" * (ties > 2)
    chance += ", a tie within chance" * (ties == 2)
    if rows[rival].share.hits == share.hits:
        chance = chance.removesuffix(", a tie within chance")
        return (
            f"{full_name(first)} and {full_name(rival)} solve the most poses: each {solved}{chance}"
        )
    other = f"the best other solver is {full_name(rival)} with {in_percent(rows[rival].share)}"
    return f"{full_name(first)} solves the most poses: {solved}; {other}{chance}"


def _fastest(rows: dict[str, Score], times: Sequence[str], best: str) -> str:
    """Return the fastest of the solvers that solve as many as the best, "" without rivals.

    Times are compared on poses solved by both, so a miss costs no time here. Solvers of fewer poses
    are compared with the best only if no other solver solves as many.
    """
    equals = [solver for solver in times if solver in rows[best].success.first] if best else []
    first = next(iter(equals), "")
    if first and (rival := best_rival(first, equals)):
        ratio = ratio_of_times(rows[rival], rows[first])
        names = f"{full_name(first)} and {full_name(rival)}"
        if ratio.low <= 1.0 <= ratio.high:
            return (
                f"of the solvers that solve the most, {names} are the fastest, a tie within chance"
            )
        first, rival, ratio = _in_order(first, rival, ratio)
        return (
            f"{full_name(first)} is the fastest of the solvers that solve the most: it is "
            f"{speed(ratio, rival)}, the next"
        )
    if best not in times:
        return ""
    ratios = {s: ratio_of_times(rows[s], rows[best]) for s in times if best_rival(best, [s])}
    ratios = {solver: ratio for solver, ratio in ratios.items() if ratio.value > 0.0}
    if not ratios:
        return ""
    rival = min(ratios, key=lambda solver: ratios[solver].value)
    return (
        f"{full_name(best)} solves more poses than any other solver and is, where both solve, "
        f"{speed(ratios[rival], rival)}, the fastest other one there"
    )


def _in_order(a: str, b: str, ratio: metrics.Interval) -> tuple[str, str, metrics.Interval]:
    """Return the faster of two solvers, the slower, and the ratio of their times, above 1."""
    if ratio.value >= 1.0:
        return a, b, ratio
    return b, a, metrics.Interval(1.0 / ratio.value, 1.0 / ratio.high, 1.0 / ratio.low)


class Race(NamedTuple):
    """A task in which engines run code of their own, and the column that ranks them."""

    chapter: str
    table: str
    column: str
    task: str  # in a sentence
    noun: str  # of a case


def _races(results: Results) -> list[Race]:
    """Return the tasks in which engines race."""
    step = f"a step solved to {SOLVED}"
    motion = f"{motion_length(results)} within {NEAR} of the truth"
    return [
        Race("cloth", "cloth_peers_step", f"time to {SOLVED}", step, "cloth"),
        Race("cloth", "cloth_peers_motion", f"time to {NEAR}", motion, "cloth"),
        Race("speed", "timing_kinematics", "median", "forward kinematics", "case"),
        Race("speed", "timing_jacobians", "median", "the Jacobian of an effector", "case"),
        Race("speed", "timing_cloth", "median", "a step of a cloth", "case"),
    ]


def _of_races(results: Results) -> Iterator[Headline]:
    """Yield the engine that is the fastest in most cases of each race with rivals."""
    layouts = {layout.name: layout for section in SECTIONS for layout in section.layouts}
    for race in _races(results):
        every = rankings(layouts[race.table](results))
        cases = [r for r in every if r.column.title == race.column and len(r.places) > 1]
        engines = {place.engine for case in cases for place in case.results}
        if len(engines) > 1:
            kinds = grouped(cases, lambda case: ", ".join(case.kind))
            parts = [
                f"{f'{kind}, ' if len(kinds) > 1 else ''}{_race_result(race, kinds[kind])}"
                for kind in kinds
            ]
            sentence = f"In {race.task}, {'; '.join(parts)}{_precision(race, engines)}."
            yield Headline(race.chapter, f"Fastest in {race.task}", sentence, race.table)


def _precision(race: Race, engines: Collection[str]) -> str:
    """Return which engines of a race of cloths compute in single precision, and on what."""
    single = listed([engine for engine in SINGLE_PRECISION if engine in engines])
    is_told = race.chapter == "cloth" and single
    return f"; each runs on one core, {single} in single precision" if is_told else ""


def _race_result(race: Race, cases: Sequence[TableRanking]) -> str:
    """Return the engine that is the fastest in most cases, and the best other engine."""
    total = counted(len(cases), race.noun)
    winners = Counter(case.leader.engine for case in cases if case.leader)
    if not winners:
        return f"no engine is the fastest beyond chance ({total})"
    first = winners.most_common(1)[0][0]
    victories = [case for case in cases if case.leader and case.leader.engine == first]
    rivals = [next((p for p in case.results if p.engine != first), None) for case in victories]
    opposed = [(c, rival) for c, rival in zip(victories, rivals, strict=True) if rival]
    sentence = f"{full_name(first)} is the fastest on {len(victories)} of {total}"
    if opposed:
        factors = span([case.factor(rival) for case, rival in opposed])
        best = listed(list(dict.fromkeys(full_name(rival.engine) for _, rival in opposed)), "or")
        sentence += f", {factors} times faster than the best other engine, {best}"
    if alone := len(victories) - len(opposed):
        sentence += f"; no other engine solves {alone} of them"
    return sentence
