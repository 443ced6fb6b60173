"""What the timing needs of pytest: the folder of the records, and the cases not yet on record."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from bench.harness.machine import stamp
from bench.harness.record import Record, RecordFile
from bench.harness.run import TIMING, is_done, now

from .case import Case
from .cases import cases


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the folder of the records."""
    parser.addoption("--records", required=True, type=Path, help="folder of the result file")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Give the test every case without a record of at least this length."""
    present = {r.key: r for r in RecordFile(metafunc.config.getoption("--records")).read().records}
    length = seconds(metafunc.config)
    todo = [case for case in cases() if not is_done(present.get(case.key), length)]
    metafunc.parametrize("case", todo, ids=[case.name for case in todo])


@pytest.fixture
def keep(request: pytest.FixtureRequest) -> Callable[[Case, Sequence[float], str], None]:
    """Return a function that stores the rounds of a case, or why it failed, at once."""
    file = RecordFile(request.config.getoption("--records"))

    def store(case: Case, rounds: Sequence[float], failed: str) -> None:
        arrays = {
            "seconds": np.array(rounds) / case.operations,
            "moved": np.array(case.moved / case.operations),
        }
        record = Record(
            TIMING,
            case.work.problem,
            case.solver,
            case.settings,
            seconds(request.config),
            {} if failed else arrays,
            {"failed": failed} if failed else {},
            stamp(),
            now(),
            float(np.sum(rounds)),
            case.facts,
        )
        file.append([record])

    return store


def seconds(config: pytest.Config) -> float:
    """Return how long a case is timed."""
    return float(config.getoption("benchmark_max_time"))
