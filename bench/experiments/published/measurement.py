"""The published tables again: the same set-up as far as it is known, with the solvers at hand."""

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from reference import scenes, solve_ik

from ...harness.block import Block, Measured, Scale
from ...peers.registry import ONE_START, OURS, RESTARTS, TOOLBOX, TRAC_IK, Entry, Peer
from ..chain.problem import unit
from ..robots.evaluate import Tolerance
from ..robots.measurement import SUITE, Run, settings_of, solve
from ..robots.problem import is_installed
from ..robots.targets import uniform_targets
from . import problem as published

# Random targets, and seconds that a solver has for them, for those of a scale.
_TARGETS = 5
_BUDGET = 15.0
_SEED = 2011
_ITERATIONS = 10_000
# The solvers fast enough for 10,000 targets, with restarts as TRAC-IK has them.
_FAST = (OURS, TOOLBOX, TRAC_IK)


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield TRAC-IK's table, the toolbox's, FABRIK's; a solver that is missing is left out."""
    count, budget = _TARGETS * scale.targets, _BUDGET * scale.seconds
    norm = math.sqrt(3.0) * published.TRAC_IK_TOLERANCE
    tolerance = Tolerance(norm, norm)
    for peer in (peer for peer in _FAST if peer.version):
        entry = next(entry for entry in peer.entries if entry.kind == RESTARTS)
        for robot in dict.fromkeys(rate.robot for rate in published.TRAC_IK):
            if is_installed(robot):
                run = Run(robot, peer, entry, tolerance, budget)
                yield _block(f"published/trac_ik/{robot}", run, count, middle=True)
    if is_installed("ur5"):
        for peer, entry in _toolbox():
            near = math.sqrt(2.0 * published.TOOLBOX_HALF_SQUARE)
            run = Run("ur5", peer, entry, Tolerance(near, near), budget)
            yield _block("published/toolbox/ur5", run, count, middle=False)
    for stratum, distance in published.FABRIK_DISTANCES.items():
        for solver in published.FABRIK:
            yield Block(
                SUITE, f"published/fabrik/{stratum}", solver, partial(iterations, solver, distance),
                {"tolerance": published.FABRIK_TOLERANCE, "max_iterations": _ITERATIONS},
            )  # fmt: skip


def _toolbox() -> Iterator[tuple[Peer, Entry]]:
    once = next(entry for entry in OURS.entries if entry.kind == ONE_START)
    iterations = {"iterations": published.TOOLBOX_ITERATIONS}
    yield OURS, once._replace(settings={**once.settings, **iterations})
    if not TOOLBOX.version:
        return
    for method in published.TOOLBOX:
        settings = {"method": method, "searches": 1, "limits": False, **iterations}
        yield TOOLBOX, Entry(ONE_START, settings, note=method)


def _block(problem: str, run: Run, count: int, middle: bool) -> Block:
    settings = settings_of(run.peer, run.entry, run.tolerance)
    measure = partial(_solve, run, count, middle)
    return Block(SUITE, problem, run.peer.called(run.entry), measure, settings, count)


def _solve(run: Run, count: int, middle: bool) -> Measured:
    measured = solve(run, uniform_targets(run.robot, count, middle))
    kept = ("solved", "claimed", "seconds", "setup")
    arrays = {name: measured.arrays[name] for name in kept if name in measured.arrays}
    return Measured(arrays, measured.notes)


def iterations(solver: str, distance: float) -> Measured:
    """Solve for targets at a distance from the root of a straight chain, in random directions."""
    skeleton, rest = scenes.ball_chain(links=published.FABRIK_LINKS)
    rng = np.random.default_rng(_SEED)
    targets = distance * unit(rng.standard_normal((published.FABRIK_RUNS, 3)))
    solution = solve_ik(
        skeleton, rest, targets, solver,
        tolerance=published.FABRIK_TOLERANCE, max_iterations=_ITERATIONS,
    )  # fmt: skip
    return Measured({"iterations": solution.iterations, "residual": solution.residual})
