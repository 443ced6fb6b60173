"""The first screen’s answers: is it right, who is most accurate and fastest, who is absent.

As in the tables, who is not told from the first by `metrics.ranking` ties with it. Solvers that did
not finish are not ranked, and a headline says of how many it speaks.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..experiments.cloth_peers import MISSING, ONE_STEP, SOLVED
from ..experiments.cloth_peers.readings import points
from ..experiments.robots import REACHABLE
from ..experiments.robots.readings import STARTS, Score, fields_of, over_sets, ratio_of_times
from ..experiments.timing.tables import median_time, ranked_by_time
from ..harness import metrics
from ..harness.record import FINISHED
from ..peers import registry
from ..tables.results import Results, by_problem, counted, listed
from ..tables.table import words
from .standings import Headline, of_finishers, solved, speed, standings

# So near to the converged step a solver has solved it.
NEAR = float(SOLVED)
# Ties of more solvers than this are counted, not listed.
MOST_NAMED = 2
SUBJECTS = {"kinematics": "Forward kinematics", "ik": "Inverse kinematics", "cloth": "Cloth step"}
_NOT_RIVALS = {registry.PLAIN.name, registry.OUR_KINEMATICS.name, registry.LIMIT_NAME}


class Verdict(NamedTuple):
    """How many claims hold of all, which uses most of its tolerance, and what share of it."""

    held: int
    total: int
    narrowest: str
    used: float


class Answers(NamedTuple):
    """What the first screen says; the verdict is None if the cross-check was not run."""

    verdict: Verdict | None
    headlines: list[Headline]
    scale: str
    absent: list[str]
    standings: Sequence[Headline] = ()


def answers(results: Results) -> Answers:
    """Return all that the first screen says."""
    parts = verdict(results), headlines(results), scale(results), absent(results)
    return Answers(*parts, standings(results))


def verdict(results: Results) -> Verdict | None:
    """Return what the cross-check says, None if it was not run."""
    claims = [record for record in results.all("check") if record.values]
    if not claims:
        return None
    used = {r.title: metrics.ratio(r.values.difference, r.values.tolerance) for r in claims}
    narrowest = max(used, key=lambda name: used[name])
    return Verdict(sum(r.values.held for r in claims), len(claims), narrowest, used[narrowest])


def headlines(results: Results) -> list[Headline]:
    """Return who is most accurate and who is fastest, chapter by chapter, as far as measured."""
    of_robots = [headline for start in STARTS for headline in _on_robots(results, start)]
    timed = [headline for subject in SUBJECTS for headline in _timed(results, subject)]
    return [*of_robots, *_on_cloths(results), *timed]


def scale(results: Results) -> str:
    """Return at which scale was measured: "Quick run: 20 targets a stratum", "" if unknown."""
    scales = dict.fromkeys(r.notes.get("scale", "") for r in results.all(FINISHED))
    name = listed([name for name in scales if name])
    records = results.all("ik", task=REACHABLE)
    counts = {int(r.size) // max(1, len(r.details.strata)) for r in records} - {0}
    targets = listed([words(count) for count in sorted(counts)], "or")
    run = f"{name} run".strip().capitalize()
    return f"{run}: {targets} targets a stratum" if targets else run if name else ""


def absent(results: Results) -> list[str]:
    """Return the peers that were asked and took no part."""
    records = results.all("ik", task=REACHABLE)
    asked = {record.solver for record in records}
    here = {record.solver for record in records if "solved" in record.arrays}
    solvers = [title for title, names in _names().items() if names & asked and not names & here]
    packages = {record.solver for record in results.all("cloth", task=MISSING)}
    engines = [peer.engine for peer in registry.cloth_peers() if peer.package in packages]
    return [*solvers, *_for_cloth(engines)]


def not_asked(results: Results) -> list[str]:
    """Return the peers of which nothing is on record, where there is something of others."""
    asked = {record.solver for record in results.all("ik", task=REACHABLE)}
    solvers = [title for title, names in _names().items() if asked and not names & asked]
    here = {registry.find(point.solver).engine for point in points(results, ONE_STEP)}
    engines = [peer.engine for peer in registry.cloth_peers() if here and peer.engine not in here]
    missing = absent(results)
    return [*solvers, *(name for name in _for_cloth(engines) if name not in missing)]


def _names() -> dict[str, set[str]]:
    """Return what records call the entries of each peer, by title."""
    return {peer.title: set(map(peer.label_of, peer.entries)) for peer in registry.PEERS}


def _for_cloth(engines: Iterable[str]) -> list[str]:
    return [f"{engine} (cloth)" for engine in dict.fromkeys(engines)]


def _on_robots(results: Results, start: str) -> Iterator[Headline]:
    """Yield who solves the most and who takes the least time, of those that finished.

    They are compared over the robots on which most of them can be ranked.
    """
    fields = fields_of(results, start)
    sets: dict[str, dict[str, Score]] = {}
    for score in over_sets(fields):
        if score.is_ranked:
            sets.setdefault(score.robots, {})[score.solver] = score
    scores = max(sets.values(), key=len, default={})
    if len(scores) < 2:
        return
    some = next(iter(scores.values()))
    count = len({score.solver for field in fields.values() for score in field})
    place = f" on {some.robots}" if len(some.records) == 1 else ""
    finishers = of_finishers(len(scores), count)
    accurate, soonest = (
        _tied([solver for solver in ranking.first if scores[solver].share.hits])
        for ranking in (some.success, some.time)
    )
    share = solved(scores[some.success.order[0]].share, "poses")
    detail = f"{share}{place}, {finishers}"
    yield Headline("kinematics", f"Most accurate, {start}", accurate, detail, "robots_overall")
    first, second = some.time.order[:2]
    lead = speed(ratio_of_times(scores[second], scores[first]), second)
    is_tied = sum(scores[solver].share.hits > 0 for solver in some.time.first) != 1
    detail = f"too near to tell{place}" if is_tied else f"{lead}{place}, misses penalised"
    detail += f", {finishers}" if len(scores) < count else ""
    yield Headline("kinematics", f"Fastest, {start}", soonest, detail, "robots_overall")


def _tied(names: Sequence[str]) -> str:
    """Return who leads: one name, or those that tie."""
    if len(names) <= 1:
        return "".join(names)
    return f"Tie: {listed(names) if len(names) <= MOST_NAMED else f'{len(names)} solvers'}"


# The median of what each work takes each solver [s].
Times = dict[str, dict[str, float]]


def _on_cloths(results: Results) -> Iterator[Headline]:
    """Yield who solves the steps of most cloths, and whose engine solves a step first."""
    steps = points(results, ONE_STEP)
    times: Times = {step.cloth: {} for step in steps}
    for step in sorted(steps, key=lambda step: -step.values["seconds"]):
        if step.values["error"] <= NEAR:
            times[step.cloth][step.solver] = step.values["seconds"]
    arrivals = Counter(solver for solvers in times.values() for solver in solvers)
    engines = {step.solver: registry.find(step.solver).engine or step.solver for step in steps}
    count = len(set(engines.values()))
    if arrivals and len(engines) > 1:
        most = max(arrivals.values())
        ties = [solver for solver in engines if arrivals[solver] == most]
        detail = f"to {SOLVED} on {most} of {counted(len(times), 'cloth')} in time"
        yield Headline("cloth", "Most steps solved", _tied(ties), detail, "cloth_peers_step")
    if count > 1:
        best = {cloth: _by_engine(of, engines) for cloth, of in times.items()}
        alone = f"the only one of {count} engines to get there in time"
        table = "cloth_peers_step"
        yield from _first("cloth", f"Fastest to {SOLVED}", "cloth", best, table, alone=alone)


def _by_engine(times: Mapping[str, float], engines: Mapping[str, str]) -> dict[str, float]:
    """Return the least time of the solvers of each engine [s]."""
    return {engines[s]: times[s] for s in sorted(times, key=lambda s: -times[s])}


def _timed(results: Results, subject: str) -> Iterator[Headline]:
    """Yield who is first in the cases of a subject that more than one can do."""
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
    yield from _first("speed", SUBJECTS[subject], "case", works, f"timing_{subject}", ties=ties)


def _first(
    chapter: str,
    asked: str,
    noun: str,
    works: Times,
    table: str,
    *,
    alone: str = "",
    ties: Collection[str] = (),
) -> Iterator[Headline]:
    """Yield who is first most often, in how many cases, and by what factors; ties are nobody's."""
    ranked = {work: sorted(of.items(), key=lambda item: item[1]) for work, of in works.items()}
    order = [times for times in ranked.values() if times]
    decided = [times for work, times in ranked.items() if times and work not in ties]
    total = counted(len(works), noun)
    if not order:
        return
    if not decided:
        leaders = [name for name, _ in order[0]]
        detail = f"too near to tell on {counted(len(order), noun)}"
    else:
        firsts = Counter(times[0][0] for times in decided)
        most = max(firsts.values())
        leaders = [name for name, count in firsts.items() if count == most]
        detail = f"each on {most} of {total}"
    if decided and len(leaders) == 1:
        detail = _lead([times for times in decided if times[0][0] == leaders[0]], total, alone)
    yield Headline(chapter, asked, _tied(leaders), detail, table)


def _lead(won: Sequence[Sequence[tuple[str, float]]], total: str, alone: str) -> str:
    """Say by what factors cases were won, and in how many nobody else took part to the end."""
    factors = [times[1][1] / times[0][1] for times in won if len(times) > 1]
    unopposed = len(won) - len(factors)
    sentences = [f"{alone} on {unopposed} of {total}"] if unopposed else []
    if factors:
        span = "–".join(dict.fromkeys(map(words, metrics.extent(np.array(factors)))))
        sentences.insert(0, f"{span} times faster than the next on {len(factors)} of {total}")
    return listed(sentences)


def _short(solver: str) -> str:
    return registry.PLUMBOB if solver == registry.COMPILED.name else solver
