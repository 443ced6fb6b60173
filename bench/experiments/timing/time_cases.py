"""The one benchmark, which pytest runs on the case that `job.Timed` holds."""

from typing import Any

from reference import set_backend, set_num_threads


def test_speed(benchmark: Any, timed: Any) -> None:
    """Time a case; the first call, which may compile, is not counted."""
    with set_backend(timed.case.backend), set_num_threads(timed.case.cores):
        call = timed.case.prepare()
        call()
        benchmark(call)
    timed.rounds = list(benchmark.stats.stats.data)
