"""Every solver that the bench knows: what it is called, how it is drawn, how far it is taken.

A solver of the reference takes part as soon as the reference lists it; a line here gives it a label
and a style, and limits other than the usual ones. A peer is an adapter of its own and a line here.
A user's solver is a peer of the run that it was entered for. Nothing here imports an engine.
"""

import functools
import importlib.metadata
import zlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from plumbob.reference import IK_SOLVERS, STEP_SOLVERS

from . import environments
from .entrant import CHAIN_TASK, ROBOT_TASK, Entrant

PLUMBOB, PINOCCHIO, MUJOCO, NEWTON = "Plumbob", "Pinocchio", "MuJoCo", "Newton"
BULLET = "PyBullet"


class Style(NamedTuple):
    """A colour by its name in `presentation.figures.style`, a line and a marker of matplotlib's."""

    colour: str
    line: Any
    marker: str


FIRST = Style("orange", "-", "o")
SECOND = Style("blue", "--", "s")
THIRD = Style("green", "-.", "^")
FOURTH = Style("purple", (0, (1, 1)), "v")
FIFTH = Style("brass", (0, (4, 1, 1, 1, 1, 1)), "D")
OTHER = Style("faint", ":", "P")
# Styles of unknown solvers are made of these: lines that no solver above has.
_COLOURS = ("ink", "blue", "orange", "green", "purple", "brass")
_LINES: tuple[Any, ...] = ((0, (8, 2)), (0, (3, 1, 1, 1)), (0, (8, 2, 2, 2)))


@dataclass(frozen=True)
class Solver:
    """A solver as tables and figures show it.

    Attributes:
        name: what records call it.
        label: how it is written.
        engine: whose it is; "" if that is not known.
        style: how it is drawn where each solver has a style of its own.
    """

    name: str
    label: str
    engine: str = PLUMBOB
    style: Style = OTHER


# Iterations of a step, or of a frame of a motion, that a solver of cloths is tried with.
MANY = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
FEW = (1, 2, 3, 4, 5, 6, 8, 10, 15, 20, 40)
SOME = (1, 10, 100)


@dataclass(frozen=True)
class StepSolver(Solver):
    """A solver of implicit Euler's steps, and how far each experiment takes it.

    Attributes:
        is_linear: whether it solves one linear system, and so makes one iteration only.
        converges: whether it goes on until a step is solved, in few iterations.
        followed: iterations of one step whose residual and error are kept; 0 for none.
        counted: the most iterations of one step in which powers of ten of the error are counted.
        certified: the most iterations before an answer is certified.
        ladder: iterations of one step in a work-precision diagram.
        motion: iterations of a frame there.
    """

    is_linear: bool = False
    converges: bool = False
    followed: int = 200
    counted: int = 2000
    certified: int = 3000
    ladder: tuple[int, ...] = MANY
    motion: tuple[int, ...] = SOME


_IK = (
    Solver("ccd", "CCD", style=FIRST),
    Solver("fabrik", "FABRIK", style=SECOND),
    Solver("levenberg_marquardt", "Levenberg-Marquardt", style=THIRD),
    Solver("damped_least_squares", "damped least squares", style=FOURTH),
    Solver("jacobian_transpose", "Jacobian transpose", style=FIFTH),
)
# Few iterations suffice for some, and one is all there is for others.
_QUADRATIC: dict[str, Any] = {"converges": True, "followed": 12, "counted": 60}
_QUADRATIC |= {"ladder": FEW, "motion": (1, 3)}
_ONE_SOLVE: dict[str, Any] = {"followed": 0, "counted": 20, "certified": 1}
_STEP = (
    StepSolver("local_global", "local/global", style=FIRST, followed=1000),
    StepSolver("chebyshev", "Chebyshev", style=THIRD, followed=1000),
    StepSolver("lbfgs", "L-BFGS", style=FOURTH),
    StepSolver("newton_cg", "Newton-CG", style=FIFTH, **_QUADRATIC),
    StepSolver("newton", "Newton", style=SECOND, certified=100, **_QUADRATIC),
    StepSolver("gauss_newton", "Gauss-Newton", is_linear=True, **_ONE_SOLVE),
)

# One Levenberg-Marquardt loop on engines' kinematics; what is timed; libraries that factor.
LOOPS = tuple(Solver(f"lm/{engine}", f"LM, {engine}", engine) for engine in (PINOCCHIO, MUJOCO))
COMPILED = Solver("Plumbob, compiled", "Plumbob, compiled", style=Style("blue", "", "o"))
PLAIN = Solver("Plumbob, plain Python", "Plumbob, plain Python", style=Style("orange", "", "D"))
OUR_KINEMATICS = Solver(
    "Plumbob's kinematics", "Plumbob's kinematics", style=Style("brass", "", "v")
)
LIMIT_NAME = "limit: copying as many bytes"
LIMIT = Solver(LIMIT_NAME, "plain copy of as many bytes", "", Style("ink", "", "|"))
TIMED = (
    COMPILED,
    PLAIN,
    OUR_KINEMATICS,
    Solver(PINOCCHIO, PINOCCHIO, PINOCCHIO, Style("green", "", "s")),
    Solver(MUJOCO, MUJOCO, MUJOCO, Style("purple", "", "^")),
    LIMIT,
)
SUPERNODAL = Solver("supernodal", "ours")
CHOLMOD = Solver("cholespy", "CHOLMOD (cholespy)", "CHOLMOD")
FACTORS = (SUPERNODAL, CHOLMOD)


@functools.cache
def version(package: str) -> str:
    """Return the version of a package, "" if it is not installed."""
    distribution = environments.distribution("", package)
    return distribution.version if distribution else ""


@dataclass(frozen=True)
class Adapter:
    """A solver behind an adapter.

    Attributes:
        title: how it is written.
        module: its adapter.
        package: what must be installed.
        environment: of its own, whose Python runs it; "" if it works in ours.
        entrant: the user's solver, if it is one: it is always there.
    """

    title: str
    module: str
    package: str
    environment: str = field(default="", kw_only=True)
    entrant: Entrant | None = field(default=None, kw_only=True)

    @property
    def distribution(self) -> importlib.metadata.Distribution | None:
        """The package where it is installed, None if it is not."""
        return environments.distribution(self.environment, self.package)

    @property
    def version(self) -> str:
        """The version that is installed, "" if none is; a user's solver says its own."""
        if self.entrant:
            return self.entrant.version
        return self.distribution.version if self.distribution else ""

    @property
    def is_installed(self) -> bool:
        """Whether it can be asked."""
        return bool(self.entrant or self.version)

    @property
    def spec(self) -> dict[str, Any]:
        """What the adapter of a user's solver is prepared with beside settings."""
        return {"spec": self.entrant.spec} if self.entrant else {}

    @property
    def entrant_name(self) -> str:
        """The name of the user's solver, "" if it is none."""
        return self.entrant.name if self.entrant else ""


# Peers of inverse kinematics. A solver that makes one attempt from the start it is given and one
# that starts again from random poses until it is done answer different questions.
ONE_START, RESTARTS = "one start", "restarts"


class PeerEntry(NamedTuple):
    """A peer with settings, as it enters the tables.

    Attributes:
        kind: one start, or restarts.
        settings: what its adapter is prepared with.
        restarts: further attempts from random poses, for solvers that make only one.
        note: what distinguishes it from another entry of the same solver and kind.
    """

    kind: str
    settings: Mapping[str, Any] = {}
    restarts: int = 0
    note: str = ""


@dataclass(frozen=True)
class Peer(Adapter):
    """A solver for robots.

    Attributes:
        license: of the package.
        can: what it takes.
        entries: with which settings it takes part.
    """

    license: str
    can: str
    entries: tuple[PeerEntry, ...]

    def label_of(self, entry: PeerEntry) -> str:
        """Return how an entry is written."""
        return f"{self.title}, {entry.note}" if entry.note else self.title

    def entry(self, kind: str) -> PeerEntry:
        """Return the first entry of a kind."""
        return next(entry for entry in self.entries if entry.kind == kind)


# Attempts beside the first where the bench starts a solver again.
AGAIN = 20


def _either(iterations: int | None = None) -> tuple[PeerEntry, PeerEntry]:
    """Return an entry with one start and one with restarts, of fewer iterations each if given."""
    fewer = {} if iterations is None else {"iterations": iterations}
    return PeerEntry(ONE_START), PeerEntry(RESTARTS, fewer, AGAIN, f"{AGAIN} restarts")


_CHAINS = "poses and limits of one chain of hinges"
_TREES = "poses, positions and limits of several effectors, balls"
_UNLIMITED = "poses and positions of several effectors, balls; looks at no limits"
_SIX = "poses of six hinges or fewer, analytically; timed without the choice of a solution"
_PULLED = (
    "poses of one chain of hinges; limits only as a pull in the null space, with which it hardly "
    "arrives and oversteps them all the same; makes no claims"
)


def _peer(
    title: str, adapter: str, package: str, license: str, can: str, *entries: PeerEntry, **more: Any
) -> Peer:
    return Peer(title, f"{__package__}.ik.{adapter}", package, license, can, entries, **more)


PLUMBOB_LM = _peer(
    *("Plumbob LM", "plumbob", "plumbob", "MIT", _TREES),
    PeerEntry(ONE_START, {"restarts": 0}),
    PeerEntry(RESTARTS, {"restarts": 100}, note="100 restarts"),
)
TOOLBOX = _peer(
    *("Robotics Toolbox ik_LM", "toolbox", "roboticstoolbox-python", "MIT", _CHAINS),
    PeerEntry(ONE_START, {"searches": 1, "iterations": 100}),
    PeerEntry(RESTARTS, {"searches": 100, "iterations": 30}, note="100 searches"),
)
TRAC_IK = _peer(
    *("TRAC-IK", "trac_ik", "pytracik", "MIT", _CHAINS),
    *(PeerEntry(RESTARTS, {"seconds": t}, note=f"{1e3 * t:g} ms") for t in (0.005, 0.05)),
)
DRAKE = _peer(
    *("Drake", "drake", "drake", "BSD-3-Clause", f"{_TREES}, these by three angles"),
    PeerEntry(ONE_START, note="SNOPT"),
    PeerEntry(ONE_START, {"solver": "IPOPT"}, note="IPOPT"),
    PeerEntry(RESTARTS, {}, AGAIN, f"SNOPT, {AGAIN} restarts"),
)
PYBULLET = _peer(
    *("PyBullet", "pybullet", "pybullet", "Zlib", _PULLED),
    PeerEntry(ONE_START, note="limits left out"),
    PeerEntry(ONE_START, {"limits": True}, note="limits in the null space"),
    PeerEntry(RESTARTS, {"check": True}, AGAIN, f"{AGAIN} restarts, its pose looked at"),
)
TORCH = _peer(
    *("pytorch_kinematics", "pytorch_kinematics", "pytorch-kinematics", "MIT", _CHAINS),
    PeerEntry(ONE_START),
    PeerEntry(RESTARTS, {"attempts": AGAIN + 1}, note=f"{AGAIN} restarts, all at once"),
)
DART = _peer("DART", "dart", "dartpy", "BSD-2-Clause", _CHAINS, *_either(100))
PLACO = _peer("PlaCo", "placo", "placo", "MIT", _CHAINS, *_either(50), environment="placo")
PEERS = (
    PLUMBOB_LM,
    _peer(
        "Pinocchio’s closed loop", "closed_loop", "pin", "BSD-3-Clause", _UNLIMITED, *_either(200)
    ),
    _peer("pink", "pink", "pin-pink", "Apache-2.0", _TREES, *_either(50)),
    _peer("mink", "mink", "mink", "Apache-2.0", _TREES, *_either(50)),
    _peer("mujoco.minimize", "minimize", "mujoco", "Apache-2.0", _CHAINS, *_either()),
    TOOLBOX,
    TRAC_IK,
    _peer(
        "ikpy", "ikpy", "ikpy", "Apache-2.0", f"{_CHAINS}; makes no claims", PeerEntry(ONE_START)
    ),
    _peer(
        *("EAIK", "eaik", "eaik", "BSD-3-Clause", _SIX),
        PeerEntry(RESTARTS, note="all solutions, no start"),
    ),
    DRAKE,
    DART,
    PLACO,
    PYBULLET,
    TORCH,
)
# Those whose kinematics is compared with ours, with what is to be known of it.
KINEMATICS = (DRAKE, DART, PYBULLET, TORCH)
SINGLE_PRECISION = {
    PYBULLET.title: "reads the file, and gives poses, in single precision",
    TORCH.title: "reads the file in single precision",
}


def robot_peers(entrants: Iterable[Entrant] = ()) -> list[Peer]:
    """Return the solvers for robots: those known, then those of a user that take robots."""
    return [*PEERS, *(_entered_peer(e) for e in entrants if ROBOT_TASK in e.tasks)]


def _entered_peer(entrant: Entrant) -> Peer:
    return _peer(entrant.name, "entrant", "", "", "", *_either(), entrant=entrant)


@dataclass(frozen=True)
class ChainPeer(Adapter):
    """A method of a user's solver for chains of balls."""

    method: str


def chain_peers(entrants: Iterable[Entrant]) -> list[ChainPeer]:
    """Return the methods of the user's solvers that take chains of balls."""
    return [
        ChainPeer(title, f"{__package__}.ik.entrant_chain", "", method, entrant=entrant)
        for entrant in entrants
        if CHAIN_TASK in entrant.tasks
        for method, title in entrant.titles.items()
    ]


# Peers for cloths: what distinguishes the settings that each is tried with.
ITERATED, LINEARISED, EXPLICIT = "iterations", "one linear solve", "explicit"
# An entrant that does not say which step it makes is tried with steps of all lengths.
UNDECLARED = "undeclared"
_EXPLICIT_METHODS = ("explicit", "symplectic")


@dataclass(frozen=True)
class ClothPeer(Adapter):
    """A solver for cloths.

    Attributes:
        engine: whose it is.
        kind: what distinguishes its rungs.
        settings: with which its adapter is always prepared.
        ladder: iterations in one step, where it iterates.
        motion: iterations a frame when it moves on frame after frame.
        converges: whether it goes on until a step is solved.
    """

    engine: str
    kind: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    ladder: tuple[int, ...] = ()
    motion: tuple[int, ...] = ()
    converges: bool = False


_CLOTH = f"{__package__}.cloth"


def _of_ours(solver: StepSolver) -> ClothPeer:
    """Return a solver of the reference as a peer."""
    known = (f"Plumbob {solver.label}", f"{_CLOTH}.plumbob", "plumbob", PLUMBOB)
    if solver.is_linear:
        return ClothPeer(*known, LINEARISED, {"solver": solver.name, "iterations": 1})
    iterated = (solver.ladder, solver.motion, solver.converges)
    return ClothPeer(*known, ITERATED, {"solver": solver.name}, *iterated)


def _explicit(title: str, solver: str) -> ClothPeer:
    known = (f"Plumbob {title}", f"{_CLOTH}.plumbob", "plumbob", PLUMBOB)
    return ClothPeer(*known, EXPLICIT, {"solver": solver})


def _mujoco(title: str, kind: str, **settings: Any) -> ClothPeer:
    known = (f"MuJoCo {title}", f"{_CLOTH}.mujoco", "mujoco", MUJOCO)
    return ClothPeer(*known, kind, settings)


def _newton(title: str, kind: str, ladder: tuple[int, ...] = (), **settings: Any) -> ClothPeer:
    known = (f"Newton engine, {title}", f"{_CLOTH}.newton", "newton", NEWTON)
    return ClothPeer(*known, kind, settings, ladder, SOME if ladder else ())


CLOTH_ENGINES = (
    _explicit("symplectic Euler", "symplectic_euler"),
    _explicit("Runge-Kutta", "runge_kutta"),
    _mujoco("Euler", EXPLICIT),
    _mujoco("implicitfast", EXPLICIT, integrator="implicitfast"),
    _mujoco("flex, Euler", EXPLICIT, flex=True),
    _mujoco("discrete", LINEARISED, integrator="discrete"),
    _mujoco(
        "discrete, to the end", LINEARISED, integrator="discrete", iterations=5000, tolerance=1e-15
    ),
    _newton("semi-implicit", EXPLICIT, solver="semi-implicit"),
    _newton("VBD", ITERATED, MANY, solver="VBD"),
    _newton("VBD, its own colours", ITERATED, SOME, solver="VBD", own=1),
    _newton("XPBD", ITERATED, SOME, solver="XPBD"),
    _newton("XPBD, substeps", EXPLICIT, solver="XPBD", iterations=1),
    ClothPeer(
        *("PyBullet deformable, Euler", f"{_CLOTH}.pybullet_deformable", "pybullet", BULLET),
        EXPLICIT,
    ),
)


def cloth_peers(entrants: Iterable[Entrant] = ()) -> tuple[ClothPeer, ...]:
    """Return the solvers for cloths: the reference's, those of engines, those of a user."""
    ours = (_of_ours(solver) for solver in step_solvers().values())
    return (*ours, *CLOTH_ENGINES, *(_entered_cloth(e) for e in entrants if e.offers("cloth")))


def _entered_cloth(entrant: Entrant) -> ClothPeer:
    """Return a user's solver as a peer for cloths, tried as its declared step asks for."""
    kind = EXPLICIT if entrant.step in _EXPLICIT_METHODS else LINEARISED
    known = (entrant.name, f"{_CLOTH}.entrant", "", entrant.name)
    return ClothPeer(*known, kind if entrant.step else UNDECLARED, entrant=entrant)


def ik_solvers() -> dict[str, Solver]:
    """Return the solvers of inverse kinematics that the reference has, by name, in its order."""
    known = {solver.name: solver for solver in _IK}
    return {name: known.get(name, Solver(name, _spaced(name))) for name in IK_SOLVERS}


def step_solvers() -> dict[str, StepSolver]:
    """Return the solvers of steps that the reference has, by name, in its order."""
    known = {solver.name: solver for solver in _STEP}
    return {name: known.get(name, StepSolver(name, _spaced(name))) for name in STEP_SOLVERS}


def followed_step_solvers() -> list[StepSolver]:
    """Return those whose convergence is followed: the known ones in order, then others."""
    solvers = step_solvers()
    order = dict.fromkeys([*(solver.name for solver in _STEP), *solvers])
    return [solvers[name] for name in order if name in solvers and solvers[name].followed]


def find(name: str) -> Solver:
    """Return the solver that records call so; one that nobody knows is written as it is called."""
    known = _by_name(tuple(IK_SOLVERS), tuple(STEP_SOLVERS))
    return known.get(name) or Solver(name, name, "", _style(name))


@functools.cache
def _by_name(*of_reference: tuple[str, ...]) -> Mapping[str, Solver]:
    """Return the solvers by what records call them, the first of a name."""
    return {solver.name: solver for solver in reversed(list(_solvers()))}


def names() -> set[str]:
    """Return what solvers of ours and of peers are called, in records and as they are written."""
    return {name for solver in _solvers() for name in (solver.name, solver.label)}


def _style(name: str) -> Style:
    """Return a style for a solver that nobody knows, the same whenever it is drawn."""
    number = zlib.crc32(name.encode(errors="replace"))
    colour = _COLOURS[number % len(_COLOURS)]
    return Style(colour, _LINES[number // len(_COLOURS) % len(_LINES)], "P")


def _solvers() -> Iterator[Solver]:
    yield from (*ik_solvers().values(), *step_solvers().values(), *LOOPS, *TIMED, *FACTORS)
    yield from (Solver(peer.title, peer.title, peer.engine) for peer in cloth_peers())
    for peer in PEERS:
        names = [peer.label_of(entry) for entry in peer.entries]
        yield from (Solver(name, name, peer.package) for name in names)


def _spaced(name: str) -> str:
    return name.replace("_", " ")
