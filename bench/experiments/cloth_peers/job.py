"""A cloth to be moved frame by frame in a worker's process, by one solver with its settings."""

import importlib
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from reference import MassSpring, State, scenes
from reference.arguments import FloatArray
from reference.mass_spring import SystemArrays

from ...harness.stopwatch import Budget, timed
from ...harness.worker import Done, Message, Ready, Solved, Unfit, describe
from ...peers.cloth.protocol import Mover

# Moved once before anything is timed, in so short a frame [s] that any solver is stable: what has
# to be compiled is compiled then.
_SMALL, _SHORT = 3, 1e-4
UNKNOWN = -1


class ClothJob(NamedTuple):
    """What is to be moved, and by what.

    Attributes:
        module: the adapter's module, by its full name.
        system: particles and springs.
        positions: at the start [m], (particle, 3).
        velocities: at the start [m/s], (particle, 3).
        frame: the length of a frame [s].
        frames: how many to move on.
        repeats: how often, from the start each time.
        settings: what the adapter is prepared with.
        budget: no further frame is begun after so long [s].
    """

    module: str
    system: SystemArrays
    positions: FloatArray
    velocities: FloatArray
    frame: float
    frames: int
    repeats: int
    settings: Mapping[str, Any]
    budget: float

    def perform(self) -> Iterator[Message]:
        """Yield the positions after each frame and how long it took, as soon as they are there."""
        try:
            mover, setup = self._prepared()
            yield Ready(setup)
            yield from self._moved(mover)
        except Exception as error:  # whatever an engine raises is its result
            yield Unfit(describe(error))

    def _prepared(self) -> tuple[Mover, float]:
        adapter = importlib.import_module(self.module)
        small, state = scenes.grid_cloth(_SMALL, _SMALL)
        trial = adapter.prepare(small, _SHORT, **self.settings)
        trial.begin(state)
        trial.advance()
        system = MassSpring(**self.system._asdict())
        return timed(lambda: adapter.prepare(system, self.frame, **self.settings))

    def _moved(self, mover: Mover) -> Iterator[Message]:
        budget = Budget(self.budget)
        for _ in range(self.repeats):
            mover.begin(State(self.positions, self.velocities))
            for _ in range(self.frames):
                stays_finite, seconds = timed(lambda: advanced(mover))
                where = mover.positions() if stays_finite else np.full_like(self.positions, np.nan)
                yield Solved(where, UNKNOWN, seconds, "")
                if budget.is_spent or not np.isfinite(where).all():
                    yield Done()
                    return
        yield Done()


def advanced(mover: Mover) -> bool:
    """Move on by one frame; return whether the solver says nothing of having blown up."""
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            mover.advance()
    except FloatingPointError:
        return False
    return True
