"""The first screen’s answers: is it right, who is most accurate and fastest, who is absent.

All are made from the records. As in the tables, who is not told from the first by
`metrics.ranking` ties with it. Solvers that did not finish are not ranked, and a headline says of
how many it speaks.
"""

from collections import Counter
from collections.abc import Container, Iterable, Iterator, Sequence
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from ..experiments.cloth_peers import MISSING, ONE_STEP, SOLVED
from ..experiments.cloth_peers.readings import points
from ..experiments.robots import REACHABLE
from ..experiments.robots.overall.readings import Overall, overall
from ..experiments.robots.readings import KINDS, SHIFT, measured, records_of
from ..experiments.timing.readings import median_time, ranked_by_time
from ..harness import metrics
from ..harness.record import FINISHED, Record
from ..harness.results import Results, by_problem, counted, listed
from ..peers import registry
from ..tables.table import words
from .standings import Headline, of_finishers, solved, speed, standings

# So near to the converged step a solver has solved it.
NEAR = float(SOLVED)
# Ties of more solvers than this are counted, not listed.
MOST_NAMED = 2
SUBJECTS = {"kinematics": "Forward kinematics", "ik": "Inverse kinematics", "cloth": "Cloth step"}
_OURS = registry.COMPILED.name
_NOT_RIVALS = {registry.PLAIN.name, registry.OUR_KINEMATICS.name, registry.LIMIT_NAME}


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
        standings: where solvers of the user's stand.
    """

    verdict: Verdict | None
    headlines: list[Headline]
    scale: str
    absent: list[str]
    standings: Sequence[Headline] = ()


def answers(results: Results) -> Answers:
    """Return all that the first screen says."""
    known = verdict(results), headlines(results), scale(results), absent(results)
    return Answers(*known, standings(results))


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
    others = [_arrived(results), _soonest(results), *(_timed(results, s) for s in SUBJECTS)]
    of_robots = [headline for kind in KINDS for headline in _on_robots(results, kind)]
    return [*of_robots, *filter(None, others)]


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


def _on_robots(results: Results, kind: str) -> Iterator[Headline]:
    """Yield who solves the most and who takes the least time, of those that finished.

    They are compared over the robots on which most of them can be ranked.
    """
    sets: dict[str, dict[str, Overall]] = {}
    for row in overall(results, kind):
        if row.is_ranked:
            sets.setdefault(row.robots, {})[row.solver] = row
    rows = max(sets.values(), key=len, default={})
    if len(rows) < 2:
        return
    row = next(iter(rows.values()))
    count = len({record.solver for record in measured(records_of(results, kind))})
    where = f" on {row.robots}" if len(row.records) == 1 else ""
    field = of_finishers(len(rows), count)
    table = f"robots_overall_{KINDS[kind]}"
    detail = f"{solved(rows[row.success.order[0]].share, 'poses')}{where}, {field}"
    first, soonest = ([s for s in of.first if rows[s].share.hits] for of in (row.success, row.time))
    yield Headline("kinematics", f"Most accurate, {kind}", _tied(first), detail, table)
    fastest, second = (rows[solver].penalised + SHIFT for solver in row.time.order[:2])
    ahead = speed(metrics.paired_ratio(second, fastest), row.time.order[1])
    ahead = f"{ahead}{where}, misses penalised" if len(soonest) == 1 else f"too near to tell{where}"
    detail = ahead + (f", {field}" if len(rows) < count else "")
    yield Headline("kinematics", f"Fastest, {kind}", _tied(soonest), detail, table)


def _tied(names: Sequence[str]) -> str:
    """Return who leads: one name, or those that tie."""
    if len(names) <= 1:
        return "".join(names)
    return f"Tie: {listed(names) if len(names) <= MOST_NAMED else f'{len(names)} solvers'}"


# The median of what each work takes each solver [s].
Times = dict[str, dict[str, float]]


def _arrival_times(results: Results) -> Times:
    """Return how long it takes to solve the step of each cloth [s], for those that solve it."""
    works: Times = {}
    for point in points(results, ONE_STEP):
        times = works.setdefault(point.cloth, {})
        if point.values["error"] <= NEAR:
            seconds = point.values["seconds"]
            times[point.solver] = min(seconds, times.get(point.solver, seconds))
    return works


def _arrived(results: Results) -> Headline | None:
    times = _arrival_times(results)
    arrivals = Counter(solver for mine in times.values() for solver in mine)
    count = len({point.solver for point in points(results, ONE_STEP)})
    if not arrivals or count < 2:
        return None
    most = max(arrivals.values())
    ties = [solver for solver, hits in arrivals.items() if hits == most]
    cloths = f"{most} of {counted(len(times), 'cloth')}"
    detail = f"to {SOLVED} on {cloths} in time"
    return Headline("cloth", "Most steps solved", _tied(ties), detail, "cloth_peers_step")


def _soonest(results: Results) -> Headline | None:
    """Return whose engine solves a step first."""
    solvers = dict.fromkeys(point.solver for point in points(results, ONE_STEP))
    engines = {solver: registry.find(solver).engine or solver for solver in solvers}
    count = len(set(engines.values()))
    best: Times = {}
    for cloth, times in _arrival_times(results).items():
        ranked = sorted(times, key=lambda solver: times[solver], reverse=True)
        best[cloth] = {engines[solver]: times[solver] for solver in ranked}
    alone = f"the only one of {count} engines to get there in time"
    found = _first("cloth", f"Fastest to {SOLVED}", "cloth", best, "cloth_peers_step", alone=alone)
    return found if count > 1 else None


def _timed(results: Results, subject: str) -> Headline | None:
    """Return who is first in the cases of a subject that more than one can do."""
    works: Times = {}
    ties: set[str] = set()
    for problem, records in by_problem(results.all("timing", subject=subject)).items():
        rivals = [record for record in records if record.solver not in _NOT_RIVALS]
        if len(rivals) > 1:
            works[problem] = {_short(r.solver): median_time(r) for r in rivals}
            ranking = ranked_by_time(rivals)
            fastest = min(works[problem], key=works[problem].__getitem__)
            if ranking is None or ranking.first != (fastest,):
                ties.add(problem)
    return _first("speed", SUBJECTS[subject], "case", works, f"timing_{subject}", ties=ties)


def _first(
    chapter: str, asked: str, noun: str, works: Times, table: str, *,
    alone: str = "", ties: Container[str] = (),
) -> Headline | None:  # fmt: skip
    """Return who is first most often, in how many cases, and by what factors; ties are nobody's."""
    ranked = {work: sorted(times.items(), key=itemgetter(1)) for work, times in works.items()}
    order = [times for times in ranked.values() if times]
    decided = [times for work, times in ranked.items() if times and work not in ties]
    if not order:
        return None
    if not decided:
        tied = _tied([name for name, _ in order[0]])
        detail = f"too near to tell on {counted(len(order), noun)}"
        return Headline(chapter, asked, tied, detail, table)
    firsts = Counter(times[0][0] for times in decided)
    most = max(firsts.values())
    leaders = [name for name, count in firsts.items() if count == most]
    total = counted(len(works), noun)
    detail = f"each on {most} of {total}"
    if len(leaders) == 1:
        detail = _ahead([r for r in decided if r[0][0] == leaders[0]], total, alone)
    return Headline(chapter, asked, _tied(leaders), detail, table)


def _ahead(won: Sequence[Sequence[tuple[str, float]]], total: str, alone: str) -> str:
    """Say by what factors cases were won, and in how many nobody else took part to the end."""
    factors = [times[1][1] / times[0][1] for times in won if len(times) > 1]
    unopposed = len(won) - len(factors)
    sentences = [f"{alone} on {unopposed} of {total}"] if unopposed else []
    if factors:
        ahead = f"{_range(factors)} times faster than the next on {len(factors)} of {total}"
        sentences.insert(0, ahead)
    return listed(sentences)


def _range(factors: Sequence[float]) -> str:
    low, high = metrics.extent(np.array(factors))
    return "–".join(dict.fromkeys((words(low), words(high))))


def _short(solver: str) -> str:
    return "Plumbob" if solver == _OURS else solver
