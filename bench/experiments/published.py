"""The published tables again: the same set-up as far as known, with the solvers at hand."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import scenes, solve_ik

from ..measure import metrics
from ..measure.block import Block, Measured, Scale
from ..measure.chain_targets import SolverLimits, blocks_of_users
from ..measure.record import Record
from ..peers import catalogue
from ..peers.ik import toolbox, trac_ik
from ..peers.peer import ONE_START, RESTARTS, Peer, Run
from ..problems import published
from ..problems.chains import TargetsForSkeleton, unit
from ..problems.evaluate import Tolerance
from ..problems.robot_targets import uniform_targets
from ..problems.robots import is_installed
from .chain import ChainSolves
from .robots import SUITE, RobotJob, RobotSolves

# The tasks of records.
TRAC_IK, TOOLBOX, FABRIK = "TRAC-IK’s table", "the toolbox’s table", "FABRIK’s table"
# Random targets per target of a scale: 10,000 at a full scale, as in TRAC-IK's table.
_TARGETS = 5
_TIMED_TARGETS = 200
_SEED = 2011  # of the targets
_LIMITS: dict[str, Any] = {
    "tolerance": published.FABRIK.tolerance,
    "max_iterations": published.FABRIK.iterations,
}
# The solvers fast enough for 10,000 targets, with restarts as in TRAC-IK.
_FAST = (catalogue.PLUMBOB_LM, toolbox.PEER, trac_ik.PEER)


KINDS = {TRAC_IK: RobotSolves, TOOLBOX: RobotSolves, FABRIK: ChainSolves}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield TRAC-IK's table, the toolbox's, FABRIK's; leave out solvers not installed."""
    count = _TARGETS * scale.targets
    counts = count, min(count, _TIMED_TARGETS)
    tolerance = Tolerance(*[math.sqrt(3.0) * published.TRAC_IK.tolerance] * 2)
    for peer in (peer for peer in _FAST if peer.is_installed):
        for robot in dict.fromkeys(rate.robot for rate in published.TRAC_IK.rates):
            if is_installed(robot):
                targets = partial(uniform_targets, robot, count, middle=True)
                job = RobotJob(robot, peer, peer.first(RESTARTS), tolerance, targets, *counts)
                facts = {"task": TRAC_IK, "robot": robot, "title": robot}
                yield job.block(f"published/trac_ik/{robot}", facts)
    tolerance = Tolerance(*[math.sqrt(2.0 * published.TOOLBOX.half_square)] * 2)
    targets = partial(uniform_targets, "ur5", count, middle=False)
    for peer, entry, infeasible in _toolbox() if is_installed("ur5") else ():
        job = RobotJob("ur5", peer, entry, tolerance, targets, *counts)
        about: dict[str, Any] = {"task": TOOLBOX, "title": "ur5", "infeasible": infeasible}
        yield job.block("published/toolbox/ur5", about)
    for stratum, distance in published.FABRIK.distances.items():
        yield from _fabrik(stratum, distance, scale)


def _toolbox() -> Iterator[tuple[Peer, Run, float | None]]:
    """Yield solvers without restarts, with the published share of infeasible targets."""
    plumbob, other = catalogue.PLUMBOB_LM, toolbox.PEER
    entry, iterations = plumbob.first(ONE_START), {"iterations": published.TOOLBOX.iterations}
    yield plumbob, replace(entry, settings={**entry.settings, **iterations}), None
    for search in published.TOOLBOX.searches if other.is_installed else ():
        settings = {**search.settings, "searches": 1, "limits": False, **iterations}
        yield other, Run(ONE_START, settings, search.title), search.infeasible


def _fabrik(stratum: str, distance: float, scale: Scale) -> Iterator[Block]:
    """Yield targets at a distance from the root of a straight chain, in random directions."""
    chain = published.FABRIK
    skeleton, rest = scenes.ball_chain(links=chain.links, link_length=chain.length)
    rng = np.random.default_rng(_SEED)
    targets = distance * unit(rng.standard_normal((chain.runs, 3)))
    name, facts = f"published/fabrik/{stratum}", {"task": FABRIK, "stratum": stratum}
    problem = TargetsForSkeleton(name, name, skeleton, rest, targets)
    for solver in chain.means:
        measure = partial(iterations, problem, solver)
        yield Block(SUITE, name, solver, measure, _LIMITS, facts=facts)
    for block in blocks_of_users(problem, SolverLimits(**_LIMITS), scale):
        yield replace(block, facts={**facts, **block.facts})


def iterations(problem: TargetsForSkeleton, solver: str) -> Measured:
    """Solve all targets with a solver of ours."""
    solution = solve_ik(problem.skeleton, problem.starts, problem.targets, solver, **_LIMITS)
    return {
        "iterations": np.asarray(solution.iterations),
        "residual": np.asarray(solution.residual),
    }


# What is shown.

from ..ranking.scores import Score
from ..tables.captions import Captions
from ..tables.columns import reported_iterations, text
from ..tables.results import Results, counted, grouped, label
from ..tables.table import Column, Summary, listing, words
from .robots import RULE


class PublishedNumber(NamedTuple):
    """A published number, None without one, and the same measured here with its 95 % interval."""

    table: str
    problem: str
    solver: str
    source: str = ""
    record: Record | None = None
    targets: int | None = None
    mark: str = ""
    quantity: str = ""
    published: float | None = None
    values: Sequence[float] = ()  # as measured: the number, and the bounds of its interval

    def of(
        self, quantity: str, number: float | None, values: Sequence[float] = ()
    ) -> "PublishedNumber":
        """Return a number of the same solver."""
        return self._replace(quantity=quantity, published=number, values=tuple(values))

    def measured(self, place: int = 0) -> float | None:
        """Return the number as measured, or a bound; None if unknown."""
        has_value = place < len(self.values) and not np.isnan(self.values[place])
        return self.values[place] if has_value else None


def _scored(row: PublishedNumber, score: Score) -> PublishedNumber:
    """Return a row as measured of a solver."""
    row = row._replace(solver=score.solver, record=score.records[0])
    return row._replace(targets=score.total, mark=score.limits)


COLUMNS = (
    text("table", lambda row: row.table),
    text("problem", lambda row: row.problem),
    text("solver", lambda row: row.solver),
    text("quantity", lambda row: row.quantity),
    Column("published", read=lambda row: row.published),
    Column("measured", read=lambda row: row.measured()),
    text("mark", lambda row: row.mark),
    Column("measured, 95 % low", folded=True, read=lambda row: row.measured(1)),
    Column("measured, 95 % high", folded=True, read=lambda row: row.measured(2)),
    Column("targets", folded=True, read=lambda row: row.targets),
    text("source", lambda row: row.source, folded=True),
)


def _rows(results: Results) -> Iterator[PublishedNumber]:
    """Yield all numbers of the published tables with records."""
    strata = list(published.FABRIK.distances)
    trac_ik, toolbox = (
        [record for record in results.all(SUITE, task=task) if record.has_numbers]
        for task in (TRAC_IK, TOOLBOX)
    )
    fabrik = sorted(results.all(SUITE, task=FABRIK), key=lambda r: strata.index(r.values.stratum))
    yield from _of_trac_ik(trac_ik)
    for record in toolbox:
        yield from _of_toolbox(record)
    for record in fabrik:
        yield from _of_fabrik(record)


def _of_trac_ik(records: Sequence[Record]) -> Iterator[PublishedNumber]:
    """Yield success rates and mean times, robot by robot, the published solvers first."""
    titles = {peer.label_of(entry): peer.name for peer in catalogue.PEERS for entry in peer.runs}
    for robot, members in grouped(published.TRAC_IK.rates, lambda rate: rate.robot).items():
        rates = {rate.solver: rate for rate in members}
        measured = {titles.get(r.solver, r.solver): r for r in records if r.values.robot == robot}
        for solver in dict.fromkeys([*rates, *measured]) if measured else ():
            *_, percent, milliseconds, source = rates.get(solver) or (None, None, "")
            row, share, time = PublishedNumber("TRAC-IK", robot, solver, source), [], []
            if record := measured.get(solver):
                score = Score(robot, "", record.solver, (record,))
                row, share = _scored(row, score), _percent(score, score.solved)
                time = [1e3 * metrics.mean(score.seconds)]
            yield row.of("solved [%]", percent, share)
            yield row.of("time, mean [ms]", milliseconds, time)


def _of_toolbox(record: Record) -> Iterator[PublishedNumber]:
    """Yield the shares of targets not solved by a single search, and its time."""
    score = Score(record.title, "", record.solver, (record,))
    rate = record.values.infeasible
    source = "" if rate is None else published.TOOLBOX.source
    row = _scored(PublishedNumber("Robotics Toolbox", record.title, "", source), score)
    yield row.of("declared infeasible [%]", rate, _percent(score, score.all("claims", 0) != 1))
    yield row.of("not solved within the limits [%]", None, _percent(score, ~score.solved))
    median = metrics.median_interval(score.seconds)
    yield row.of("time, median [µs]", None, [1e6 * seconds for seconds in median])


def _of_fabrik(record: Record) -> Iterator[PublishedNumber]:
    """Yield the mean and the largest number of iterations of a solver in a stratum."""
    stratum, counts = record.values.stratum, reported_iterations(record)
    number = published.FABRIK.means.get(record.solver, {}).get(stratum)
    source = "" if number is None else published.FABRIK.source
    row = PublishedNumber("FABRIK", stratum, label(record.solver), source, record)
    if not counts.size:
        row = row._replace(mark="iterations not reported")
        yield from (row.of("iterations, mean", number), row.of("iterations, largest", None))
        return
    row = row._replace(targets=counts.size, mark="claimed" * record.is_user_solver)
    yield row.of("iterations, mean", number, metrics.mean_interval(counts))
    yield row.of("iterations, largest", None, [float(counts.max())])


def _percent(score: Score, hits: np.ndarray) -> list[float]:
    """Return a share with its interval [%]; empty for an unfinished solver."""
    if not score.is_finished:
        return []
    share = metrics.share(hits)
    return [100.0 * metrics.ratio(*share[:2]), 100.0 * share.low, 100.0 * share.high]


def _summary(rows: Sequence[PublishedNumber]) -> Summary:
    complete = [row for row in rows if None not in (row.published, row.measured())]
    sentence = f"{counted(len(complete), 'published figure')} can be compared with ours."
    return listing(sentence, map(_point, complete))


def _point(row: PublishedNumber) -> str:
    low, high = row.measured(1), row.measured(2)
    interval = "" if low is None else f"{words(low)}–{words(high)}, "
    mark = f", {row.mark}" if row.mark else ""
    return (
        f"{row.problem}, {row.solver}: {row.quantity} {words(row.measured())} "
        f"({interval}n = {words(row.targets)}), published {words(row.published)}{mark}"
    )


_CAPTIONS = Captions(
    __file__,
    rule=RULE,
    trac_ik_tolerance=words(published.TRAC_IK.tolerance),
    toolbox_iterations=words(published.TOOLBOX.iterations),
    toolbox_half_square=words(published.TOOLBOX.half_square),
    links=str(published.FABRIK.links),
    length=str(published.FABRIK.length),
    runs=str(published.FABRIK.runs),
    distances=" and ".join(map(str, published.FABRIK.distances.values())),
    fabrik_tolerance=words(published.FABRIK.tolerance),
)

published_ik = _CAPTIONS.layout("published_ik", _rows, _summary, columns=COLUMNS)

LAYOUTS = (published_ik,)
