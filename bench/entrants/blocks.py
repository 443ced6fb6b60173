"""The blocks of entrants, and of everybody on the user's problems, in the suites that know them."""

import functools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import scenes

from ..experiments import chain, published
from ..experiments.chain.measurement import (
    BEYOND_TOLERANCE,
    MAX_ITERATIONS,
    TOLERANCE,
    Limits,
    blocks_of,
)
from ..experiments.chain.problem import STRATA, chain_targets, unit
from ..experiments.cloth_peers import measurement as cloth_peers
from ..experiments.cloth_peers.problem import FallingCloth, own_cloth
from ..experiments.published import problem as of_paper
from ..experiments.robots import REACHABLE
from ..experiments.robots import measurement as robots
from ..experiments.robots.problem import ROBOTS, enter, is_installed
from ..harness.block import Block, Measured, Scale
from ..peers import registry
from ..peers.registry import (
    AGAIN,
    EXPLICIT,
    LINEARISED,
    ONE_START,
    RESTARTS,
    UNDECLARED,
    ClothPeer,
    Entry,
    Peer,
)
from . import robot
from .chain import ChainProblem, solve_chain
from .chain_job import TASK as CHAIN_TASK
from .entrant import SUITE_TASKS, Entrant, Method
from .problems import OwnProblem

# Seconds that an entrant has for a stratum of the chain, for those of a scale: enough for as many
# iterations as ours may make, in the interpreter.
CHAIN_BUDGET = 250.0
_BY_LOT = ("robots/", "unreachable/")
_EXPLICIT_METHODS = ("explicit", "symplectic")
NO_ROBOTS = "not asked for robots: it offers no robot_inverse_kinematics"
NO_BALLS = "not asked for chains: it offers no inverse_kinematics"


class EnteredPeer(Peer):
    """An entrant as a peer for robots; `package` holds its version."""

    @property
    def version(self) -> str:
        """What it says of itself."""
        return self.package


@dataclass(frozen=True)
class EnteredCloth(ClothPeer):
    """An entrant as a peer for cloths; `package` holds its version."""

    @property
    def version(self) -> str:
        """What it says of itself."""
        return self.package


def blocks(suite: str, scale: Scale) -> Iterator[Block]:
    """Yield what a suite asks of each entrant."""
    own = [problem for problem in scale.problems if problem.suite == suite]
    for problem in own:
        if problem.robot is not None:
            enter(problem.robot)
        yield from (_with_digest(block, problem) for block in _of_problem(problem, scale))
    for entrant in scale.entrants:
        if suite in SUITE_TASKS and entrant.offers(suite):
            of_suite = _of_kinematics if suite == "ik" else _of_cloths
            for block in of_suite(entrant, scale):
                yield _marked(block, entrant)
            for problem in own:
                for block in _on_own(entrant, problem, scale):
                    yield _with_digest(_marked(block, entrant), problem)


def _with_digest(block: Block, problem: OwnProblem) -> Block:
    """Return a block that is measured again once the problem is another."""
    return replace(block, facts={**block.facts, "problem_digest": problem.digest})


def _of_problem(problem: OwnProblem, scale: Scale) -> Iterator[Block]:
    """Yield a user's problem for every solver that the bench knows."""
    if problem.robot is not None:
        for peer in registry.PEERS:
            if peer.version:
                yield from robots.blocks_of(peer, [problem.name], scale)
    elif problem.targets is not None:
        yield from blocks_of(problem.targets, problem.recorded[0], _chain_facts(problem))
    elif problem.cloth is not None:
        for one in registry.cloth_peers():
            if one.version:
                yield from _cloth_of(one, problem, scale)


def _chain_facts(problem: OwnProblem) -> dict[str, Any]:
    return {"task": chain.CHAIN, "stratum": "yours", "title": problem.name}


def _on_own(entrant: Entrant, problem: OwnProblem, scale: Scale) -> Iterator[Block]:
    """Yield a user's problem for a user's solver."""
    if problem.robot is not None and robot.TASK in entrant.tasks:
        yield from robots.blocks_of(as_peer(entrant), [problem.name], scale)
    if problem.cloth is not None:
        yield from _cloth_of(as_cloth_peer(entrant), problem, scale)
    if problem.targets is not None and CHAIN_TASK in entrant.tasks:
        made, limits = problem.targets, Limits(TOLERANCE, MAX_ITERATIONS)
        asked = ChainProblem(made.skeleton, made.starts, made.targets)
        budget, name = CHAIN_BUDGET * scale.seconds, problem.recorded[0]
        known, count = (asked, limits, budget), len(made.targets)
        for method in entrant.called():
            measure = partial(solve_chain, entrant.spec, method.name, *known, followed=True)
            facts, settings = _chain_facts(problem), limits._asdict()
            yield Block("ik", name, method.solver, measure, settings, count, facts)


def _cloth_of(peer: ClothPeer, problem: OwnProblem, scale: Scale) -> Iterator[Block]:
    yield from cloth_peers.own_blocks(peer, problem, partial(_falling, problem), scale)


@functools.lru_cache(maxsize=4)
def _falling(problem: OwnProblem) -> FallingCloth:
    assert problem.cloth is not None
    return own_cloth(problem.name, *problem.cloth, problem.h)


def joined(known: list[Block], suite: str, scale: Scale) -> list[Block]:
    """Return the blocks of a suite with those of entrants, each beside others on its problem.

    On robots, where times are compared, they follow each other by lot.
    """
    by_problem: dict[str, list[Block]] = {}
    for block in (*known, *blocks(suite, scale)):
        by_problem.setdefault(block.problem, []).append(block)
    return [
        block
        for problem, group in by_problem.items()
        for block in (robots.by_lot(group) if problem.startswith(_BY_LOT) else group)
    ]


def _marked(block: Block, entrant: Entrant) -> Block:
    """Return a block that says whose it is; what opens an entrant changes no answer."""
    settings = {name: value for name, value in block.settings.items() if name != "spec"}
    return replace(
        block,
        settings={**settings, "version": entrant.version},
        facts={**block.facts, **entrant.facts},
        conditions=entrant.conditions,
    )


def _of_kinematics(entrant: Entrant, scale: Scale) -> Iterator[Block]:
    if CHAIN_TASK in entrant.tasks:
        for method in entrant.called():
            yield from _on_chains(entrant, method, scale)
            yield from _as_in_the_paper(entrant, method, scale)
    else:
        facts = {"task": chain.CHAIN, "stratum": chain.BEYOND, "title": "every chain"}
        yield Block("ik", "chain/all", entrant.name, partial(not_asked, NO_BALLS), facts=facts)
    if robot.TASK in entrant.tasks:
        yield from _on_robots(entrant, scale)
    else:
        facts = {"task": REACHABLE, "title": "every robot"}
        measure, settings = partial(not_asked, NO_ROBOTS), {"kind": "any"}
        yield Block("ik", "robots/all", entrant.name, measure, settings, facts=facts)


def not_asked(why: str) -> Measured:
    """Return a block without numbers that says why a solver is not asked."""
    return Measured({}, {"remark": why})


def _on_chains(entrant: Entrant, method: Method, scale: Scale) -> Iterator[Block]:
    for stratum in STRATA:
        targets = chain_targets(stratum, scale.targets)
        beyond = stratum == chain.BEYOND
        limits = Limits(BEYOND_TOLERANCE if beyond else TOLERANCE, MAX_ITERATIONS)
        problem = ChainProblem(targets.skeleton, targets.starts, targets.targets)
        budget = CHAIN_BUDGET * scale.seconds
        measure = partial(
            solve_chain, entrant.spec, method.name, problem, limits, budget, followed=not beyond
        )
        facts = {"task": chain.CHAIN, "stratum": stratum, "title": targets.title}
        settings = limits._asdict()
        yield Block("ik", targets.name, method.solver, measure, settings, scale.targets, facts)


def _as_in_the_paper(entrant: Entrant, method: Method, scale: Scale) -> Iterator[Block]:
    """Yield the set-up of the paper on FABRIK."""
    skeleton, rest = scenes.ball_chain(links=of_paper.FABRIK_LINKS)
    rng = np.random.default_rng(_SEED_OF_PAPER)
    directions = unit(rng.standard_normal((of_paper.FABRIK_RUNS, 3)))
    limits = Limits(of_paper.FABRIK_TOLERANCE, of_paper.FABRIK_ITERATIONS)
    for stratum, distance in of_paper.FABRIK_DISTANCES.items():
        problem = ChainProblem(skeleton, rest, distance * directions)
        budget = CHAIN_BUDGET * scale.seconds
        measure = partial(solve_chain, entrant.spec, method.name, problem, limits, budget)
        facts = {"task": published.FABRIK, "stratum": stratum}
        name, settings = f"published/fabrik/{stratum}", limits._asdict()
        yield Block("ik", name, method.solver, measure, settings, facts=facts)


_SEED_OF_PAPER = 2011


def as_peer(entrant: Entrant) -> EnteredPeer:
    """Return an entrant as a peer for robots."""
    settings = {"spec": entrant.spec}
    entries = (
        Entry(ONE_START, settings),
        Entry(RESTARTS, settings, AGAIN, f"{AGAIN} restarts"),
    )
    version = entrant.version or entrant.digest or "unsaid"
    return EnteredPeer(entrant.name, robot.__name__, version, "", "", entries)


def _on_robots(entrant: Entrant, scale: Scale) -> Iterator[Block]:
    here = [name for name in ROBOTS if is_installed(name)]
    yield from robots.blocks_of(as_peer(entrant), here, scale)


def _of_cloths(entrant: Entrant, scale: Scale) -> Iterator[Block]:
    yield from cloth_peers.blocks_of(as_cloth_peer(entrant), cloth_peers.levels(scale))


def as_cloth_peer(entrant: Entrant) -> EnteredCloth:
    """Return an entrant as a peer for cloths, tried as its declared step asks for."""
    kind = EXPLICIT if entrant.step in _EXPLICIT_METHODS else LINEARISED
    version = entrant.version or entrant.digest or "unsaid"
    return EnteredCloth(
        title=entrant.name,
        engine=entrant.name,
        module="plumbob.bench.entrants.cloth",
        package=version,
        kind=kind if entrant.step else UNDECLARED,
        settings={"spec": entrant.spec},
    )
