"""The published tables again: the same set-up as far as it is known, with the solvers at hand."""

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import scenes, solve_ik

from ...harness.block import Block, Measured, Scale
from ...peers import registry
from ...peers.registry import ONE_START, RESTARTS, Entry, Peer
from ..chain.problem import unit
from ..robots.evaluate import Tolerance
from ..robots.measurement import SUITE, Run, settings_of, solve
from ..robots.problem import is_installed
from ..robots.targets import uniform_targets
from . import FABRIK, TOOLBOX, TRAC_IK
from . import problem as published

# Random targets, and seconds that a solver has for them, for those of a scale.
_TARGETS = 5
_BUDGET = 15.0
_SEED = 2011
_LIMITS: dict[str, Any] = {
    "tolerance": published.FABRIK_TOLERANCE,
    "max_iterations": published.FABRIK_ITERATIONS,
}
# The solvers fast enough for 10,000 targets, with restarts as TRAC-IK has them.
_FAST = (registry.OURS, registry.TOOLBOX, registry.TRAC_IK)


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
                about = {"task": TRAC_IK, "robot": robot, "title": robot}
                yield _block(f"published/trac_ik/{robot}", run, count, about)
    if is_installed("ur5"):
        for peer, entry, infeasible in _toolbox():
            near = math.sqrt(2.0 * published.TOOLBOX_HALF_SQUARE)
            run = Run("ur5", peer, entry, Tolerance(near, near), budget)
            facts: dict[str, Any] = {"task": TOOLBOX, "title": "ur5", "infeasible": infeasible}
            yield _block("published/toolbox/ur5", run, count, facts)
    for stratum, distance in published.FABRIK_DISTANCES.items():
        about = {"task": FABRIK, "stratum": stratum}
        for solver in published.FABRIK:
            measure = partial(iterations, solver, distance)
            yield Block(SUITE, f"published/fabrik/{stratum}", solver, measure, _LIMITS, facts=about)


def _toolbox() -> Iterator[tuple[Peer, Entry, float | None]]:
    """Yield what makes one search, and the rate of infeasible targets that was published."""
    ours, toolbox = registry.OURS, registry.TOOLBOX
    once = next(entry for entry in ours.entries if entry.kind == ONE_START)
    iterations = {"iterations": published.TOOLBOX_ITERATIONS}
    yield ours, once._replace(settings={**once.settings, **iterations}), None
    for search in published.TOOLBOX if toolbox.version else ():
        settings = {**search.settings, "searches": 1, "limits": False, **iterations}
        yield toolbox, Entry(ONE_START, settings, note=search.title), search.infeasible


def _block(problem: str, run: Run, count: int, facts: dict[str, Any]) -> Block:
    settings = settings_of(run.peer, run.entry, run.tolerance)
    measure = partial(_solve, run, count, middle=facts["task"] == TRAC_IK)
    return Block(SUITE, problem, run.peer.called(run.entry), measure, settings, count, facts)


def _solve(run: Run, count: int, middle: bool) -> Measured:
    measured = solve(run, uniform_targets(run.robot, count, middle))
    kept = ("solved", "claimed", "seconds", "setup")
    arrays = {name: measured.arrays[name] for name in kept if name in measured.arrays}
    return Measured(arrays, measured.notes, measured.facts)


def iterations(solver: str, distance: float) -> Measured:
    """Solve for targets at a distance from the root of a straight chain, in random directions."""
    skeleton, rest = scenes.ball_chain(
        links=published.FABRIK_LINKS, link_length=published.FABRIK_LENGTH
    )
    rng = np.random.default_rng(_SEED)
    targets = distance * unit(rng.standard_normal((published.FABRIK_RUNS, 3)))
    solution = solve_ik(skeleton, rest, targets, solver, **_LIMITS)
    return Measured({"iterations": solution.iterations, "residual": solution.residual})
