"""The records of growing cloths: times [s], (round,), memory [bytes] and sizes of factors."""

from ...harness.values import Details, Floats1, Kind, Values


class Scaled(Values, frozen=True, kw_only=True):
    """A cloth factored by one library; what only ours measures is None for others.

    Attributes:
        before: the memory before anything was made.
        assembly: the time to assemble the matrix.
        factor: the time of the first factor.
        refactor: the time of a second factor of the same pattern.
        solve: the times of a solve of three right-hand sides.
        local: the times of a local step.
        step: the times of a step of all iterations.
        limit: the times of plain reads of as many bytes as an iteration reads.
        entries: the nonzeros of the factor.
        matrix_entries: the nonzeros of the matrix.
        memory: the most memory that the process ever had.
        residual: after all iterations of a step.
        history: the residual before and after each iteration, (iteration + 1,).
    """

    before: int
    assembly: float | None = None
    factor: float
    refactor: float | None = None
    solve: Floats1
    local: Floats1 | None = None
    step: Floats1 | None = None
    limit: Floats1 | None = None
    entries: int | None = None
    matrix_entries: int | None = None
    memory: int
    residual: float | None = None
    history: Floats1 | None = None


class ScaledDetails(Details, frozen=True):
    """How many particles there are and iterations a step makes, and why a library is missing."""

    particles: int
    iterations: int
    missing: str = ""


KINDS = {"": Kind(Scaled, ScaledDetails)}
