"""The cases of the timing for pytest-benchmark, outside of the report.

Run `pytest tools/time_cases.py --benchmark-autosave`, and the same with
`--benchmark-compare` after a change; `-k linearised` chooses by name.
"""

from typing import Any

import pytest

from plumbob.bench.experiments.timing import TimedCase, cases
from plumbob.reference import set_backend, set_num_threads


@pytest.mark.parametrize("case", cases(), ids=lambda case: case.name)
def test_speed(benchmark: Any, case: TimedCase) -> None:
    """Time a case as pytest-benchmark does; its first call, which may compile, is not counted."""
    with set_backend(case.backend), set_num_threads(case.cores):
        call = case.prepare()
        call()
        benchmark(call)
