"""When a minimiser of g stops, for steps in a kernel and for iterates in Python alike."""

from ..outcome import Outcome

# Stop early if the least residual is at least PATIENCE iterations and PATIENCE_RATIO of all
# iterations old. The residual of an accelerated solver oscillates, with a period that grows as its
# convergence slows down.
PATIENCE, PATIENCE_RATIO = 3, 0.25
GO_ON = -1
CONVERGED, STALLED, ITERATION_LIMIT, DIVERGED, AT_ROUNDING, SADDLE = map(
    int,
    (
        Outcome.CONVERGED,
        Outcome.STALLED,
        Outcome.ITERATION_LIMIT,
        Outcome.DIVERGED,
        Outcome.AT_ROUNDING,
        Outcome.SADDLE,
    ),
)


def outcome_at(count, stop, residual, best, stuck, at_floor, at_rest):
    """Return the outcome after `count` iterations or GO_ON, and whether no iteration could follow.

    `stop` is the tolerance and the limit of iterations, `best` the iteration of the least residual.
    A solver is stuck if it could not improve its last iterate. `Iterate` defines at_floor and
    at_rest. The floor is an upper bound, often a thousand times the actual rounding error. A
    gradient below the floor therefore stops the solver only if the start is at rest, or once the
    least residual is no longer improved.
    """
    tolerance, limit = stop
    final = count >= limit
    if tolerance > 0 or final:
        since = count - best
        ended = stuck or (since >= PATIENCE and since >= PATIENCE_RATIO * count)
        rests = (ended and at_floor) or (count == 0 and at_rest)
        if residual <= tolerance:
            return CONVERGED, rests or stuck or final
        if rests:
            return AT_ROUNDING, True
        if stuck:
            return STALLED, True
    return ITERATION_LIMIT if final else GO_ON, final
