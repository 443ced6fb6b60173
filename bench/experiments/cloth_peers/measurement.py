"""The same cloth for every installed solver: work and precision, limits of stability.

Each solver runs in a worker process. Its positions are compared with converged implicit Euler and
with the true motion.
"""

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import msgspec
import numpy as np

from plumbob.reference import ImplicitEuler, MassSpring, State

from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ...harness.isolation import JobOutcome, WorkerProcess
from ...harness.measure import not_installed
from ...harness.values import Values
from ...peers import registry
from ...peers.registry import EXPLICIT, LINEARISED, UNDECLARED, ClothPeer
from ...problems.falling_cloth import (
    FRAME,
    SIDE,
    STIFFNESSES,
    FallingCloth,
    explicit_substeps,
    falling_cloth,
    hanging_cloth,
    highest_mode,
    own_cloth,
)
from ..published import problem as published
from . import DECADES, LIU, MISSING, MOTION, NEEDED, ONE_STEP, STABILITY
from .job import ClothJob, Shape
from .truth import ClothTruth, implicit_motion, inertial_positions, truth_of
from .values import IterationCounts, LiuFrame, MotionWork, StabilityLimits, StepWork

# Explicit steps a frame, relative to symplectic Euler's limit of stability.
MARGINS = (1.1, 2.0, 4.0)
# Implicit steps a frame.
PARTS = (1, 4, 16)
# Residual of solvers that converge, in motions.
RESIDUAL, RESIDUAL_LABEL = 1e-6, "1e-6"
# Repetitions of one step, within a twentieth of the budget of a ladder.
REPEATS, _REPEATING = 5, 0.05
# A ladder ends with the first rung of this error.
NEAR_ENOUGH = 1e-9
# Time limits of a silent frame of a large cloth and of its set-up [s].
_PATIENCE, _START_PATIENCE = 60.0, 300.0

# Particles a side of the cloth on which iterations are counted.
NEEDED_SIZE = 20

# A mode is unstable if, from this amplitude [m], it grows by this factor in this number of steps.
STABILITY_SIZE, AMPLITUDE, GROWTH, STABILITY_STEPS = 6, 1e-5, 100.0, 400
BISECTION, _DOUBLINGS = 2e-4, 30
# An undeclared solver that is stable at this multiple of symplectic Euler's limit is implicit.
_IMPLICIT_MULTIPLE = 8.0

# The parts of a cloth's ladder that use its whole budget.
_LADDER_PARTS = 2.0


class Level(NamedTuple):
    """A size of the cloth: particles a side, frames of a motion, budget of a ladder [s]."""

    size: int
    frames: int
    budget: float


QUICK = (Level(20, 3, 0.2),)
FULL = (Level(20, 30, 2.0), Level(40, 10, 3.0), Level(100, 2, 30.0))
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
    """Yield a step, a motion and the limit of every solver, and a block for each missing package.

    Larger cloths and the cloth of Liu et al. are for the full scale.
    """
    peers = registry.cloth_peers(scale.entrants)
    for package in dict.fromkeys(peer.package for peer in peers if not peer.is_installed):
        yield _block(MISSING, "all", package, partial(not_installed, package), {})
    for stiffness in STIFFNESSES:
        settings = {"size": NEEDED_SIZE, "stiffness": stiffness, "frame": FRAME}
        for solver in registry.step_solvers():
            measure = partial(iterations_needed, solver, stiffness)
            yield _block(NEEDED, f"iterations/k{stiffness:g}", solver, measure, settings)
    for peer in (peer for peer in peers if peer.is_installed):
        yield from blocks_of(peer, scale)
    settings = {"size": published.LIU_2013_SIZE, "frame": published.LIU_2013_FRAME}
    for solver in published.LIU_2013 if levels(scale) == FULL else ():
        yield _block(LIU, "liu2013", solver, partial(liu_2013, solver), settings)


def _block(task: str, name: str, solver: str, measure: Any, settings: Any, **more: Any) -> Block:
    facts = {"task": task}
    return Block("cloth", f"peers/{name}", solver, measure, settings, facts=facts, **more)


def blocks_of(peer: ClothPeer, scale: Scale) -> Iterator[Block]:
    """Yield a step, a motion and, if it is explicit, the limit of a solver."""
    sizes = levels(scale)
    for k in STIFFNESSES:
        falls = [Fall(level, partial(falling_cloth, level.size, k)) for level in sizes]
        yield from _falling(peer, f"k{k:g}", {"stiffness": k, "frame": FRAME}, falls)
    for own in scale.problems:
        if own.cloth is not None:
            system, _ = own.cloth
            settings = {"stiffness": float(system.stiffnesses.mean()), "frame": own.h}
            fall = Fall(sizes[0]._replace(size=system.particle_count), partial(own_cloth, own))
            for block in _falling(peer, own.name, settings, [fall]):
                yield replace(block, facts={**block.facts, "cloth": own.name}).on(own)
    if peer.kind in (EXPLICIT, UNDECLARED) and not peer.settings.get("iterations"):
        stiffnesses = STIFFNESSES if sizes == FULL else QUICK_STIFFNESS
        measure, size = partial(stability, peer, stiffnesses), len(stiffnesses)
        version = {"size": STABILITY_SIZE, "version": peer.version}
        block = _block(STABILITY, "stability", peer.title, measure, version, size=size)
        yield block.of(peer.entrant)


def _falling(
    peer: ClothPeer, cloth: str, settings: Mapping[str, Any], falls: Sequence[Fall]
) -> Iterator[Block]:
    """Yield a step and a motion of a cloth at some sizes."""
    settings = {**settings, "version": peer.version}
    size, seconds = (sum(fall.level[i] for fall in falls) for i in (0, 2))
    for task, name, measure in ((ONE_STEP, "one step", one_step), (MOTION, "motion", motion)):
        work, budget = partial(measure, peer, falls), _LADDER_PARTS * seconds
        block = _block(
            task, f"{name}/{cloth}", peer.title, work, settings, size=size, budget=budget
        )
        yield block.of(peer.entrant)


class Rung(NamedTuple):
    """A solver with settings, a point in a work-precision diagram, and their label."""

    label: str
    settings: Mapping[str, Any]


def step_rungs(peer: ClothPeer, frequency: float) -> list[Rung]:
    """Return the rungs for a step of a frame, from cheap to expensive."""
    return _rungs(peer, frequency, peer.ladder, (1,))


def motion_rungs(peer: ClothPeer, frequency: float) -> list[Rung]:
    """Return the rungs for a motion; steps of part of a frame are nearer to the truth."""
    return _rungs(peer, frequency, peer.motion, PARTS)


def _rungs(
    peer: ClothPeer, frequency: float, iterations: tuple[int, ...], parts: tuple[int, ...]
) -> list[Rung]:
    stable = [explicit_substeps(frequency, margin) for margin in MARGINS]
    substeps = {EXPLICIT: stable, LINEARISED: parts, UNDECLARED: sorted({*parts, *stable})}
    if peer.kind in substeps:
        return [_rung(peer, _counted(n, "step"), substeps=n) for n in substeps[peer.kind]]
    rungs = [_rung(peer, _counted(n, "iteration"), iterations=n) for n in iterations]
    if peer.converges and len(parts) > 1:
        for n in parts:
            label = f"{_counted(n, 'step')} to {RESIDUAL_LABEL}"
            rungs.append(_rung(peer, label, tolerance=RESIDUAL, substeps=n))
    return rungs


def _rung(peer: ClothPeer, label: str, **settings: float) -> Rung:
    return Rung(label, {**peer.settings, **peer.spec, **settings})


def _counted(count: int, name: str) -> str:
    return f"{count:,} {name}{'' if count == 1 else 's'}"


# The notes on set-ups that ran out of time, by adapter, entrant and number of particles.
_given_up: dict[tuple[str, str, int], str] = {}


class RungResults:
    """The results of a solver: the numbers and label of each rung, and remarks."""

    def __init__(self, peer: ClothPeer) -> None:
        self.rows: list[dict[str, Any]] = []
        self._peer = peer
        self._remarks: list[tuple[int, str, bool]] = []  # particles, sentence, whether it failed

    def run(self, cloth: FallingCloth, rung: Rung, shape: Shape) -> JobOutcome:
        """Return the outcome of a rung; a set-up that ran out of time is not repeated."""
        task = self._peer.module, self._peer.entrant_name, len(cloth.start.positions)
        if task in _given_up:
            outcome = JobOutcome(0.0, [], _given_up[task])
        else:
            outcome = worker_process().perform(job(self._peer, cloth, rung.settings, shape))
        if outcome.is_silent and not outcome.is_lost:
            _given_up[task] = outcome.note
        if outcome.note:
            sentence = f"{cloth.size} × {cloth.size}, {rung.label}: {outcome.note}"
            self._remarks.append((cloth.size, sentence, bool(outcome.trouble)))
        return outcome

    def measured(self, kind: type[Values], **more: Any) -> Measured:
        """Return the rows as arrays, and their labels and remarks as facts."""
        names = {field.name for field in msgspec.structs.fields(kind)} - {"remark_particles", *more}
        arrays = {name: np.array([row[name] for row in self.rows]) for name in names}
        sizes, sentences = ([remark[i] for remark in self._remarks] for i in (0, 1))
        troubles = [sentence for _, sentence, failed in self._remarks if failed]
        trouble = next(iter(troubles), "")
        rungs = [row["rung"] for row in self.rows]
        facts = {"rungs": rungs, "remarks": sentences, "trouble": trouble}
        return Measured(kind(**arrays, remark_particles=np.array(sizes), **more), facts=facts)


def one_step(peer: ClothPeer, falls: Sequence[Fall]) -> Measured:
    """Take the same step at increasing cost; keep time and error.

    Stop when the budget is spent or the error is reached.
    """
    results = RungResults(peer)
    for fall in falls:
        level, cloth, truth, spent_seconds = fall.level, fall.make(), fall.truth, 0.0
        for rung in step_rungs(peer, cloth.beat):
            shape = Shape(1, REPEATS, _REPEATING * level.budget, cloth.frame)
            outcome = results.run(cloth, rung, shape)
            if not outcome.solved:
                break
            seconds = np.array([frame.seconds for frame in outcome.solved])
            error = step_error(outcome.solved[-1].q, truth)
            row = {"particles": level.size, "error": error, "rung": rung.label}
            results.rows.append({**row, "seconds": metrics.spread(seconds).median})
            spent_seconds += float(seconds.sum())
            if error <= NEAR_ENOUGH or spent_seconds > level.budget:
                break
    return results.measured(StepWork)


def motion(peer: ClothPeer, falls: Sequence[Fall]) -> Measured:
    """Move on frame after frame; keep the distances from implicit Euler and from the truth."""
    results = RungResults(peer)
    for fall in falls:
        level, cloth, truth = fall.level, fall.make(), fall.truth
        for rung in motion_rungs(peer, cloth.beat):
            shape = Shape(level.frames, 1, level.budget, cloth.frame)
            outcome = results.run(cloth, rung, shape)
            row = {"particles": level.size, "target_frames": level.frames, "rung": rung.label}
            results.rows.append(row | _distances(outcome, truth, cloth.extent))
            if not outcome.solved:
                break
    truths = [fall.truth for fall in falls]
    certainty = {"order": [t.order for t in truths], "unsure": [t.unsure for t in truths]}
    return results.measured(MotionWork, **certainty)


def _distances(outcome: JobOutcome, truth: ClothTruth, extent: float) -> dict[str, Any]:
    """Return times, and distances from the references after the last frame that was reached."""
    frames = len(outcome.solved)
    seconds = np.array([frame.seconds for frame in outcome.solved])
    positions = np.array([frame.q for frame in outcome.solved])
    positions = positions.reshape(frames, *truth.inertial.shape)
    row = {
        "frames": frames,
        "seconds": metrics.spread(seconds).median,
        "setup": outcome.setup,
        "diverged": diverged(positions, truth.true[:frames], extent),
    }
    for name, motion in (("implicit", truth.implicit), ("true", truth.true)):
        is_near = frames and not row["diverged"]
        end = motion[frames - 1]
        row[name] = metrics.rms_distance(positions[-1], end) if is_near else np.nan
    return row


def step_error(positions: np.ndarray, truth: ClothTruth) -> float:
    """Return the error of a step relative to that of its inertial start y; inf if it diverged.

    The error is the distance from converged implicit Euler.
    """
    if not np.isfinite(positions).all() or np.abs(positions).max() > 1e100:
        return np.inf
    return truth.first.error(positions, truth.inertial)


def diverged(positions: np.ndarray, true: np.ndarray, extent: float = SIDE) -> bool:
    """Return whether a particle is ever farther from its true position than the cloth is wide."""
    if not np.isfinite(positions).all():
        return True
    return bool((np.abs(positions - true) > extent).any())


def iterations_needed(solver: str, stiffness: float) -> Measured:
    """Count the iterations of a step to errors of a tenth, a hundredth and so on."""
    cloth = falling_cloth(NEEDED_SIZE, stiffness)
    truth = truth_of(cloth, 1)
    iterates = ImplicitEuler(cloth.system, h=FRAME, solver=solver).iterates(cloth.start)
    errors = []
    limit = registry.step_solvers()[solver].counted
    for _, iterate in zip(range(limit + 1), iterates, strict=False):
        errors.append(step_error(iterate.positions, truth))
        if errors[-1] <= NEAR_ENOUGH:
            break
    needed = [metrics.first_below(np.array(errors), float(decade)) for decade in DECADES]
    counts = np.array([np.nan if count is None else count for count in needed])
    return Measured(IterationCounts(counts, len(errors) - 1, min(errors)))


def stability(peer: ClothPeer, stiffnesses: tuple[float, ...]) -> Measured:
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
            if peer.kind == UNDECLARED and stable(implicit_step):
                raise ArithmeticError(f"stable at {implicit_step:.2g} s, as implicit steps are")
            limits.append(stability_limit(stable, FRAME))
        except ArithmeticError as error:
            limits.append(np.nan)
            remarks.append(str(error))
    columns = map(np.array, (stiffnesses, limits, frequencies))
    return Measured(StabilityLimits(*columns), {"remark": "; ".join(remarks)})


def is_stable(
    peer: ClothPeer, system: MassSpring, start: State, rest: np.ndarray, h: float
) -> bool:
    """Return whether the particles stay near their rest for many steps of length h.

    Raises:
        ArithmeticError: if the solver fails.
    """
    settings = {**peer.settings, **peer.spec, "substeps": STABILITY_STEPS}
    shape = Shape(1, 1, np.inf, h * STABILITY_STEPS)
    arrays, entrant = system.arrays, peer.entrant_name
    job = ClothJob(peer.module, arrays, start, settings, shape, entrant)
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
    exact = implicit_motion(cloth, 1, frame)[0]
    settings = {"solver": solver, **published.LIU_2013[solver].settings}
    shape, peer = Shape(1, REPEATS, 5.0, frame), registry.cloth_peers()[0]
    outcome = worker_process().perform(job(peer, cloth, settings, shape))
    if not outcome.solved:
        raise ArithmeticError(outcome.trouble)
    seconds = np.array([step.seconds for step in outcome.solved])
    inertial = inertial_positions(cloth, frame)
    error = metrics.relative_error(outcome.solved[-1].q, exact, inertial)
    return Measured(LiuFrame(seconds, error, cloth.system.particle_count))


def job(
    peer: ClothPeer, cloth: FallingCloth, settings: Mapping[str, Any], shape: Shape
) -> ClothJob:
    """Return the job of moving a cloth from its start."""
    system = cloth.system.arrays
    return ClothJob(peer.module, system, cloth.start, settings, shape, peer.entrant_name)


@functools.cache
def worker_process() -> WorkerProcess:
    """Return the process in which all solvers work in turn."""
    return WorkerProcess(_START_PATIENCE, _PATIENCE)
