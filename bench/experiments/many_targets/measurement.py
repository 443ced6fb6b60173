"""As many targets for an arm as are asked for: how many it misses, and what its solver claims.

They are measured in parts of some thousand, a block each, so that a million spread over the workers
of a cluster, and a run that is taken up again loses little. A part has the same targets however
many parts there are, and a part that is cut short has the first of them. The answers are evaluated
by MuJoCo's kinematics.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from ...harness.block import Block, Measured, Scale
from ...peers import registry
from ...peers.ik import plumbob
from ...peers.registry import RESTARTS, Entry
from ...problems.evaluate import Targets, Tolerance, evaluator_of
from ...problems.robots import title
from ..robots.measurement import TOLERANCE, settings_of

SUITE = "many_targets"
ROBOT = "iiwa14"
# So many targets make a part.
PART = 5000
_SEED = 1999


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield the parts; the last one may be smaller."""
    peer = registry.OURS
    entry = next(entry for entry in peer.entries if entry.kind == RESTARTS)
    settings = settings_of(peer, entry, TOLERANCE)
    for part, first in enumerate(range(0, scale.targets, PART)):
        count = min(PART, scale.targets - first)
        facts = {"title": title(ROBOT), "robot": ROBOT, "part": part}
        measure = partial(solve_part, entry, part, count, TOLERANCE)
        problem = f"many/{ROBOT}/{part:06d}"
        yield Block(SUITE, problem, peer.called(entry), measure, settings, count, facts)


def solve_part(entry: Entry, part: int, count: int, tolerance: Tolerance) -> Measured:
    """Solve the first targets of a part; keep counts, the worst answer and which were missed."""
    targets = part_targets(part, count)
    robot = evaluator_of(ROBOT).robot
    ask = plumbob.prepare(robot, tolerance, **entry.settings)
    found = [
        ask(positions, rotations, start)()
        for positions, rotations, start in zip(*targets[:3], strict=True)
    ]
    answers = np.array([one.q for one in found])
    claimed = np.array([bool(one.claimed) for one in found])
    evaluation = evaluator_of(ROBOT).evaluate(targets, answers, tolerance)
    solved = evaluation.solved
    return Measured(
        {
            "targets": count,
            "solved": np.count_nonzero(solved),
            "false": np.count_nonzero(claimed & ~solved),
            "position": evaluation.position[solved].max(initial=0.0),
            "rotation": evaluation.rotation[solved].max(initial=0.0),
            "missed": np.flatnonzero(~solved),
        }
    )


def part_targets(part: int, count: int) -> Targets:
    """Return the first targets of a part, uniform in joint space, and random starts."""
    evaluator = evaluator_of(ROBOT)
    rng = np.random.default_rng([_SEED, part])
    poses, starts = (evaluator.robot.draw(rng, PART)[:count] for _ in range(2))
    return Targets(*evaluator.forward(poses), starts, np.zeros(count, dtype=int))
