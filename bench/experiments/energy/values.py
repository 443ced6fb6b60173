"""The records of a swinging cloth's energy."""

from ...harness.values import Details, Floats1, Kind, Values


class Swing(Values, frozen=True):
    """The energy of a swing by an integrator, (state,)."""

    time: Floats1  # [s]
    left: Floats1  # the energy above that of the cloth at rest, over that of the start


class SwingDetails(Details, frozen=True):
    """How the cloth swings."""

    title: str
    damping: float  # of every spring [N s/m]
    h: float  # length of a step [s]
    steps: int
    every: int  # of so many steps, one is looked at
    tolerance: float  # residual of the implicit steps


KINDS = {"": Kind(Swing, SwingDetails)}
