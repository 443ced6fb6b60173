"""The user's solver in this worker's child, opened at its first use."""

from collections.abc import Mapping
from typing import Any

from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.connections import ProcessLimits, open_connection
from plumbob.verify.exchange import Failure
from plumbob.verify.greeting import Greeting
from plumbob.verify.message import NO_SECONDS

from ..clock import time_call
from .protocol import NoAnswerError, OwnTime
from .user_solver import Spec

# The bench itself loses patience with a silent worker sooner.
LIMITS = ProcessLimits(first=900.0, request=900.0, line=1 << 26)
_ABOUT = sentence("")
ROUND_TRIPS = 'timed by the round trip of a request, for want of valid "seconds"'


class SolverConnection:
    """An open solver.

    Attributes:
        remark: how its times are taken, where that is not by its own clock.
    """

    def __init__(self, spec: Spec) -> None:
        self._solver, self.remark = open_connection(spec, LIMITS), ""

    @property
    def greeting(self) -> Greeting:
        """Its description of itself."""
        return self._solver.greeting

    def close(self) -> None:
        """End it."""
        self._solver.close()

    def answer(self, task: str, inputs: Mapping[str, Any]) -> tuple[Mapping[str, Any], OwnTime]:
        """Return its answer and its time, or raise NoAnswerError without an answer."""
        case = Case("of the bench", task, inputs, "bench", _ABOUT)
        answer, round_trip = time_call(lambda: self._solver.answer(case))
        if isinstance(answer, Failure):
            raise NoAnswerError(str(answer.sentence))
        count, limit = answer.values.get("iterations", 0), inputs.get("max_iterations", 0)
        if count > limit:
            raise NoAnswerError(
                f"iterations: expected 0 to {limit}, the max_iterations sent, got {count}"
            )
        doubt = "" if answer.untimed in (None, NO_SECONDS) else str(answer.untimed)
        if not doubt and (answer.untimed or not answer.seconds):
            self.remark = ROUND_TRIPS
        return answer.values, OwnTime(answer.seconds or round_trip, round_trip, doubt)


_connections: dict[Spec, SolverConnection] = {}


def connection(spec: Spec) -> SolverConnection:
    """Return an open solver; others stay open, for solvers take turns, and end with the process."""
    solver = _connections.pop(spec) if spec in _connections else SolverConnection(spec)
    _connections[spec] = solver
    return solver


def remark() -> str:
    """Return how the times of the last solver are taken, if not by its own clock."""
    return list(_connections.values())[-1].remark if _connections else ""
