"""Measure another revision and ours side by side, the order of each pair drawn by lot.

Both run in processes of their own, which are fresh for each round of pairs, since a process is
fast or slow by the accident of its addresses too.
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

from plumbob.crosscheck.child_process import ChildProcess, LostError, one_thread

from ..harness.metrics import adjusted
from ..harness.record import Record, untyped
from . import revision_process
from .answers import is_clocked
from .compare import Comparison, decide
from .rows import Pair, Ratio, RowKey, by_row, come_and_gone, is_meant, pairs, row_key, worst_first
from .times import (
    ERROR_RATE,
    FLOOR,
    UNKNOWN,
    Deviation,
    Drift,
    known_drift,
    pairs_needed,
    ratio_of_pairs,
)

# Pairs of median times, old and new, of each time of each row.
Taken = dict[tuple[RowKey, str], list[tuple[float, float]]]
Ratios = dict[tuple[RowKey, str], Ratio]

SEED = 20130
PREFIX = "plumbob-rerun-"
HOW = (
    "Both revisions are measured side by side in fresh processes, {pairs} times each, the order "
    "drawn by lot. Answers are compared to the bit. Times are decided by Wilcoxon's signed-rank "
    "test, exact by that lot; the chance of calling any row wrongly is held at "
    f"{100 * ERROR_RATE:g} % over all rows (Holm), and what is called is measured a second time."
)


class Plan(NamedTuple):
    """What is measured again.

    Attributes:
        revision: what git knows the other revision by.
        suites: the suites.
        words: only problems or solvers that contain one of these; all if there are none.
        pairs: how many pairs; 0 for as many as the number of rows needs.
        scale: how much is measured each time.
        seed: of the order.
    """

    revision: str
    suites: tuple[str, ...]
    words: tuple[str, ...] = ()
    pairs: int = 0
    scale: str = "quick"
    seed: int = SEED


def rerun(plan: Plan, root: Path, tell: Callable[[str], None] = lambda _: None) -> Comparison:
    """Return what the working copy at a root does otherwise than another revision of it.

    Raises:
        ValueError: if there is no such revision, nothing to measure in both, or a process ends
            before it has measured all.
    """
    with _temporary_folder() as folder:
        old, new = folder / "old", folder / "new"
        _check_out(root, plan.revision, old)
        new.symlink_to(root, target_is_directory=True)  # so that both paths are as long
        return _measured((old, new), plan, tell)


def clone_root(folder: Path) -> Path:
    """Return the root of the clone of Plumbob that holds a folder.

    Raises:
        ValueError: if the folder is in no clone of Plumbob.
    """
    top_level = ["git", "-C", str(folder), "rev-parse", "--show-toplevel"]
    git = subprocess.run(top_level, capture_output=True, check=False)
    root = folder / os.fsdecode(git.stdout.removesuffix(b"\n"))
    project = root / "pyproject.toml"
    if project.is_file() and b'\nname = "plumbob"\n' in project.read_bytes():
        return root
    raise ValueError(
        "--rerun: expected to be run in a clone of Plumbob, whose revisions it measures, "
        f"got {folder}: change to a clone, or compare two folders of records"
    )


@contextlib.contextmanager
def _temporary_folder() -> Iterator[Path]:
    """Yield a locked folder; remove those whose process was killed, which ended its lock."""
    for old in Path(tempfile.gettempdir()).glob(f"{PREFIX}*/old"):
        with contextlib.suppress(OSError):
            _remove_abandoned(old.parent)
    with tempfile.TemporaryDirectory(prefix=PREFIX) as name, Path(name, "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield Path(name)


def _remove_abandoned(folder: Path) -> None:
    """Remove a folder of this user's that no process holds; others may have put any there."""
    status = folder.lstat()
    if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid():
        with Path(folder, "lock").open() as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(folder)


def _check_out(root: Path, revision: str, folder: Path) -> None:
    """Write the files of a revision to a new folder, of which the repository knows nothing.

    Raises:
        ValueError: if there is no such revision, or no room to write it.
    """
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
    """A process that measures blocks of one revision, by the sources in a folder."""

    def __init__(self, folder: Path, suites: Sequence[str], scale: str) -> None:
        command = [sys.executable, "-P", revision_process.__file__, str(folder), scale, *suites]
        environment = {**one_thread(), "PYTHONPATH": str(folder)}
        self._process = ChildProcess(command, folder=folder.parent, environment=environment)

    def blocks(self) -> list[list[str]]:
        """Return the keys of what there is to be measured: suite, problem, solver, settings."""
        return json.loads(self._answer())

    def measure(self, key: Sequence[str]) -> Record:
        """Return a fresh record of a block."""
        self._process.send(f"{json.dumps(key)}\n".encode())
        return untyped(self._answer())

    def _answer(self) -> str:
        try:
            line: bytes = self._process.receive()
        except LostError:
            last = self._process.last_words.decode(errors="replace").strip().splitlines()[-1:]
            why = " ".join(last) or "without a word"
            raise ValueError(f"a process of the rerun ended: {why}") from None
        return line.decode()

    def close(self) -> None:
        """End the process and what it has started."""
        self._process.end()


@contextlib.contextmanager
def _both(
    folders: tuple[Path, Path], plan: Plan, order: tuple[int, ...] = (0, 1)
) -> Iterator[tuple[Revision, Revision]]:
    """Yield a process of each revision, begun in this order: the first may find a cold machine."""
    with contextlib.ExitStack() as stack:
        made: dict[int, Revision] = {}
        for i in order:
            made[i] = Revision(folders[i], plan.suites, plan.scale)
            stack.callback(made[i].close)
        yield made[0], made[1]


def _drawn(lot: np.random.Generator) -> tuple[int, ...]:
    """Return the order of old, 0, and new, 1, drawn by lot."""
    return (1, 0) if lot.integers(2) else (0, 1)


def _measured(folders: tuple[Path, Path], plan: Plan, tell: Callable[[str], None]) -> Comparison:
    """Measure once for the answers, which also compiles, and then pair by pair for the times."""
    old, new = (by_row(records) for records in _answers(folders, plan, tell))
    rows = pairs(old, new)
    taken = _take_pairs(folders, plan, rows, tell)
    ratios = _ratios(taken)
    count = max(map(len, taken.values()), default=0)
    if called := _called(ratios):
        again = plan._replace(seed=plan.seed + 1, pairs=count)
        few = {key: rows[key] for key, _ in called}
        ratios |= _confirmed(called, _ratios(_take_pairs(folders, again, few, tell)))
    decided = [*come_and_gone(old, new), *decide(rows, ratios)]
    return Comparison(worst_first(decided), _drift(taken, count), HOW.format(pairs=count), True)


def _answers(
    folders: tuple[Path, Path], plan: Plan, tell: Callable[[str], None]
) -> list[list[Record]]:
    """Return the records of both revisions.

    Raises:
        ValueError: if there is nothing to measure.
    """
    with _both(folders, plan) as both:
        keys = [[key for key in one.blocks() if is_meant(key, plan.words)] for one in both]
        if not any(keys):
            raise ValueError(
                "--rerun: expected something to measure in both revisions, got nothing"
            )
        records = []
        for one, wanted in zip(both, keys, strict=True):
            tell(f"answers of {len(wanted)} rows")
            records.append(list(map(one.measure, wanted)))
    return records


def _ratios(taken: Taken) -> Ratios:
    """Return the ratio of each time; one too near to 1 to matter counts as chance."""
    ratios = {at: ratio_of_pairs(*np.array(values).T) for at, values in taken.items()}
    return {
        at: ratio._replace(chance=1.0) if abs(math.log(ratio.value)) < FLOOR else ratio
        for at, ratio in ratios.items()
    }


def _called(ratios: Ratios) -> Ratios:
    """Return what would be called faster or slower."""
    chances = adjusted([ratio.chance for ratio in ratios.values()])
    return {at: ratios[at] for at, chance in zip(ratios, chances, strict=True)
            if chance <= ERROR_RATE}  # fmt: skip


def _confirmed(called: Ratios, again: Ratios) -> Ratios:
    """Return what was called as it was measured again; where that says otherwise, as chance.

    The second estimate is not one of those that were chosen for being large.
    """
    known = _called({at: ratio for at, ratio in again.items() if at in called})
    return {
        at: known[at]._replace(chance=first.chance)
        if at in known and (known[at].value > 1) == (first.value > 1)
        else first._replace(chance=1.0)
        for at, first in called.items()
    }


def _drift(taken: Taken, count: int) -> Drift:
    """Return by how much the old revision's times differ among themselves."""
    if not taken:
        return known_drift(0.0, "no times were compared")
    if count < 2:
        return known_drift(UNKNOWN, "assumed, for one pair does not tell")
    variances = [np.var(np.log(np.array(values)[:, 0]), ddof=1) for values in taken.values()]
    deviation = Deviation(math.sqrt(2 * np.mean(variances)), len(taken) * (count - 1))
    return Drift(deviation, f"the old revision beside itself, {count} times")


def _take_pairs(
    folders: tuple[Path, Path], plan: Plan, rows: Mapping[RowKey, Pair], tell: Callable[[str], None]
) -> Taken:
    """Return pairs of median times, old and new, of each time of each row."""
    timed = [pair for pair in rows.values() if all(map(_times, pair))]
    count = plan.pairs or pairs_needed(sum(len(_times(pair.old)) for pair in timed))
    lot = np.random.default_rng(plan.seed)
    taken: Taken = {}
    for i in range(count if timed else 0):
        tell(f"pair {i + 1} of {count}, {len(timed)} rows")
        with _both(folders, plan, _drawn(lot)) as both:
            for one in both:
                one.blocks()
            for j in lot.permutation(len(timed)):
                _take_pair(both, timed[j], _drawn(lot), taken)
    return taken


def _take_pair(
    both: tuple[Revision, Revision], pair: Pair, order: tuple[int, ...], taken: Taken
) -> None:
    medians = {i: _times(both[i].measure(pair[i].key)) for i in order}
    for name in medians[0].keys() & medians[1].keys():
        times = medians[0][name], medians[1][name]
        taken.setdefault((row_key(pair.old), name), []).append(times)


def _times(record: Record) -> dict[str, float]:
    """Return the medians of the times of a record."""
    medians = {
        name: float(np.median(values)) for name, values in record.arrays.items()
        if is_clocked(record.suite, name) and values.size
    }  # fmt: skip
    return {name: value for name, value in medians.items() if value > 0}
