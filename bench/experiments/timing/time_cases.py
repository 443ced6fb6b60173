"""The one benchmark, which pytest runs on the case that `job.Timed` holds."""

from reference import cores, speed


def test_speed(benchmark, timed):
    """Time a case; the first call, which may compile, is not counted."""
    with speed(timed.case.speed), cores(timed.case.cores):
        call = timed.case.prepare()
        call()
        benchmark(call)
    timed.rounds = list(benchmark.stats.stats.data)
