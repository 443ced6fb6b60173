"""Search the settings of all solvers for robots, ours included, on the tuning robots.

    python tools/search_settings.py [--solver NAME ...] [--anew] [--results FILE]

Every solver gets the same care: at most 64 settings, listed in the file beside, on the same 120
targets of each tuning robot, which no table of the bench contains. All settings are tried on the
first targets; the best, the authors' defaults and the bench's own settings on all. The file of
results continues an interrupted search; a solver of another version is tried again.
"""

import argparse
import functools
import itertools
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from plumbob.bench.experiments.robots import TOLERANCE
from plumbob.bench.measure.metrics import CONFIDENCE, chance_of_pairs, shifted_geometric_mean
from plumbob.bench.measure.timing import Job, answers
from plumbob.bench.peers import peer as peers
from plumbob.bench.peers.catalogue import PEERS
from plumbob.bench.problems.evaluate import Targets, arbiter_of, evaluator_of
from plumbob.bench.problems.robot_targets import robot_targets
from plumbob.bench.problems.robots import TUNING

RESULTS = Path(__file__).with_name("settings.jsonl")
# Settings of a solver at the most, targets of each robot, and those on which all are tried.
MAXIMUM, COUNT, SCREENED = 64, 120, 24
# The best settings on the first targets that are tried on all.
FINALISTS = 3
# Targets drawn in each stratum; a search takes the first of these.
DRAWN = 34
SEED = 2011
# Processor times within this factor of each other are taken for equal.
EQUAL_TIMES = 1.25
# Added to times before their geometric mean, and subtracted from it [s].
_SHIFT = 1e-5
# The iterations of all attempts together, and the settings by which a solver divides them itself.
ITERATIONS = {
    peers.PORTFOLIO: peers.PORTFOLIO_ITERATIONS,
    peers.RESTARTS: peers.RESTART_ITERATIONS,
}
OWN_ATTEMPTS = {"phases", "restarts", "searches", "seconds"}
Settings = dict[str, Any]


class SettingsTrial(msgspec.Struct, frozen=True):
    """A solver with settings on the first targets of each tuning robot."""

    solver: str
    kind: str  # one start, portfolio or restarts
    settings: dict[str, Any]  # of its adapter; `bench_restarts` are restarts by the bench
    version: str  # of the solver's package
    microseconds: float  # of processors for a target, the geometric mean
    bits: str  # whether each target is solved, robot by robot, four in a digit to base 16
    targets: int  # of each robot
    exceptions: int = 0  # targets over which the solver raised, or its process was lost
    trouble: str = ""  # the first exception

    @property
    def key(self) -> tuple[str, str, Settings]:
        """What no two trials of a file share."""
        return self.solver, self.kind, self.settings

    @property
    def solved(self) -> np.ndarray:
        """Whether each target is solved, (robot, target)."""
        bits = np.unpackbits(np.frombuffer(bytes.fromhex(self.bits), dtype=np.uint8))
        count = len(TUNING) * self.targets
        return bits[:count].reshape(len(TUNING), self.targets).astype(bool)

    @property
    def share(self) -> float:
        """The share of solved targets."""
        return float(np.mean(self.solved))

    @property
    def screened_share(self) -> float:
        """The share of solved targets among the first."""
        return float(np.mean(self.solved[:, :SCREENED]))


class SettingsSearch(NamedTuple):
    """The settings of a solver for one start, a portfolio or restarts."""

    solver: str
    kind: str
    candidates: tuple[Settings, ...]  # the authors' defaults first
    bench: Settings  # of the bench, among the candidates

    @property
    def peer(self) -> peers.Peer:
        """The solver."""
        return peer_of(self.solver)

    def own(self, trials: Iterable[SettingsTrial], count: int) -> list[SettingsTrial]:
        """Return the trials of this search on at least so many targets of each robot."""
        return [
            trial
            for trial in trials
            if (trial.solver, trial.kind) == (self.solver, self.kind)
            and trial.settings in self.candidates
            and trial.targets >= count
        ]

    def finalists(self, trials: Sequence[SettingsTrial]) -> list[Settings]:
        """Return the settings to try on all targets, from their trials on the first."""
        shares = [
            (-trial.screened_share, self.candidates.index(trial.settings)) for trial in trials
        ]
        best = [self.candidates[i] for _, i in sorted(shares)[:FINALISTS]]
        best += [self.candidates[0], self.bench]
        return [settings for i, settings in enumerate(best) if settings not in best[:i]]


def peer_of(solver: str) -> peers.Peer:
    """Return a solver by its title."""
    return next(peer for peer in PEERS if peer.title == solver)


def searches() -> list[SettingsSearch]:
    """Return the searches of `search_settings.toml`."""
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    return [
        _search(solver, kind, axes, kinds.get("authors", {}))
        for solver, kinds in tomllib.loads(text).items()
        for kind, axes in kinds.items()
        if kind != "authors"
    ]


def _search(
    solver: str, kind: str, axes: dict[str, list[Any]], authors: Settings
) -> SettingsSearch:
    points = [
        [value if isinstance(value, dict) else {name: value} for value in values]
        for name, values in axes.items()
    ]
    candidates = list[Settings]()
    for point in itertools.product(*points):
        settings = functools.reduce(dict.__or__, point, authors)
        is_divided = kind in ITERATIONS and not OWN_ATTEMPTS & settings.keys()
        restarts = ITERATIONS[kind] // settings["iterations"] - 1 if is_divided else 0
        candidates.append(_with_restarts(settings, restarts))
    run = peer_of(solver).first(kind)
    bench = _with_restarts(dict(run.settings), run.restarts)
    candidates += [bench] * (bench not in candidates)
    return SettingsSearch(solver, kind, tuple(candidates), bench)


def _with_restarts(settings: Settings, restarts: int) -> Settings:
    return {**settings, "bench_restarts": restarts} if restarts else settings


def tuning_targets(name: str, count: int) -> Targets:
    """Return the first targets of a tuning robot, the strata alternating, and random starts."""
    targets = robot_targets(name, DRAWN, SEED)
    return Targets(*(part[:count] for part in targets))


def trial(search: SettingsSearch, settings: Settings, count: int) -> SettingsTrial:
    """Try settings on the first targets of each robot; unanswered targets are not solved."""
    options = dict(settings)
    restarts, engine = options.pop("bench_restarts", 0), arbiter_of(search.peer.built_on)
    solved = np.zeros((len(TUNING), count), dtype=bool)
    seconds, errors = list[float](), list[str]()
    for robot, name in enumerate(TUNING):
        evaluator, targets = evaluator_of(name), tuning_targets(name, count)
        twice = Targets(*(np.concatenate([part[:1], part]) for part in targets))
        request = (search.peer.module, evaluator.robot, twice, TOLERANCE, options, restarts)
        outcome = answers(Job(*request, warms_up=False))
        output = outcome.solved[1:]  # the first target is solved before, uncounted
        errors += [answer.trouble for answer in output if answer.trouble]
        errors += [outcome.trouble] * (count - len(output))
        if output:
            q = np.array([answer.q for answer in output])
            solved[robot, : len(q)] = evaluator.evaluate(targets, q, TOLERANCE, engine).solved
            seconds += [answer.seconds for answer in output]
    time = 1e6 * shifted_geometric_mean(np.array(seconds), _SHIFT).value if seconds else 0.0
    bits, version = np.packbits(solved).tobytes().hex(), search.peer.version
    result = (settings, version, round(time, 1), bits, count, len(errors), "".join(errors[:1]))
    return SettingsTrial(search.solver, search.kind, *result)


def best_trial(search: SettingsSearch, trials: Sequence[SettingsTrial]) -> SettingsTrial:
    """Return the best of the trials on all targets.

    Trials tie with the greatest share that McNemar's paired test cannot tell from it. The fastest
    of these tie whose times are equal. Without exceptions the authors' defaults are preferred, then
    the bench's own settings, then the greatest share.
    """
    trials = search.own(trials, COUNT)
    best = max(trials, key=lambda trial: trial.share).solved.ravel()
    tied = [
        trial for trial in trials if chance_of_pairs(best, trial.solved.ravel()) > 1.0 - CONFIDENCE
    ]
    limit = EQUAL_TIMES * min(trial.microseconds for trial in tied)
    fast = [trial for trial in tied if trial.microseconds <= limit]
    fast = [trial for trial in fast if not trial.exceptions] or fast
    preferred = (search.candidates[0], search.bench)
    return max(fast, key=lambda trial: (*map(trial.settings.__eq__, preferred), trial.share))


def read(path: Path) -> list[SettingsTrial]:
    """Return the trials of a file of results, a line each; none if it does not exist."""
    lines = path.read_bytes().splitlines() if path.exists() else []
    return [msgspec.json.decode(line, type=SettingsTrial) for line in lines]


def write(path: Path, trials: Iterable[SettingsTrial]) -> None:
    """Write trials to a file of results, a line each."""
    path.write_bytes(b"".join(msgspec.json.encode(trial) + b"\n" for trial in trials))


def perform(search: SettingsSearch, path: Path) -> Iterator[SettingsTrial]:
    """Perform the missing trials of a search; store each in the file and yield it."""
    version = search.peer.version
    for count in (SCREENED, COUNT):
        trials = [other for other in search.own(read(path), SCREENED) if other.version == version]
        settings = search.finalists(trials) if count == COUNT else search.candidates
        finished = [other.settings for other in trials if other.targets >= count]
        for missing in (part for part in settings if part not in finished):
            result = trial(search, missing, count)
            write(path, [*(other for other in read(path) if other.key != result.key), result])
            yield result


def main() -> None:
    """Perform the searches of the installed solvers, and print what they choose."""
    parser = argparse.ArgumentParser(description="Search the settings of solvers for robots.")
    names = list(dict.fromkeys(search.solver for search in searches()))
    parser.add_argument("--solver", action="append", choices=names, help="by default all")
    parser.add_argument("--results", type=Path, default=RESULTS, metavar="FILE")
    parser.add_argument("--anew", action="store_true", help="forget the solvers' earlier trials")
    arguments = parser.parse_args()
    chosen = [s for s in searches() if s.solver in (arguments.solver or names)]
    installed = [search for search in chosen if search.peer.is_installed]
    if arguments.anew:
        forgotten = {search.solver for search in installed}
        trials = read(arguments.results)
        write(arguments.results, [trial for trial in trials if trial.solver not in forgotten])
    for search in installed:
        for result in perform(search, arguments.results):
            figures = f"{100 * result.share:5.1f} %  {result.microseconds:8.0f} µs"
            print(figures, result.settings, result.trouble, flush=True)
        best = best_trial(search, read(arguments.results))
        print(f"{search.solver}, {search.kind}: {best.settings}", flush=True)


if __name__ == "__main__":
    main()
