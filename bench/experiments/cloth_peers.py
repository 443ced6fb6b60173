"""The same cloth for every solver: steps to a minimiser, motions to the truth, stability.

Each solver runs in a worker process. Its step is compared with the nearest minimiser to 25 digits,
its motion with the true motion. Every sweep runs every solver with all of its settings, so only the
times depend on the machine. Solvers with different sweeps are seen. Solvers that minimise the
objective of an implicit step stand in both tables, all others only in the table of motions.
"""

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import MassSpring, State, scenes
from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import SystemArrays

from ..clock import compute_time_of, time_call
from ..measure import metrics
from ..measure.block import Block, Measured, Scale
from ..measure.isolation import JobOutcome, Message, Ready, Solved, WorkerProcess
from ..measure.measure import not_installed
from ..measure.timing import messages_of
from ..measure.values import Booleans1, Fact, Floats1, Integers1, Values
from ..peers import catalogue
from ..peers.peer import EXPLICIT, ITERATED, LINEARISED, UNDECLARED, Peer
from ..peers.protocol import Mover, OwnTime
from ..problems import published
from ..problems.cloth_truth import ClothTruth, rms_distance, truth_of
from ..problems.falling_cloth import (
    FALLING,
    FRAME,
    GRAVITY,
    MASS,
    SIDE,
    STIFFNESSES,
    FallingCloth,
    explicit_substeps,
    falling_cloth,
    hanging_cloth,
    highest_mode,
    own_cloth,
)
from ..problems.own import OwnProblem
from ..problems.step_minima import above_lowest, minima_of

# The tasks of its records.
ONE_STEP, MOTION = "work of a step", "work of a motion"
STABILITY, LIU, MISSING = "stability", "Liu 2013", "missing"
# Errors of a step to which time is measured. A minimiser rounded to single precision is 1e-5 off,
# so engines in single precision can reach the last, the error of a solved step.
TARGETS = {"1e-2": 1e-2, "1e-4": 1e-4}
SOLVED = "1e-4"
# Errors of a motion, relative to the distance moved, to which time is measured.
MOTION_TARGETS = {"10 %": 0.1, "1 %": 0.01}
NEAR = "1 %"
# Engines that compute in single precision, all others in double.
SINGLE_PRECISION = (catalogue.NEWTON,)
# Errors to which iterations are counted.
DECADES = tuple(f"1e-{power}" for power in range(1, 9))


# The records.


class Work(Values, frozen=True, kw_only=True):
    """A step or a motion at increasing cost, (rung,), and how sure its arbiter is, (size,).

    A sweep measures every rung once.
    """

    stiffness: Fact[float]  # of the springs [N/m]
    cloth: Fact[str] = ""  # the name of a user's cloth
    rungs: Fact[tuple[str, ...]] = ()  # the settings, (rung,)
    remarks: Fact[tuple[str, ...]] = ()  # on each setting, (rung,)
    kind: Fact[str] = ""  # how the solver's settings differ, see `Run`
    sweep: Fact[int] = 1  # the pass over all solvers in which it was measured
    particles: Integers1  # along a side
    seconds: Floats1  # for a frame
    setup: Floats1  # time to set the solver up [s]
    # |x - x*| / |y - x*| of a step; of a motion, distance from the truth over distance moved
    error: Floats1
    above: Floats1 | None = None  # excess of g of a step, see `StepMinima.measure`
    minimum: Floats1 | None = None  # the same of x*
    proven: Booleans1 | None = None  # whether x* is proven to be a minimiser
    rounding: Floats1 | None = None  # the error of x* rounded to single precision
    order: Floats1 | None = None  # observed, of the true motion
    frames: Integers1 | None = None  # of the motion; a step is one
    unsure: Floats1 | None = None  # share of the distance by which halved steps move the truth


class StabilityLimits(Values, frozen=True):
    """The longest stable step [s] and the highest frequency [rad/s] by stiffness [N/m]."""

    stiffness: Floats1
    limit: Floats1
    frequency: Floats1


class LiuFrame(Values, frozen=True):
    """The cloth of Liu et al. (2013): times of a frame [s], the final error, and its particles."""

    seconds: Floats1
    error: float
    vertices: int


KINDS = {
    ONE_STEP: Work,
    MOTION: Work,
    STABILITY: StabilityLimits,
    LIU: LiuFrame,
    MISSING: Values,
}


# What is measured.

# Before the timing, each solver moves a small cloth once to compile everything, in a frame [s] in
# which any solver is stable.
_SMALL, _SHORT = 3, 1e-4
_compiled: set[tuple[str, ...]] = set()
UNKNOWN = -1  # the claim of a solver without claims


class Shape(NamedTuple):
    """The length and repetitions of a motion."""

    frames: int
    repeats: int  # number of motions, each from the start
    frame: float = FRAME  # its length [s]


class ClothJob(NamedTuple):
    """A cloth to be moved, and its solver."""

    module: str  # of the adapter, by its full name
    system: SystemArrays
    start: State
    settings: Mapping[str, Any]  # of the adapter
    shape: Shape
    user_solver: str = ""  # the name of a user's solver, whose first error is announced

    def perform(self) -> Iterator[Message]:
        """Yield the positions and the time of each frame as soon as computed."""
        return messages_of(self)

    def set_up(self, adapter: Any) -> tuple[Mover, Ready]:
        """Return the solver for the cloth, and how long its set-up took."""
        code = (
            self.module,
            self.user_solver,
            *(v for v in self.settings.values() if isinstance(v, str)),
        )
        if code not in _compiled:
            small, state = scenes.grid_cloth(_SMALL, _SMALL)
            trial = adapter.prepare(small, _SHORT, **self.settings)
            trial.begin(state)
            trial.advance()
            _compiled.add(code)
        system = MassSpring(**self.system._asdict())
        frame, settings = self.shape.frame, self.settings
        mover, setup = time_call(lambda: adapter.prepare(system, frame, **settings))
        return mover, Ready(setup)

    def answers(self, mover: Mover) -> Iterator[Solved]:
        """Move the cloth, again and again from its start, until it leaves the finite numbers."""
        nowhere = np.full_like(self.start.positions, np.nan)
        for _ in range(self.shape.repeats):
            mover.begin(self.start)
            for _ in range(self.shape.frames):
                frame = advanced(mover, nowhere)
                yield frame
                if not np.isfinite(frame.q).all():
                    return


def advanced(mover: Mover, nowhere: FloatArray) -> Solved:
    """Advance by a frame, of which nothing else is timed; `nowhere` if the solver overflows."""
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            own_time, seconds = compute_time_of(mover.advance)
    except FloatingPointError:
        return Solved(nowhere, UNKNOWN, OwnTime(np.nan))
    return Solved(mover.positions(), UNKNOWN, own_time or OwnTime(seconds))


# Explicit steps a frame, relative to symplectic Euler's limit of stability.
MARGINS = (1.1, 2.0, 4.0)
# Implicit steps a frame.
PARTS = (1, 4, 16)
# Residual of convergent solvers, in motions.
RESIDUAL, RESIDUAL_LABEL = 1e-6, "1e-6"
# Passes over all solvers at a full and at a quick scale: the drift of the machine affects all, as
# the order alternates. Repetitions of a step in each pass, of which the last counts.
SWEEPS, QUICK_SWEEPS, REPEATS, LIU_REPEATS = 3, 2, 2, 5
# A solver silent for this long [s] over a frame, or over its set-up, has not finished. No solver
# takes nearly as long on any machine in use.
_PATIENCE, _START_PATIENCE = 120.0, 600.0
# The remark on answers that are measured against positions not proven to be a minimiser.
UNPROVEN = "x* not proven"

# Particles a side of the cloth for the limit of stability.
STABILITY_SIZE = 6
# An unstable mode grows from this amplitude [m] by this factor in this number of steps.
AMPLITUDE, GROWTH, STABILITY_STEPS = 1e-5, 100.0, 400
# The relative accuracy of the limit. In 400 steps longer by 2e-4 the highest mode of symplectic
# Euler grows by 2e8, far above `GROWTH`; in steps shorter by as much, by 50.
BISECTION = 2e-4
# From a frame of 1/60 s down to 1e-11 s.
_DOUBLINGS = 30
# An undeclared solver stable at this multiple of symplectic Euler's limit is implicit. Other
# explicit methods have shorter limits; the limit of Runge-Kutta of order 4 is 1.41 times as long.
_IMPLICIT_MULTIPLE = 8.0


class Level(NamedTuple):
    """A size of the cloth: particles a side, and frames of a motion."""

    size: int
    frames: int


QUICK = (Level(20, 2),)
FULL = (Level(20, 10), Level(40, 5), Level(100, 1))
QUICK_STIFFNESS = STIFFNESSES[1:2]
# The shortest benchmarks of a full scale [s].
_FULL_SECONDS = 1.0


def levels(scale: Scale) -> tuple[Level, ...]:
    """Return the sizes of the cloth at a scale."""
    return FULL if scale.seconds >= _FULL_SECONDS else QUICK


class Fall(NamedTuple):
    """A falling cloth at a size."""

    level: Level
    make: Callable[[], FallingCloth]

    @property
    def truth(self) -> ClothTruth:
        """Its reference solutions."""
        return truth_of(self.make(), self.level.frames)


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield steps and motions of every solver, sweep by sweep, and limits of stability.

    Each missing package has a block. Larger cloths and the cloth of Liu et al. are for the full
    scale.
    """
    peers = catalogue.cloth_peers(scale.user_solvers)
    for package in dict.fromkeys(peer.package for peer in peers if not peer.is_installed):
        yield _block(MISSING, "all", package, partial(not_installed, package), {})
    installed = [peer for peer in peers if peer.is_installed]
    sweeps = SWEEPS if levels(scale) == FULL else QUICK_SWEEPS
    for sweep in range(1, sweeps + 1):
        order = installed[:: 1 if sweep % 2 else -1]
        for cloth in _cloths(scale):
            yield from (block for peer in order for block in _works(peer, cloth, sweep))
    for peer in installed:
        yield from _stability_blocks(peer, levels(scale))
    settings = {"size": published.LIU_2013_SIZE, "frame": published.LIU_2013_FRAME}
    for solver in published.LIU_2013 if levels(scale) == FULL else ():
        yield _block(LIU, "liu2013", solver, partial(liu_2013, solver), settings)


def _block(task: str, name: str, solver: str, measure: Any, settings: Any, **more: Any) -> Block:
    facts = {"task": task, **more.pop("facts", {})}
    return Block("cloth", f"peers/{name}", solver, measure, settings, facts=facts, **more)


class _Cloth(NamedTuple):
    """A falling cloth at all sizes of a scale."""

    name: str
    settings: Mapping[str, Any]
    falls: Sequence[Fall]
    own: OwnProblem | None = None


def _cloths(scale: Scale) -> Iterator[_Cloth]:
    """Yield the bench's cloths, then the user's."""
    sizes = levels(scale)
    for k in STIFFNESSES:
        falls = [Fall(level, partial(falling_cloth, level.size, k)) for level in sizes]
        yield _Cloth(f"k{k:g}", {"stiffness": k, "frame": FRAME}, falls)
    for own in scale.problems:
        if own.cloth is not None:
            system, _ = own.cloth
            settings = {"stiffness": float(system.stiffnesses.mean()), "frame": own.h}
            fall = Fall(sizes[0]._replace(size=system.particle_count), partial(own_cloth, own))
            yield _Cloth(own.name, settings, [fall], own)


def _works(peer: Peer, cloth: _Cloth, sweep: int) -> Iterator[Block]:
    """Yield the motion of a cloth, and its step unless the solver is explicit."""
    settings = {**cloth.settings, "version": peer.version, "sweep": sweep}
    size = sum(fall.level.size for fall in cloth.falls)
    names = {} if peer.run.kind == EXPLICIT else {ONE_STEP: "one step"}
    names[MOTION] = "motion"
    for task, name in names.items():
        measure = partial(work, task, peer, cloth.falls)
        facts = {"kind": peer.run.kind, **({"cloth": cloth.name} if cloth.own else {})}
        name, more = f"{name}/{cloth.name}", {"size": size, "facts": facts}
        block = _block(task, name, peer.title, measure, settings, **more).of(peer.user_solver)
        yield block.on(cloth.own) if cloth.own else block


def _stability_blocks(peer: Peer, sizes: tuple[Level, ...]) -> Iterator[Block]:
    """Yield the limit of stability of an explicit solver without iterations."""
    if peer.run.kind in (EXPLICIT, UNDECLARED) and not peer.run.settings.get("iterations"):
        stiffnesses = STIFFNESSES if sizes == FULL else QUICK_STIFFNESS
        measure, size = partial(stability, peer, stiffnesses), len(stiffnesses)
        version = {"size": STABILITY_SIZE, "version": peer.version}
        block = _block(STABILITY, "stability", peer.title, measure, version, size=size)
        yield block.of(peer.user_solver)


class Rung(NamedTuple):
    """A solver with settings, a point in a work-precision diagram, and their label."""

    label: str
    settings: Mapping[str, Any]


def step_rungs(peer: Peer, frequency: float) -> list[Rung]:
    """Return the rungs for a step of a frame, from cheap to expensive."""
    if peer.run.kind == ITERATED:
        return [_rung(peer, _counted(n, "iteration"), iterations=n) for n in peer.run.ladder]
    return [_rung(peer, "1 step", substeps=1)]


def motion_rungs(peer: Peer, frequency: float) -> list[Rung]:
    """Return the rungs for a motion: steps of part of a frame, which are nearer to the truth."""
    stable = [explicit_substeps(frequency, margin) for margin in MARGINS]
    substeps = {EXPLICIT: stable, LINEARISED: PARTS, UNDECLARED: sorted({*PARTS, *stable})}
    rungs = [_rung(peer, _counted(n, "step"), substeps=n) for n in substeps.get(peer.run.kind, ())]
    for n, iterations in peer.run.motion:
        name = f"{_counted(n, 'step')} of {_counted(iterations, 'iteration')}"
        rungs.append(_rung(peer, name, substeps=n, iterations=iterations))
    if peer.run.converges:
        for n in PARTS:
            name = f"{_counted(n, 'step')} to {RESIDUAL_LABEL}"
            rungs.append(_rung(peer, name, tolerance=RESIDUAL, substeps=n))
    return rungs


def _rung(peer: Peer, name: str, **settings: float) -> Rung:
    return Rung(name, {**peer.run.settings, **peer.spec, **settings})


def _counted(count: int, name: str) -> str:
    return f"{count:,} {name}{'' if count == 1 else 's'}"


# The notes on unfinished solvers, by their titles and the number of particles.
_unfinished: dict[tuple[str, int], str] = {}


def _performed(peer: Peer, cloth: FallingCloth, rung: Rung, shape: Shape) -> JobOutcome:
    """Return the outcome of a rung; an unfinished solver is not tried again."""
    task = peer.title, len(cloth.start.positions)
    if task in _unfinished:
        return JobOutcome(trouble=_unfinished[task])
    outcome = worker_process().perform(job(peer, cloth, rung.settings, shape))
    if outcome.is_silent:
        _unfinished[task] = f"not finished: {outcome.trouble}"
        return replace(outcome, trouble=_unfinished[task])
    return outcome


def work(task: str, peer: Peer, falls: Sequence[Fall]) -> Measured:
    """Take the same step, or move on for the same frames, at increasing cost.

    Keep the time for a frame and the error of the last, infinite if not reached.
    """
    rows, errors = [], []
    for fall in falls:
        cloth, (rungs, frames, repeats) = fall.make(), (step_rungs, 1, REPEATS)
        if task == MOTION:
            rungs, frames, repeats = motion_rungs, fall.level.frames, 1
        answers, nowhere = [], np.full((frames, *cloth.start.positions.shape), np.nan)
        for rung in rungs(peer, cloth.beat):
            outcome = _performed(peer, cloth, rung, Shape(frames, repeats, cloth.frame))
            last = outcome.solved[-frames:]
            positions = np.array([frame.q for frame in last])
            answers.append(positions.reshape(nowhere.shape) if len(last) == frames else nowhere)
            seconds = metrics.spread(np.array([frame.seconds for frame in last])).median
            cost = seconds, outcome.setup
            rows.append((fall.level.size, *cost, rung.label, outcome.note, outcome.trouble))
        errors.append(_errors(task, answers, fall))
    particles, times, setups, labels, notes, troubles = map(list, zip(*rows, strict=True))
    measured = {name: np.concatenate([level[name] for level in errors]) for name in errors[0]}
    proven = measured.get("proven", True)
    flaws = np.where(np.isinf(measured["error"]), "diverged", np.where(proven, "", UNPROVEN))
    return {
        **measured,
        "particles": np.array(particles),
        "seconds": np.array(times),
        "setup": np.array(setups),
        **_certainty(falls),
        "frames": np.array([fall.level.frames if task == MOTION else 1 for fall in falls]),
        "rungs": labels,
        "remarks": [note or str(flaw) for note, flaw in zip(notes, flaws, strict=True)],
        "trouble": next(filter(None, troubles), ""),
    }


def _errors(task: str, answers: Sequence[FloatArray], fall: Fall) -> dict[str, FloatArray]:
    """Return the errors of all settings, whose answers are positions frame by frame."""
    if task == MOTION:
        extent = fall.make().extent
        return {"error": np.array([motion_error(x, fall.truth, extent) for x in answers])}
    return fall.truth.first.measure([x[-1] for x in answers])


def _certainty(falls: Sequence[Fall]) -> dict[str, np.ndarray]:
    """Return how sure the arbiters are at each size.

    The rounding is the error of Newton's minimum in single precision.
    """
    truths = [fall.truth for fall in falls]
    return {
        "rounding": np.array([truth.first.rounding for truth in truths]),
        "order": np.array([truth.order for truth in truths]),
        "unsure": np.array([truth.unsure for truth in truths]),
    }


def motion_error(positions: np.ndarray, truth: ClothTruth, extent: float = SIDE) -> float:
    """Return the final distance from the truth over the distance moved; inf after divergence.

    A motion diverged if a particle is ever farther from its true position than the cloth is wide.
    The result is at least the uncertainty of the truth.
    """
    is_near = np.abs(positions - truth.true) <= extent
    if not is_near.all():
        return np.inf
    return max(rms_distance(positions[-1], truth.true[-1]) / truth.path, truth.unsure)


def stability(peer: Peer, stiffnesses: tuple[float, ...]) -> Measured:
    """Find the longest stable step of an explicit solver, on hanging cloths."""
    limits, frequencies, remarks = [], [], []
    for stiffness in stiffnesses:
        system, rest = hanging_cloth(STABILITY_SIZE, stiffness)
        largest, mode = highest_mode(system, rest)
        frequencies.append(np.sqrt(largest))
        start = State(rest + AMPLITUDE * mode, np.zeros_like(rest))
        stable = partial(is_stable, peer, system, start, rest)
        implicit_step = _IMPLICIT_MULTIPLE * 2.0 / np.sqrt(largest)
        try:
            if peer.run.kind == UNDECLARED and stable(implicit_step):
                raise ArithmeticError(f"stable at {implicit_step:.2g} s, as implicit steps are")
            limits.append(stability_limit(stable, FRAME))
        except ArithmeticError as error:
            limits.append(np.nan)
            remarks.append(str(error))
    return {
        "stiffness": np.array(stiffnesses),
        "limit": np.array(limits),
        "frequency": np.array(frequencies),
        "remark": "; ".join(remarks),
    }


def is_stable(peer: Peer, system: MassSpring, start: State, rest: np.ndarray, h: float) -> bool:
    """Return whether the particles stay near their rest for many steps of length h.

    Raises:
        ArithmeticError: if the solver fails.
    """
    settings = {**peer.run.settings, **peer.spec, "substeps": STABILITY_STEPS}
    shape = Shape(1, 1, h * STABILITY_STEPS)
    arrays, user_solver = system.arrays, peer.user_solver_name
    job = ClothJob(peer.module, arrays, start, settings, shape, user_solver)
    outcome = worker_process().perform(job)
    if not outcome.solved:
        raise ArithmeticError(outcome.trouble)
    offsets = np.abs(outcome.solved[-1].q - rest)
    return bool(np.isfinite(offsets).all() and offsets.max() <= GROWTH * AMPLITUDE)


def stability_limit(stable: Callable[[float], bool], h: float) -> float:
    """Return the longest stable step, by doubling, halving and bisection from a first guess h.

    Raises:
        ArithmeticError: if no step is stable, or every step.
    """
    low, high = (h, 2.0 * h) if stable(h) else (h / 2.0, h)
    for _ in range(_DOUBLINGS):
        if not stable(low):
            low, high = low / 2.0, low
        elif stable(high):
            low, high = high, 2.0 * high
        else:
            break
    else:
        raise ArithmeticError(f"no limit of stability between {low:g} and {high:g} s")
    while high - low > BISECTION * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return 0.5 * (low + high)


def liu_2013(solver: str) -> Measured:
    """Take steps of a cloth of the paper's size, by the paper's ten iterations or by Newton."""
    cloth = falling_cloth(published.LIU_2013_SIZE, published.LIU_2013_STIFFNESS)
    frame = published.LIU_2013_FRAME
    settings = {"solver": solver, **published.LIU_2013[solver].settings}
    shape, peer = Shape(1, LIU_REPEATS, frame), catalogue.cloth_peers()[0]
    outcome = worker_process().perform(job(peer, cloth, settings, shape))
    if not outcome.solved:
        raise ArithmeticError(outcome.trouble)
    seconds = np.array([step.seconds for step in outcome.solved])
    minima = minima_of(cloth.system, cloth.start, frame)
    end = outcome.solved[-1].q.reshape(cloth.start.positions.shape)
    (error,) = minima.measure([end])["error"]
    return {"seconds": seconds, "error": error, "vertices": cloth.system.particle_count}


def job(peer: Peer, cloth: FallingCloth, settings: Mapping[str, Any], shape: Shape) -> ClothJob:
    """Return the job of moving a cloth from its start."""
    system = cloth.system.arrays
    return ClothJob(peer.module, system, cloth.start, settings, shape, peer.user_solver_name)


@functools.cache
def worker_process() -> WorkerProcess:
    """Return the process in which all solvers work in turn."""
    return WorkerProcess(_START_PATIENCE, _PATIENCE)


# What is shown.

from ..figures.chart import Panel, Series, declared_chart, series
from ..figures.sketch import Sketch
from ..measure.record import Record
from ..tables.captions import Captions
from ..tables.columns import folded, number, text, words_in
from ..tables.results import Results, counted, grouped, label, listed, most_often
from ..tables.table import NO_SUMMARY, Cell, Column, Summary, words

CAPTIONS = Captions(
    __file__,
    side=f"{SIDE:g}",
    mass=f"{MASS:g}",
    gravity=f"{GRAVITY:g}",
    fall=f"{FALLING * FRAME:g}",
    frame=words_in(FRAME, "ms"),
    solved=SOLVED,
    near=NEAR,
    stability_size=str(STABILITY_SIZE),
    amplitude=words(AMPLITUDE),
    growth=f"{GROWTH:g}",
    stability_steps=str(STABILITY_STEPS),
    bisection=words(BISECTION),
    liu_stiffness=words(int(published.LIU_2013_STIFFNESS)),
    liu_frame=words_in(published.LIU_2013_FRAME, "ms"),
    liu_tolerance=words(published.LIU_2013["newton"].settings["tolerance"]),
)
# Larger errors belong to diverged motions, and are not drawn.
MAX_ERROR = 10.0


class Point(NamedTuple):
    """A solver with a setting on a cloth, by all sweeps: the errors of the first, median times."""

    record: Record  # of the first sweep
    particles: int  # along each side
    setting: str  # by its name
    remark: str  # on this setting, else ""
    error: float  # of a step or a motion; infinite if not reached
    seconds: float  # for a frame
    above: float = np.nan  # excess of g of a step, see `StepMinima.measure`
    minimum: float = 0.0  # the same of x*
    spread: float = 0.0  # largest difference between the errors of two sweeps
    drift: float = 1.0  # the longest of the sweeps' times over the shortest
    sweeps: int = 1

    @property
    def solver(self) -> str:
        """Its solver as records call it."""
        return self.record.solver

    @property
    def own(self) -> str:
        """The name of a user's cloth, "" of ours."""
        return str(self.record.values.cloth)

    @property
    def is_whole(self) -> bool:
        """Whether the setting reached the end."""
        return bool(np.isfinite(self.error))

    @property
    def stiffness(self) -> float:
        """The stiffness of the springs [N/m]."""
        return float(self.record.values.stiffness)

    @property
    def cloth(self) -> str:
        """The name of its cloth in tables."""
        return self.own or f"{self.particles} × {self.particles}, {words(int(self.stiffness))} N/m"


def points(results: Results, task: str) -> list[Point]:
    """Return all points of a task, cloth by cloth: stiffness first, then particles."""
    return results.cached(_points, task)


def _points(results: Results, task: str) -> list[Point]:
    records = [record for record in results.all("cloth", task=task) if record.has_numbers]
    sweeps = grouped(records, lambda record: (record.problem, record.solver))
    every = [point for group in sweeps.values() for point in _points_of(group)]
    return sorted(every, key=lambda point: (point.own, point.stiffness, point.particles))


def _points_of(sweeps: Sequence[Record]) -> Iterator[Point]:
    """Yield the points of a solver on a cloth, by all sweeps."""
    first, *_ = sweeps = sorted(sweeps, key=lambda record: record.values.sweep)
    rungs = [list(zip(r.values.particles.tolist(), r.values.rungs, strict=True)) for r in sweeps]
    for i, rung in enumerate(rungs[0]):
        same = [(r.values, names.index(rung)) for r, names in zip(sweeps, rungs, strict=True)
                if rung in names]  # fmt: skip
        seconds = np.array([values.seconds[k] for values, k in same])
        errors = np.array([values.error[k] for values, k in same])
        spread = float(np.ptp(errors)) if np.isfinite(errors).all() else 0.0
        drift = float(seconds.max() / seconds.min()) if seconds.min() > 0.0 else 1.0
        remark = "".join(first.values.remarks[i : i + 1])
        error, median = float(first.values.error[i]), float(np.median(seconds))
        above, minimum = first.values.above, first.values.minimum
        g = (np.nan, 0.0) if above is None else (float(above[i]), float(minimum[i]))
        yield Point(first, *rung, remark, error, median, *g, spread, drift, len(same))


def motion_length(results: Results) -> str:
    """Return the motions in words: "a motion of 2 or 5 frames", "a motion" if unknown."""
    recorded = [r.values.frames for r in results.all("cloth", task=MOTION)]
    frames = sorted({int(count) for counts in recorded if counts is not None for count in counts})
    return f"a motion of {listed([*map(words, frames)], 'or')} frames" if frames else "a motion"


def work_precision(name: str, task: str, results: Results) -> Sketch | None:
    """Show an error against the time for a frame: a curve for each solver.

    Each stiffness has a column, each size a row.
    """
    visible = [p for p in points(results, task) if p.seconds > 0 and 0 < p.error < MAX_ERROR]
    cloths = [point for point in visible if not point.own]
    stiffnesses = sorted({point.stiffness for point in cloths})
    panels = [
        Panel(
            f"{size} × {size}, {stiffness:,.0f} N/m",
            _curves([p for p in cloths if (p.particles, p.stiffness) == (size, stiffness)]),
        )
        for size in sorted({point.particles for point in cloths})
        for stiffness in stiffnesses
    ]
    own = grouped((point for point in visible if point.own), lambda point: point.own)
    panels += [Panel(cloth, _curves(group)) for cloth, group in own.items()]
    columns = len(stiffnesses) or len(panels)
    return declared_chart(CAPTIONS.figure(name), panels, results.user_solvers, columns=columns)


step_chart = partial(work_precision, "work_precision_step", ONE_STEP)
truth_chart = partial(work_precision, "work_precision_truth", MOTION)


def _curves(visible: Sequence[Point]) -> tuple[Series, ...]:
    return tuple(
        series(solver, [1e3 * p.seconds for p in group], [p.error for p in group])
        for solver, group in grouped(visible, lambda point: point.solver).items()
    )


class StabilityLimit(NamedTuple):
    """The longest stable step of a solver and of symplectic Euler [s]; NaN if unknown."""

    step: float
    theory: float
    record: Record


class ClothRow(NamedTuple):
    """A solver on a cloth with all of its settings; without points, an engine that is missing."""

    cloth: str
    solver: str
    points: tuple[Point, ...] = ()
    limit: StabilityLimit | None = None
    minima: tuple[float, ...] = ()  # of the cloth, near to which any solver ends
    missing: str = ""  # why

    @property
    def best(self) -> Point | None:
        """The setting with the smallest error."""
        return min(self.points, key=lambda point: point.error, default=None)

    @property
    def error(self) -> Cell:
        """The smallest error."""
        return self.best and (self.best.error if self.best.is_whole else "diverged")

    def cheapest(self, error: float) -> Point | None:
        """Return the cheapest setting with so small an error, None without any."""
        near = [point for point in self.points if point.error <= error]
        return min(near, key=lambda point: point.seconds, default=None)

    @property
    def remark(self) -> str:
        """The remarks on the solver, each with its settings."""
        return "; ".join(_remarks(self)) if self.points else self.missing


def _remarks(row: ClothRow) -> Iterator[str]:
    if row.points[0].record.values.kind == LINEARISED and len(row.points) == 1:
        yield "one linearised step"
    if row.best and (height := above_lowest(row.best.minimum, row.minima)):
        yield f"near a minimum that is not the lowest: g is {words(height)} above"
    for remark, group in grouped(row.points, lambda point: point.remark).items():
        if remark:
            rungs = f"{listed([point.setting for point in group])}: "
            yield (rungs if len(group) < len(row.points) else "") + remark
    if row.limit and row.limit.record.remark:
        yield row.limit.record.remark


def _rows(
    task: str, limits: Mapping[tuple[str, float], StabilityLimit], results: Results
) -> Iterator[ClothRow]:
    """Yield a row for each solver on each cloth, and for each missing engine."""
    settings = grouped(points(results, task), lambda point: (point.cloth, point.solver))
    cloths = grouped(points(results, task), lambda point: point.cloth)
    for (cloth, solver), group in settings.items():
        limit = None if group[0].own else limits.get((solver, group[0].stiffness))
        minima = tuple(point.minimum for point in cloths[cloth])
        yield ClothRow(cloth, solver, tuple(group), limit, minima)
    for record in results.all("cloth", task=MISSING):
        yield ClothRow("every cloth", record.solver, missing=record.remark)


def _of_cheapest(error: float, name: str, row: ClothRow) -> Cell:
    """Return an attribute of the cheapest setting with so small an error, None without any."""
    cheapest = row.cheapest(error)
    return cheapest and getattr(cheapest, name)


def _above(row: ClothRow) -> Cell:
    """Return g of the setting with the smallest error above the lowest minimum."""
    return row.best and number(above_lowest(row.best.above, row.minima))


def _largest(name: str, row: ClothRow) -> float | None:
    """Return the largest value of an attribute among the points of a row; None without points."""
    return max((getattr(point, name) for point in row.points), default=None)


def _columns(targets: Mapping[str, float], unit: str, *further: Column) -> list[Column]:
    """Return the columns of a task: first the time to the last target, which ranks."""
    *times, first = (
        Column(
            f"time to {target}", "ms", best="least", read=partial(_of_cheapest, error, "seconds")
        )
        for target, error in targets.items()
    )
    return [
        text("cloth", lambda row: row.cloth),
        text("solver", lambda row: row.solver),
        *(first, Column("smallest error", unit, best="least", read=lambda row: row.error)),
        *(*times, *further[:1], text("remark", lambda row: row.remark)),
        *folded(
            *(
                text(f"setting for {target}", partial(_of_cheapest, error, "setting"))
                for target, error in targets.items()
            )
        ),
        *folded(text("setting for the smallest error", lambda row: row.best and row.best.setting)),
        *folded(Column("slowest over fastest sweep", read=partial(_largest, "drift"))),
        *folded(Column("difference between sweeps", read=partial(_largest, "spread"))),
        *folded(*further[1:]),
    ]


def _measured_rows(rows: Sequence[ClothRow]) -> list[ClothRow]:
    return [row for row in rows if row.points]


def _extent_of(name: str, rows: Sequence[ClothRow]) -> list[str]:
    """Return the least and the greatest number of an array of the records, "–" without records."""
    arrays = [getattr(row.points[0].record.values, name) for row in _measured_rows(rows)]
    return [words(end) for end in metrics.extent(np.concatenate(arrays))] if arrays else ["–"] * 2


def _rounding(rows: Sequence[ClothRow]) -> dict[str, str]:
    """Return the range of the errors of minimisers rounded to single precision."""
    ends = dict.fromkeys(_extent_of("rounding", rows))
    return {"rounding": " to ".join(ends), "agreement": _agreement(rows)}


def _agreement(rows: Sequence[ClothRow]) -> str:
    """Return a sentence on the drift of times, and on solvers whose sweeps gave other errors."""
    if not _measured_rows(rows):
        return "–"
    points = [point for row in rows for point in row.points]
    differing = listed(list({point.solver: 0 for point in points if point.spread > 0.0}))
    drift = words(max([1.0, *(point.drift for point in points)]))
    errors = f"equal to the bit but for {differing}" if differing else "the same bits"
    sweeps = max([1, *(point.sweeps for point in points)])
    sentence = f"The times of {counted(sweeps, 'sweep')} differ by a factor of at most {drift}"
    return f"{sentence}; the errors are {errors}."


def _summary(title: str, targets: Mapping[str, float], rows: Sequence[ClothRow]) -> Summary:
    """Return who is the fastest to the last target, and to each on each cloth."""
    cloths = grouped(_measured_rows(rows), lambda row: row.cloth)
    if not cloths:
        return NO_SUMMARY
    target = [*targets][-1]
    times = [_arrivals(cloths[cloth], targets[target]) for cloth in cloths]
    firsts = [_only_first(arrivals) for arrivals in times if arrivals]
    sentence = f"No solver reaches {target}, {title}."
    if firsts:
        sentence = f"The fastest to {target}, {title}, is {most_often(firsts, 'cloth')}."
    if several := [cloth for cloth, group in cloths.items() if len(set(group[0].minima)) > 1]:
        sentence += f" Solvers end near different minima on {listed(several)}."
    return Summary(sentence, tuple(
        f"{cloth}: {listed([f'to {t} {_fastest(group, targets[t])}' for t in targets])}"
        for cloth, group in cloths.items()
    ))  # fmt: skip


def _arrivals(rows: Sequence[ClothRow], error: float) -> list[Point]:
    """Return the cheapest setting of each solver with so small an error, the fastest first."""
    cheapest = (row.cheapest(error) for row in rows)
    return sorted((point for point in cheapest if point), key=lambda point: point.seconds)


def _only_first(arrivals: Sequence[Point]) -> str:
    """Return the fastest solver, "" if the time of another one is written alike."""
    first, *rivals = (words(point.seconds) for point in arrivals)
    return "" if first in rivals else arrivals[0].solver


def _fastest(rows: Sequence[ClothRow], error: float) -> str:
    """Return the fastest of all solvers, and the fastest of all other engines."""
    arrivals = _arrivals(rows, error)
    engines = [catalogue.find(point.solver).engine for point in arrivals]
    rivals = [p for p, engine in zip(arrivals, engines, strict=True) if engine != engines[0]]
    names = [f"{p.solver}, {words_in(p.seconds, 'ms')}" for p in (*arrivals[:1], *rivals[:1])]
    return " (then ".join(names) + ")" * (len(names) > 1) or "none"


one_step = CAPTIONS.layout(
    "cloth_peers_step",
    partial(_rows, ONE_STEP, {}),
    partial(_summary, "an error of one implicit step", TARGETS),
    columns=_columns(TARGETS, "", Column("g above lowest", read=_above)),
    measured=_rounding,
    figures=(step_chart,),
)


def _motion_rows(results: Results) -> Iterator[ClothRow]:
    limits = (limit for r in results.all("cloth", task=STABILITY) for limit in _limits(r))
    return _rows(MOTION, dict(limits), results)


def _limits(record: Record) -> Iterator[tuple[tuple[str, float], StabilityLimit]]:
    """Yield the limits of a solver, by solver and stiffness [N/m]."""
    values = record.values
    columns = np.transpose((values.stiffness, values.limit, 2.0 / values.frequency)).tolist()
    for stiffness, step, theory in columns:
        yield (record.solver, stiffness), StabilityLimit(step, theory, record)


def _certainty_of(rows: Sequence[ClothRow]) -> dict[str, str]:
    """Return the change of the true motions by halved steps, and the range of their order."""
    unsure = [float(row.points[0].record.values.unsure.max()) for row in _measured_rows(rows)]
    low, high = _extent_of("order", rows)
    largest = words_in(max(unsure), "%") if unsure else "–"
    return {"unsure": largest, "low": low, "high": high, "agreement": _agreement(rows)}


motion = CAPTIONS.layout(
    "cloth_peers_motion",
    _motion_rows,
    partial(_summary, "a distance from the true motion", MOTION_TARGETS),
    columns=_columns(
        MOTION_TARGETS,
        "%",
        Column(
            *("stability limit", "2/ω"),
            read=lambda row: row.limit and number(row.limit.step / row.limit.theory),
        ),
        Column("longest stable step", "ms", read=lambda row: row.limit and number(row.limit.step)),
        Column("2 / ω", "ms", read=lambda row: row.limit and row.limit.theory),
    ),
    measured=_certainty_of,
    figures=(truth_chart,),
)


def _liu_summary(records: Sequence[Record]) -> Summary:
    sentences, ratios = [], []
    for record in records:
        frame, seconds = published.LIU_2013[record.solver], _liu_time(record)
        sentences.append(
            f"{label(record.solver)}, {frame.work}: {words_in(seconds, 'ms')} with an error of "
            f"{words(record.values.error)}, published {words_in(frame.seconds, 'ms')}"
        )
        ratios.append(frame.seconds / seconds)
    low, high = map(words, metrics.extent(np.array(ratios)))
    sentence = f"On another machine, our times are {low} to {high} times shorter."
    return Summary(sentence, tuple(sentences))


def _liu_time(record: Record) -> float:
    return metrics.spread(record.values.seconds).median


liu = CAPTIONS.layout(
    "cloth_liu_2013",
    lambda results: [
        record for record in results.all("cloth", task=LIU) if record.solver in published.LIU_2013
    ],
    _liu_summary,
    columns=(
        text("solver", lambda record: label(record.solver)),
        text("setting for a frame", lambda record: published.LIU_2013[record.solver].work),
        Column("published time", "ms", read=lambda r: published.LIU_2013[r.solver].seconds),
        Column("our time", "ms", best="least", read=_liu_time),
        Column("our error", read=lambda record: record.values.error),
    ),
    measured=lambda records: {"vertices": words(records[0].values.vertices)},
    compared=0,
)

LAYOUTS = (one_step, motion, liu)
