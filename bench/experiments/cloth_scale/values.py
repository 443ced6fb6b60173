"""The records of growing cloths: times [s], (round,), memory [bytes] and sizes of factors."""

from ...harness.values import Floats1, Values


class FactorWords(Values, frozen=True, kw_only=True):
    """The number of particles, and the iterations of a step."""

    particles: int
    iterations: int


class FactorCosts(FactorWords, frozen=True, kw_only=True):
    """A cloth factored by a library; SciPy's has None where only ours is measured."""

    before: int  # the memory before the cloth
    assembly: float | None = None
    factor: float
    refactor: float | None = None  # the time of a second factor of the same pattern
    solve: Floats1  # of three right-hand sides
    local: Floats1 | None = None
    step: Floats1 | None = None
    limit: Floats1 | None = None  # plain reads of as many bytes as an iteration reads
    entries: int | None = None  # nonzeros of the factor
    matrix_entries: int | None = None
    memory: int  # the peak of the process
    residual: float | None = None  # after all iterations of a step
    history: Floats1 | None = None  # the residual at the start and after each iteration


KINDS = {"": FactorCosts}
