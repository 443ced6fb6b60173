"""The records of a swinging cloth's energy."""

from ...harness.values import Floats1, Values


class SwingWords(Values, frozen=True, kw_only=True):
    """The damping of every spring [N s/m]; each `every`-th step counts."""

    damping: float
    every: int


class Swing(SwingWords, frozen=True):
    """The energy of a swing by an integrator, (state,)."""

    time: Floats1  # [s]
    left: Floats1  # the energy above that of the cloth at rest, over that of the start


KINDS = {"": Swing}
