"""Every solver of the bench: its name, its style, how many iterations are allowed.

Every solver listed in the reference takes part; an entry in `solvers.toml` gives a label, a style
and limits. A peer is an adapter and an entry there. A user's solver is a peer of its run only. No
engine is imported.
"""

import functools
import importlib.metadata
import json
import shlex
import sys
import tomllib
import zlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, TypeVar
from urllib.parse import urlsplit
from urllib.request import url2pathname

import msgspec

from plumbob.reference import IK_SOLVERS, STEP_SOLVERS

from .entrant import CHAIN_TASK, ROBOT_TASK, Entrant

PLUMBOB, PINOCCHIO, MUJOCO, NEWTON = "Plumbob", "Pinocchio", "MuJoCo", "Newton engine"


class Style(NamedTuple):
    """A colour by its name in `bench.figures.style`, a line and a marker of matplotlib's."""

    colour: str
    line: Any
    marker: str


_DATA: dict[str, Any] = tomllib.loads(
    Path(__file__).with_name("solvers.toml").read_text(encoding="utf-8")
)


STYLES = {
    name: Style(colour, (line[0], tuple(line[1])) if isinstance(line, list) else line, marker)
    for name, (colour, line, marker) in _DATA["styles"].items()
}
OTHER = STYLES["other"]
# Styles of unknown solvers are made of these: lines unused by the solvers above.
_COLOURS = ("ink", "blue", "orange", "green", "purple", "brass")
_LINES: tuple[Any, ...] = ((0, (8, 2)), (0, (3, 1, 1, 1)), (0, (8, 2, 2, 2)))


@dataclass(frozen=True)
class Solver:
    """A solver as in tables and figures."""

    name: str  # in records
    label: str  # how it is written
    engine: str = PLUMBOB  # its engine; "" if that is not known
    style: Style = OTHER  # how it is drawn where each solver has a style of its own
    loop: bool = False  # whether it is a Python loop of ours on another engine's kinematics
    ranked: bool = True  # whether its times are compared with those of others


@dataclass(frozen=True)
class StepSolver(Solver):
    """A solver of implicit Euler's steps, and its iterations in each experiment."""

    is_linear: bool = False  # whether it solves a linear system, and so makes a single iteration
    converges: bool = False  # whether it solves a step to the end, in few iterations
    followed: int = 200  # iterations of a step with recorded residual and error; 0 for none
    certified: int = 3000  # the maximum before an answer is certified
    # iterations of a step in a work-precision diagram
    ladder: tuple[int, ...] = (1, 3, 10, 30, 100, 300, 1000)
    # steps of a frame there, and iterations of each
    motion: tuple[tuple[int, int], ...] = ((1, 10), (10, 10), (40, 10))


_Row = TypeVar("_Row")


def _rows(table: str, kind: type[_Row]) -> dict[str, _Row]:
    """Return the solvers of a table by name."""
    rows = [{**row, "style": style_of(row)} for row in _DATA[table]]
    return {row["name"]: msgspec.convert(row, kind) for row in rows}


def style_of(row: Mapping[str, str]) -> Style:
    """Return the style of a solver in `solvers.toml`.

    Raises:
        ValueError: if there is none of this name.
    """
    name = row.get("style", "other")
    if name not in STYLES:
        names = ", ".join(STYLES)
        raise ValueError(f"style of {row['name']!r}: expected one of {names}, got {name!r}")
    return STYLES[name]


_IK, _STEP = _rows("ik", Solver), _rows("steps", StepSolver)
LOOPS, FACTORS = (tuple(_rows(name, Solver).values()) for name in ("loops", "factors"))
_BENCHMARKED = _rows("benchmarked", Solver)
COMPILED, PREPARED, PLAIN, OUR_KINEMATICS, *_, PRESET, TIGHT, LIMIT = _BENCHMARKED.values()
LIMIT_NAME = LIMIT.name
SUPERNODAL = FACTORS[0]


def environment_python(name: str) -> Path:
    """Return the path of the Python of a peer's environment, which need not exist.

    Peers with requirements in conflict with ours have environments of their own. `make peers` makes
    these as `peers/NAME` below the environment of the bench.
    """
    place = "Scripts/python.exe" if sys.platform == "win32" else "bin/python"
    return Path(sys.prefix, "peers", name, place)


def _distribution(environment: str, package: str) -> importlib.metadata.Distribution | None:
    """Return a package in a peer's environment, or in ours if "", None if missing."""
    places = map(str, Path(sys.prefix, "peers", environment).glob("lib/python*/site-packages"))
    path = list(places) if environment else sys.path
    return next(iter(importlib.metadata.distributions(name=package, path=path)), None)


@functools.cache
def version(package: str) -> str:
    """Return the version of a package, "" if not installed."""
    distribution = _distribution("", package)
    return distribution.version if distribution else ""


@functools.cache
def peers_command() -> str:
    """Return the command to install the peers into the environment of this Plumbob."""
    distributions = importlib.metadata.distributions(name=PLUMBOB.casefold())
    texts = filter(None, (each.read_text("direct_url.json") for each in distributions))
    origin = json.loads(next(texts, "{}"))
    url, revision = origin.get("url", ""), origin.get("vcs_info", {})
    folder = url2pathname(urlsplit(url).path) if "dir_info" in origin else ""
    if folder and Path(sys.prefix) == Path(folder, ".venv"):
        return "make peers"
    if folder:
        is_editable = origin["dir_info"].get("editable", False)
        return f"pip install {'-e ' * is_editable}{shlex.quote(f'{folder}[peers]')}"
    prefix = f"{revision['vcs']}+" if revision else ""
    place = f" @ {prefix}{url}" if url else ""
    return f"pip install '{PLUMBOB.casefold()}[peers]{place}'"


@dataclass(frozen=True)
class Adapter:
    """A solver behind an adapter."""

    title: str  # how it is written
    module: str  # its adapter
    package: str  # the package that must be installed
    # an environment of its own with its own Python; "" for a solver in ours
    environment: str = field(default="", kw_only=True)
    # the user's solver, if any, which is always there
    entrant: Entrant | None = field(default=None, kw_only=True)

    @property
    def distribution(self) -> importlib.metadata.Distribution | None:
        """The package where installed, None if not installed."""
        return _distribution(self.environment, self.package)

    @property
    def version(self) -> str:
        """The installed version, "" if there is none; a user's solver states its own."""
        if self.entrant:
            return self.entrant.version
        return self.distribution.version if self.distribution else ""

    @property
    def is_installed(self) -> bool:
        """Whether the peer can be used."""
        return bool(self.entrant or self.version)

    @property
    def spec(self) -> dict[str, Any]:
        """Settings of the adapter to open a user's solver."""
        return {"spec": self.entrant.spec} if self.entrant else {}

    @property
    def entrant_name(self) -> str:
        """The name of the user's solver, "" of others."""
        return self.entrant.name if self.entrant else ""


# A single attempt, a portfolio of several, and restarts from random poses until the solver succeeds
# answer different questions.
ONE_START, PORTFOLIO, RESTARTS = "one start", "portfolio", "restarts"
# The iterations of all attempts together, and the attempts and iterations of most portfolios.
PORTFOLIO_ITERATIONS, RESTART_ITERATIONS, SHORT_ATTEMPTS = 100, 3000, (8, 12)
# Attempts beside the first where the bench starts a solver again.
_RESTART_COUNT = 20


@dataclass(frozen=True)
class PeerEntry:
    """A peer with settings, as in the tables."""

    kind: str  # `ONE_START`, `PORTFOLIO` or `RESTARTS`
    settings: Mapping[str, Any] = field(default_factory=dict)  # of its adapter
    restarts: int = 0  # further attempts from random poses, for solvers without restarts
    note: str = ""  # tells it from another entry of the same solver and kind

    @property
    def has_time_limit(self) -> bool:
        """Whether each target has a time limit [s]: answers then depend on the load."""
        return "seconds" in self.settings


@dataclass(frozen=True)
class Peer(Adapter):
    """A solver for robots."""

    license: str  # of the package
    can: str  # the robots that it takes
    entries: tuple[PeerEntry, ...]  # its settings
    # its name as written, if not its title
    label: str = field(default="", kw_only=True)
    # whether its forward kinematics is compared with ours
    kinematics: bool = field(default=False, kw_only=True)
    # the precision, if not double
    precision: str = field(default="", kw_only=True)
    # whether its adapter lists all solutions of a pose
    lists_all: bool = field(default=False, kw_only=True)
    # whether its adapter takes tasks beyond poses
    takes_tasks: bool = field(default=False, kw_only=True)
    built_on: str = field(default="", kw_only=True)  # the engine whose kinematics it works with
    # whether it is a Python loop of ours on the package's kinematics
    loop: bool = field(default=False, kw_only=True)
    # the reason to choose this peer
    use: str = field(default="", kw_only=True)

    def label_of(self, entry: PeerEntry) -> str:
        """Return how an entry is written."""
        return f"{self.name}, {entry.note}" if entry.note else self.name

    @property
    def name(self) -> str:
        """How the solver is written."""
        return self.label or self.title

    def entry(self, kind: str) -> PeerEntry:
        """Return the first entry of a kind."""
        return next(entry for entry in self.entries if entry.kind == kind)


@dataclass(frozen=True)
class ChainPeer(Adapter):
    """A method of a user's solver for chains of balls."""

    method: str


# How the settings of a peer for cloths differ from try to try.
ITERATED, LINEARISED, EXPLICIT = "iterations", "one linear solve", "explicit"
# A user's solver without a declared step is tried with steps of all lengths.
UNDECLARED = "undeclared"
_EXPLICIT_METHODS = ("explicit", "symplectic")


@dataclass(frozen=True)
class ClothPeer(Adapter):
    """A solver for cloths."""

    engine: str  # its engine
    kind: str  # how its settings differ from try to try
    # the constant settings of its adapter
    settings: Mapping[str, Any] = field(default_factory=dict)
    ladder: tuple[int, ...] = ()  # iterations in a step, where it iterates
    motion: tuple[tuple[int, int], ...] = ()  # steps of a frame of a motion, iterations of each
    converges: bool = False  # whether it solves a step to the end


_IK_ADAPTERS, _CLOTH_ADAPTERS = f"{__package__}.ik", f"{__package__}.cloth"


def _peers(table: str, adapters: str, kind: type[_Row]) -> tuple[_Row, ...]:
    """Return the peers of a table."""
    rows = [{**row, "module": f"{adapters}.{row['adapter']}"} for row in _DATA[table]]
    return tuple(msgspec.convert(row, kind) for row in rows)


PEERS = _peers("robots", _IK_ADAPTERS, Peer)
CLOTH_ENGINES = _peers("cloths", _CLOTH_ADAPTERS, ClothPeer)
_PEERS = {peer.title: peer for peer in PEERS}
PLUMBOB_LM, TOOLBOX = _PEERS["Plumbob LM"], _PEERS["Robotics Toolbox ik_LM"]
TRAC_IK, DRAKE, PLACO = _PEERS["TRAC-IK"], _PEERS["Drake"], _PEERS["PlaCo"]
KINEMATICS = tuple(peer for peer in PEERS if peer.kinematics)
BRANCH_SOLVERS = tuple(peer for peer in PEERS if peer.lists_all)
TASK_SOLVERS = tuple(peer for peer in PEERS if peer.takes_tasks)
SINGLE_PRECISION = {peer.title: peer.precision for peer in PEERS if peer.precision}


def robot_peers(entrants: Iterable[Entrant] = ()) -> list[Peer]:
    """Return the solvers for robots: `PEERS`, then the user's for robots."""
    restarts = PeerEntry(RESTARTS, {}, _RESTART_COUNT, f"{_RESTART_COUNT} restarts")
    adapter = (f"{__package__}.entrant_robot", "", "", "", (PeerEntry(ONE_START), restarts))
    takers = [entrant for entrant in entrants if ROBOT_TASK in entrant.tasks]
    return [*PEERS, *(Peer(entrant.name, *adapter, entrant=entrant) for entrant in takers)]


def chain_peers(entrants: Iterable[Entrant]) -> list[ChainPeer]:
    """Return the methods of the user's solvers for chains of balls."""
    return [
        ChainPeer(title, f"{__package__}.entrant_chain", "", method, entrant=entrant)
        for entrant in entrants
        if CHAIN_TASK in entrant.tasks
        for method, title in entrant.titles.items()
    ]


def cloth_peers(entrants: Iterable[Entrant] = ()) -> tuple[ClothPeer, ...]:
    """Return the solvers for cloths: the reference's, the engines', the user's."""
    reference = map(_reference_cloth_peer, step_solvers().values())
    users = (_entered_cloth_peer(e) for e in entrants if e.offers("cloth"))
    return (*reference, *CLOTH_ENGINES, *users)


def _reference_cloth_peer(solver: StepSolver) -> ClothPeer:
    adapter = (f"Plumbob {solver.label}", f"{_CLOTH_ADAPTERS}.plumbob", "plumbob", PLUMBOB)
    if solver.is_linear:
        return ClothPeer(*adapter, LINEARISED, {"solver": solver.name, "iterations": 1})
    iterations = (solver.ladder, solver.motion, solver.converges)
    return ClothPeer(*adapter, ITERATED, {"solver": solver.name}, *iterations)


def _entered_cloth_peer(entrant: Entrant) -> ClothPeer:
    """Return a user's solver as a peer for cloths, tried as its declared step requires."""
    kind = EXPLICIT if entrant.step in _EXPLICIT_METHODS else LINEARISED
    adapter = (entrant.name, f"{__package__}.entrant_cloth", "", entrant.name)
    return ClothPeer(*adapter, kind if entrant.step else UNDECLARED, entrant=entrant)


def ik_solvers() -> dict[str, Solver]:
    """Return the reference's solvers of inverse kinematics, by name, in its order."""
    return {name: _IK.get(name) or Solver(name, name.replace("_", " ")) for name in IK_SOLVERS}


def step_solvers() -> dict[str, StepSolver]:
    """Return the reference's solvers of steps, by name, in its order."""
    return {
        name: _STEP.get(name) or StepSolver(name, name.replace("_", " ")) for name in STEP_SOLVERS
    }


def followed_step_solvers() -> list[StepSolver]:
    """Return the solvers with recorded convergence: the listed in order, then others."""
    solvers = step_solvers()
    order = dict.fromkeys([*_STEP, *solvers])
    return [solvers[name] for name in order if name in solvers and solvers[name].followed]


def find(name: str) -> Solver:
    """Return the solver of a name in records; the label of an unknown solver is its name."""
    solver = _by_name(tuple(IK_SOLVERS), tuple(STEP_SOLVERS)).get(name)
    if solver:
        return solver
    number = zlib.crc32(name.encode(errors="replace"))  # the same style whenever it is drawn
    colour = _COLOURS[number % len(_COLOURS)]
    line = _LINES[number // len(_COLOURS) % len(_LINES)]
    return Solver(name, name, "", Style(colour, line, "P"))


def is_ours(name: str) -> bool:
    """Return whether a solver is Plumbob's, by its name in records, or Plumbob as an engine."""
    return engine_of(name) == PLUMBOB.casefold()


def is_loop(name: str) -> bool:
    """Return whether a solver is a Python loop of ours on another engine's kinematics."""
    return find(name).loop


def title_of(name: str) -> str:
    """Return the name of a solver without its settings."""
    return name.partition(", ")[0]


def engine_of(name: str) -> str:
    """Return the engine or package of a solver, whatever its settings were, else its name."""
    return (find(name).engine or find(title_of(name)).engine or name).casefold()


@functools.cache
def _by_name(*reference_names: tuple[str, ...]) -> Mapping[str, Solver]:
    """Return the solvers by their names in records, the first of a name."""
    return {solver.name: solver for solver in reversed(list(_solvers()))}


def names() -> set[str]:
    """Return the names of our solvers and of peers, in records and as written."""
    return {name for solver in _solvers() for name in (solver.name, solver.label)}


def _solvers() -> Iterator[Solver]:
    yield from (*ik_solvers().values(), *step_solvers().values())
    yield from (*LOOPS, *_BENCHMARKED.values(), *FACTORS)
    yield from (Solver(peer.title, peer.title, peer.engine) for peer in cloth_peers())
    for peer in PEERS:
        labels = dict.fromkeys([*map(peer.label_of, peer.entries), peer.name])
        yield from (Solver(label, label, peer.package, loop=peer.loop) for label in labels)
