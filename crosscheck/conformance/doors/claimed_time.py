"""Whether the times that a program claims agree with what its processes are seen to compute.

A request costs time beside the solver's: JSON, pipes, garbage collection. A larger message costs no
less, so that the cheapest of all as large bounds this cost; far more is allowed. Main threads only
are looked at: others may compute beside them, or wait by spinning.
"""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..sentence import Sentence, sentence
from .processes import family, main_thread_seconds

# So many calls are compared, then again after as many more; the last ones are kept.
CALLS, KEPT = 10, 40
# A call contradicts its claim if it computes more than so many times as long, its messages aside.
FACTOR = 10.0
# Messages cost at most so much, and so much a byte [s]; so many times what is seen is allowed.
MESSAGE, BYTE, ALLOWED = 5e-3, 3e-7, 3.0
# Equal calls may differ by so much [s].
NOISE = 5e-4


class Call(NamedTuple):
    """The seconds claimed, those that the busiest process computed, and the bytes of messages."""

    claimed: float
    computed: float
    size: int


class ClaimedTimes:
    """The calls of a program, with what its processes are seen to compute."""

    def __init__(self, leader: int) -> None:
        self._leader = leader
        self.forget()

    def forget(self) -> None:
        """Forget all calls, and look which processes there are now."""
        self._processes = [process.pid for process in family(self._leader)]
        self._calls: deque[Call] = deque(maxlen=KEPT)
        self._count = 0

    def begin(self) -> None:
        """Begin a call."""
        self._before = self._computed()

    def end(self, claimed: float, size: int) -> Sentence | None:
        """Return why the times that are claimed cannot be, as far as is seen after this call."""
        computed = float(np.max(self._computed() - self._before))
        self._calls.append(Call(claimed, computed, size))
        self._count += 1
        if self._count % CALLS or not contradicts(self._calls):
            return None
        claimed, computed, _ = np.sum(self._calls, axis=0).tolist()
        return sentence(
            "Timed by round trips: it claims {claimed:.2g} s for {count} requests over which its "
            "process computed for {computed:.2g} s.",
            claimed=claimed,
            count=len(self._calls),
            computed=computed,
        )

    def _computed(self) -> np.ndarray:
        """Return how long each process has computed so far [s]."""
        return np.array([main_thread_seconds(process) for process in self._processes])


def contradicts(calls: Sequence[Call]) -> bool:
    """Return whether most calls compute far longer than is claimed for them."""
    claimed, computed, size = np.array(sorted(calls, key=lambda call: -call.size)).T
    beside = computed - claimed
    messages = np.minimum(np.minimum.accumulate(beside), MESSAGE + BYTE * size)
    excess = beside - ALLOWED * np.maximum(messages, 0.0) - NOISE
    return bool(np.mean(excess > (FACTOR - 1.0) * claimed) > 0.5)
