"""Every solver of the bench by its name in records: ours, peers, and solvers only timed.

Every solver listed in the reference takes part; an entry here gives a label, a colour and limits. A
peer is a file in `ik` or `cloth` with a constant `PEER`. A user's solver is a peer of its run only.
No engine is imported.
"""

import functools
import importlib
import pkgutil
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from plumbob.reference import IK_SOLVERS, STEP_SOLVERS

from . import cloth, ik
from .peer import EXPLICIT, ITERATED, LINEARISED, ONE_START, RESTARTS, UNDECLARED, Peer, Run
from .user_solver import CHAIN_TASK, ROBOT_TASK, UserSolver

PLUMBOB, PINOCCHIO, MUJOCO, NEWTON = "Plumbob", "Pinocchio", "MuJoCo", "Newton engine"


@dataclass(frozen=True)
class Solver:
    """A solver as in tables and figures."""

    name: str  # in records
    label: str  # how it is written
    engine: str = PLUMBOB  # its engine; "" if that is not listed
    colour: str = ""  # by its name in `bench.figures.style`; "" for any
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

    @property
    def run(self) -> Run:
        """The settings of the solver on falling cloths."""
        title = f"Plumbob {self.label}"
        if self.is_linear:
            return Run(LINEARISED, {"solver": self.name, "iterations": 1}, title=title)
        iterations = (self.ladder, self.motion, self.converges)
        return Run(ITERATED, {"solver": self.name}, "", 0, title, *iterations)


_IK = (
    Solver("ccd", "CCD", colour="orange"),
    Solver("fabrik", "FABRIK", colour="blue"),
    Solver("levenberg_marquardt", "Levenberg-Marquardt", colour="green"),
    Solver("damped_least_squares", "damped least squares", colour="purple"),
    Solver("jacobian_transpose", "Jacobian transpose", colour="brass"),
    Solver("anderson_ccd", "Anderson CCD"),
)
# Newton's methods need few iterations, and solve a step to the end.
_NEWTON: dict[str, Any] = {
    "converges": True,
    "followed": 12,
    "ladder": (1, 2, 3, 4, 5, 6, 8, 10, 15, 25),
}
_STEPS = (
    StepSolver("local_global", "local/global", colour="orange", followed=1000),
    StepSolver("chebyshev", "Chebyshev", colour="green", followed=1000),
    StepSolver("lbfgs", "L-BFGS", colour="purple"),
    StepSolver(
        "newton_cg", "Newton-CG", colour="brass", motion=((1, 1), (10, 1), (20, 1)), **_NEWTON
    ),
    StepSolver(
        "newton", "Newton", colour="blue", motion=((1, 1), (5, 1)), certified=100, **_NEWTON
    ),
    StepSolver("gauss_newton", "Gauss-Newton", is_linear=True, followed=0, certified=1),
)
# The Levenberg-Marquardt loop on the kinematics of two engines.
LOOPS = tuple(
    Solver(f"lm/{engine}", f"LM, our loop on {engine}", engine, loop=True)
    for engine in (PINOCCHIO, MUJOCO)
)
# Libraries that factorise.
SUPERNODAL = Solver("supernodal", "ours")
FACTORS = (SUPERNODAL, Solver("scipy", "SciPy's SuperLU", "SciPy"))
# Calls of ours without preparation, beside peers that are timed on prepared objects.
PLAIN_CALL = Solver(f"{PLUMBOB}, plain call", f"{PLUMBOB}, plain call")
# The timing suite. Rows that are not ranked are only shown.
COMPILED = Solver("Plumbob, compiled", "Plumbob, compiled", colour="blue")
PREPARED = Solver("Plumbob, prepared", "Plumbob, prepared", colour="blue")
PLAIN = Solver("Plumbob, plain Python", "Plumbob, plain Python", colour="orange", ranked=False)
OUR_KINEMATICS = Solver("Plumbob's kinematics", "Plumbob's kinematics", colour="brass")
_BY_PINOCCHIO = Solver(PINOCCHIO, PINOCCHIO, PINOCCHIO, "green")
_BY_MUJOCO = Solver(MUJOCO, MUJOCO, MUJOCO, "purple")
PRESET, TIGHT = (
    Solver(f"MuJoCo, {setting}", f"MuJoCo, {setting}", MUJOCO, "purple", ranked=False)
    for setting in ("qpos set before", "tolerance 1e-15")
)
LIMIT_NAME = "limit: copying as many bytes"
LIMIT = Solver(LIMIT_NAME, "plain copy of as many bytes", "", "ink", ranked=False)
MACHINE = Solver("limit", "limit of the machine", "", "ink", ranked=False)
_BENCHMARKED = (
    *(COMPILED, PREPARED, PLAIN, OUR_KINEMATICS, _BY_PINOCCHIO, _BY_MUJOCO),
    *(PRESET, TIGHT, LIMIT, MACHINE, PLAIN_CALL),
)


def _peers(folder: Iterable[str], package: str) -> tuple[Peer, ...]:
    """Return the peers of a folder's files, ours first, then by name."""
    names = (f"{package}.{module.name}" for module in pkgutil.iter_modules(folder))
    modules = map(importlib.import_module, names)
    peers: list[Peer] = [module.PEER for module in modules if hasattr(module, "PEER")]
    own_package = PLUMBOB.casefold()
    peers.sort(key=lambda peer: (peer.package != own_package, peer.name.casefold()))
    return tuple(peers)


PEERS = _peers(ik.__path__, ik.__name__)
CLOTH_PEERS = _peers(cloth.__path__, cloth.__name__)
PLUMBOB_LM = PEERS[0]
# Peers by the functions of their adapters: the forward kinematics is compared with ours, all
# solutions of a pose are listed, tasks beyond poses are solved.
KINEMATICS, BRANCH_SOLVERS, TASK_SOLVERS = (
    tuple(peer for peer in PEERS if hasattr(importlib.import_module(peer.module), function))
    for function in ("kinematics", "prepare_all", "prepare_task")
)
SINGLE_PRECISION = {peer.title: peer.precision for peer in PEERS if peer.precision}
# Attempts beside the first where the bench starts a user's solver again.
_RESTART_COUNT = 20
_EXPLICIT_METHODS = ("explicit", "symplectic")


def calls_of(peers: Iterable[Peer]) -> Iterator[tuple[str, Peer, dict[str, bool]]]:
    """Yield installed peers with a name in records and settings; ours prepared, then plain."""
    for peer in (peer for peer in peers if peer.is_installed):
        yield (PLUMBOB if peer is PLUMBOB_LM else peer.title), peer, {}
        if peer is PLUMBOB_LM:
            yield PLAIN_CALL.name, peer, {"prepared": False}


def robot_peers(solvers: Iterable[UserSolver] = ()) -> list[Peer]:
    """Return the solvers for robots: `PEERS`, then the user's for robots."""
    restarts = Run(RESTARTS, {}, f"{_RESTART_COUNT} restarts", _RESTART_COUNT)
    takers = [solver for solver in solvers if ROBOT_TASK in solver.tasks]
    users = (_user(solver, "robot", (Run(ONE_START), restarts)) for solver in takers)
    return [*PEERS, *users]


def chain_peers(solvers: Iterable[UserSolver]) -> list[Peer]:
    """Return the methods of the user's solvers for chains of balls."""
    return [
        _user(solver, "chain", (Run("", {"method": method}),), title)
        for solver in solvers
        if CHAIN_TASK in solver.tasks
        for method, title in solver.titles.items()
    ]


def cloth_peers(solvers: Iterable[UserSolver] = ()) -> tuple[Peer, ...]:
    """Return a peer for each run on cloths: of the reference's solvers, engines, the user's."""
    reference, *engines = CLOTH_PEERS
    steps = (solver.run for solver in step_solvers().values())
    reference = replace(reference, runs=(*steps, *reference.runs))
    rows = (row for peer in (reference, *engines) for row in peer.rows)
    return (*rows, *(_cloth_user(solver) for solver in solvers if solver.offers("cloth")))


def _cloth_user(solver: UserSolver) -> Peer:
    """Return a user's solver as a peer for cloths, tried as its declared step requires."""
    kind = EXPLICIT if solver.step in _EXPLICIT_METHODS else LINEARISED
    return _user(solver, "cloth", (Run(kind if solver.step else UNDECLARED),))


def _user(solver: UserSolver, problem: str, runs: tuple[Run, ...], title: str = "") -> Peer:
    title, module = title or solver.name, f"{__package__}.user_{problem}"
    return Peer(title, module, "", "", "", "", runs, engine=solver.name, user_solver=solver)


def ik_solvers() -> dict[str, Solver]:
    """Return the reference's solvers of inverse kinematics, by name, in its order."""
    listed = {solver.name: solver for solver in _IK}
    return {name: listed.get(name) or Solver(name, name.replace("_", " ")) for name in IK_SOLVERS}


def step_solvers() -> dict[str, StepSolver]:
    """Return the reference's solvers of steps, by name, in its order."""
    listed = {solver.name: solver for solver in _STEPS}
    return {
        name: listed.get(name) or StepSolver(name, name.replace("_", " ")) for name in STEP_SOLVERS
    }


def followed_step_solvers() -> list[StepSolver]:
    """Return the solvers with recorded convergence: the listed in order, then others."""
    solvers = step_solvers()
    order = dict.fromkeys([*(solver.name for solver in _STEPS), *solvers])
    return [solvers[name] for name in order if name in solvers and solvers[name].followed]


def find(name: str) -> Solver:
    """Return the solver of a name in records; the label of an unknown solver is its name."""
    return _by_name(tuple(IK_SOLVERS), tuple(STEP_SOLVERS)).get(name) or Solver(name, name, "")


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


def names() -> set[str]:
    """Return the names of our solvers and of peers, in records and as written."""
    return {name for solver in _solvers() for name in (solver.name, solver.label)}


@functools.cache
def _by_name(*reference_names: tuple[str, ...]) -> Mapping[str, Solver]:
    """Return the solvers by their names in records, the first of a name."""
    return {solver.name: solver for solver in reversed(list(_solvers()))}


def _solvers() -> Iterator[Solver]:
    yield from (*ik_solvers().values(), *step_solvers().values(), *LOOPS, *_BENCHMARKED, *FACTORS)
    for peer in (*cloth_peers(), *PEERS):
        labels = dict.fromkeys([*map(peer.label_of, peer.runs), peer.name])
        engine = peer.engine or peer.package
        for label in labels:
            yield Solver(label, label, engine, peer.colour, peer.is_loop)
