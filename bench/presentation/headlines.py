"""The first screen’s answers: is it right, who is most accurate and fastest, who is absent.

All are made from the records. As in the tables, who is not told from the first by
`metrics.ranking` ties with it.
"""

from collections import Counter
from collections.abc import Container, Iterable, Sequence
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from ..experiments.cloth_peers import MISSING, ONE_STEP, SOLVED
from ..experiments.cloth_peers.readings import points
from ..experiments.robots import REACHABLE
from ..experiments.robots.overall.readings import Overall, overall
from ..experiments.robots.readings import KINDS, SHIFT, measured
from ..experiments.timing.tables import median_time, ranked_by_time
from ..harness import metrics
from ..harness.record import FINISHED, Record
from ..peers import registry
from .results import Results, by_problem, counted, listed
from .tables.table import words

# So near to the converged step a solver has solved it.
NEAR = float(SOLVED)
# The table of solvers over all robots.
OVERALL = "robots_overall_one_start"
# Ties of more solvers than this are counted, not listed.
MOST_NAMED = 2
SUBJECTS = {"kinematics": "Forward kinematics", "ik": "Inverse kinematics", "cloth": "Cloth step"}
_OURS = registry.COMPILED.name
_NOT_RIVALS = {registry.PLAIN.name, registry.OUR_KINEMATICS.name, registry.LIMIT_NAME}


class Headline(NamedTuple):
    """An answer in a line.

    Attributes:
        chapter: the section of the report that it belongs to.
        asked: what is asked.
        answer: who.
        detail: by how much, over how many.
        table: the name of the table that it can be read in.
    """

    chapter: str
    asked: str
    answer: str
    detail: str
    table: str


class Verdict(NamedTuple):
    """How many claims of the cross-check hold, and which of them only just.

    Attributes:
        held: claims that hold.
        total: claims.
        narrowest: the claim that uses most of its tolerance.
        used: how much of it, as a share.
    """

    held: int
    total: int
    narrowest: str
    used: float


class Answers(NamedTuple):
    """What the first screen says.

    Attributes:
        verdict: of the cross-check, None if it was not run.
        headlines: who is most accurate and who is fastest.
        scale: at which scale was measured, "" if that is not known.
        absent: peers that took no part.
    """

    verdict: Verdict | None
    headlines: list[Headline]
    scale: str
    absent: list[str]


def answers(results: Results) -> Answers:
    """Return all that the first screen says."""
    return Answers(verdict(results), headlines(results), scale(results), absent(results))


def verdict(results: Results) -> Verdict | None:
    """Return what the cross-check says, None if it was not run."""
    claims = [record for record in results.all("check") if "held" in record.arrays]
    if not claims:
        return None
    held = sum(bool(record.arrays["held"]) for record in claims)
    narrowest = max(claims, key=_used)
    return Verdict(held, len(claims), narrowest.title, _used(narrowest))


def _used(claim: Record) -> float:
    return metrics.ratio(float(claim.arrays["difference"]), float(claim.arrays["tolerance"]))


def headlines(results: Results) -> list[Headline]:
    """Return who is most accurate and who is fastest, chapter by chapter, as far as measured."""
    made = [_most_accurate(results), _fastest(results), _arrived(results), _soonest(results)]
    made += [_timed(results, subject) for subject in SUBJECTS]
    return [headline for headline in made if headline]


def scale(results: Results) -> str:
    """Return at which scale was measured: "Quick run: 20 targets a stratum", "" if unknown."""
    scales = dict.fromkeys(r.notes.get("scale", "") for r in results.all(FINISHED))
    named = listed([name for name in scales if name])
    counts = sorted({c for r in results.all("ik", task=REACHABLE) if (c := _in_a_stratum(r))})
    targets = listed([words(count) for count in counts], "or")
    said = f"{named} run".strip().capitalize()
    return f"{said}: {targets} targets a stratum" if targets else said if named else ""


def _in_a_stratum(record: Record) -> int:
    return int(record.size) // max(1, len(record.facts.get("strata", ())))


def absent(results: Results) -> list[str]:
    """Return the peers that were asked and took no part."""
    packages = {record.solver for record in results.all("cloth", task=MISSING)}
    engines = [peer.engine for peer in registry.cloth_peers() if peer.package in packages]
    return [*_absent_solvers(results), *_for_cloth(engines)]


def _absent_solvers(results: Results) -> list[str]:
    records = results.all("ik", task=REACHABLE)
    here, asked = ({r.solver for r in some} for some in (measured(records), records))
    names = {peer.title: set(map(peer.called, peer.entries)) for peer in registry.PEERS}
    return [title for title, mine in names.items() if mine & asked and not mine & here]


def not_asked(results: Results) -> list[str]:
    """Return the peers of which nothing is on record, where there is something of others."""
    asked = {record.solver for record in results.all("ik", task=REACHABLE)}
    peers = registry.PEERS if asked else ()
    solvers = [p.title for p in peers if asked.isdisjoint(map(p.called, p.entries))]
    here = {registry.find(point.solver).engine for point in points(results, ONE_STEP)}
    others = [peer.engine for peer in registry.cloth_peers() if here and peer.engine not in here]
    missing = absent(results)
    return [*solvers, *(name for name in _for_cloth(others) if name not in missing)]


def _for_cloth(engines: Iterable[str]) -> list[str]:
    return [f"{engine} (cloth)" for engine in dict.fromkeys(engines)]


def _compared(results: Results) -> dict[str, Overall]:
    """Return the solvers over the set of robots on which most of them can be ranked."""
    sets: dict[str, dict[str, Overall]] = {}
    for row in overall(results, next(iter(KINDS))):
        if row.is_ranked:
            sets.setdefault(row.robots, {})[row.solver] = row
    return max(sets.values(), key=len, default={})


def _most_accurate(results: Results) -> Headline | None:
    rows = _compared(results)
    if len(rows) < 2:
        return None
    ranking = next(iter(rows.values())).success
    share = rows[ranking.order[0]].share
    rate, low, high = (f"{100 * x:.3g}" for x in (share.hits / share.total, share.low, share.high))
    detail = f"solves {rate} % of {words(share.total)} poses ({low}–{high})"
    return Headline("kinematics", "Most accurate", _tied(ranking.first), detail, OVERALL)


def _fastest(results: Results) -> Headline | None:
    """Return who takes the least time, unsolved poses with their penalty, and the next."""
    rows = _compared(results)
    if len(rows) < 2:
        return None
    ranking = next(iter(rows.values())).time
    first, second = (rows[solver].penalised + SHIFT for solver in ranking.order[:2])
    ratio = metrics.paired_ratio(second, first)
    interval = f" ({words(ratio.low)}–{words(ratio.high)})" if ratio.pairs > 1 else ""
    detail = f"{words(ratio.mean)} × {ranking.order[1]}{interval}, {counted(ratio.pairs, 'pose')}"
    return Headline(
        "kinematics", "Fastest, misses penalised", _tied(ranking.first), detail, OVERALL
    )


def _tied(names: Sequence[str]) -> str:
    """Return who leads: one name, or those that tie."""
    if len(names) <= 1:
        return "".join(names)
    return f"Tie: {listed(names) if len(names) <= MOST_NAMED else f'{len(names)} solvers'}"


# The median of what each work takes each solver [s].
Times = dict[str, dict[str, float]]


def _arrival_times(results: Results) -> Times:
    """Return how long it takes to solve the step of each cloth [s], for those that solve it."""
    found: Times = {}
    for point in points(results, ONE_STEP):
        times = found.setdefault(f"{point.particles}/{point.stiffness}", {})
        if point.values["error"] <= NEAR:
            seconds = point.values["seconds"]
            times[point.solver] = min(seconds, times.get(point.solver, seconds))
    return found


def _arrived(results: Results) -> Headline | None:
    times = _arrival_times(results)
    arrivals = Counter(solver for mine in times.values() for solver in mine)
    most = max(arrivals.values(), default=0)
    if not most:
        return None
    ties = [solver for solver, count in arrivals.items() if count == most]
    detail = f"within {SOLVED} on {most}/{len(times)} cloths"
    return Headline("cloth", "Most accurate", _tied(ties), detail, "cloth_peers_step")


def _soonest(results: Results) -> Headline | None:
    """Return whose engine solves a step first."""
    best: Times = {}
    for cloth, times in _arrival_times(results).items():
        for solver in sorted(times, key=lambda solver: times[solver]):
            best.setdefault(cloth, {}).setdefault(registry.find(solver).engine, times[solver])
    return _first("cloth", "Fastest", "cloths", best, "cloth_peers_step")


def _timed(results: Results, subject: str) -> Headline | None:
    """Return who is first in the cases of a subject that more than one can do."""
    works: Times = {}
    ties: set[str] = set()
    for problem, records in by_problem(results.all("timing", subject=subject)).items():
        rivals = [record for record in records if record.solver not in _NOT_RIVALS]
        if len(rivals) > 1:
            works[problem] = {_short(r.solver): median_time(r) for r in rivals}
            ranking = ranked_by_time(rivals)
            if ranking is None or ranking.first != (
                min(works[problem], key=works[problem].__getitem__),
            ):
                ties.add(problem)
    return _first("speed", SUBJECTS[subject], "cases", works, f"timing_{subject}", ties)


def _first(
    chapter: str, asked: str, of: str, works: Times, table: str, ties: Container[str] = ()
) -> Headline | None:
    """Return who is first most often, in how many cases, and by what factors; ties are nobody's."""
    ranked = {work: sorted(times.items(), key=itemgetter(1)) for work, times in works.items()}
    order = [times for times in ranked.values() if times]
    decided = [times for work, times in ranked.items() if times and work not in ties]
    if not order:
        return None
    if not decided:
        tied = _tied([name for name, _ in order[0]])
        return Headline(chapter, asked, tied, f"nobody leads, 0/{len(order)} {of}", table)
    firsts = Counter(ranked[0][0] for ranked in decided)
    most = max(firsts.values())
    leaders = [name for name, count in firsts.items() if count == most]
    detail = f"{most}/{len(works)} {of}"
    if len(leaders) == 1:
        detail = f"{_ahead([r for r in decided if r[0][0] == leaders[0]])}, {detail}"
    return Headline(chapter, asked, _tied(leaders), detail, table)


def _ahead(won: Sequence[Sequence[tuple[str, float]]]) -> str:
    """Say by what factors the cases were won."""
    factors = [ranked[1][1] / ranked[0][1] for ranked in won if len(ranked) > 1]
    return f"{_range(factors)} × the next" if factors else "no rival arrives"


def _range(factors: Sequence[float]) -> str:
    low, high = metrics.extent(np.array(factors))
    return "–".join(dict.fromkeys((words(low), words(high))))


def _short(solver: str) -> str:
    return "Plumbob" if solver == _OURS else solver
