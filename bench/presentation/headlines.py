"""The first screen’s answers: is it right, who is most accurate and fastest, who is absent.

All are made from the records. Who leads by less than the interval allows ties with who is led.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..experiments.cloth_peers import ONE_STEP
from ..experiments.cloth_peers.readings import points
from ..experiments.robots import REACHABLE
from ..experiments.robots.readings import KINDS, measured, records_of
from ..harness import metrics
from ..harness.record import FINISHED, Record
from ..peers import registry
from .results import Results, by_problem, listed
from .tables import words

# So near to the converged step a solver has solved it.
TARGET = "1e-6"
NEAR = float(TARGET)
# Ties of more solvers than this are counted, not listed.
MOST_NAMED = 2
SUBJECTS = {"kinematics": "Forward kinematics", "ik": "An IK solve", "cloth": "A cloth step"}
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
    """Return the peers that took no part in what was measured."""
    return [*_absent_solvers(results), *_absent_engines(results)]


def _absent_solvers(results: Results) -> list[str]:
    records = results.all("ik", task=REACHABLE)
    here = {record.solver for record in measured(records)}
    peers = registry.PEERS if records else ()
    return [p.title for p in peers if here.isdisjoint(p.called(entry) for entry in p.entries)]


def _absent_engines(results: Results) -> list[str]:
    here = {registry.find(point.solver).engine for point in points(results, ONE_STEP)}
    engines = dict.fromkeys(peer.engine for peer in registry.cloth_peers()) if here else ()
    return [f"{engine} (cloth)" for engine in engines if engine not in here]


class _Poses(NamedTuple):
    """The same poses for several solvers: which are solved, and how soon [s], (solver, pose)."""

    solvers: list[str]
    solved: np.ndarray
    seconds: np.ndarray


def _poses(results: Results) -> _Poses | None:
    """Return the poses of all robots that most solvers took; what was not begun is not solved."""
    kind = next(iter(KINDS))
    taken: dict[str, dict[str, Record]] = {}
    for record in measured(records_of(results, kind)):
        taken.setdefault(record.solver, {})[record.problem] = record
    solvers, robots = _comparable({solver: list(of) for solver, of in taken.items()})
    if len(solvers) < 2 or not robots:
        return None
    sizes = [max(int(of[robot].size) for of in taken.values() if robot in of) for robot in robots]

    def read(name: str) -> np.ndarray:
        records = [[taken[solver][robot] for robot in robots] for solver in solvers]
        return np.array([_joined(of, name, sizes) for of in records])

    return _Poses(solvers, read("solved") == 1.0, read("seconds"))


def _joined(records: Sequence[Record], name: str, sizes: Sequence[int]) -> np.ndarray:
    """Return an array over several records, NaN where a solver was cut short."""
    joined = [np.full(size, np.nan) for size in sizes]
    for values, record in zip(joined, records, strict=True):
        values[: len(record.arrays[name])] = record.arrays[name]
    return np.concatenate(joined)


def _comparable(taken: Mapping[str, list[str]]) -> tuple[list[str], list[str]]:
    """Return solvers and the problems that all of them took, at least half of the most taken."""
    chosen: list[str] = []
    common = max(taken.values(), key=len, default=[])
    least = len(common) / 2
    for solver in sorted(taken, key=lambda solver: -len(taken[solver])):
        left = [problem for problem in common if problem in taken[solver]]
        if left and len(left) >= least:
            chosen, common = [*chosen, solver], left
    return [solver for solver in taken if solver in chosen], common


def _most_accurate(results: Results) -> Headline | None:
    poses = _poses(results)
    if poses is None:
        return None
    shares = dict(zip(poses.solvers, map(metrics.share, poses.solved), strict=True))
    best = max(shares.values(), key=lambda share: share.hits)
    ties = [
        s for s, x in sorted(shares.items(), key=lambda item: -item[1].hits) if x.high >= best.low
    ]
    rate, low, high = (f"{100 * x:.3g}" for x in (best.hits / best.total, best.low, best.high))
    detail = f"solves {rate} % of {words(best.total)} poses ({low}–{high})"
    return Headline("kinematics", "Most accurate", _tied(ties), detail, "robots_success_one_start")


def _tied(names: Sequence[str]) -> str:
    """Return who leads: one name, or those that tie."""
    if len(names) <= 1:
        return "".join(names)
    return f"{listed(names)} tie" if len(names) <= MOST_NAMED else f"{len(names)} solvers tie"


def _fastest(results: Results) -> Headline | None:
    poses = _poses(results)
    if poses is None:
        return None
    taken = np.where(poses.solved, poses.seconds, np.nan)
    first = metrics.performance_profiles(taken, poses.solved, np.array([1.0]))[:, 0]
    leader = int(np.argmax(first))
    rivals = {s: taken[i] for i, s in enumerate(poses.solvers) if i != leader}
    closest = _closest(taken[leader], rivals)
    if closest is None:
        return None
    answer, factor = _leads(poses.solvers[leader], *closest)
    detail = f"{factor} on {words(closest[1].pairs)} poses both solve"
    return Headline("kinematics", "Fastest", answer, detail, "robots_success_one_start")


def _closest(
    leader: np.ndarray, rivals: Mapping[str, np.ndarray]
) -> tuple[str, metrics.Ratio] | None:
    """Return who comes nearest to the leader where both are known, and by what factor."""
    ratios = {name: metrics.paired_ratio(times, leader) for name, times in rivals.items()}
    known = {name: ratio for name, ratio in ratios.items() if ratio.pairs}
    name = min(known, key=lambda name: known[name].mean, default=None)
    return None if name is None else (name, known[name])


def _leads(leader: str, rival: str, ratio: metrics.Ratio) -> tuple[str, str]:
    """Return who leads, or ties, and by what factor."""
    interval = f"({words(ratio.low)}–{words(ratio.high)})"
    if ratio.low <= 1.0 <= ratio.high:
        return f"{leader} and {rival} tie", f"time ratio {words(ratio.mean)} {interval}"
    if ratio.mean < 1.0:
        return rival, f"{words(1 / ratio.mean)} × as fast as {leader}"
    return leader, f"{words(ratio.mean)} × {rival}’s speed {interval}"


class Time(NamedTuple):
    """What a work takes a solver [s], and where 80 % of the rounds lie."""

    median: float
    low: float
    high: float


# What each work takes each solver.
Times = dict[str, dict[str, Time]]


def _arrival_times(results: Results) -> Times:
    """Return how long it takes to solve the step of each cloth [s], for those that solve it."""
    found: Times = {}
    for point in points(results, ONE_STEP):
        times = found.setdefault(f"{point.particles}/{point.stiffness}", {})
        seconds, before = point.values["seconds"], times.get(point.solver)
        if point.values["error"] <= NEAR and (before is None or seconds < before.median):
            times[point.solver] = Time(seconds, seconds, seconds)
    return found


def _arrived(results: Results) -> Headline | None:
    times = _arrival_times(results)
    arrivals = Counter(solver for mine in times.values() for solver in mine)
    most = max(arrivals.values(), default=0)
    if not most:
        return None
    ties = [solver for solver, count in arrivals.items() if count == most]
    detail = f"within {TARGET} of the converged step on {most} of {len(times)} cloths"
    return Headline("cloth", "Most accurate", _tied(ties), detail, "cloth_peers_step")


def _soonest(results: Results) -> Headline | None:
    """Return whose engine solves a step first."""
    best: Times = {}
    for cloth, times in _arrival_times(results).items():
        for solver in sorted(times, key=lambda solver: times[solver]):
            best.setdefault(cloth, {}).setdefault(registry.find(solver).engine, times[solver])
    return _first("cloth", "Fastest there", "cloths", best, "cloth_peers_step")


def _timed(results: Results, subject: str) -> Headline | None:
    """Return who is first in the works of a subject that more than one can do."""
    works: Times = {}
    for problem, records in by_problem(results.all("timing", subject=subject)).items():
        rivals = [record for record in records if record.solver not in _NOT_RIVALS]
        if len(rivals) > 1:
            works[problem] = {_short(record.solver): _time(record) for record in rivals}
    return _first("speed", SUBJECTS[subject], "works", works, f"timing_{subject}")


def _time(record: Record) -> Time:
    timing = metrics.timing(record.arrays["seconds"])
    return Time(timing.median, timing.low, timing.high)


def _first(chapter: str, asked: str, of: str, works: Times, table: str) -> Headline | None:
    """Return who is first most often, in how many works, and by what factors; ties are nobody's."""
    order = [sorted(times.items(), key=lambda item: item[1]) for times in works.values() if times]
    decided = [ranked for ranked in order if not _is_tie(ranked)]
    if not order:
        return None
    if not decided:
        tied = _tied([name for name, _ in order[0]])
        return Headline(chapter, asked, tied, f"no lead in {len(order)} {of}", table)
    firsts = Counter(ranked[0][0] for ranked in decided)
    most = max(firsts.values())
    leaders = [name for name, count in firsts.items() if count == most]
    detail = f"first in {most} of {len(works)} {of}"
    if len(leaders) == 1:
        detail += _ahead([ranked for ranked in decided if ranked[0][0] == leaders[0]])
    return Headline(chapter, asked, _tied(leaders), detail, table)


def _ahead(won: Sequence[Sequence[tuple[str, Time]]]) -> str:
    """Say by what factors the works were won."""
    factors = [ranked[1][1].median / ranked[0][1].median for ranked in won if len(ranked) > 1]
    return f", {_range(factors)} × the next" if factors else "; no other engine arrives"


def _is_tie(ranked: Sequence[tuple[str, Time]]) -> bool:
    """Return whether the rounds of the first two overlap."""
    return len(ranked) > 1 and ranked[0][1].high >= ranked[1][1].low


def _range(factors: Sequence[float]) -> str:
    low, high = metrics.extent(np.array(factors))
    return "–".join(dict.fromkeys((words(low), words(high))))


def _short(solver: str) -> str:
    return "Plumbob" if solver == _OURS else solver
