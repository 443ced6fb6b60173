"""The records of a swinging cloth's energy."""

from ...harness.values import Details, Floats1, Kind, Values


class Swing(Values, frozen=True):
    """The energy of a swing by an integrator, (state,)."""

    time: Floats1  # [s]
    left: Floats1  # the energy above that of the cloth at rest, over that of the start


class SwingDetails(Details, frozen=True):
    """The damping of every spring [N s/m]; each `every`-th step counts."""

    damping: float
    every: int


KINDS = {"": Kind(Swing, SwingDetails)}
