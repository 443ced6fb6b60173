"""The same cloth for every installed solver: work and precision, limits of stability.

Each solver runs in a worker process. Its step is compared with the minimiser to 25 digits, its
motion with the true motion. Every sweep runs every solver with all of its settings, so only the
times depend on the machine. Solvers with different sweeps are seen.
"""

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import MassSpring, State

from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ...harness.isolation import JobOutcome, Solved, WorkerProcess
from ...harness.measure import not_installed
from ...peers import catalogue
from ...peers.peer import EXPLICIT, ITERATED, LINEARISED, UNDECLARED, Peer
from ...problems import published
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
from ...problems.own import OwnProblem
from . import LIU, MISSING, MOTION, ONE_STEP, STABILITY
from .job import ClothJob, Shape
from .truth import ClothTruth, first_step, inertial_positions, truth_of

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
# What errors are measured against.
_ARBITERS = {
    ONE_STEP: "the minimiser to 25 digits, by decimal arithmetic",
    MOTION: "Runge-Kutta with steps halved until they agree",
}

# An unstable mode grows from this amplitude [m] by this factor in this number of steps.
STABILITY_SIZE, AMPLITUDE, GROWTH, STABILITY_STEPS = 6, 1e-5, 100.0, 400
BISECTION, _DOUBLINGS = 2e-4, 30
# An undeclared solver stable at this multiple of symplectic Euler's limit is implicit.
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
    peers = catalogue.cloth_peers(scale.entrants)
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
        facts = {"kind": peer.run.kind, "arbiter": _ARBITERS[task]}
        facts |= {"cloth": cloth.name} if cloth.own else {}
        name, more = f"{name}/{cloth.name}", {"size": size, "facts": facts}
        block = _block(task, name, peer.title, measure, settings, **more).of(peer.entrant)
        yield block.on(cloth.own) if cloth.own else block


def _stability_blocks(peer: Peer, sizes: tuple[Level, ...]) -> Iterator[Block]:
    """Yield the limit of stability of an explicit solver without iterations."""
    if peer.run.kind in (EXPLICIT, UNDECLARED) and not peer.run.settings.get("iterations"):
        stiffnesses = STIFFNESSES if sizes == FULL else QUICK_STIFFNESS
        measure, size = partial(stability, peer, stiffnesses), len(stiffnesses)
        version = {"size": STABILITY_SIZE, "version": peer.version}
        block = _block(STABILITY, "stability", peer.title, measure, version, size=size)
        yield block.of(peer.entrant)


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
        label = f"{_counted(n, 'step')} of {_counted(iterations, 'iteration')}"
        rungs.append(_rung(peer, label, substeps=n, iterations=iterations))
    if peer.run.converges:
        for n in PARTS:
            label = f"{_counted(n, 'step')} to {RESIDUAL_LABEL}"
            rungs.append(_rung(peer, label, tolerance=RESIDUAL, substeps=n))
    return rungs


def _rung(peer: Peer, label: str, **settings: float) -> Rung:
    return Rung(label, {**peer.run.settings, **peer.spec, **settings})


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
    rows, labels, remarks, troubles = [], [], [], []
    for fall in falls:
        cloth, (rungs, frames, repeats) = fall.make(), (step_rungs, 1, REPEATS)
        if task == MOTION:
            rungs, frames, repeats = motion_rungs, fall.level.frames, 1
        for rung in rungs(peer, cloth.beat):
            outcome = _performed(peer, cloth, rung, Shape(frames, repeats, cloth.frame))
            last = outcome.solved[-frames:]
            error = _error(task, last, fall) if len(last) == frames else np.inf
            seconds = metrics.spread(np.array([frame.seconds for frame in last])).median
            rows.append((fall.level.size, seconds, outcome.setup, error))
            labels.append(rung.label)
            remarks.append(outcome.note or ("diverged" if np.isinf(error) else ""))
            troubles.append(outcome.trouble)
    names = ("particles", "seconds", "setup", "error")
    return {
        **dict(zip(names, map(np.array, zip(*rows, strict=True)), strict=True)),
        **_certainty(falls),
        "rungs": labels,
        "remarks": remarks,
        "trouble": next(filter(None, troubles), ""),
    }


def _error(task: str, frames: Sequence[Solved], fall: Fall) -> float:
    """Return the error of a step, or of the frames of a motion."""
    positions = np.array([frame.q for frame in frames]).reshape(-1, *fall.truth.inertial.shape)
    if task == MOTION:
        return motion_error(positions, fall.truth, fall.make().extent)
    return step_error(positions[-1], fall.truth)


def _certainty(falls: Sequence[Fall]) -> dict[str, np.ndarray]:
    """Return how sure the arbiters are at each size."""
    truths = [fall.truth for fall in falls]
    columns = zip(*((rounding(t), t.order, t.unsure) for t in truths), strict=True)
    return dict(zip(("rounding", "order", "unsure"), map(np.array, columns), strict=True))


def rounding(truth: ClothTruth) -> float:
    """Return the error of the converged step rounded to single precision."""
    return step_error(truth.first.positions.astype(np.float32).astype(float), truth)


def step_error(positions: np.ndarray, truth: ClothTruth) -> float:
    """Return the error of a step over the error of its inertial start y; inf after divergence.

    The error is the distance from converged implicit Euler.
    """
    if not np.isfinite(positions).all() or np.abs(positions).max() > 1e100:
        return np.inf
    return truth.first.error(positions, truth.inertial)


def motion_error(positions: np.ndarray, truth: ClothTruth, extent: float = SIDE) -> float:
    """Return the final distance from the truth over the distance moved; inf after divergence.

    A motion diverged if a particle is ever farther from its true position than the cloth is wide.
    The result is at least the uncertainty of the truth.
    """
    is_near = np.abs(positions - truth.true) <= extent
    if not is_near.all():
        return np.inf
    return max(metrics.rms_distance(positions[-1], truth.true[-1]) / truth.path, truth.unsure)


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
    settings = {"solver": solver, **published.LIU_2013[solver].settings}
    shape, peer = Shape(1, LIU_REPEATS, frame), catalogue.cloth_peers()[0]
    outcome = worker_process().perform(job(peer, cloth, settings, shape))
    if not outcome.solved:
        raise ArithmeticError(outcome.trouble)
    seconds = np.array([step.seconds for step in outcome.solved])
    exact, inertial = first_step(cloth, frame), inertial_positions(cloth, frame)
    error = exact.error(outcome.solved[-1].q, inertial)
    return {"seconds": seconds, "error": error, "vertices": cloth.system.particle_count}


def job(peer: Peer, cloth: FallingCloth, settings: Mapping[str, Any], shape: Shape) -> ClothJob:
    """Return the job of moving a cloth from its start."""
    system = cloth.system.arrays
    return ClothJob(peer.module, system, cloth.start, settings, shape, peer.entrant_name)


@functools.cache
def worker_process() -> WorkerProcess:
    """Return the process in which all solvers work in turn."""
    return WorkerProcess(_START_PATIENCE, _PATIENCE)
