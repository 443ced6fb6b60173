"""Cases to be timed in a worker's process, by pytest-benchmark: each a little, again and again."""

import contextlib
import io
import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from ...harness.progress import announce
from ...harness.record import Key
from ...harness.worker import Done, Found, Message, Unfit
from ...peers.protocol import describe
from .case import Case
from .cases import cases

# Cases are gone through so often, in an order by lot, so that what a machine drifts meanwhile falls
# on all of them; nine is the least of which a median's interval leaves out the extremes.
SWEEPS = 9
# Rounds of a case, together; and lines of what pytest says that are kept if it fails.
ROUNDS, LAST_LINES = 200, 20


class Timed:
    """A plugin of pytest: cases to be timed, their rounds [s], and why there are none.

    Attributes:
        cases: what is timed.
        order: the numbers of the cases, sweep after sweep, those of a sweep in an order by lot.
        rounds: the seconds of one call, for each case a list for each sweep.
        iterations: how many calls make a round of each case, once that is known.
        paces: how long a fixed loop took beside each measurement.
        troubles: what each case raised first.
    """

    def __init__(self, cases: Sequence[Case]) -> None:
        self.cases = cases
        lot = np.random.default_rng(len(cases))
        self.order = [i for _ in range(SWEEPS) for i in lot.permutation(len(cases)).tolist()]
        self.rounds: list[list[list[float]]] = [[] for _ in cases]
        self.iterations = [0 for _ in cases]
        self.paces: list[float] = []
        self.troubles = ["" for _ in cases]
        self._calls: dict[int, Callable[[], Any]] = {}

    def call(self, number: int) -> Callable[[], Any]:
        """Return the call of a case, which is prepared once."""
        if number not in self._calls:
            self._calls[number] = self.cases[number].prepare()
        return self._calls[number]

    def pytest_generate_tests(self, metafunc: pytest.Metafunc) -> None:
        """Make a test of each measurement, in their order."""
        metafunc.parametrize("step", range(len(self.order)))

    @pytest.fixture
    def timed(self) -> "Timed":
        """Hand the cases to the benchmark, and take the rounds."""
        return self

    def pytest_runtest_logfinish(self) -> None:
        """Say which sweep it is."""
        sweep = max(map(len, self.rounds))
        announce(f"{self.cases[0].work.group}, sweep {sweep} of {SWEEPS}")

    def pytest_exception_interact(self, node: Any, call: pytest.CallInfo[Any]) -> None:
        """Keep what a case raised first."""
        if call.excinfo is not None and isinstance(call.excinfo.value, Exception):
            number = self.order[node.callspec.params["step"]] if hasattr(node, "callspec") else 0
            self.troubles[number] = self.troubles[number] or describe(call.excinfo.value)


class TimingJob(NamedTuple):
    """Cases that are compared, by the keys of their records, and how long each is timed [s]."""

    cases: tuple[Key, ...]
    seconds: float

    def perform(self) -> Iterator[Message]:
        """Yield the rounds of the cases, (case, sweep, round), or why there are none of any."""
        known = {case.key: case for case in cases()}
        timed = Timed([known[key] for key in self.cases])
        with tempfile.TemporaryDirectory() as storage:
            last = _run(timed, arguments(self.seconds, storage))
        if any(timed.rounds):
            found = {"rounds": timed.rounds, "paces": timed.paces, "troubles": timed.troubles}
            yield Found(found)
            yield Done()
        else:
            yield Unfit(next(filter(None, timed.troubles), last))


def _run(timed: Timed, options: list[str]) -> str:
    """Run pytest; return the last lines of what it says."""
    os.environ["PYTEST_ADDOPTS"] = ""  # options of the user's own test runs are not meant here
    os.environ.pop("PYTEST_XDIST_WORKER", None)  # nor are their parallel processes
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        pytest.main(options, [timed])
    return "".join(said.getvalue().splitlines(keepends=True)[-LAST_LINES:]).strip()


def arguments(seconds: float, storage: str) -> list[str]:
    """Return pytest's arguments: no configuration but ours, and so many seconds for each case.

    pytest-benchmark makes a folder for results of its own, which lies in `storage`.
    """
    here = Path(__file__).parent
    return [
        str(here / "time_cases.py"),
        *("-c", os.devnull, "--rootdir", str(here), "--import-mode=importlib"),
        *("-p", "no:cacheprovider", "-s", "-q"),
        f"--benchmark-storage=file://{storage}",
        f"--benchmark-max-time={seconds / SWEEPS}",
        f"--benchmark-min-time={seconds / ROUNDS}",
        *("--benchmark-min-rounds=1", "--benchmark-disable-gc", "--benchmark-warmup=off"),
    ]
