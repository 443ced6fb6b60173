"""The solvers by name, and the settings of a solve, checked."""

import functools
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .. import arguments
from ..arguments import FloatArray
from ..backend.compiled import Kernel
from ..skeleton import Skeleton
from .problem import Target, are_targets
from .restarts import Limits
from .solve_chain import ON_CHAINS
from .solve_mechanism import ON_MECHANISMS


class IKSolver(NamedTuple):
    """A solver's two kernels; its pickle holds the name."""

    name: str  # in IK_SOLVERS
    chain: Kernel  # for one position to reach by a chain of unlimited balls
    mechanism: Kernel  # for all other problems

    def __reduce__(self) -> tuple[Any, ...]:
        return _solver, (self.name,)


def _solver(name: str) -> IKSolver:
    return IK_SOLVERS[name]


IK_SOLVERS = {name: IKSolver(name, ON_CHAINS[name], ON_MECHANISMS[name]) for name in ON_CHAINS}

# The defaults of `solve_ik`: iterations of an attempt, the same towards a target out of reach, and
# restarts where the solver is left to us and is not FABRIK.
MAX_ITERATIONS, FAR_ITERATIONS, RESTARTS = 100, 2000, 20
# All integers up to this are floats.
LARGEST_COUNT = 2**53


@dataclass(frozen=True)
class Settings:
    """Settings of a solve, checked."""

    solver: IKSolver  # its kernels
    limits: Limits  # what the solve may leave and take
    seed: int  # of the restarts
    record: bool  # whether to keep the residuals of all iterations

    @functools.cached_property
    def numbers(self) -> FloatArray:
        """The limits as an array, as kernels take them."""
        return np.array(self.limits, dtype=np.float64)


def default_solver(model: Any, target: Any) -> tuple[str, int]:
    """Return the solver and the restarts that suit a model and its target."""
    target = target[0] if are_targets(target) and len(target) == 1 else target
    oriented = isinstance(target, Target) and target.rotation is not None
    if isinstance(model, Skeleton) and not (oriented or are_targets(target)):
        return "fabrik", 0
    return "levenberg_marquardt", RESTARTS


def checked_settings(*arguments: Any) -> Settings:
    """Return the settings, recent settings from a cache."""
    try:
        return _cached_settings(*arguments)
    except TypeError:  # some argument has no hash, and so is no number or name
        return _settings(*arguments)


def _settings(
    solver: Any, tolerance: Any, tolerance_rotation: Any, max_iterations: Any,
    restarts: Any, seed: Any, record: bool, chained: bool = False,
) -> Settings:  # fmt: skip
    within_reach, out_of_reach = MAX_ITERATIONS, FAR_ITERATIONS
    if max_iterations is not None:
        count = arguments.integer("max_iterations", max_iterations, least=0)
        within_reach = out_of_reach = min(count, LARGEST_COUNT)
    kernels = IK_SOLVERS[arguments.choice("solver", solver, IK_SOLVERS)]
    limits = Limits(
        arguments.number("tolerance", tolerance, least=0.0),
        arguments.number("tolerance_rotation", tolerance_rotation, least=0.0),
        within_reach,
        out_of_reach,
        arguments.count("restarts", restarts, least=0),
        chained,
    )
    seed = arguments.integer("seed", seed, least=0)
    return Settings(kernels, limits, seed, arguments.boolean("record", record))


_cached_settings = functools.lru_cache(maxsize=64, typed=True)(_settings)
