"""The headlines of the page: correctness, the most accurate, the fastest, and the absent solvers.

Solvers that `metrics.ranking` does not distinguish from the first tie with it, as in the tables.
Solvers that did not finish are not ranked, and a headline gives the number of those that did.
"""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
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

# Ties of more solvers are counted, not listed.
MAX_NAMED = 2
SUBJECTS = {"kinematics": "Forward kinematics", "ik": "Inverse kinematics", "cloth": "Cloth step"}
_NOT_RIVALS = {registry.PLAIN.name, registry.OUR_KINEMATICS.name, registry.LIMIT_NAME}
# What the scales of a run mean.
_SCALES = {"quick": "Quick run: few targets and rounds", "full": "Full run: all targets and rounds"}
# Median times by problem and solver [s].
Times = Mapping[str, Mapping[str, float]]


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


def overview(results: Results) -> Overview:
    """Return the contents of the first screen."""
    parts = verdict(results), headlines(results), scale(results), absent(results)
    return Overview(*parts, standings(results))


def verdict(results: Results) -> ClaimCount | None:
    """Return the result of the cross-check, None if it was not run."""
    claims = [record for record in results.all("check") if record.values]
    if not claims:
        return None
    used = {r.title: metrics.ratio(r.values.difference, r.values.tolerance) for r in claims}
    narrowest = max(used, key=lambda name: used[name])
    holding = sum(record.values.held for record in claims)
    return ClaimCount(holding, len(claims), narrowest, used[narrowest])


def headlines(results: Results) -> list[Headline]:
    """Return the most accurate and fastest solvers, chapter by chapter, as far as measured."""
    robots = [headline for start in STARTS for headline in _robot_headlines(results, start)]
    times = [headline for subject in SUBJECTS for headline in _timing_headlines(results, subject)]
    return [*robots, *_cloth_headlines(results), *times]


def scale(results: Results) -> str:
    """Return the scale of the records: "Quick run: 20 targets a stratum", "" if unknown."""
    names = dict.fromkeys(r.notes.get("scale", "") for r in results.all(FINISHED))
    name = listed(list(filter(None, names)))
    records = results.all("ik", task=REACHABLE)
    counts = {int(r.size) // max(1, len(r.details.strata)) for r in records} - {0}
    targets = listed([words(count) for count in sorted(counts)], "or")
    run = f"{name} run".strip().capitalize()
    if targets:
        return f"{run}: {targets} targets a stratum"
    mixture = "Some suites were measured quickly, others at full length"
    return _SCALES.get(name, mixture) if name else ""


def absent(results: Results) -> list[str]:
    """Return the peers that were asked and took no part."""
    records = results.all("ik", task=REACHABLE)
    requested = {record.solver for record in records}
    present = {record.solver for record in records if "solved" in record.arrays}
    peers = _recorded_names()
    solvers = [peer for peer, names in peers.items() if names & requested and not names & present]
    packages = {record.solver for record in results.all("cloth", task=MISSING)}
    engines = [peer.engine for peer in registry.cloth_peers() if peer.package in packages]
    return [*solvers, *(f"{engine} (cloth)" for engine in dict.fromkeys(engines))]


def not_asked(results: Results) -> list[str]:
    """Return the peers without records, where there are records of others."""
    requested = {record.solver for record in results.all("ik", task=REACHABLE)}
    solvers = [
        peer for peer, names in _recorded_names().items() if requested and not names & requested
    ]
    present = {registry.find(point.solver).engine for point in points(results, ONE_STEP)}
    engines = dict.fromkeys(peer.engine for peer in registry.cloth_peers())
    cloth = [f"{engine} (cloth)" for engine in engines if present and engine not in present]
    missing = absent(results)
    return [*solvers, *(name for name in cloth if name not in missing)]


def _recorded_names() -> dict[str, set[str]]:
    """Return the names of each peer's entries in records, by its title."""
    return {peer.title: set(map(peer.label_of, peer.entries)) for peer in registry.PEERS}


def _robot_headlines(results: Results, start: str) -> Iterator[Headline]:
    """Yield the solver that solves the most, and the fastest, on the robots most can solve."""
    fields = fields_of(results, start)
    sets: dict[str, dict[str, Score]] = {}
    for score in over_sets(fields):
        if score.is_ranked:
            sets.setdefault(score.robots, {})[score.solver] = score
    scores = max(sets.values(), key=len, default={})
    if len(scores) < 2:
        return
    row = next(iter(scores.values()))
    count = len({score.solver for field in fields.values() for score in field})
    place = f" on {row.robots}" if len(row.records) == 1 else ""
    finishers = of_finishers(len(scores), count)
    most_solved, fastest = (
        [solver for solver in ranking.first if scores[solver].share.hits]
        for ranking in (row.success, row.time)
    )
    share = solved(scores[row.success.order[0]].share, "poses")
    detail = f"{share}{place}, {finishers}"
    question = f"Most accurate, {start}"
    yield Headline("kinematics", question, _leaders(most_solved), detail, "robots_overall")
    first, second = row.time.order[:2]
    detail = f"too near to tell{place}"
    if len(fastest) == 1:
        lead = speed(ratio_of_times(scores[second], scores[first]), second)
        detail = f"{lead}{place}, failures penalised"
    detail += f", {finishers}" if len(scores) < count else ""
    question = f"Fastest, {start}"
    yield Headline("kinematics", question, _leaders(fastest), detail, "robots_overall")


def _leaders(names: Sequence[str]) -> str:
    """Return the leader, or the solvers that tie."""
    if len(names) <= 1:
        return "".join(names)
    return f"Tie: {listed(names) if len(names) <= MAX_NAMED else f'{len(names)} solvers'}"


def _cloth_headlines(results: Results) -> Iterator[Headline]:
    """Yield the solver of the steps of most cloths, and the engine with the fastest step."""
    steps = points(results, ONE_STEP)
    engines = {step.solver: registry.find(step.solver).engine or step.solver for step in steps}
    count = len(set(engines.values()))
    times: dict[str, dict[str, float]] = {step.cloth: {} for step in steps}
    fastest: dict[str, dict[str, float]] = {step.cloth: {} for step in steps}
    for step in sorted(steps, key=lambda step: -step.values["seconds"]):
        if step.values["error"] <= float(SOLVED):
            times[step.cloth][step.solver] = step.values["seconds"]
            fastest[step.cloth][engines[step.solver]] = step.values["seconds"]
    arrivals = Counter(solver for solvers in times.values() for solver in solvers)
    if arrivals and len(engines) > 1:
        maximum = max(arrivals.values())
        leaders = [solver for solver in engines if arrivals[solver] == maximum]
        detail = f"to {SOLVED} on {maximum} of {counted(len(times), 'cloth')} in time"
        yield Headline("cloth", "Most steps solved", _leaders(leaders), detail, "cloth_peers_step")
    if count > 1 and (answer := _most_often_first("cloth", fastest, engines=count)):
        yield Headline("cloth", f"Fastest to {SOLVED}", *answer, "cloth_peers_step")


def _timing_headlines(results: Results, subject: str) -> Iterator[Headline]:
    """Yield the fastest solver in the cases of a subject that several can solve."""
    times: dict[str, dict[str, float]] = {}
    ties: set[str] = set()
    for problem, records in by_problem(results.all("timing", subject=subject)).items():
        rivals = [record for record in records if record.solver not in _NOT_RIVALS]
        if len(rivals) > 1:
            times[problem] = {_short_name(r.solver): median_time(r) for r in rivals}
            ranking = ranked_by_time(rivals)
            fastest = min(times[problem], key=times[problem].__getitem__)
            if ranking is None or ranking.first != (fastest,):
                ties.add(problem)
    if answer := _most_often_first("case", times, ties):
        yield Headline("speed", SUBJECTS[subject], *answer, f"timing_{subject}")


def _most_often_first(
    noun: str, times: Times, ties: Collection[str] = (), engines: int = 0
) -> tuple[str, str] | None:
    """Return the solver that is fastest on most problems and by which factors, None without any.

    A problem with a tie has no first. With a number of engines, the detail counts the problems
    that no other engine solved in time.
    """
    ranked = {name: sorted(times[name].items(), key=lambda pair: pair[1]) for name in times}
    ranked = {name: order for name, order in ranked.items() if order}
    if not ranked:
        return None
    wins = [order for name, order in ranked.items() if name not in ties]
    if not wins:
        leaders = [solver for solver, _ in next(iter(ranked.values()))]
        return _leaders(leaders), f"too near to tell on {counted(len(ranked), noun)}"
    firsts = Counter(order[0][0] for order in wins)
    maximum = max(firsts.values())
    leaders = [solver for solver, count in firsts.items() if count == maximum]
    total = counted(len(times), noun)
    if len(leaders) > 1:
        return _leaders(leaders), f"each on {maximum} of {total}"
    wins = [order for order in wins if order[0][0] == leaders[0]]
    factors = [order[1][1] / order[0][1] for order in wins if len(order) > 1]
    sentences = []
    if factors:
        span = "–".join(dict.fromkeys(map(words, metrics.extent(np.array(factors)))))
        sentences.append(f"{span} times faster than the next on {len(factors)} of {total}")
    if unopposed := len(wins) - len(factors):
        only = f"the only one of {engines} engines that reached it in time"
        sentences.append(f"{only} on {unopposed} of {total}")
    return leaders[0], listed(sentences)


def _short_name(solver: str) -> str:
    return registry.PLUMBOB if solver == registry.COMPILED.name else solver
