"""A worker's job: move a cloth frame by frame, by a solver with its settings."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import MassSpring, State, scenes
from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import SystemArrays

from ...clock import compute_time_of, time_call
from ...harness.isolation import Message, Ready, Solved
from ...harness.timing import messages_of
from ...peers.protocol import Mover, OwnTime
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
        return messages_of(self)

    def set_up(self, adapter: Any) -> tuple[Mover, Ready]:
        """Return the solver for the cloth, and how long its set-up took."""
        code = self.module, self.entrant, *(v for v in self.settings.values() if isinstance(v, str))
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
