"""A worker's job: move a cloth frame by frame, by a solver with its settings."""

import importlib
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import MassSpring, State, scenes
from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import SystemArrays

from ...harness.job import announced, solved_in, unfit
from ...harness.worker import Finished, Message, Ready, Solved
from ...peers.cloth.protocol import Mover
from ...peers.protocol import OwnTime, remark_of
from ...peers.stopwatch import compute_time_of, time_call
from ...problems.falling_cloth import FRAME

# Before the timing, each solver moves a small cloth once to compile everything, in a frame [s] in
# which any solver is stable.
_SMALL, _SHORT = 3, 1e-4
_compiled: set[tuple[str, ...]] = set()
UNKNOWN = -1


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
    entrant: str = ""  # the name of a user's solver, whose first error is announced

    def perform(self) -> Iterator[Message]:
        """Yield the positions and the time of each frame as soon as computed."""
        try:
            adapter = importlib.import_module(self.module)
            mover, setup = self._prepared(adapter)
            yield Ready(setup, remark_of(adapter))
            yield from announced(self._moved(mover), self.entrant)
            yield Finished()
        except Exception as error:  # an exception of an engine is its result
            yield from unfit(error, self.entrant)

    def _prepared(self, adapter: Any) -> tuple[Mover, float]:
        code = self.module, self.entrant, *(v for v in self.settings.values() if isinstance(v, str))
        if code not in _compiled:
            small, state = scenes.grid_cloth(_SMALL, _SMALL)
            trial = adapter.prepare(small, _SHORT, **self.settings)
            trial.begin(state)
            trial.advance()
            _compiled.add(code)
        system = MassSpring(**self.system._asdict())
        return time_call(lambda: adapter.prepare(system, self.shape.frame, **self.settings))

    def _moved(self, mover: Mover) -> Iterator[Solved]:
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
        return solved_in(OwnTime(np.nan), nowhere, UNKNOWN)
    return solved_in(own_time or OwnTime(seconds), mover.positions(), UNKNOWN)
