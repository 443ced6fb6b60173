"""A peer: a solver of a package behind an adapter, and the settings with which it runs."""

from collections.abc import Iterator, Mapping
from dataclasses import KW_ONLY, dataclass, field, replace
from typing import Any

from . import packages
from .user_solver import UserSolver

# A single attempt, a portfolio of several, and restarts from random poses until the solver succeeds
# answer different questions.
ONE_START, PORTFOLIO, RESTARTS = "one start", "portfolio", "restarts"
# The iterations of all attempts together, and the attempts and iterations of most portfolios.
PORTFOLIO_ITERATIONS, RESTART_ITERATIONS, SHORT_ATTEMPTS = 100, 3000, (8, 12)
# How the settings of a solver for cloths differ from try to try: by iterations, not at all, or by
# explicit steps relative to the limit of stability. A user's solver without a declared step is
# tried with steps of all lengths.
ITERATED, LINEARISED, EXPLICIT = "iterations", "one linear solve", "explicit"
UNDECLARED = "undeclared"


@dataclass(frozen=True)
class Run:
    """A peer with settings, as in the tables."""

    kind: str  # `ONE_START`, `PORTFOLIO` or `RESTARTS`; of cloths `ITERATED` and so on
    settings: Mapping[str, Any] = field(default_factory=dict)  # of the adapter
    note: str = ""  # tells it from another run of the same solver and kind
    restarts: int = 0  # further attempts from random poses, for solvers without restarts
    # For cloths: the name in records, the iterations of one step, steps of a frame of a motion and
    # iterations of each, and whether the solver solves a step to the end.
    title: str = ""
    ladder: tuple[int, ...] = ()
    motion: tuple[tuple[int, int], ...] = ()
    converges: bool = False

    @property
    def has_time_limit(self) -> bool:
        """Whether each target has a time limit [s]: answers then depend on the load."""
        return "seconds" in self.settings


def short_attempts(
    settings: Mapping[str, Any], note: str = "{}", count: int = SHORT_ATTEMPTS[0]
) -> Run:
    """Return the portfolio of so many attempts, the first from the start, made by the bench."""
    iterations = PORTFOLIO_ITERATIONS // count
    attempts = note.format(f"{count} attempts of {iterations}")
    return Run(PORTFOLIO, {"iterations": iterations, **settings}, attempts, count - 1)


def restarted(iterations: int, settings: Mapping[str, Any], note: str = "{}") -> Run:
    """Return attempts of so many iterations each from random poses, which the bench makes."""
    count = RESTART_ITERATIONS // iterations - 1
    settings = {"iterations": iterations, **settings}
    return Run(RESTARTS, settings, note.format(f"{count} restarts"), count)


@dataclass(frozen=True)
class Peer:
    """A solver behind an adapter, a module with a function `prepare`."""

    title: str  # how it is written
    module: str  # its adapter
    package: str  # the package that must be installed
    license: str  # of the package
    algorithm: str
    can: str  # what it solves
    runs: tuple[Run, ...]
    _: KW_ONLY
    label: str = ""  # its name as written, if not its title
    engine: str = ""  # its engine, if not its package
    colour: str = ""  # its colour in figures, by its name in `bench.figures.style`; "" for any
    # the engine whose kinematics it works with, which never evaluates its answers
    built_on: str = ""
    use: str = ""  # the reason to choose this peer, for the column "best use"
    precision: str = ""  # the precision of its kinematics, if not double
    is_loop: bool = False  # whether it is a Python loop of ours on the package's kinematics
    environment: str = ""  # an environment of its own with its own Python; "" for a solver in ours
    user_solver: UserSolver | None = None  # the user's solver, if any, which is always there

    @property
    def name(self) -> str:
        """How the solver is written."""
        return self.label or self.title

    def label_of(self, run: Run) -> str:
        """Return how a run is written."""
        return f"{self.name}, {run.note}" if run.note else self.name

    def first(self, kind: str) -> Run:
        """Return the first run of a kind."""
        return next(run for run in self.runs if run.kind == kind)

    @property
    def run(self) -> Run:
        """The only run of a solver for cloths or chains."""
        (run,) = self.runs
        return run

    @property
    def rows(self) -> Iterator["Peer"]:
        """A peer for each run, named by the run."""
        for run in self.runs:
            yield replace(self, title=run.title, runs=(run,))

    @property
    def version(self) -> str:
        """The installed version, "" if there is none; a user's solver states its own."""
        if self.user_solver:
            return self.user_solver.version
        return packages.version(self.package, self.environment)

    @property
    def is_installed(self) -> bool:
        """Whether the peer can be used."""
        return bool(self.user_solver or self.version)

    @property
    def spec(self) -> dict[str, Any]:
        """Settings of the adapter to open a user's solver."""
        return {"spec": self.user_solver.spec} if self.user_solver else {}

    @property
    def user_solver_name(self) -> str:
        """The name of the user's solver, "" of others."""
        return self.user_solver.name if self.user_solver else ""
