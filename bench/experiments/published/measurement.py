"""The published tables again: the same set-up as far as known, with the solvers at hand."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import scenes, solve_ik

from ...harness.block import Block, Measured, Scale
from ...peers import registry
from ...peers.registry import ONE_START, RESTARTS, Peer, PeerEntry
from ...problems import published
from ...problems.chains import TargetsForSkeleton, unit
from ...problems.evaluate import Targets, Tolerance
from ...problems.robot_targets import uniform_targets
from ...problems.robots import is_installed
from ..chain.measurement import SolverLimits, blocks_of_users
from ..robots.measurement import SUITE, RobotJob
from . import FABRIK, TOOLBOX, TRAC_IK

# Random targets per target of a scale, and how many are timed.
_TARGETS = 5
_TIMED_TARGETS = 200
_SEED = 2011
_LIMITS = SolverLimits(published.FABRIK.tolerance, published.FABRIK.iterations)
# The solvers fast enough for 10,000 targets, with restarts as in TRAC-IK.
_FAST = (registry.PLUMBOB_LM, registry.TOOLBOX, registry.TRAC_IK)


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield TRAC-IK's table, the toolbox's, FABRIK's; leave out solvers not installed."""
    count = _TARGETS * scale.targets
    tolerance = Tolerance(*[math.sqrt(3.0) * published.TRAC_IK.tolerance] * 2)
    for peer in (peer for peer in _FAST if peer.is_installed):
        for robot in dict.fromkeys(rate.robot for rate in published.TRAC_IK.rates):
            if is_installed(robot):
                targets = partial(uniform_targets, robot, count, middle=True)
                job = _job(robot, peer, peer.entry(RESTARTS), tolerance, targets, count)
                facts = {"task": TRAC_IK, "robot": robot, "title": robot}
                yield job.block(f"published/trac_ik/{robot}", facts)
    tolerance = Tolerance(*[math.sqrt(2.0 * published.TOOLBOX.half_square)] * 2)
    targets = partial(uniform_targets, "ur5", count, middle=False)
    for peer, entry, infeasible in _toolbox() if is_installed("ur5") else ():
        job = _job("ur5", peer, entry, tolerance, targets, count)
        about: dict[str, Any] = {"task": TOOLBOX, "title": "ur5", "infeasible": infeasible}
        yield job.block("published/toolbox/ur5", about)
    for stratum, distance in published.FABRIK.distances.items():
        yield from _fabrik(stratum, distance, scale)


def _toolbox() -> Iterator[tuple[Peer, PeerEntry, float | None]]:
    """Yield solvers without restarts, with the published share of infeasible targets."""
    plumbob, toolbox = registry.PLUMBOB_LM, registry.TOOLBOX
    entry, iterations = plumbob.entry(ONE_START), {"iterations": published.TOOLBOX.iterations}
    yield plumbob, replace(entry, settings={**entry.settings, **iterations}), None
    for search in published.TOOLBOX.searches if toolbox.is_installed else ():
        settings = {**search.settings, "searches": 1, "limits": False, **iterations}
        yield toolbox, PeerEntry(ONE_START, settings, note=search.title), search.infeasible


def _job(
    robot: str,
    peer: Peer,
    entry: PeerEntry,
    tolerance: Tolerance,
    targets: Callable[[], Targets],
    count: int,
) -> RobotJob:
    return RobotJob(robot, peer, entry, tolerance, targets, count, min(count, _TIMED_TARGETS))


def _fabrik(stratum: str, distance: float, scale: Scale) -> Iterator[Block]:
    """Yield targets at a distance from the root of a straight chain, in random directions."""
    chain = published.FABRIK
    skeleton, rest = scenes.ball_chain(links=chain.links, link_length=chain.length)
    rng = np.random.default_rng(_SEED)
    targets = distance * unit(rng.standard_normal((chain.runs, 3)))
    name, facts = f"published/fabrik/{stratum}", {"task": FABRIK, "stratum": stratum}
    problem = TargetsForSkeleton(name, name, skeleton, rest, targets)
    for solver in chain.means:
        measure = partial(iterations, problem, solver)
        yield Block(SUITE, name, solver, measure, _LIMITS._asdict(), facts=facts)
    for block in blocks_of_users(problem, _LIMITS, scale):
        yield replace(block, facts={**facts, **block.facts})


def iterations(problem: TargetsForSkeleton, solver: str) -> Measured:
    """Solve all targets with a solver of ours."""
    solution = solve_ik(
        problem.skeleton, problem.starts, problem.targets, solver, **_LIMITS._asdict()
    )
    return {
        "iterations": np.asarray(solution.iterations),
        "residual": np.asarray(solution.residual),
    }
