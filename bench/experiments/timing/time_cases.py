"""The one benchmark, run on every case by `pytest -p bench.experiments.timing.plugin`."""

from bench.harness.progress import tell
from reference import set_backend, set_num_threads


def test_speed(benchmark, case, keep):
    """Time a case; the first call, which may compile, is not counted."""
    tell(case.name, "measuring")
    try:
        with set_backend(case.backend), set_num_threads(case.cores):
            call = case.prepare()
            call()
            benchmark(call)
    except Exception as error:  # one that fails must not cost the others
        failed = f"{type(error).__name__}: {error}"
        keep(case, [], failed)
        tell(case.name, "failed", failed)
        return
    keep(case, benchmark.stats.stats.data, "")
    tell(case.name, "measured")
