"""The first screen: the best solver, the best other solver, where others win, absent solvers.

Plumbob takes part like everyone else. Solvers that `metrics.ranking` does not distinguish from the
first are tied, as in the tables. Our own Python loops on engines count as no rivals.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from ..experiments.cloth_peers import (
    MISSING,
    MOTION,
    MOTION_TARGETS,
    NEAR,
    ONE_STEP,
    SOLVED,
    TARGETS,
)
from ..experiments.cloth_peers.readings import points
from ..experiments.robots import REACHABLE
from ..experiments.robots.readings import (
    STARTS,
    Score,
    fields_of,
    ratio_of_times,
    times_of_both,
    together,
)
from ..experiments.timing import is_ranked, median_time, ranked_by_time
from ..harness import metrics
from ..harness.record import FINISHED, Record
from ..peers import catalogue
from ..peers.peer import ONE_START, PORTFOLIO, PORTFOLIO_ITERATIONS, RESTARTS
from ..problems.robots import CHARACTER
from ..tables.results import Results, by_problem, counted, grouped, listed
from ..tables.table import words
from .standings import Headline, best_rival, factor, full_name, percent, speed, standings

# The most robots or cases that a sentence names.
MAX_NAMED = 3
_FROM = {
    ONE_START: "from one start",
    PORTFOLIO: f"with a portfolio of {words(PORTFOLIO_ITERATIONS)} iterations",
    RESTARTS: "with restarts",
}
# Times within which the shares of solved poses are compared [s].
_BUDGETS = (1e-4, 1e-3)
# What is timed of other engines' own code; loops of ours on engines are no rivals.
_SUBJECTS = {
    "kinematics": "forward kinematics",
    "jacobians": "the Jacobian of an effector",
    "cloth": "a step of a cloth",
}
# The goals of cloths: the problem, the error, and the table with the ranking.
_CLOTH_GOALS = {
    ONE_STEP: (f"a step solved to {SOLVED}", TARGETS[SOLVED], "cloth_peers_step"),
    MOTION: (f"a motion within {NEAR} of the truth", MOTION_TARGETS[NEAR], "cloth_peers_motion"),
}
# The groups of robots, first the group held out from tuning.
_GROUPS = ["held out", "tuning", CHARACTER, "yours"]
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

    Robots held out from tuning come first. A sentence on other solvers counts absent solvers.
    """
    missing = absent(results)
    engines = sum(name.endswith(_IN_CLOTH) for name in missing)
    counts = {"kinematics": len(missing) - engines, "cloth": engines}
    robots = [
        headline
        for group, start, fields in _robot_groups(results)
        if group != CHARACTER
        for headline in _robot_headlines(group, start, fields)
    ]
    every = [*robots, *filter(None, map(_race_headline, _races(results)))]
    return [_with_absent(headline, counts.get(headline.chapter, 0)) for headline in every]


def _with_absent(headline: Headline, count: int) -> Headline:
    """Add the number of absent solvers to a sentence on other solvers."""
    if not count or " other " not in headline.sentence:
        return headline
    absence = f"{counted(count, 'other')} {'was' if count == 1 else 'were'} not installed"
    return headline._replace(sentence=f"{headline.sentence.removesuffix('.')}; {absence}.")


def scale(results: Results) -> str:
    """Return the scale of the records: "Quick run: 20 targets of each kind", "" if unknown."""
    names = dict.fromkeys(r.notes.get("scale", "") for r in results.all(FINISHED))
    name = listed(list(filter(None, names)))
    records = results.all("ik", task=REACHABLE)
    counts = {int(r.size) // max(1, len(r.details.strata)) for r in records} - {0}
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
    present = {record.solver for record in records if record.details.version}
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
    measured = [point for task in _CLOTH_GOALS for point in points(results, task)]
    present = {catalogue.find(point.solver).engine for point in measured}
    engines = dict.fromkeys(peer.engine for peer in catalogue.cloth_peers())
    cloth = [f"{engine}{_IN_CLOTH}" for engine in engines if present and engine not in present]
    missing = absent(results)
    return [*solvers, *(name for name in cloth if name not in missing)]


def _recorded_names() -> dict[str, set[str]]:
    """Return the names of each peer's entries in records, by its title."""
    return {peer.name: set(map(peer.label_of, peer.runs)) for peer in catalogue.PEERS}


def _robot_groups(results: Results) -> Iterator[tuple[str, str, dict[str, list[Score]]]]:
    """Yield group, start and solvers on each robot: robots held out and restarts come first."""
    by_start = {start: fields_of(results, start) for start in reversed(STARTS)}
    groups = {robot: f[robot][0].group for f in by_start.values() for robot in f}
    for group in sorted(set(groups.values()), key=_GROUPS.index):
        for start, fields in by_start.items():
            yield group, start, {robot: fields[robot] for robot in fields if groups[robot] == group}


def _robot_headlines(group: str, start: str, fields: dict[str, list[Score]]) -> Iterator[Headline]:
    """Yield the solver of the most targets, and the fastest, on robots that most solvers take."""
    rows = {row.solver: row for row in _most_compared(fields)}
    if len(rows) < 2:
        return
    row = next(iter(rows.values()))
    place = f"On {_place(group, row, len(fields))} {_FROM[start]}"
    times = [solver for solver in row.time.order if rows[solver].share.hits]
    order = [solver for solver in row.success.order if rows[solver].share.hits]
    untimed = [solver for solver in order if solver not in times]
    order.sort(key=lambda s: (-rows[s].share.hits, [*times, *untimed].index(s)))
    first = _first(order)
    if sentence := _solved_in_time(rows):
        yield _headline("Solved within a time", group, start, f"{place}, {sentence}.")
    if sentence := _fastest(rows, times, first):
        yield _headline("Fastest", group, start, f"{place}, {sentence}.")
    if first:
        sentence = _most_solved(rows, first, best_rival(first, order))
        yield _headline("Most poses solved", group, start, f"{place}, {sentence}.")


def _solved_in_time(rows: dict[str, Score]) -> str:
    """Return who solves the largest share of the timed poses within each budget of time."""
    sentences = []
    for seconds in _BUDGETS:
        shares = {
            solver: metrics.share(row.timed_solved & (row.seconds <= seconds))
            for solver, row in rows.items()
            if row.is_timed
        }
        order = sorted(shares, key=lambda solver: -shares[solver].hits)
        first = _first(order)
        if first and (rival := best_rival(first, order)) and shares[first].hits:
            share, other = percent(shares[first]), percent(shares[rival])
            sentences.append(
                f"within {1e6 * seconds:,.0f} µs {full_name(first)} solves {share} of the poses "
                f"and {full_name(rival)}, the best other solver, {other}"
            )
    return "; ".join(sentences)


def _most_solved(rows: dict[str, Score], first: str, rival: str) -> str:
    """Return who solves the most poses, the best other solver if any, and how many tie."""
    share, rates = rows[first].share, 100.0 * np.array(rows[first].shares_by_seed)
    span = f", {rates.min():.1f} to {rates.max():.1f} by seed" if np.ptp(rates) else ""
    solved = f"{percent(share)} of {words(share.total)}{span}"
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
    other = f"the best other solver is {full_name(rival)} with {percent(rows[rival].share)}"
    return f"{full_name(first)} solves the most poses: {solved}; {other}{chance}"


def _fastest(rows: dict[str, Score], times: Sequence[str], best: str) -> str:
    """Return the fastest of the solvers that solve as many as the best, "" without rivals.

    Times are compared on poses solved by both, so a miss costs no time here. Solvers of fewer poses
    are compared with the best only if no other solver solves as many.
    """
    equals = [solver for solver in times if solver in rows[best].success.first] if best else []
    first = _first(equals)
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
    """Return two solvers, the faster first, with the ratio of the other's time to its."""
    if ratio.value >= 1.0:
        return a, b, ratio
    return b, a, metrics.Interval(1.0 / ratio.value, 1.0 / ratio.high, 1.0 / ratio.low)


def _headline(question: str, group: str, start: str, sentence: str) -> Headline:
    question = ", ".join(filter(None, (question, group, start)))
    return Headline("kinematics", question, sentence, "robots_overall")


def _most_compared(fields: dict[str, list[Score]]) -> list[Score]:
    """Return the ranked solvers over the robots with the most pairs of a robot and a solver."""
    takers = grouped((s for field in fields.values() for s in field), lambda score: score.solver)
    sets = dict.fromkeys(frozenset(s.robots for s in group) for group in takers.values())
    ranked = [[row for row in together(robots, fields) if row.is_ranked] for robots in sets]
    return max(ranked, key=lambda rows: sum(len(row.records) for row in rows), default=[])


def _place(group: str, row: Score, total: int) -> str:
    """Return the robots of a row as words: "the 10 held-out robots", "UR5"."""
    count = len(row.records)
    if count == 1:
        return row.robots
    return f"{'the' if count == total else f'{count} of'} {_robots(group, total)}"


def _robots(group: str, count: int) -> str:
    """Return a number of robots of a group as words: "10 held-out robots"."""
    if group == _GROUPS[-1]:
        return f"{counted(count, 'robot')} of yours"
    return counted(count, f"{group.replace(' ', '-')} robot")


def _first(order: Sequence[str]) -> str:
    """Return the first solver that is no loop of ours on another engine, "" without any."""
    return next((solver for solver in order if not catalogue.is_loop(solver)), "")


class Race(NamedTuple):
    """The times of engines in several cases [s], and the cases that chance may decide."""

    chapter: str
    task: str  # in a sentence
    noun: str  # of a case
    table: str
    times: dict[str, dict[str, float]]  # by case and engine, the fastest first
    ties: set[str]


def _races(results: Results) -> Iterator[Race]:
    """Yield the times of each task in which engines run code of their own."""
    for task, (goal, limit, table) in _CLOTH_GOALS.items():
        cloths: dict[str, dict[str, float]] = {}
        for point in points(results, task):
            best = cloths.setdefault(point.cloth, {})
            if point.error <= limit:
                engine = point.engine or point.solver
                best[engine] = min(point.seconds, best.get(engine, np.inf))
        yield Race("cloth", goal, "cloth", table, cloths, set())
    for subject, task in _SUBJECTS.items():
        records = list(filter(is_ranked, results.all("timing", subject=subject)))
        cases = {g[0].title: g for g in by_problem(records).values() if len(g) > 1}
        times = {case: _times_of_engines(members) for case, members in cases.items()}
        rankings = {case: ranked_by_time(cases[case]) for case in cases}
        ties = {
            case
            for case, order in rankings.items()
            if not order or len(set(map(_engine, order.first))) > 1
        }
        yield Race("speed", task, "case", f"timing_{subject}", times, ties)


def _times_of_engines(records: Sequence[Record]) -> dict[str, float]:
    """Return the shortest time of each engine [s]."""
    slowest_first = sorted(records, key=median_time, reverse=True)
    return {_engine(record.solver): median_time(record) for record in slowest_first}


def _engine(solver: str) -> str:
    calls = {catalogue.COMPILED.name, catalogue.PREPARED.name}
    return catalogue.PLUMBOB if solver in calls else solver


def _race_headline(race: Race) -> Headline | None:
    """Return the engine that is the fastest in most cases, None without rivals."""
    if len({engine for times in race.times.values() for engine in times}) < 2:
        return None
    orders = {case: sorted(race.times[case].items(), key=itemgetter(1)) for case in race.times}
    decided = [order for case, order in orders.items() if order and case not in race.ties]
    total = counted(len(orders), race.noun)
    question = f"Fastest in {race.task}"
    if not decided:
        sentence = f"No engine is the fastest beyond chance in {race.task} ({total})."
        return Headline(race.chapter, question, sentence, race.table)
    first = Counter(order[0][0] for order in decided).most_common(1)[0][0]
    orders_won = [dict(order) for order in decided if order[0][0] == first]
    rivals = [best_rival(first, list(times)) for times in orders_won]
    sentence = f"In {race.task}, {full_name(first)} is the fastest on {len(orders_won)} of {total}"
    opposed = [
        (times[r] / times[first], r) for times, r in zip(orders_won, rivals, strict=True) if r
    ]
    if opposed:
        ratios, names = zip(*opposed, strict=True)
        best = listed(list(map(full_name, dict.fromkeys(names))), "or")
        sentence += f", {_span(ratios)} times faster than the best other engine, {best}"
    if alone := len(orders_won) - len(opposed):
        sentence += f"; no other engine solves {alone} of them"
    return Headline(race.chapter, question, f"{sentence}.", race.table)


def _span(numbers: Sequence[float]) -> str:
    """Return the least and the greatest number: "1.3 to 1.9"."""
    return " to ".join(dict.fromkeys(map(factor, metrics.extent(np.array(numbers)))))


class Win(NamedTuple):
    """A case in which another solver beats ours beyond chance, and by how much."""

    chapter: str
    solver: str
    result: str  # "is faster than ours"
    case: str
    size: float  # a factor, or points of a share
    cases: str  # how many there are: "5 robots"
    table: str


def wins_of_others(results: Results) -> list[Headline]:
    """Return where other solvers beat ours beyond chance, among all compared rows."""
    wins = [win for group in _robot_groups(results) for win in _robot_wins(*group)]
    wins += [win for race in _races(results) for win in _race_wins(race)]
    return [
        _win_headline(group)
        for group in grouped(wins, lambda win: (win.solver, win.result, win.cases)).values()
    ]


def _win_headline(wins: Sequence[Win]) -> Headline:
    win, names = wins[0], [win.case for win in wins]
    unit = "{} percentage points" if "solves" in win.result else "a factor of {}"
    size = unit.format(_span([win.size for win in wins]))
    cases = f" ({listed(names)})" if len(names) <= MAX_NAMED else ""
    sentence = (
        f"{full_name(win.solver)} {win.result} on {len(names)} of {win.cases}{cases}, by {size}."
    )
    return Headline(win.chapter, "Where others win", sentence, win.table)


def _robot_wins(group: str, start: str, fields: dict[str, list[Score]]) -> Iterator[Win]:
    """Yield the robots on which another solver solves more, or is faster."""
    for robot, field in fields.items():
        rows = {row.solver: row for row in field}
        cases = _robots(group, len(fields))
        own = next(filter(catalogue.is_ours, field[0].success.order), "")
        first = _first(field[0].success.first)
        if own and first and own not in field[0].success.first:
            size = 100 * float(np.mean(rows[first].solved) - np.mean(rows[own].solved))
            result = f"solves more poses than {full_name(own)} {_FROM[start]}"
            yield Win("kinematics", first, result, robot, size, cases, "robots_by_robot")
        own = next(filter(catalogue.is_ours, field[0].time.order), "")
        if own and (first := _faster(rows, own)):
            size = ratio_of_times(rows[own], rows[first]).value
            result = f"is faster, where both solve, than {full_name(own)} {_FROM[start]}"
            yield Win("kinematics", first, result, robot, size, cases, "robots_by_robot")


def _faster(rows: dict[str, Score], own: str) -> str:
    """Return the fastest solver that beats ours on the poses solved by both, else ""."""
    rivals = [solver for solver in rows[own].time.order if best_rival(own, [solver])]
    pairs = [times_of_both(rows[own], rows[rival]) for rival in rivals]
    logs = [(np.log(times), np.log(rival_times)) for times, rival_times in pairs]
    chances = metrics.adjusted([metrics.chance_of_pairs(*pair) for pair in logs])
    gains = {
        rival: metrics.mean(times - rival_times)
        for rival, chance, (times, rival_times) in zip(rivals, chances, logs, strict=True)
        if chance <= 1.0 - metrics.CONFIDENCE
    }
    return max((rival for rival in gains if gains[rival] > 0.0), key=gains.__getitem__, default="")


def _race_wins(race: Race) -> Iterator[Win]:
    """Yield the cases in which another engine is faster."""
    for case, times in race.times.items():
        first = min(times, key=times.__getitem__, default="")
        if catalogue.PLUMBOB in times and first != catalogue.PLUMBOB and case not in race.ties:
            ratio = times[catalogue.PLUMBOB] / times[first]
            result = f"is faster than {full_name(catalogue.PLUMBOB)} in {race.task}"
            cases = counted(len(race.times), race.noun)
            yield Win(race.chapter, first, result, case, ratio, cases, race.table)
