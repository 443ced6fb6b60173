"""Whether a program's claimed times agree with the processor time of its processes.

A request costs time beside the solver's: JSON, pipes, garbage collection. A larger message costs no
less. So the cheapest request of at least this size bounds the cost, its solution included; far more
is allowed. The claim is not subtracted: on a busy machine a claim includes waits of the process.
Main threads alone are measured: other threads may compute beside, or wait by spinning.
"""

from collections import deque
from collections.abc import Sequence

import numpy as np

from plumbob.process.tree import family, main_thread_seconds
from plumbob.text.sentence import Sentence, sentence

# So many requests are compared, then again after as many more; the last requests are kept.
COMPARED, WINDOW = 10, 40
# A request contradicts its claim by more than this multiple of processor time, messages aside.
FACTOR = 10.0
# Messages cost at most so much, and so much a byte [s]; so many times what is seen is allowed.
MESSAGE, BYTE, ALLOWED = 5e-3, 3e-7, 3.0
# Equal requests may differ by so much [s].
NOISE = 5e-4

# The claimed seconds, the processor time of the busiest process, and the bytes of both messages.
Request = tuple[float, float, int]


class ClaimedTimes:
    """The last requests to a program, compared with the processor time of its processes."""

    def __init__(self, leader: int) -> None:
        self._processes = [process.pid for process in family(leader)]
        self._requests: deque[Request] = deque(maxlen=WINDOW)
        self._count = 0

    def begin(self) -> None:
        """Begin a request."""
        self._before = [main_thread_seconds(process) for process in self._processes]

    def end(self, claim: float, size: int) -> Sentence | None:
        """Return why the claimed times are impossible, as far as known after this request."""
        now = map(main_thread_seconds, self._processes)
        computed = (after - before for after, before in zip(now, self._before, strict=True))
        self._requests.append((claim, max(computed, default=0.0), size))
        self._count += 1
        if self._count % COMPARED or not contradicts(self._requests):
            return None
        claim, used, _ = np.sum(self._requests, axis=0).tolist()
        return sentence(
            "Timed by round trips: it claims {claimed:.2g} s for {count} requests over which its "
            "process computed for {computed:.2g} s.",
            claimed=claim,
            count=len(self._requests),
            computed=used,
        )


def contradicts(requests: Sequence[Request]) -> bool:
    """Return whether most requests compute far longer than their claims."""
    claim, computed, size = np.array(sorted(requests, key=lambda request: -request[2])).T
    messages = np.minimum(np.minimum.accumulate(computed), MESSAGE + BYTE * size)
    excess = computed - claim - ALLOWED * messages - NOISE
    return bool(np.mean(excess > (FACTOR - 1.0) * claim) > 0.5)
