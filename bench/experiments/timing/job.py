"""A case to be timed in a worker's process, by pytest-benchmark."""

import contextlib
import io
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from ...harness.record import Key
from ...harness.worker import Done, Found, Message, Unfit, describe
from .case import Case
from .cases import cases

# At most so many rounds of a benchmark are kept, and so many lines of what pytest says if it fails.
ROUNDS, LAST_LINES = 200, 20


class Timed:
    """A plugin of pytest: the case to be timed, its rounds [s], and why there are none."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.rounds: list[float] = []
        self.trouble = ""

    @pytest.fixture
    def timed(self) -> "Timed":
        """Hand the case to the benchmark, and take the rounds."""
        return self

    def pytest_exception_interact(self, call: pytest.CallInfo[Any]) -> None:
        """Keep what the case raised first."""
        if call.excinfo is not None and isinstance(call.excinfo.value, Exception):
            self.trouble = self.trouble or describe(call.excinfo.value)


class TimingJob(NamedTuple):
    """A case, by the key of its record, and how long it is timed [s]."""

    case: Key
    seconds: float

    def perform(self) -> Iterator[Message]:
        """Yield the rounds of the case, or why there are none."""
        timed = Timed(next(case for case in cases() if case.key == self.case))
        with tempfile.TemporaryDirectory() as storage:
            last = _run(timed, arguments(self.seconds, storage))
        if timed.rounds:
            yield Found({"seconds": timed.rounds})
            yield Done()
        else:
            yield Unfit(timed.trouble or last)


def _run(timed: Timed, options: list[str]) -> str:
    """Run pytest; return the last lines of what it says."""
    os.environ["PYTEST_ADDOPTS"] = ""  # options of the user's own test runs are not meant here
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        pytest.main(options, [timed])
    return "".join(said.getvalue().splitlines(keepends=True)[-LAST_LINES:]).strip()


def arguments(seconds: float, storage: str) -> list[str]:
    """Return pytest's arguments: no configuration but ours, and so many seconds for the case.

    pytest-benchmark makes a folder for results of its own, which lies in `storage`.
    """
    here = Path(__file__).parent
    return [
        str(here / "time_cases.py"),
        *("-c", os.devnull, "--rootdir", str(here), "--import-mode=importlib"),
        *("-p", "no:cacheprovider", "-s", "-q"),
        f"--benchmark-storage=file://{storage}",
        f"--benchmark-max-time={seconds}",
        f"--benchmark-min-time={seconds / ROUNDS}",
        *("--benchmark-min-rounds=5", "--benchmark-disable-gc", "--benchmark-warmup=off"),
    ]
