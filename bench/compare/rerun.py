"""Measure another revision beside the working copy, the order of each pair drawn at random.

Each round of pairs uses fresh processes: the speed of a process depends on its addresses too.
"""

import contextlib
import fcntl
import json
import math
import os
import shutil
import stat
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from plumbob.process.child import ChildProcess, LostError, one_thread

from ..measure.metrics import adjusted
from ..measure.record import Record, untyped
from . import revision_process
from .answers import is_time
from .compare import RunComparison, row_changes
from .rows import Pair, RowKey, TimeRatio, by_row, contains_any, match_rows, row_key, worst_first
from .times import ERROR_RATE, FLOOR, UNKNOWN, Drift, assumed_drift, pairs_needed, ratio_of_pairs

# Pairs of median times, old and new, of each time of each row.
TimePairs = dict[tuple[RowKey, str], list[tuple[float, float]]]
TimeRatios = dict[tuple[RowKey, str], TimeRatio]

SEED = 20130  # of the order in which a pair is measured
PREFIX = "plumbob-rerun-"
METHOD = (
    "Both revisions are measured side by side in fresh processes, {pairs} times each, in random "
    "order. Answers are compared to the bit. Times are compared by Wilcoxon's signed-rank test, "
    "exact by that order; the probability of any wrong verdict is at most "
    f"{100 * ERROR_RATE:g} % over all rows (Holm), and each difference is measured a second time."
)


class Plan(NamedTuple):
    """A comparison of two revisions."""

    revision: str  # the name of the other revision in git
    suites: tuple[str, ...]  # to measure
    words: tuple[str, ...] = ()  # only problems or solvers that contain one of these; all if empty
    pairs: int = 0  # number of pairs; 0 for as many as the number of rows needs
    scale: str = "quick"  # of each measurement
    seed: int = SEED  # of the order
    solvers: tuple[str, ...] = ()  # addresses of the user's solvers; the bench's own if none
    place: Path = Path()  # where the addresses are from, below the root of the repository


def rerun(plan: Plan, place: Path, tell: Callable[[str], None] = lambda _: None) -> RunComparison:
    """Return the differences between a revision and the working copy that contains a folder.

    Solvers of the user's are addressed from this folder; else the repository is Plumbob's.

    Raises:
        ValueError: if the folder is in no such repository, there is no such revision, nothing to
            measure in both, or a process ends before all is measured.
    """
    root = _repository(place, plan)
    with _temporary_folder() as folder:
        old, new = folder / "old", folder / "new"
        _check_out(root, plan.revision, old)
        new.symlink_to(root, target_is_directory=True)  # so that both paths are as long
        plan = plan._replace(place=place.resolve().relative_to(root) if plan.solvers else Path())
        return _measure(_Bench((old, new), plan, tell))


def _repository(folder: Path, plan: Plan) -> Path:
    """Return the root of the repository that contains a folder."""
    command = ["git", "-C", str(folder), "rev-parse", "--show-toplevel"]
    git = subprocess.run(command, capture_output=True, check=False)
    root = folder / os.fsdecode(git.stdout.removesuffix(b"\n"))
    project = root / "pyproject.toml"
    is_own = project.is_file() and b'\nname = "plumbob"\n' in project.read_bytes()
    if git.returncode == 0 and (plan.solvers or is_own):
        return root.resolve()
    if plan.solvers:
        raise ValueError(f"--rerun: expected to be run in a git repository, got {folder}")
    raise ValueError(
        "--rerun: expected --with and a solver of yours, or to be run in a clone of Plumbob, got "
        f"{folder}"
    )


@contextlib.contextmanager
def _temporary_folder() -> Iterator[Path]:
    """Yield a locked folder; remove folders of this user after their process was killed."""
    for old in Path(tempfile.gettempdir()).glob(f"{PREFIX}*/old"):
        with contextlib.suppress(OSError):
            status = old.parent.lstat()
            if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid():
                with Path(old.parent, "lock").open() as lock:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(old.parent)
    with tempfile.TemporaryDirectory(prefix=PREFIX) as name, Path(name, "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield Path(name)


def _check_out(root: Path, revision: str, folder: Path) -> None:
    """Write the files of a revision to a new folder, without a trace in the repository."""
    archive, commit = f"{folder}.zip", f"{revision}^{{commit}}"
    command = ["git", "-C", str(root), "archive", "-o", archive, "--end-of-options", commit]
    git = subprocess.run(command, capture_output=True, check=False)
    reason = " ".join(git.stderr.decode(errors="replace").split())
    if git.returncode == 0:
        try:
            shutil.unpack_archive(archive, folder)
            return
        except OSError as error:
            reason = str(error)
    raise ValueError(
        f"--rerun: expected a revision that git can check out, got {revision!r} {reason}"
    )


class Revision:
    """A process that measures blocks of a revision, by the sources in a folder.

    Modules of the user's are searched at the place of their address, in `src` and in the root.
    """

    def __init__(self, folder: Path, plan: Plan) -> None:
        self._name = plan.revision if folder.name == "old" else "the working copy"
        place, path = folder / plan.place, [str(folder)]
        command = [sys.executable, "-P", revision_process.__file__]
        command += [str(place), plan.scale, json.dumps(plan.suites)]
        if plan.solvers:
            command.append(json.dumps(plan.solvers))
            path = [str(place), str(folder / "src"), *path, os.environ.get("PYTHONPATH", "")]
        environment = {**one_thread(), "PYTHONPATH": os.pathsep.join(path)}
        self._process = ChildProcess(command, folder=folder.parent, environment=environment)

    def blocks(self) -> list[list[str]]:
        """Return the keys of all blocks: suite, problem, solver, settings."""
        return json.loads(self._answer())

    def measure(self, key: Sequence[str]) -> Record:
        """Return a new record of a block."""
        self._process.send(f"{json.dumps(key)}\n".encode())
        return untyped(self._answer())

    def _answer(self) -> str:
        try:
            return self._process.receive().decode()
        except LostError:
            last = self._process.last_words.decode(errors="replace").strip().splitlines()[-1:]
            reason = " ".join(last) or "without a word"
            raise ValueError(f"--rerun: {self._name} cannot be measured: {reason}") from None

    def close(self) -> None:
        """End the process and its children."""
        self._process.end()


class _Bench(NamedTuple):
    """The folders of both revisions, the plan, and a function to show progress."""

    folders: tuple[Path, Path]
    plan: Plan
    tell: Callable[[str], None]

    @contextlib.contextmanager
    def processes(self, order: Sequence[int] = (0, 1)) -> Iterator[tuple[Revision, Revision]]:
        """Yield a process of each revision, started in this order."""
        with contextlib.ExitStack() as stack:
            revisions = {}
            for i in order:
                revisions[i] = Revision(self.folders[i], self.plan)
                stack.callback(revisions[i].close)
            yield revisions[0], revisions[1]


def _measure(bench: _Bench) -> RunComparison:
    """Measure once for the answers, which also compiles, and then pair by pair for the times."""
    old, new = _measure_answers(bench)
    pairs, changes = match_rows(old, new)
    times = _measure_times(bench, pairs)
    count = max(map(len, times.values()), default=0)
    ratios = _ratios(times)
    if decided := _decided(ratios):
        second = bench._replace(plan=bench.plan._replace(seed=bench.plan.seed + 1, pairs=count))
        repeated = _measure_times(second, {key: pairs[key] for key, _ in decided})
        ratios |= _confirmed(decided, _ratios(repeated))
    rows = worst_first([*changes, *row_changes(pairs, ratios, bool(bench.plan.solvers))])
    return RunComparison(rows, _drift(times, count), METHOD.format(pairs=count), is_rerun=True)


def _measure_answers(bench: _Bench) -> list[dict[RowKey, Record]]:
    """Return the records of both revisions by row."""
    rows = []
    with bench.processes() as revisions:
        keys = [
            [key for key in revision.blocks() if contains_any(key, bench.plan.words)]
            for revision in revisions
        ]
        if not any(keys):
            raise ValueError(
                "--rerun: expected something to measure in both revisions, got nothing"
            )
        for revision, blocks in zip(revisions, keys, strict=True):
            bench.tell(f"answers of {len(blocks)} rows")
            rows.append(by_row(map(revision.measure, blocks)))
    return rows


def _measure_times(bench: _Bench, rows: Mapping[RowKey, Pair]) -> TimePairs:
    """Return pairs of median times of each time of each row, in random order."""
    clocked = [pair for pair in rows.values() if all(map(_median_times, pair))]
    needed = pairs_needed(sum(len(_median_times(pair.old)) for pair in clocked))
    count = (bench.plan.pairs or needed) if clocked else 0
    rng = np.random.default_rng(bench.plan.seed)
    times: TimePairs = {}
    for i in range(count):
        bench.tell(f"pair {i + 1} of {count}, {len(clocked)} rows")
        with bench.processes(_random_order(rng)) as revisions:
            for revision in revisions:
                revision.blocks()
            for j in rng.permutation(len(clocked)):
                pair = clocked[j]
                order = _random_order(rng)
                medians = {k: _median_times(revisions[k].measure(pair[k].key)) for k in order}
                for name in medians[0].keys() & medians[1].keys():
                    time = row_key(pair.old), name
                    times.setdefault(time, []).append((medians[0][name], medians[1][name]))
    return times


def _random_order(rng: np.random.Generator) -> tuple[int, int]:
    return (1, 0) if rng.integers(2) else (0, 1)


def _median_times(record: Record) -> dict[str, float]:
    """Return the medians of a record's positive times [s]."""
    medians = {
        name: float(np.median(array)) for name, array in record.numbers().items()
        if is_time(record.suite, name) and array.size
    }  # fmt: skip
    return {name: median for name, median in medians.items() if median > 0}


def _ratios(times: TimePairs) -> TimeRatios:
    """Return the ratio of each time; a ratio near 1 counts as chance."""
    ratios = {time: ratio_of_pairs(*np.array(pairs).T) for time, pairs in times.items()}
    return {
        time: ratio._replace(chance=1.0) if abs(math.log(ratio.ratio)) < FLOOR else ratio
        for time, ratio in ratios.items()
    }


def _decided(ratios: TimeRatios) -> TimeRatios:
    """Return the ratios different from 1 beyond chance."""
    chances = adjusted([ratio.chance for ratio in ratios.values()])
    return {time: ratios[time] for time, chance in zip(ratios, chances, strict=True)
            if chance <= ERROR_RATE}  # fmt: skip


def _confirmed(first: TimeRatios, second: TimeRatios) -> TimeRatios:
    """Return the second ratios of times decided twice alike; the others count as chance.

    The second estimate is unbiased, because no ratio was selected by its size.
    """
    repeated = _decided({time: ratio for time, ratio in second.items() if time in first})
    return {
        time: repeated[time]._replace(chance=ratio.chance)
        if time in repeated and (repeated[time].ratio > 1) == (ratio.ratio > 1)
        else ratio._replace(chance=1.0)
        for time, ratio in first.items()
    }


def _drift(times: TimePairs, count: int) -> Drift:
    """Return how much the old revision's times differ among themselves."""
    if not times:
        return assumed_drift(0.0, "no times were compared")
    if count < 2:
        return assumed_drift(UNKNOWN, "assumed: one pair does not measure it")
    variances = [np.var(np.log(np.array(pairs)[:, 0]), ddof=1) for pairs in times.values()]
    sigma = math.sqrt(2 * np.mean(variances))
    freedom = len(times) * (count - 1)
    return Drift(sigma, freedom, f"the old revision beside itself, {count} times")
