"""A cloth to be moved frame by frame in a worker's process, by one solver with its settings."""

import importlib
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import MassSpring, State, scenes
from plumbob.reference.mass_spring import SystemArrays

from ...harness.stopwatch import Budget, round_trips, timed
from ...harness.worker import Done, Message, Ready, Solved, Unfit, describe
from ...peers.cloth.protocol import Mover
from ...peers.ik.protocol import remark_of
from .problem import FRAME

# Moved once before anything is timed, in so short a frame [s] that any solver is stable: what has
# to be compiled is compiled then.
_SMALL, _SHORT = 3, 1e-4
UNKNOWN = -1


class Shape(NamedTuple):
    """How far and how often a cloth is moved.

    Attributes:
        frames: how many to move on.
        repeats: how often, from the start each time.
        budget: no further frame is begun after so long [s].
        frame: the length of a frame [s].
    """

    frames: int
    repeats: int
    budget: float
    frame: float = FRAME


class ClothJob(NamedTuple):
    """What is to be moved, and by what.

    Attributes:
        module: the adapter's module, by its full name.
        system: particles and springs.
        start: where the particles are at first.
        settings: what the adapter is prepared with.
        shape: how far and how often it is moved.
    """

    module: str
    system: SystemArrays
    start: State
    settings: Mapping[str, Any]
    shape: Shape

    def perform(self) -> Iterator[Message]:
        """Yield the positions after each frame and how long it took, as soon as they are there."""
        try:
            mover, setup = self._prepared()
            yield Ready(setup, remark_of(importlib.import_module(self.module)))
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
        return timed(lambda: adapter.prepare(system, self.shape.frame, **self.settings))

    def _moved(self, mover: Mover) -> Iterator[Message]:
        budget, nowhere = Budget(self.shape.budget), np.full_like(self.start.positions, np.nan)
        for _ in range(self.shape.repeats):
            mover.begin(self.start)
            for _ in range(self.shape.frames):
                stays_finite, seconds = timed(lambda: advanced(mover))
                where = mover.positions() if stays_finite else nowhere
                yield Solved(where, UNKNOWN, seconds, "", *round_trips())
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
