"""The one benchmark: pytest runs it for each measurement of the cases that `job.Timed` holds."""

from typing import Any

from plumbob.reference import set_backend, set_num_threads

from ...harness.machine import pace

# A call that took less [s] is made once more, uncounted, before it is timed in a later sweep, so
# that caches are as in a loop of such calls.
QUICK = 1e-3


def test_speed(benchmark: Any, timed: Any, step: int) -> None:
    """Time a case for a while; its first call, which may compile, is not counted.

    As many calls make a round, and as many rounds are made, as the first time.
    """
    number = timed.order[step]
    if timed.troubles[number]:
        return
    case, before = timed.cases[number], timed.rounds[number]
    timed.paces.append(pace())
    with set_backend(case.backend), set_num_threads(case.cores):
        call = timed.call(number)
        if not before or min(before[0]) < QUICK:
            call()
        if before:
            loops = timed.iterations[number]
            benchmark.pedantic(call, rounds=len(before[0]), iterations=loops)
        else:
            benchmark(call)
            timed.iterations[number] = benchmark.stats.iterations
    before.append(list(benchmark.stats.stats.data))
