"""The records of a swinging cloth's energy."""

from ...harness.values import Details, Floats1, Kind, Values


class Swing(Values, frozen=True):
    """The energy of a swing by one integrator.

    Attributes:
        time: of the states that are looked at [s], (state,).
        left: the energy above that of the cloth at rest, over that of the start, (state,).
    """

    time: Floats1
    left: Floats1


class SwingDetails(Details, frozen=True):
    """How the cloth swings.

    Attributes:
        damping: of every spring [N s/m].
        h: length of a step [s].
        steps: how many there are.
        every: of so many steps, one is looked at.
        tolerance: residual of the implicit steps.
    """

    title: str
    damping: float
    h: float
    steps: int
    every: int
    tolerance: float


KINDS = {"": Kind(Swing, SwingDetails)}
