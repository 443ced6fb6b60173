"""One cloth for every solver that is installed: work and precision, limits of stability.

Each solver works in a process of its own. What it returns is held against converged implicit Euler
and against the motion itself.
"""

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import ImplicitEuler, MassSpring, State

from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ...harness.isolation import Outcome, WorkerProcess
from ...harness.measure import not_installed
from ...harness.values import Values
from ...peers import registry
from ...peers.registry import EXPLICIT, UNDECLARED, ClothPeer
from ...problems.falling_cloth import (
    FRAME,
    SIDE,
    STIFFNESSES,
    FallingCloth,
    falling_cloth,
    hanging_cloth,
    highest_mode,
    own_cloth,
)
from ..published import problem as published
from . import DECADES, LIU, MISSING, MOTION, NEEDED, ONE_STEP, STABILITY
from .job import ClothJob, Shape
from .ladder import Rung, motion_rungs, step_rungs
from .truth import ClothTruth, implicit_motion, truth_of
from .values import Counted, MotionWork, Published, Stability, StepWork

SUITE = "cloth"
# One step is timed so often, but for no more than a twentieth of its ladder's time.
REPEATS, _REPEATING = 5, 0.05
# A ladder ends with the first rung this near to the answer.
NEAR_ENOUGH = 1e-9
# A silent frame of a large cloth is given up after so long [s], and so is one being set up.
_PATIENCE, _START_PATIENCE = 60.0, 300.0

# Iterations are counted on a cloth of so many particles a side.
NEEDED_SIZE = 20

# A mode is unstable if, begun with this amplitude [m], it grows so much in so many steps.
STABILITY_SIZE, AMPLITUDE, GROWTH, STABILITY_STEPS = 6, 1e-5, 100.0, 400
BISECTION = 2e-4
_DOUBLINGS = 30
# A solver that does not say that it is explicit, and is stable at so many times symplectic Euler's
# limit, is taken not to be.
_FAR = 8.0

# Numbers, and a label in the end.
Row = tuple[Any, ...]
# Parts of a cloth's ladder that use its whole budget.
_LADDER = 2.0


class Level(NamedTuple):
    """A size of the cloth: particles a side, frames of a motion, seconds for a solver's ladder."""

    size: int
    frames: int
    budget: float


QUICK = (Level(20, 3, 0.2),)
FULL = (Level(20, 30, 2.0), Level(40, 10, 3.0), Level(100, 2, 30.0))
QUICK_STIFFNESS = STIFFNESSES[1:2]
# The benchmarks of a scale that is full take so long [s].
_FULL = 1.0


def levels(scale: Scale) -> tuple[Level, ...]:
    """Return the sizes of the cloth at a scale."""
    return FULL if scale.seconds >= _FULL else QUICK


class Fall(NamedTuple):
    """A cloth that falls: how far, and what makes it."""

    level: Level
    make: Callable[[], FallingCloth]

    @property
    def truth(self) -> ClothTruth:
        """Its answers."""
        return truth_of(self.make(), self.level.frames)


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield one step, a motion and the limit of every solver; what is missing makes one block.

    Larger cloths, the published one among them, are for the full scale.
    """
    peers = registry.cloth_peers(scale.entrants)
    for package in dict.fromkeys(peer.package for peer in peers if not peer.is_installed):
        absent = partial(not_installed, package)
        yield Block(SUITE, "peers/all", package, absent, facts={"task": MISSING})
    for stiffness in STIFFNESSES:
        settings = {"size": NEEDED_SIZE, "stiffness": stiffness, "frame": FRAME}
        name, facts = f"peers/iterations/k{stiffness:g}", {"task": NEEDED}
        for solver in registry.step_solvers():
            measure = partial(iterations_needed, solver, stiffness)
            yield Block(SUITE, name, solver, measure, settings, facts=facts)
    for peer in (peer for peer in peers if peer.is_installed):
        yield from blocks_of(peer, scale)
    settings = {"size": published.LIU_2013_SIZE, "frame": published.LIU_2013_FRAME}
    for solver in published.LIU_2013 if levels(scale) == FULL else ():
        measure, facts = partial(liu_2013, solver), {"task": LIU}
        yield Block(SUITE, "peers/liu2013", solver, measure, settings, facts=facts)


def blocks_of(peer: ClothPeer, scale: Scale) -> Iterator[Block]:
    """Yield one step, a motion and, if it is explicit, the limit of a solver."""
    sizes = levels(scale)
    for k in STIFFNESSES:
        falls = [Fall(level, partial(falling_cloth, level.size, k)) for level in sizes]
        yield from _falling(peer, f"k{k:g}", {"stiffness": k, "frame": FRAME}, falls)
    for own in scale.problems:
        if own.cloth is not None:
            system, _ = own.cloth
            settings: dict[str, Any] = {"stiffness": float(system.stiffnesses.mean())}
            settings |= {"frame": own.h}
            fall = Fall(sizes[0]._replace(size=system.particle_count), partial(own_cloth, own))
            for block in _falling(peer, own.name, settings, [fall]):
                yield replace(block, facts={**block.facts, "cloth": own.name}).on(own)
    if peer.kind in (EXPLICIT, UNDECLARED) and not peer.settings.get("iterations"):
        hung = STIFFNESSES if sizes == FULL else QUICK_STIFFNESS
        settings = {"size": STABILITY_SIZE, "version": peer.version}
        measure, facts = partial(stability, peer, hung), {"task": STABILITY}
        block = Block(SUITE, "peers/stability", peer.title, measure, settings, len(hung), facts)
        yield block.of(peer.entrant)


def _falling(
    peer: ClothPeer, cloth: str, settings: dict[str, Any], falls: list[Fall]
) -> Iterator[Block]:
    """Yield one step and a motion of a cloth at some sizes."""
    size, budget = (sum(fall.level[i] for fall in falls) for i in (0, 2))
    settings = settings | {"version": peer.version}
    for words, task, measure in (("one step", ONE_STEP, one_step), ("motion", MOTION, motion)):
        known = (SUITE, f"peers/{words}/{cloth}", peer.title, partial(measure, peer, falls))
        block = Block(*known, settings, size, {"task": task}, budget=_LADDER * budget)
        yield block.of(peer.entrant)


class Remark(NamedTuple):
    """A sentence on what happened on a cloth of so many particles a side."""

    particles: int
    sentence: str
    is_trouble: bool


def one_step(peer: ClothPeer, falls: Sequence[Fall]) -> Measured:
    """Take the same step with ever more work; keep time and what is left of the error.

    A ladder that has used its time, or has arrived, is climbed no further.
    """
    rows: list[Row] = []
    remarks: list[Remark] = []
    for fall in falls:
        level, cloth, truth = fall.level, fall.make(), fall.truth
        spent = 0.0
        for rung in step_rungs(peer, cloth.beat):
            shape = Shape(1, REPEATS, _REPEATING * level.budget, cloth.frame)
            outcome = _tried(peer, cloth, rung, shape, remarks)
            if not outcome.solved:
                break
            seconds = np.array([one.seconds for one in outcome.solved])
            error = step_error(outcome.solved[-1].q, truth)
            rows.append((level.size, metrics.spread(seconds).median, error, rung.label))
            spent += float(seconds.sum())
            if error <= NEAR_ENOUGH or spent > level.budget:
                break
    return _columns(StepWork, ("particles", "seconds", "error"), rows, remarks)


def motion(peer: ClothPeer, falls: Sequence[Fall]) -> Measured:
    """Move on frame after frame; keep the distances from implicit Euler and from the truth."""
    rows: list[Row] = []
    remarks: list[Remark] = []
    for fall in falls:
        level, cloth, truth = fall.level, fall.make(), fall.truth
        for rung in motion_rungs(peer, cloth.beat):
            shape = Shape(level.frames, 1, level.budget, cloth.frame)
            outcome = _tried(peer, cloth, rung, shape, remarks)
            rows.append((*_moved(outcome, level, truth, cloth.extent), rung.label))
            if not outcome.solved:
                break
    names = ("particles", "frames", "wanted", "seconds", "setup", "implicit", "true", "diverged")
    truths = [fall.truth for fall in falls]
    known = {"order": [t.order for t in truths], "unsure": [t.unsure for t in truths]}
    return _columns(MotionWork, names, rows, remarks, **known)


def _tried(
    peer: ClothPeer, cloth: FallingCloth, rung: Rung, shape: Shape, remarks: list[Remark]
) -> Outcome:
    """Return what came of a rung, and add a remark on it if there is something to say.

    What could not be set up in time is not set up again.
    """
    task = peer.module, peer.entrant_name, len(cloth.start.positions)
    if task in _given_up:
        outcome = Outcome(0.0, [], _given_up[task])
    else:
        outcome = worker_process().perform(job(peer, cloth, rung.settings, shape))
    if outcome.is_silent and not outcome.is_lost:
        _given_up[task] = outcome.note
    if outcome.note:
        sentence = f"{cloth.size} × {cloth.size}, {rung.label}: {outcome.note}"
        remarks.append(Remark(cloth.size, sentence, bool(outcome.trouble)))
    return outcome


_given_up: dict[tuple[str, str, int], str] = {}


def step_error(positions: np.ndarray, truth: ClothTruth) -> float:
    """Return the error of a step relative to that of its inertial start y; inf if it diverged.

    The error is the distance from converged implicit Euler.
    """
    if not np.isfinite(positions).all() or np.abs(positions).max() > 1e100:
        return np.inf
    return truth.first.error(positions, truth.inertial)


def _moved(outcome: Outcome, level: Level, truth: ClothTruth, extent: float) -> tuple[float, ...]:
    """Return a row: distances are those in the end, or as far as the motion got."""
    frames = len(outcome.solved)
    seconds = metrics.spread(np.array([one.seconds for one in outcome.solved])).median
    positions = np.array([one.q for one in outcome.solved]).reshape(frames, *truth.start.shape)
    lost = diverged(positions, truth.true[:frames], extent)
    apart = [np.nan, np.nan]
    if frames and not lost:
        answers = truth.implicit[frames - 1], truth.true[frames - 1]
        apart = [metrics.rms_distance(positions[-1], answer) for answer in answers]
    return (level.size, frames, level.frames, seconds, outcome.setup, *apart, lost)


def diverged(positions: np.ndarray, true: np.ndarray, extent: float = SIDE) -> bool:
    """Return whether a particle ever is farther from where it belongs than the cloth is wide."""
    if not np.isfinite(positions).all():
        return True
    return bool((np.abs(positions - true) > extent).any())


def iterations_needed(solver: str, stiffness: float) -> Measured:
    """Count the iterations of one step to errors of a tenth, a hundredth and so on."""
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
    return Measured(Counted(counts, tried=len(errors) - 1, least=min(errors)))


def stability(peer: ClothPeer, stiffnesses: tuple[float, ...]) -> Measured:
    """Find the longest stable step of an explicit solver, on hanging cloths."""
    limits, frequencies, remarks = [], [], []
    for stiffness in stiffnesses:
        system, rest = hanging_cloth(STABILITY_SIZE, stiffness)
        largest, mode = highest_mode(system, rest)
        frequencies.append(np.sqrt(largest))
        start = State(rest + AMPLITUDE * mode, np.zeros_like(rest))
        stable = partial(is_stable, peer, system, start, rest)
        far = _FAR * 2.0 / np.sqrt(largest)
        try:
            if peer.kind == UNDECLARED and stable(far):
                raise ArithmeticError(f"stable at {far:.2g} s, as implicit steps are")
            limits.append(stability_limit(stable, FRAME))
        except ArithmeticError as error:
            limits.append(np.nan)
            remarks.append(str(error))
    columns = map(np.array, (stiffnesses, limits, frequencies))
    return Measured(Stability(*columns), {"remark": "; ".join(remarks)})


def is_stable(
    peer: ClothPeer, system: MassSpring, start: State, rest: np.ndarray, h: float
) -> bool:
    """Return whether the particles stay near their rest for many steps of length h.

    Raises:
        ArithmeticError: if the solver does not get through.
    """
    settings = {**peer.settings, **peer.spec, "substeps": STABILITY_STEPS}
    job = (system.arrays, start, settings, Shape(1, 1, np.inf, h * STABILITY_STEPS))
    outcome = worker_process().perform(ClothJob(peer.module, *job, peer.entrant_name))
    if not outcome.solved:
        raise ArithmeticError(outcome.trouble)
    away = np.abs(outcome.solved[-1].q - rest)
    return bool(np.isfinite(away).all() and away.max() <= GROWTH * AMPLITUDE)


def stability_limit(stable: Callable[[float], bool], h: float) -> float:
    """Return the longest stable step, by doubling, halving and bisection from a first guess h.

    Raises:
        ArithmeticError: if no step is stable, or every one is.
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
    """Take steps of the cloth of the paper's size, by the paper's ten iterations or by Newton."""
    cloth = falling_cloth(published.LIU_2013_SIZE, published.LIU_2013_STIFFNESS)
    exact = implicit_motion(cloth, 1, published.LIU_2013_FRAME)[0]
    x, v = cloth.start.positions, cloth.start.velocities
    settings = {"solver": solver, **published.LIU_2013[solver].settings}
    shape, peer = Shape(1, REPEATS, 5.0, published.LIU_2013_FRAME), registry.cloth_peers()[0]
    outcome = worker_process().perform(job(peer, cloth, settings, shape))
    if not outcome.solved:
        raise ArithmeticError(outcome.trouble)
    inertial = x + published.LIU_2013_FRAME * np.where(cloth.system.free[:, None], v, 0.0)
    seconds = np.array([one.seconds for one in outcome.solved])
    error = metrics.relative_error(outcome.solved[-1].q, exact, inertial)
    return Measured(Published(seconds, error, cloth.system.particle_count))


def job(
    peer: ClothPeer, cloth: FallingCloth, settings: Mapping[str, Any], shape: Shape
) -> ClothJob:
    """Return the job of moving a cloth from its start."""
    known = (cloth.system.arrays, cloth.start, settings, shape)
    return ClothJob(peer.module, *known, peer.entrant_name)


def _columns(
    kind: type[Values],
    names: tuple[str, ...],
    rows: list[Row],
    remarks: list[Remark],
    **more: list[float],
) -> Measured:
    """Return rows, their labels last, as arrays and facts."""
    arrays = {name: np.array([row[i] for row in rows]) for i, name in enumerate(names)}
    arrays["remark_particles"] = np.array([remark.particles for remark in remarks])
    troubles = [remark.sentence for remark in remarks if remark.is_trouble]
    facts = {
        "rungs": [row[-1] for row in rows],
        "remarks": [remark.sentence for remark in remarks],
        "trouble": troubles[0] if troubles else "",
    }
    return Measured(kind(**arrays, **more), facts=facts)


@functools.cache
def worker_process() -> WorkerProcess:
    """Return the one process in which all solvers work, one after the other."""
    return WorkerProcess(_START_PATIENCE, _PATIENCE)
