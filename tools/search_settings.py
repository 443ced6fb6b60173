"""Search the settings of all solvers for robots, ours included, on the tuning robots.

    python tools/search_settings.py [--solver NAME ...] [--results FILE]

Every solver gets the same care: at most 64 settings, listed in the file beside, on the same 200
targets of each tuning robot, which no table of the bench contains. All settings are tried on the
first targets; the best quarter, the authors' defaults and the bench's earlier settings on all. The
file of results continues an interrupted search.
"""

import argparse
import contextlib
import functools
import importlib
import itertools
import json
import math
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from plumbob.bench.experiments.robots import TOLERANCE
from plumbob.bench.harness.isolation import WorkerProcess
from plumbob.bench.harness.metrics import CONFIDENCE, chance_of_pairs, shifted_geometric_mean
from plumbob.bench.harness.timing import attempt, digest_of, restarted, seed_shared_generators
from plumbob.bench.peers.catalogue import PEERS
from plumbob.bench.peers.peer import Peer
from plumbob.bench.problems.evaluate import Targets, arbiter_of, evaluator_of
from plumbob.bench.problems.robot_targets import STRATA, robot_targets
from plumbob.bench.problems.robots import TUNING

RESULTS = Path(__file__).with_name("settings.jsonl")
# Settings of a solver at the most, targets of each robot, and those on which all are tried.
MAXIMUM, COUNT, SCREENED = 64, 200, 40
SEED = 2011
# Processor times within this factor of each other are taken for equal.
EQUAL_TIMES = 1.25
# Added to times before their geometric mean, and subtracted from it [s].
_SHIFT = 1e-5
# A worker is ended that has not finished a robot after so long [s].
_PATIENCE = 3600.0
Settings = dict[str, Any]


class SettingsSearch(NamedTuple):
    """The settings of a solver, from one start or with restarts."""

    solver: str
    start: str  # `ONE_START` or `RESTARTS`
    default: Settings  # of its authors
    before: Settings  # of the bench before the search
    candidates: tuple[Settings, ...]  # the settings among which is chosen, the default first

    @property
    def peer(self) -> Peer:
        """The solver."""
        return next(peer for peer in PEERS if peer.title == self.solver)

    @property
    def settings(self) -> list[Settings]:
        """All settings that are tried."""
        return [*self.candidates, *([] if self.before in self.candidates else [self.before])]


class SettingsTrial(msgspec.Struct, frozen=True):
    """A solver with settings on the first targets of each tuning robot."""

    solver: str
    start: str
    settings: dict[str, Any]
    version: str  # of the solver's package
    targets: int  # of each robot
    microseconds: float  # of processors for a target, the geometric mean
    bits: str  # whether it solves each target, robot by robot, four in a digit to base 16
    exceptions: int = 0  # targets over which it raised, or its process was lost
    trouble: str = ""  # the first of these

    @property
    def solved(self) -> np.ndarray:
        """Whether it solves each target, (robot, target)."""
        bits = np.unpackbits(np.frombuffer(bytes.fromhex(self.bits), dtype=np.uint8))
        count = len(TUNING) * self.targets
        return bits[:count].reshape(len(TUNING), self.targets).astype(bool)

    @property
    def share(self) -> float:
        """The share of targets that it solves."""
        return float(np.mean(self.solved))


def searches() -> list[SettingsSearch]:
    """Return the searches of `tuning.toml`."""
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    return [_search(**row) for row in tomllib.loads(text)["searches"]]


def _search(
    solver: str, start: str, default: Settings, before: Settings, axes: list[dict[str, list[Any]]]
) -> SettingsSearch:
    points = [
        [dict(zip(axis, values, strict=True)) for values in zip(*axis.values(), strict=True)]
        for axis in axes
    ]
    products = [functools.reduce(dict.__or__, parts) for parts in itertools.product(*points)]
    candidates = [default, *(settings for settings in products if settings != default)]
    return SettingsSearch(solver, start, default, before, tuple(candidates))


def tuning_targets(name: str, count: int) -> Targets:
    """Return the first targets of a tuning robot, the strata alternating, and random starts."""
    targets = robot_targets(name, -(-COUNT // len(STRATA)), SEED)
    return Targets(*(part[:count] for part in targets))


def answers(peer: Peer, name: str, count: int, settings: Settings) -> dict[str, Any]:
    """Return a solver's answers to targets of a robot, and their processor times [s]."""
    options, robot = dict(settings), evaluator_of(name).robot
    restarts = options.pop("bench_restarts", 0)
    ask = importlib.import_module(peer.module).prepare(robot, TOLERANCE, **options)
    ask = restarted(ask, robot, restarts) if restarts else ask
    targets, seconds, errors = tuning_targets(name, count), [], []
    attempt(ask(targets.request(0)))  # which compiles
    q = np.full(targets.starts.shape, math.nan)
    for i in range(count):
        solve = ask(request := targets.request(i))
        seed_shared_generators(digest_of(*request))
        output = attempt(solve)
        q[i] = math.nan if output.q is None else output.q
        errors += [output.error] if output.error else []
        seconds.append(output.time.seconds if output.time else math.nan)
    return {"q": q, "seconds": seconds, "errors": errors}


def trial(
    worker: WorkerProcess, search: SettingsSearch, settings: Settings, count: int
) -> SettingsTrial:
    """Try settings in a worker's process; a robot over which that is lost is not solved."""
    solved = np.zeros((len(TUNING), count), dtype=bool)
    seconds, errors = list[float](), list[str]()
    for robot, name in enumerate(TUNING):
        try:
            values = worker.calculate(answers, search.peer, name, count, settings)
            targets = tuning_targets(name, count)
            engine = arbiter_of(search.peer.built_on)
            evaluation = evaluator_of(name).evaluate(targets, values["q"], TOLERANCE, engine)
            solved[robot] = evaluation.solved
            seconds += values["seconds"]
            errors += values["errors"]
        except RuntimeError as error:
            errors += [f"{name}: {error}"] * count
    time = 1e6 * shifted_geometric_mean(np.array(seconds), _SHIFT).value if seconds else 0.0
    bits = np.packbits(solved).tobytes().hex()
    names = (*search[:2], settings, search.peer.version)
    return SettingsTrial(
        *names, count, round(time, 1), bits, len(errors), errors[0] if errors else ""
    )


def finalists(search: SettingsSearch, trials: Sequence[SettingsTrial]) -> list[Settings]:
    """Return the settings to try on all targets, from their trials on the first."""
    candidates = [trial for trial in trials if trial.settings in search.candidates]
    order = sorted(candidates, key=lambda trial: -trial.share)[: math.ceil(len(candidates) / 4)]
    best = [*(trial.settings for trial in order), search.default, search.before]
    return [settings for i, settings in enumerate(best) if settings not in best[:i]]


def best_trial(search: SettingsSearch, trials: Sequence[SettingsTrial]) -> SettingsTrial:
    """Return the best of the trials on all targets.

    Trials tie with the greatest share that McNemar's paired test cannot tell from it. Of these,
    those tie whose times are equal to the fastest; of these it is the default, if there and without
    exceptions, or the one with the greatest share.
    """
    candidates = [trial for trial in trials if trial.settings in search.candidates]
    best = max(candidates, key=lambda trial: trial.share).solved.ravel()
    tied = [
        trial
        for trial in candidates
        if chance_of_pairs(best, trial.solved.ravel()) > 1.0 - CONFIDENCE
    ]
    limit = EQUAL_TIMES * min(trial.microseconds for trial in tied)
    fast = [trial for trial in tied if trial.microseconds <= limit]
    fast = [trial for trial in fast if not trial.exceptions] or fast
    return max(fast, key=lambda trial: (trial.settings == search.default, trial.share))


def read(path: Path) -> list[SettingsTrial]:
    """Return the trials of a file of results, a line each; none if it does not exist."""
    lines = path.read_bytes().splitlines() if path.exists() else []
    return [msgspec.json.decode(line, type=SettingsTrial) for line in lines]


def trials_of(
    search: SettingsSearch, trials: Sequence[SettingsTrial], count: int
) -> list[SettingsTrial]:
    """Return the trials of a search on so many targets of each robot, in its order."""
    trials = [
        trial
        for trial in trials
        if (trial.solver, trial.start, trial.targets) == (*search[:2], count)
    ]
    own_trials = [trial for trial in trials if trial.settings in search.settings]
    return sorted(own_trials, key=lambda trial: search.settings.index(trial.settings))


def perform(search: SettingsSearch, path: Path) -> Iterator[SettingsTrial]:
    """Perform the missing trials of a search; append each to the file and yield it."""
    with contextlib.closing(WorkerProcess(_PATIENCE)) as worker:
        for count in (SCREENED, COUNT):
            trials = read(path)
            first = trials_of(search, trials, SCREENED)
            settings = finalists(search, first) if count == COUNT else search.settings
            finished = [trial.settings for trial in trials_of(search, trials, count)]
            for missing in (part for part in settings if part not in finished):
                result = trial(worker, search, missing, count)
                with path.open("ab") as file:
                    file.write(msgspec.json.encode(result) + b"\n")
                yield result


def main() -> None:
    """Perform the searches of the installed solvers, and print what they choose."""
    parser = argparse.ArgumentParser(description="Search the settings of solvers for robots.")
    names = list(dict.fromkeys(search.solver for search in searches()))
    parser.add_argument("--solver", action="append", choices=names, help="by default all")
    parser.add_argument("--results", type=Path, default=RESULTS, metavar="FILE")
    arguments = parser.parse_args()
    for search in searches():
        if search.solver not in (arguments.solver or names) or not search.peer.is_installed:
            continue
        for result in perform(search, arguments.results):
            figures = f"{100 * result.share:5.1f} %  {result.microseconds:8.0f} µs"
            print(figures, json.dumps(result.settings), result.trouble, flush=True)
        best = best_trial(search, trials_of(search, read(arguments.results), COUNT))
        print(f"{search.solver}, {search.start}: {json.dumps(best.settings)}", flush=True)


if __name__ == "__main__":  # the worker imports this file by its name
    importlib.import_module("search_settings").main()
