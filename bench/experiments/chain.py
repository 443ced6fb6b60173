"""A chain of ten ball joints: accuracy and iterations of every inverse-kinematics solver."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from plumbob.reference import IK_SOLVERS

from ..measure import metrics
from ..measure.block import Block, Scale
from ..measure.chain_targets import (
    SUITE,
    ChainJob,
    SolverLimits,
    blocks_of_users,
    job_of,
    solve_one_by_one,
    solve_targets,
)
from ..measure.measure import not_asked
from ..measure.record import Record
from ..measure.values import Booleans1, Fact, Floats1, Floats2, Integers1, Values
from ..peers import catalogue
from ..peers.user_solver import CHAIN_TASK
from ..problems.chains import BEYOND, SEED, STRATA, TargetsForSkeleton, chain_targets
from ..problems.curves import CURVE

# The task of records.
CHAIN = "chain"
# The default of `solve_ik` [m].
TOLERANCE = 1e-4
# Beyond reach: of the distance from the closest pose; small, to require a straight chain.
BEYOND_TOLERANCE = 1e-6
# Ten times the default of `solve_ik`: slow methods show their convergence.
MAX_ITERATIONS = 1000
# Targets in a stratum, and out of reach, per target of a scale. A solver in Python may need seconds
# for a target that takes all iterations, as each target out of reach does.
_TARGETS, _TARGETS_BEYOND = 0.25, 0.05
# The least number of either.
_LEAST_TARGETS = 3
NO_BALLS = "not asked for chains: it offers no inverse_kinematics"


class SolveFacts(Values, frozen=True, kw_only=True):
    """The tolerance [m] and the most iterations, how a frame starts, the stratum or curve."""

    tolerance: Fact[float] = math.nan
    max_iterations: Fact[int | None] = None
    warm: Fact[bool | None] = None
    mode: Fact[str] = ""  # of a closed curve
    stratum: Fact[str] = ""
    curve: Fact[str] = ""


class ChainSolves(SolveFacts, frozen=True):
    """The solutions of a batch of targets, (target,); lengths in metres."""

    residual: Floats1  # infinite without a solution
    iterations: Floats1  # NaN where the solver does not report them
    distance: Floats1 | None = None  # of the target from the root
    bend: Floats1 | None = None  # of the farthest joint from the line from root to target
    excess: Floats1 | None = None  # residual above distance - reach
    reach: float | None = None
    solved: Booleans1 | None = None  # whether the residual is within the tolerance
    outcome: Integers1 | None = None  # the number of an `Outcome`, of our solvers
    history_low: Floats1 | None = None  # 10th percentile of the residuals by iteration
    history_median: Floats1 | None = None
    history_high: Floats1 | None = None  # 90th percentile
    seconds: Floats2 | None = None  # of the first targets, (round, target)
    control: Floats1 | None = None  # of a fixed loop before each round
    # 1 or 0 as a user's solver claims, or -1 for no claim
    claims: Integers1 | None = None


KINDS = {CHAIN: ChainSolves}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every stratum, and a user's targets, for every solver."""
    for stratum in STRATA:
        share = _TARGETS_BEYOND if stratum == BEYOND else _TARGETS
        count = min(scale.targets, max(_LEAST_TARGETS, round(share * scale.targets)))
        problem = chain_targets(stratum, count, scale.seed)
        tolerance = BEYOND_TOLERANCE if stratum == BEYOND else TOLERANCE
        digest = {} if scale.seed == SEED else {"problem_digest": f"seed {scale.seed}"}
        for block in _blocks_on(problem, stratum, SolverLimits(tolerance, MAX_ITERATIONS), scale):
            yield replace(block, facts={**block.facts, **digest})
    limits = SolverLimits(TOLERANCE, MAX_ITERATIONS)
    for own in scale.problems:
        if own.targets is not None:
            yield from (b.on(own) for b in _blocks_on(own.targets, "yours", limits, scale))
    facts = {"task": CHAIN, "stratum": BEYOND, "title": "every chain"}
    for solver in scale.user_solvers:
        if solver.offers(SUITE) and CHAIN_TASK not in solver.tasks:
            measure = partial(not_asked, NO_BALLS)
            yield Block(SUITE, "chain/all", solver.name, measure, facts=facts).of(solver)


def _blocks_on(
    problem: TargetsForSkeleton, stratum: str, limits: SolverLimits, scale: Scale
) -> Iterator[Block]:
    """Yield targets for every solver of ours, the loop on each engine, and users' solvers."""
    from plumbob.crosscheck.engines import SKELETON_ENGINES

    from ..peers import chain_loops

    facts = {"task": CHAIN, "stratum": stratum, "title": problem.title}
    adapters: dict[str, dict[str, str]] = {solver: {"solver": solver} for solver in IK_SOLVERS}
    loops = [loop for loop in catalogue.LOOPS if loop.engine in SKELETON_ENGINES]
    adapters |= {loop.name: {"engine": loop.engine} for loop in loops}
    for name, settings in adapters.items():
        job = job_of(problem, limits, chain_loops.__name__, settings)
        answers = partial(solve_one_by_one, problem, job, limits)
        if name in IK_SOLVERS:
            answers = partial(solve_targets, problem, name, limits, record=True)
        block = ChainJob(answers, job).block(problem, name, limits)
        yield replace(block, size=len(problem.targets), facts=facts)
    for block in blocks_of_users(problem, limits, scale, followed=stratum != BEYOND):
        yield replace(block, size=len(problem.targets), facts={**facts, **block.facts})


# What is shown.

from ..figures.chart import Panel, Series, declared_chart, series
from ..figures.sketch import Sketch
from ..tables.captions import Captions
from ..tables.columns import (
    folded,
    quantiles,
    reported_iterations,
    spread_of,
    spread_of_iterations,
    text,
    words_in,
)
from ..tables.results import Results, by_problem, counted, grouped, label
from ..tables.table import Column, Summary, words

# A chain counts as straight if no joint is off the line by more than this share of the reach. A
# round number: a pixel of a chain drawn with a hundred.
STRAIGHT = 0.01
# Iterations at which targets are counted.
COUNTED = np.unique(np.logspace(0, 3, 61).round())
_CAPTIONS = Captions(__file__)

# The columns common to every table of solves.
PROBLEM = text("problem", lambda record: record.title)
SOLVER = text("solver", lambda record: label(record.solver))
ALLOWED = Column("iterations allowed", read=lambda record: record.values.max_iterations)
REMARK = text("remark", lambda record: record.remark)


def within_tolerance(record: Record) -> np.ndarray:
    """Return which residuals are within the tolerance."""
    return np.asarray(record.values.residual <= record.values.tolerance)


def share_within_tolerance(record: Record) -> metrics.Share:
    """Return how many residuals are within the tolerance."""
    return metrics.share(within_tolerance(record))


# Beyond reach.


def _beyond_reach(results: Results) -> list[Record]:
    chains = [r for r in results.all("ik", task=CHAIN, stratum=BEYOND) if r.has_numbers]
    return results.all("arm", task=BEYOND) + chains


_bend = partial(quantiles, "off the line", read=partial(spread_of, name="bend"), unit="m")
_excess = partial(
    quantiles,
    "residual above distance − reach",
    read=partial(spread_of, name="excess"),
    unit="m",
)
BEYOND_COLUMNS = (
    PROBLEM,
    SOLVER,
    *_bend(["largest"]),
    *_excess(["largest"]),
    *quantiles("iterations", ["median", "largest"], spread_of_iterations),
    ALLOWED,
    REMARK,
    *folded(
        Column("targets", read=lambda record: int(record.size)),
        Column("targets without a solution", read=lambda r: np.isinf(r.values.bend).sum()),
        *_bend(["median"]),
        *_excess(["median"]),
    ),
)


def _straight(record: Record) -> np.ndarray:
    """Return which targets the chain reaches for in a straight line."""
    return np.asarray(record.values.bend <= STRAIGHT * record.values.reach)


def _beyond_summary(records: Sequence[Record]) -> Summary:
    shares = {
        solver: metrics.share(np.concatenate([*map(_straight, members)]))
        for solver, members in grouped(records, lambda record: label(record.solver)).items()
    }
    straight = sum(share.hits == share.total for share in shares.values())
    return Summary(
        "The best solution is the straight line from root to target; "
        f"{straight} of {counted(len(shares), 'solver')} always end within "
        f"{words_in(STRAIGHT, '%')} of the reach of that line.",
        tuple(f"{solver}: {words(share)}" for solver, share in shares.items()),
    )


def _beyond_measured(records: Sequence[Record]) -> dict[str, str]:
    distances = np.concatenate([record.values.distance / record.values.reach for record in records])
    return {"distances": " to ".join(map(words, metrics.extent(distances)))}


beyond_reach = _CAPTIONS.layout(
    "q1_beyond_reach", _beyond_reach, _beyond_summary, _beyond_measured, columns=BEYOND_COLUMNS
)


# CCD and FABRIK.


class Rivals(NamedTuple):
    """A problem solved by both CCD and FABRIK."""

    ccd: Record
    fabrik: Record

    @property
    def ratio(self) -> float:
        """The mean iterations of CCD over FABRIK's."""
        ccd, fabrik = (metrics.mean(record.values.iterations) for record in self)
        return metrics.ratio(ccd, fabrik)

    @property
    def fewer(self) -> tuple[str, ...]:
        """The solver with fewer iterations, both in a tie."""
        ccd, fabrik = (-record.values.iterations for record in self)
        return metrics.ranking({"CCD": ccd, "FABRIK": fabrik}).first


def _rivals(results: Results) -> list[Rivals]:
    records = results.all("arm", task=CURVE, warm=True)
    records += results.all("arm", task=BEYOND) + results.all("ik", task=CHAIN)
    groups = [{r.solver: r for r in group} for group in by_problem(records).values()]
    return [
        Rivals(group["ccd"], group["fabrik"])
        for group in groups
        if "ccd" in group and "fabrik" in group
    ]


_ccd = partial(quantiles, "CCD", read=lambda rivals: spread_of(rivals.ccd, "iterations"))
_fabrik = partial(quantiles, "FABRIK", read=lambda rivals: spread_of(rivals.fabrik, "iterations"))
RIVAL_COLUMNS = (
    text("problem", lambda rivals: rivals.ccd.title),
    *_ccd(["median"]),
    *_fabrik(["median"]),
    Column("CCD / FABRIK, means", read=lambda rivals: rivals.ratio),
    *folded(
        Column("solves", read=lambda rivals: rivals.ccd.values.iterations.size),
        *_ccd(["95 %", "largest"]),
        *_fabrik(["95 %", "largest"]),
    ),
)


def _rival_summary(rows: Sequence[Rivals]) -> Summary:
    ratios = [rivals.ratio for rivals in rows]
    winners = [rivals.fewer for rivals in rows]
    solves = sum(rivals.ccd.values.iterations.size for rivals in rows)
    ccd, fabrik = (winners.count((name,)) for name in ("CCD", "FABRIK"))
    return Summary(
        f"FABRIK needs fewer iterations than CCD on {fabrik} of {len(rows)} problems, more on "
        f"{ccd}, and on {len(rows) - fabrik - ccd} they tie (n = {words(solves)} solves); CCD "
        f"makes {words(min(ratios))} to {words(max(ratios))} times as many on average "
        f"(median of the problems {words(metrics.spread(np.array(ratios)).median)})."
    )


def iterations_chart(results: Results) -> Sketch | None:
    """Show the share of the targets reached within each number of iterations, by stratum."""
    groups = ([r for r in group if reported_iterations(r).size] for group in histories(results))
    panels = [Panel(group[0].title, tuple(map(_reached, group))) for group in groups if group]
    chart = _CAPTIONS.figure("iterations")
    chart["shows"] += " Users’ solvers claim their iterations." * bool(results.user_solvers)
    return declared_chart(chart, panels, results.user_solvers)


def histories(results: Results) -> list[list[Record]]:
    """Return the records with a history of each stratum within reach."""
    records = [r for r in results.all("ik", task=CHAIN) if r.values.stratum != BEYOND]
    records = [record for record in records if record.values.history_median is not None]
    return list(by_problem(records).values())


def _reached(record: Record) -> Series:
    """Return the share of the targets reached within each number of iterations [%]."""
    iterations = np.where(within_tolerance(record), record.values.iterations, np.inf)
    rates = np.mean(iterations[:, None] <= COUNTED, axis=0)
    low, high = metrics.wilson(rates, iterations.size)
    return series(record.solver, COUNTED, 100 * rates, (100 * low, 100 * high))


rivals = _CAPTIONS.layout(
    "q2_iterations", _rivals, _rival_summary, columns=RIVAL_COLUMNS, figures=(iterations_chart,)
)

LAYOUTS = (beyond_reach, rivals)
