"""The interface of adapters for cloths.

An adapter is a module with a function `prepare(system, frame, **settings)`. `prepare` sets the
engine up for particles and springs and returns a `Mover`, to move the particles a frame at a time.
Only `advance` is timed: conversions cost no solver anything, and set-up is timed apart. For an
unsuitable system `prepare` raises a `ValueError`.
"""

from typing import Protocol

from plumbob.reference import State
from plumbob.reference.arguments import FloatArray

from ..protocol import OwnTime


class Mover(Protocol):
    """A solver set up for a system and the length of a frame."""

    def begin(self, state: State) -> None:
        """Put the particles into a state; the solver forgets all earlier states."""

    def advance(self) -> OwnTime | None:
        """Move on by a frame; return the solver's own time, None if the call is timed.

        Raises:
            FloatingPointError: if the motion leaves the finite numbers.
        """

    def positions(self) -> FloatArray:
        """Return the positions of the particles [m], (particle, 3), not finite after a blow-up."""
