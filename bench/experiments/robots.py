"""Robots and characters: every installed solver on the same targets, in all strata.

Each solver works in a process of its own and is given a fixed number of targets. Its answers are
evaluated here, by an engine that the solver is not built on. Then the solvers of a robot are timed
in turns. The tables say who takes part, who solves how many targets, how fast, and which claims
are false.
"""

import dataclasses
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import msgspec
import numpy as np

from ..measure.block import Block, Group, Measured, Scale
from ..measure.isolation import JobOutcome, Solved, raised
from ..measure.measure import not_asked, not_installed
from ..measure.progress import announce
from ..measure.timing import Job, Times, answers, first_targets, times_in_turns
from ..measure.values import Booleans1, Fact, Floats1, Floats2, Integers1, Values
from ..peers import catalogue
from ..peers.peer import Peer, Run
from ..peers.user_solver import ROBOT_TASK
from ..problems.evaluate import AGREEMENT, Targets, Tolerance, arbiter_of, evaluator_of
from ..problems.robot_targets import (
    SEED,
    STRATA,
    least_distances,
    robot_targets,
    unreachable_targets,
)
from ..problems.robots import (
    HELD_OUT,
    PACKAGE,
    REACHABLE,
    ROBOTS,
    UNREACHABLE,
    enter,
    group_of,
    is_installed,
    title,
)

# A solver with a time limit, whose answers differ from run to run, solves all targets so often.
REPEATS = 3
SUITE = "ik"
# A millimetre and a milliradian, more than ten times what industrial arms repeat.
TOLERANCE = Tolerance(1e-3, 1e-3)
# Targets in a stratum, and out of reach of a robot, per target of a scale. Targets out of reach are
# few: solvers try all of their restarts, which takes long.
_TARGETS, _TARGETS_BEYOND = 0.05, 0.03
# Time every tenth target of a stratum, in `ROUNDS`; every third out of reach, in `ROUNDS_BEYOND`.
_PER_TIMED, _PER_TIMED_BEYOND = 10, 3
# Time at least four targets of a stratum: a clear difference is then beyond chance.
_LEAST_TIMED = 4
# The median of three leaves out a disturbed round; targets out of reach take too long for three.
ROUNDS, ROUNDS_BEYOND = 3, 1
# Digits kept of times and residuals: more would fill the disk with noise.
_DIGITS = 5
_ANY = {"kind": "any"}
NO_ROBOTS = "not asked for robots: it offers no robot_inverse_kinematics"


class RobotSolves(Values, frozen=True, kw_only=True):
    """The targets of a solver, (target,); only `setup` if no target was begun.

    Targets, a pose or a position for each effector, are solved within the tolerances [m], [rad].
    Their seeds alternate, stratum after stratum.

    Attributes:
        solved: whether the evaluation finds the target solved.
        claims: 1 or 0 as the solver claims, or -1 if it makes no claims.
        seconds: how long the first targets took [s], (round, target).
        control: how long a fixed loop took before each round [s], (round,).
        position, rotation: distance of the effectors from the target [m], [rad]; NaN without an
            answer.
        beyond: by how much the answer oversteps limits [rad].
        exception: whether the solver raised, or its process was lost.
        stratum: the number of each target's stratum.
        setup: how long the solver took before the first [s].
        overhead: of the time of a solve, what the harness adds [s]; NaN if unknown.
        bound: how near any pose may come to a target out of reach [m].
        disputed: the numbers of the targets whose answers the engines place differently.
        repeats: how many targets a solver with a time limit solves each time, (repeat,).
    """

    kind: Fact[str] = ""
    version: Fact[str] = ""
    tolerance: Fact[float] = 0.0
    tolerance_rotation: Fact[float] = 0.0
    seeds: Fact[int] = 1
    strata: Fact[list[str]] = msgspec.field(default_factory=list)
    effectors: Fact[list[str]] = msgspec.field(default_factory=list)
    joints: Fact[int] = 0
    freedom: Fact[int] = 0
    target: Fact[str] = ""
    group: Fact[str] = ""  # of the robot, never averaged with another group
    arbiter: Fact[str] = ""  # the engine that evaluates the answers
    time_limited: Fact[bool] = False  # whether a time limit ends the solves
    robot: Fact[str] = ""  # of a published table
    infeasible: Fact[float | None] = None  # published share of infeasible targets [%]
    solved: Booleans1 | None = None
    claims: Integers1 | None = None
    seconds: Floats2 | None = None
    control: Floats1 | None = None
    position: Floats1 | None = None
    rotation: Floats1 | None = None
    beyond: Floats1 | None = None
    exception: Booleans1 | None = None
    stratum: Integers1 | None = None
    setup: float
    overhead: float | None = None
    bound: Floats1 | None = None
    disputed: Integers1 | None = None
    repeats: Integers1 | None = None

    def __post_init__(self) -> None:
        """Refuse records of which some arrays are missing, or of other lengths."""
        names = ("solved", "claims", "position", "rotation", "beyond", "stratum")
        if len({np.shape(getattr(self, name)) for name in names}) > 1:
            raise ValueError("solved: expected as many entries in every array")


KINDS = {REACHABLE: RobotSolves, UNREACHABLE: RobotSolves}


class RobotJob(NamedTuple):
    """Targets of a robot, and a solver with its settings and tolerance."""

    robot: str
    peer: Peer
    entry: Run
    tolerance: Tolerance
    targets: Callable[[], Targets]
    size: int  # how many targets there are
    timed_count: int  # so many of them, the first, are timed
    seed: int = SEED  # of the targets
    seeds: int = 1  # that they are drawn from
    is_beyond: bool = False  # whether the targets are out of reach

    @property
    def job(self) -> Job:
        """The job of a worker process."""
        settings = {**self.entry.settings, **self.peer.spec}
        model, restarts = evaluator_of(self.robot).robot, self.entry.restarts
        request = (self.peer.module, model, self.targets(), self.tolerance, settings, restarts)
        return Job(*request, self.peer.user_solver_name)

    def block(self, problem: str, facts: dict[str, Any]) -> Block:
        """Return the block of a problem; only its settings change an answer.

        Solvers of the same targets are measured together; a solver with a time limit is by itself.
        """
        settings = {
            **self.entry.settings,
            "kind": self.entry.kind,
            "attempts": self.entry.restarts + 1,
            "version": self.peer.version,
            "tolerance": self.tolerance.position,
            "tolerance_rotation": self.tolerance.rotation,
            "seed": self.seed,
            "seeds": self.seeds,
        }
        solver = self.peer.label_of(self.entry)
        group = Group(problem, solve_together, self)
        block = Block(SUITE, problem, solver, group.measure_alone, settings, self.size, facts)
        block = block if self.entry.has_time_limit else dataclasses.replace(block, group=group)
        return block.of(self.peer.user_solver)


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield each solver on each robot, and a block for each solver not installed."""
    own = {problem.name: problem for problem in scale.problems if problem.robot is not None}
    for problem in own.values():
        if problem.robot is not None:
            enter(problem.robot)
    installed = [name for name in ROBOTS if is_installed(name)]
    for name in ROBOTS:
        if name not in installed:
            absent, facts = partial(not_installed, PACKAGE), _facts(REACHABLE, title(name))
            yield Block(SUITE, f"robots/{name}", "all solvers", absent, _ANY, 0, facts)
    peers = catalogue.robot_peers(scale.user_solvers)
    robots = [*installed, *own]
    groups = ("robots", "unreachable")
    owners = {f"{group}/{name}": problem for name, problem in own.items() for group in groups}
    for block in _drawn(block for peer in peers for block in _blocks_of(peer, robots, scale)):
        yield block.on(owners[block.problem]) if block.problem in owners else block
    for solver in scale.user_solvers:
        if solver.offers(SUITE) and ROBOT_TASK not in solver.tasks:
            measure, facts = partial(not_asked, NO_ROBOTS), _facts(REACHABLE, "every robot")
            yield Block(SUITE, "robots/all", solver.name, measure, _ANY, 0, facts).of(solver)


def _facts(task: str, title: str) -> dict[str, Any]:
    return {"task": task, "title": title}


def _blocks_of(peer: Peer, robots: list[str], scale: Scale) -> Iterator[Block]:
    """Yield a solver on installed robots, with each of its settings."""
    count = max(1, round(_TARGETS * scale.targets))
    for entry in peer.runs:
        if not peer.is_installed:
            no_targets = partial(robot_targets, "", 0)
            job = RobotJob("", peer, entry, TOLERANCE, no_targets, 0, 0, scale.seed)
            block = job.block("robots/all", _facts(REACHABLE, "every robot"))
            absent = partial(not_installed, peer.package)
            yield dataclasses.replace(block, measure=absent, group=None)
            continue
        for name in robots:
            targets = partial(robot_targets, name, count, scale.seed, scale.seeds)
            rounds = scale.seeds * count
            timings = max(min(rounds, _LEAST_TIMED), -(-rounds // _PER_TIMED))
            sizes = (rounds * len(STRATA), len(STRATA) * timings)
            job = RobotJob(name, peer, entry, TOLERANCE, targets, *sizes, scale.seed, scale.seeds)
            yield job.block(f"robots/{name}", _facts(REACHABLE, title(name)))
            if name in HELD_OUT:
                continue
            beyond = max(1, round(_TARGETS_BEYOND * scale.targets))
            targets = partial(unreachable_targets, name, beyond, scale.seed)
            sizes = (beyond, -(-beyond // _PER_TIMED_BEYOND))
            job = RobotJob(
                name, peer, entry, TOLERANCE, targets, *sizes, scale.seed, is_beyond=True
            )
            yield job.block(f"unreachable/{name}", _facts(UNREACHABLE, title(name)))


def _drawn(blocks: Iterable[Block]) -> list[Block]:
    """Return blocks problem by problem, a group's blocks in a row, in an order of its own.

    The order is the same every time, whichever other solvers take part.
    """
    blocks = list(blocks)
    problems = list(dict.fromkeys(block.problem for block in blocks))

    def rank(block: Block) -> tuple[int, bool, int]:
        lot = zlib.crc32(f"{block.problem}, {block.solver}".encode())
        return problems.index(block.problem), block.group is None, lot

    return sorted(blocks, key=rank)


def solve_together(jobs: Sequence[RobotJob]) -> list[Measured]:
    """Solve the targets of every solver; then time the first targets, the solvers in turns."""
    results = []
    for job in jobs:
        announce(f"{job.peer.label_of(job.entry)}: answers")
        results.append(answers(job.job))
    finished = [i for i, outcome in enumerate(results) if len(outcome.solved) == jobs[i].size]
    slow = [i for i, job in enumerate(jobs) if first_targets(job.job, results[i])]
    turns = [i for i in finished if not jobs[i].entry.has_time_limit]
    times: dict[int, Times | None] = {i: _own_times(jobs[i], results[i]) for i in finished + slow}
    if turns:
        announce("times, all solvers in turns")
        requests = [jobs[i].job for i in turns]
        rounds = ROUNDS_BEYOND if jobs[0].is_beyond else ROUNDS
        times |= zip(turns, times_in_turns(requests, jobs[0].timed_count, rounds), strict=True)
    return [
        _measured(job, outcome, times.get(i))
        for i, (job, outcome) in enumerate(zip(jobs, results, strict=True))
    ]


def _repeats(job: RobotJob, outcome: JobOutcome) -> np.ndarray:
    """Return how many targets are solved in each repetition of all targets."""
    announce(f"{job.peer.label_of(job.entry)}: answers again")
    results = [outcome, *(answers(job.job) for _ in range(REPEATS - 1))]
    engine = arbiter_of(job.peer.built_on)
    return np.array([_evaluated(job, o.solved, engine)["solved"].sum() for o in results])


def _own_times(job: RobotJob, outcome: JobOutcome) -> Times:
    """Return the times taken with the answers, of a solver with a time limit."""
    seconds = [answer.seconds for answer in outcome.solved[: job.timed_count]]
    return Times(np.array([seconds]), np.zeros(0))


def _measured(job: RobotJob, outcome: JobOutcome, times: Times | None) -> Measured:
    """Return the numbers of answers and times.

    Targets never begun have no numbers; their solver did not finish.
    """
    evaluator, engine = evaluator_of(job.robot), arbiter_of(job.peer.built_on)
    robot = evaluator.robot
    arrays = _evaluated(job, outcome.solved, engine) if outcome.solved else {}
    if times is not None:
        arrays |= {"seconds": _rounded(times.seconds), "control": _rounded(times.control)}
    if job.entry.has_time_limit and not job.is_beyond and outcome.solved:
        arrays["repeats"] = _repeats(job, outcome)
    return {
        **arrays,
        "setup": outcome.setup,
        "overhead": outcome.overhead,
        "remark": outcome.note,
        "strata": list(STRATA),
        "effectors": list(robot.effectors),
        "joints": len(robot.joints),
        "freedom": int(evaluator.model.nv),
        "target": "pose" if robot.oriented else "position",
        "trouble": raised(outcome.solved),
        "arbiter": engine,
        "group": group_of(job.robot),
        "time_limited": job.entry.has_time_limit,
        **first_targets(job.job, outcome),
    }


def _evaluated(job: RobotJob, solved: list[Solved], engine: str) -> dict[str, np.ndarray]:
    q, targets = np.array([answer.q for answer in solved]), job.targets()
    evaluation = evaluator_of(job.robot).evaluate(targets, q, job.tolerance, engine)
    arrays = {
        "solved": evaluation.solved,
        "claims": np.array([answer.claim for answer in solved]),
        "position": _rounded(evaluation.position),
        "rotation": _rounded(evaluation.rotation),
        "beyond": _rounded(evaluation.beyond),
        "exception": np.array([bool(answer.trouble) for answer in solved]),
        "stratum": targets.strata[: len(solved)],
        "disputed": np.flatnonzero(evaluation.difference > AGREEMENT),
    }
    if job.is_beyond:  # how near any pose may come
        arrays["bound"] = least_distances(job.robot, targets)[: len(solved)]
    return arrays


def _rounded(numbers: np.ndarray) -> np.ndarray:
    return np.vectorize(lambda value: float(f"{value:.{_DIGITS - 1}e}"), otypes=[float])(numbers)


# What is shown.

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

from ..figures.chart import Panel, Series, declared_chart, series
from ..figures.sketch import Sketch
from ..measure import metrics
from ..measure.metrics import Floats
from ..measure.record import Record
from ..peers.peer import (
    ONE_START,
    PORTFOLIO_ITERATIONS,
    RESTART_ITERATIONS,
    RESTARTS,
    SHORT_ATTEMPTS,
)
from ..problems.robots import LIMIT_TOLERANCE
from ..ranking import scores
from ..ranking.scores import (
    OUTCOMES,
    PENALTY,
    SHIFT,
    STARTS,
    Score,
    fields_of,
    in_groups,
    title_of,
    together,
)
from ..tables.captions import Captions
from ..tables.columns import folded, number, text, words_in
from ..tables.layout import Figure, Layout
from ..tables.results import Results, counted, first_of_kinds, grouped, leaders, listed, only_first
from ..tables.table import INTERVAL, Column, Summary, listing, words
from ..tables.user_solvers import user_solver_table

CAPTIONS = Captions(
    __file__,
    shift=words_in(SHIFT, "µs"),
    penalty=words_in(PENALTY, "ms"),
    resamples=str(metrics.RESAMPLES),
    limit_tolerance=words(LIMIT_TOLERANCE),
    agreement=words(AGREEMENT),
    repeats=str(REPEATS),
    portfolio=words(PORTFOLIO_ITERATIONS),
    restarts=words(RESTART_ITERATIONS),
    attempts=words(SHORT_ATTEMPTS[0]),
    short=words(SHORT_ATTEMPTS[1]),
)
# The rule for unranked solvers.
RULE = CAPTIONS.shared["rule"]
MEAN, RELATIVE = "time, geometric mean", "time relative to fastest"
BESIDE_OURS = "time relative to ours, where both solve"


# Participants.


class Participant(NamedTuple):
    """A solver that was asked, its records, and a record of each robot of all."""

    peer: Peer
    records: tuple[Record, ...]
    robots: Mapping[str, Record]

    @property
    def version(self) -> str:
        """The version of its package, "" if not installed."""
        return str(self.records[0].values.version)

    @property
    def robots_taken(self) -> str:
        """The robots that it takes."""
        titles = {record.title for record in self.records if "solved" in record.measured}
        names = [robot for robot in self.robots if robot in titles]
        return title_of(names, [robot for robot in self.robots if robot not in titles])

    @property
    def overhead(self) -> float:
        """The median time that the harness adds to an attempt [s]; NaN if unknown."""
        every = [getattr(record.values, "overhead", None) for record in self.records]
        overheads = [overhead for overhead in every if overhead is not None and overhead >= 0.0]
        return float(np.median(overheads)) if overheads else np.nan

    @property
    def remark(self) -> str:
        """Why robots are not taken, each reason with its robots."""
        remarks = {r.title: r.remark for r in self.records if r.remark}
        reasons = grouped(remarks if self.version else (), remarks.__getitem__)
        return "; ".join(f"{listed(titles)}: {reason}" for reason, titles in reasons.items())


def _participants(results: Results) -> Iterator[Participant]:
    """Yield the peers with records, and the solvers entered by users."""
    records = [r for start in STARTS for r in results.all("ik", task=REACHABLE, kind=start)]
    robots = {record.title: record for record in records if "solved" in record.measured}
    users = {r.solver: _as_peer(r) for r in records if r.is_user_solver}
    for peer in (*catalogue.PEERS, *users.values()):
        names = set(map(peer.label_of, peer.runs))
        if own := tuple(record for record in records if record.solver in names):
            yield Participant(peer, own, robots)


def _as_peer(record: Record) -> Peer:
    """Return a user's solver in the form of the bench's solvers."""
    address = str(record.measured.get("door", ""))
    return Peer(record.solver, "", address, "", "", "", (Run(record.values.kind),))


def _entry(entry: Run) -> str:
    """Return the start of an entry, its note, and who makes its restarts."""
    maker = "made by the bench" if entry.restarts else ""
    notes = "; ".join(filter(None, (entry.note, maker)))
    return f"{entry.kind} ({notes})" if notes else entry.kind


def _participant_summary(rows: Sequence[Participant]) -> Summary:
    titles = {row.peer.name for row in rows}
    missing = [peer.name for peer in catalogue.PEERS if peer.name not in titles]
    not_asked = f"; not selected: {', '.join(missing)}" if missing else ""
    count, robots = sum(bool(row.version) for row in rows), rows[0].robots.values()
    return Summary(
        f"{count} of {len(rows)} selected solvers took part, on "
        f"{counted(len(robots), 'robot')}{not_asked}.",
        tuple(map(_robot, robots)),
    )


def _robot(record: Record) -> str:
    """Return the joints of a robot, and the target of its effectors."""
    robot: RobotSolves = record.values
    freedoms = "" if robot.freedom == robot.joints else f", {robot.freedom} freedoms"
    effectors = listed(robot.effectors)
    return f"{record.title}: {robot.joints} joints{freedoms}, {robot.target} of {effectors}"


participants = CAPTIONS.layout(
    "participants",
    _participants,
    _participant_summary,
    columns=(
        text("solver", lambda row: row.peer.name),
        text("package", lambda row: row.peer.package),
        text("version", lambda row: row.version or "not installed"),
        text("license", lambda row: row.peer.license),
        text("algorithm", lambda row: row.peer.algorithm),
        text("robots", lambda row: row.robots_taken),
        text("solves", lambda row: row.peer.can),
        text("entries", lambda row: listed(list(map(_entry, row.peer.runs)))),
        Column("harness overhead, median", "µs", read=lambda row: number(row.overhead)),
        text("remark", lambda row: row.remark),
    ),
)


# Charts.

# Times of a target within which shares are drawn [s].
_BUDGETS = np.logspace(-6, 0, 121)
# Times relative to the fastest for which performance profiles are drawn.
_RATIOS = np.logspace(0, 4, 121)


def budgets(start: str, results: Results) -> Sketch | None:
    """Return the shares of targets solved within each budget of time."""
    return _chart("budget", _shares_in_time, fields_of(results, start), results)


def _shares_in_time(field: Sequence[Score]) -> list[Series]:
    """Return the shares of all targets that are solved within each budget, with intervals."""
    return [_share(score, _BUDGETS, *score.solved_within(_BUDGETS)) for score in field]


def group_budgets(start: str, results: Results) -> Sketch | None:
    """Return the same shares over all robots held out, of the solvers that take all."""
    members = in_groups(fields_of(results, start)).get("held out", {})
    scores = together(list(members), members) if len(members) > 1 else []
    fields = {scores[0].robots: scores} if scores else {}
    return _chart("group_budget", _shares_in_time, fields, results)


def performance_profiles(start: str, results: Results) -> Sketch | None:
    """Return the performance profiles of solvers on the same targets (Dolan and Moré 2002)."""
    fields = {
        robot: [score for score in field if score.has_same_targets]
        for robot, field in fields_of(results, start).items()
    }
    return _chart("profile", _profiles, fields, results)


def _profiles(field: Sequence[Score]) -> list[Series]:
    """Return the shares of the timed targets within each ratio of the time of the fastest."""
    seconds = np.array([score.seconds for score in field])
    solved = np.array([score.timed_solved for score in field])
    profiles = metrics.performance_profiles(seconds, solved, _RATIOS)
    pairs = zip(field, profiles, strict=True)
    return [_share(s, _RATIOS, y, metrics.wilson(y, max(1, len(s.seconds)))) for s, y in pairs]


def _chart(
    name: str,
    curves: Callable[[Sequence[Score]], list[Series]],
    fields: Mapping[str, Sequence[Score]],
    results: Results,
) -> Sketch | None:
    """Return a panel of curves for each robot; None if there are no solvers with this start."""
    fields_shown = {
        robot: [score for score in members if score.is_timed and score.is_finished]
        for robot, members in fields.items()
    }
    panels = [
        Panel(robot, tuple(curves(field) if field else ())) for robot, field in fields_shown.items()
    ]
    start = next((score.start for members in fields.values() for score in members), "")
    sample = scores.sample([score for field in fields_shown.values() for score in field])
    chart, name = CAPTIONS.figure(name), f"{name}_{start.replace(' ', '_')}"
    title = f"Robots, {start}: {chart['title']} ({sample})"
    return declared_chart({**chart, "name": name, "title": title}, panels, results.user_solvers)


def _share(score: Score, x: Floats, shares: Floats, bounds: tuple[Floats, Floats]) -> Series:
    """Return the curve of a share with its 95 % interval [%]."""
    low, high = bounds
    return series(score.solver, x, 100 * shares, (100 * low, 100 * high))


# Portfolios have no charts of each robot: the page would be half as large again.
FIGURES: tuple[Figure, ...] = (
    *(partial(group_budgets, start) for start in STARTS),
    *(
        partial(draw, start)
        for draw in (budgets, performance_profiles)
        for start in (ONE_START, RESTARTS)
    ),
)


# Columns of scores.


def _parts(
    title: str, unit: str, read: Callable[[Score], Any], **endings: str
) -> tuple[Column, ...]:
    """Return the columns of parts of an estimate: each part with the ending of its title."""

    def cell(part: str, score: Score) -> float | None:
        return number(getattr(read(score), part))

    return tuple(
        Column(title + ending, unit, read=partial(cell, part)) for part, ending in endings.items()
    )


# The columns of an estimate of a time and of its interval.
_of_interval = partial(_parts, unit="µs", value="", low=", 95 % low", high=", 95 % high")


def _of_spread(title: str, unit: str, read: Callable[[Score], Floats]) -> tuple[Column, ...]:
    """Return the columns of the median and the largest of the finite numbers."""

    def spread(score: Score) -> metrics.Spread:
        numbers = read(score)
        return metrics.spread(numbers[np.isfinite(numbers)])

    return _parts(title, unit, spread, median=", median", largest=", largest")


def _outcome(name: str, folded: bool = False) -> Column:
    """Return the column of the number of targets with an outcome."""
    return Column(name, read=lambda score: score.outcomes[name], folded=folded)


def _list_by_seed(numbers: Sequence[float]) -> str | None:
    """Return the numbers of several seeds, in the order of the seeds; None of a single seed."""
    return ", ".join(map(words, numbers)) if len(numbers) > 1 else None


def _mark(score: Score) -> str:
    """Return why a solver is not ranked, where it is first, and its first error."""
    return "; ".join(filter(None, (score.limits, score.leads, score.trouble)))


def _reached(name: str) -> Callable[[Score], Floats]:
    """Return what reads an array of the solved targets."""
    return lambda score: score.attempted(name)[score.attempted("solved")]


_SOLVER = (
    text("robots", lambda score: score.robots),
    text("starts", lambda score: score.start),
    text("solver", lambda score: score.solver),
)
_GROUP = text("group", lambda score: score.group)
_SOLVED = Column(
    "solved", note=INTERVAL, best="greatest", read=lambda s: s.share if s.is_finished else None
)
_FALSE = Column("false successes", read=lambda s: s.false_successes.hits if s.claims else None)
_DISPUTED = Column("disputed answers", read=lambda score: score.disputed)
_TOTAL = Column("targets", read=lambda score: score.total)
_BY_SEED = (
    text("solved, by seed", lambda s: _list_by_seed([100.0 * x for x in s.shares_by_seed])),
    text(f"{MEAN}, by seed", lambda s: _list_by_seed([1e6 * x for x in s.mean_times_by_seed])),
)
_MEDIAN, *_MEDIAN_BOUNDS = _of_interval(
    "time, median", read=lambda score: metrics.median_interval(score.seconds)
)
_TAIL = (
    Column("time, 95 %", "µs", read=lambda score: number(metrics.spread(score.seconds).p95)),
    Column("time, mean", "µs", read=lambda score: number(metrics.mean(score.seconds))),
)


def _leads(score: Score) -> dict[str, bool]:
    """Return whether a solver is first, or ties with the first, by the titles of columns."""
    rankings = {
        "solved": score.success, MEAN: score.time, RELATIVE: score.time, BESIDE_OURS: score.paired,
    }  # fmt: skip
    return {
        title: len(ranking.order) > 1 and score.solver in ranking.first
        for title, ranking in rankings.items()
        if score.success.order
    }


def _layout(
    name: str, subjects: Callable[[Results], Iterable[Score]], columns: Any, **fields: Any
) -> Layout:
    """Return a table of scores; solvers with the same robots and starts are compared."""
    return CAPTIONS.layout(
        name,
        subjects,
        columns=columns,
        measured=lambda rows: {"steadiness": scores.drift(rows)},
        compared=2,
        ranked=lambda score: score.is_ranked,
        leads=_leads,
        **fields,
    )


# Targets within reach.


def _fields(rows: Sequence[Score]) -> dict[tuple[str, str], list[Score]]:
    return grouped(rows, lambda score: (score.robots, score.start))


def _points(rows: Sequence[Score]) -> Iterator[str]:
    """Yield who solves most targets, and who is fastest, on each robot and with each start."""
    for (robots, start), field in _fields(rows).items():
        solvers = {score.solver: score for score in field}
        success, time = field[0].success, field[0].time
        if success.order:
            solved = words(solvers[success.order[0]].share)
            speed = f"; shortest time {_time(time, solvers)}" if time.order else ""
            yield f"{robots}, {start}: {leaders(success)}, {solved}{speed}"


def _time(time: metrics.Ranking, solvers: Mapping[str, Score]) -> str:
    """Return the fastest solvers, and the mean time of the first with its interval."""
    fastest = solvers[time.order[0]]
    mean, low, high = (words_in(seconds, "µs") for seconds in fastest.mean_time)
    low, high = (bound.removesuffix(" µs") for bound in (low, high))
    return f"{leaders(time)}, {mean} ({low}–{high}, n = {words(len(fastest.seconds))})"


def _summary(rows: Sequence[Score]) -> Summary:
    """Return who is first most often with each start; nobody is where solvers tie."""
    fields = [field[0] for field in _fields(rows).values()]
    rankings = ([(s.start, s.success) for s in fields], [(s.start, s.time) for s in fields])
    solved, fastest = (
        first_of_kinds(((start, only_first(r)) for start, r in pairs if r.order), "comparison")
        for pairs in rankings
    )
    sentence = f"Ties aside, most targets are solved by {solved}; the fastest is {fastest}."
    return listing(sentence, _points(rows))


_MEAN, *_MEAN_BOUNDS = _of_interval(MEAN, read=lambda score: score.mean_time)
over_all = _layout(
    "robots_overall",
    scores.overall,
    (
        *(*_SOLVER, _SOLVED, _FALSE, replace(_MEAN, best="least")),
        text("mark", _mark),
        *folded(*_MEAN_BOUNDS, *_BY_SEED),
        *folded(*map(_outcome, OUTCOMES[1:]), _DISPUTED, _GROUP),
    ),
    summary=_summary,
)
robot_by_robot = _layout(
    "robots_by_robot",
    scores.scores,
    (
        *(*_SOLVER, _SOLVED, _FALSE, _MEDIAN),
        Column(RELATIVE, best="least", read=lambda score: number(score.relative_time)),
        Column(BESIDE_OURS, best="least", read=lambda score: number(score.ratio_to_ours)),
        *(text("mark", _mark), _GROUP),
        *folded(*_MEDIAN_BOUNDS, *_TAIL, _MEAN, *_MEAN_BOUNDS),
        *folded(*_of_spread("position residual", "m", _reached("position"))),
        *folded(*_of_spread("rotation residual", "rad", _reached("rotation"))),
        *folded(Column("set-up", "ms", read=lambda score: score.records[0].values.setup)),
    ),
    summary=_summary,
    figures=FIGURES,
)


# Outcomes.


def _stratum(stratum: int, *scores: Score) -> metrics.Share:
    """Return how many targets of a stratum some solvers solve."""
    return metrics.share(np.concatenate([s.solved_in_stratum(stratum) for s in scores]))


def _outcome_columns(rows: Sequence[Score]) -> list[Column]:
    """Return the columns of outcomes, folded if all zero, and of strata."""
    strata = rows[0].records[0].values.strata if rows else ()
    return [
        *_SOLVER,
        *(_outcome(name, not any(score.outcomes[name] for score in rows)) for name in OUTCOMES),
        *(_TOTAL, _DISPUTED),
        *(Column(f"solved, {name}", note=INTERVAL, best="greatest", folded=True,
                 read=partial(_stratum, i)) for i, name in enumerate(strata)),
    ]  # fmt: skip


def _outcome_summary(rows: Sequence[Score]) -> Summary:
    """Return the outcomes of unsolved targets, and the hardest strata."""
    points = []
    for solver, group in grouped(rows, lambda score: score.solver).items():
        counts: Counter[str] = sum((score.outcomes for score in group), Counter())
        failures = [f"{words(counts[name])} {name}" for name in OUTCOMES[1:] if counts[name]]
        if failures:
            points.append(f"{solver}: {listed(failures)}, of {words(counts.total())}")
    for start, group in grouped(rows, lambda score: score.start).items():
        ranked = [score for score in group if score.is_ranked]
        names = ranked[0].records[0].values.strata if ranked else []
        shares = {name: _stratum(i, *ranked) for i, name in enumerate(names)}
        hardest = sorted(shares, key=lambda name: metrics.ratio(*shares[name][:2]))
        strata = [f"{name} {words(shares[name])}" for name in hardest if shares[name].total]
        if strata:
            points.append(f"{start}, strata from the hardest: {', '.join(strata)}")
    counts = sum((score.outcomes for score in rows), Counter())
    unsolved = Counter({name: counts[name] for name in OUTCOMES[1:]})
    name, count = unsolved.most_common(1)[0]
    sentence = f"{words(count)} of {words(unsolved.total())} unsolved targets count as “{name}”."
    return listing(sentence, points)


outcomes = _layout("robots_outcomes", scores.scores, _outcome_columns, summary=_outcome_summary)


# Targets out of reach.


def _above_bound(score: Score) -> Floats:
    """Return the distances above the lower bound [m], (attempted target,)."""
    bounds = [record.measured.get("bound", np.nan) for record in score.records]
    return score.distances - np.hstack(bounds)


def _unreachable_summary(rows: Sequence[Score]) -> Summary:
    points = [
        f"{score.robots}, {score.solver}: {words(score.false_successes)}"
        for score in rows
        if score.false_successes.hits
    ]
    if points:
        return listing("Reported as solved, but out of reach:", points)
    count = sum(score.claims for score in rows)
    silent = list(dict.fromkeys(score.solver for score in rows if not score.claims))
    without_claims = (
        f" These solvers do not report success or failure: {listed(silent)}." if silent else ""
    )
    sentence = "No solver reports a target out of reach as solved"
    return Summary(f"{sentence} (n = {words(count)}).{without_claims}")


def _within_limits(score: Score) -> int:
    return int(np.isfinite(score.distances).sum())


_ABOVE_BEST, _LARGEST_ABOVE_BEST = _of_spread(
    "distance above best", "m", lambda score: score.distances - score.best_distances
)
_TO_BOUND, _ = _of_spread("distance above lower bound", "m", _above_bound)
unreachable = _layout(
    "robots_unreachable",
    scores.out_of_reach,
    (
        *(*_SOLVER, _FALSE, replace(_ABOVE_BEST, best="least"), _MEDIAN),
        text("mark", lambda score: "; ".join(filter(None, (score.limits, score.trouble)))),
        *folded(_LARGEST_ABOVE_BEST, _TO_BOUND),
        *folded(*_of_spread("distance to target", "m", lambda s: s.attempted("position"))),
        *folded(_TOTAL, Column("answers within limits", read=_within_limits)),
        *folded(*map(_outcome, OUTCOMES[-3:]), *_TAIL, _GROUP),
    ),
    summary=_unreachable_summary,
)

LAYOUTS = (participants, over_all, robot_by_robot, outcomes, unreachable, user_solver_table)
