"""Targets for the effectors of robots: strata, all reachable by construction from seeded poses.

Targets come from a pool of random poses within the limits. A stratum is drawn from its poses in the
pool. Unreachable targets lie farther from the first joint than the sum of all link lengths.
"""

import functools

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray

from .chains import unit
from .evaluate import Evaluator, Targets, evaluator_of
from .robots import seed_of

STRATA = {
    "joint space": "uniform in joint space",
    "space": "the effector uniform in the space that it reaches",
    "outer shell": "the twentieth of the poses that reach farthest from the root",
    "near the root": "the twentieth that stay nearest to it",
    "near singular": "the twentieth with the smallest least singular value of the Jacobian",
    "at a limit": "uniform in joint space, then one joint put at one of its limits",
}
# Poses in the pool for each target of a stratum.
_POOL = 40
# The share of the pool in an extreme stratum: a twentieth, two poses for each target.
_EXTREME = 0.05
# Cells a side of the grid by which effectors are spread evenly over space.
_CELLS = 12
SEED = 1986  # of the targets


@functools.lru_cache(maxsize=16)
def robot_targets(name: str, count: int, seed: int = SEED, seeds: int = 1) -> Targets:
    """Return `count` targets of each seed in each stratum, and random starts.

    The strata alternate, then the seeds, from `seed` on.
    """
    draws = [_drawn_targets(name, count, seed + k) for k in range(seeds)]

    def interleaved(*parts: np.ndarray) -> np.ndarray:
        rounds = [part.reshape(count, len(STRATA), *part.shape[1:]) for part in parts]
        return np.stack(rounds, axis=1).reshape(-1, *parts[0].shape[1:])

    return Targets(*map(interleaved, *draws))


def seed_indices(target_count: int, seeds: int) -> np.ndarray:
    """Return the index of each target's seed in `robot_targets`, (target,)."""
    return np.arange(target_count) // len(STRATA) % seeds


def _drawn_targets(name: str, count: int, seed: int) -> Targets:
    """Return `count` targets of a seed in each stratum, the strata alternating."""
    evaluator = evaluator_of(name)
    rng = np.random.default_rng([seed, seed_of(name)])
    poses = np.stack(list(stratum_poses(evaluator, rng, count).values()), axis=1)
    positions, rotations = evaluator.forward(poses.reshape(-1, poses.shape[-1]))
    strata = np.tile(np.arange(len(STRATA)), count)
    return Targets(positions, rotations, evaluator.robot.draw(rng, len(strata)), strata)


def stratum_poses(
    evaluator: Evaluator, rng: np.random.Generator, count: int
) -> dict[str, FloatArray]:
    """Return the poses behind the targets, (count, coordinate) for each stratum."""
    pool = evaluator.robot.draw(rng, _POOL * count)
    effectors, _ = evaluator.forward(pool)
    distance = np.linalg.norm(effectors - evaluator.first_joint, axis=-1).max(axis=-1)
    poses = [
        pool[:count],
        pool[spread(rng, effectors, count)],
        pool[_extreme(rng, -distance, count)],
        pool[_extreme(rng, distance, count)],
        pool[_extreme(rng, least_singular_values(evaluator, pool), count)],
        _at_a_limit(rng, evaluator, count),
    ]
    return dict(zip(STRATA, poses, strict=True))


@functools.lru_cache(maxsize=16)
def unreachable_targets(name: str, count: int, seed: int = SEED) -> Targets:
    """Return targets 1.05 to 1.5 times as far from the first joint as any pose reaches."""
    evaluator, rng = evaluator_of(name), np.random.default_rng([seed, seed_of(name), 1])
    return targets_at(
        evaluator, rng, rng.uniform(1.05, 1.5, (count, len(evaluator.robot.effectors)))
    )


def targets_at(evaluator: Evaluator, rng: np.random.Generator, distance: FloatArray) -> Targets:
    """Return random poses at distances from the first joint, (target, effector).

    The unit of the distances is the sum of all link lengths.
    """
    shape, length = distance.shape, farthest(evaluator)
    offsets = length * distance[..., None] * unit(rng.standard_normal((*shape, 3)))
    rotations = rotation.to_matrix(rotation.random(rng, *shape))
    starts, strata = evaluator.robot.draw(rng, len(distance)), np.zeros(len(distance), dtype=int)
    return Targets(evaluator.first_joint + offsets, rotations, starts, strata)


def least_distances(name: str, targets: Targets) -> FloatArray:
    """Return a lower bound of the farther effector's distance from its target [m], (target,).

    The target's distance from the first joint exceeds the sum of all link lengths by this bound.
    """
    evaluator = evaluator_of(name)
    distance = np.linalg.norm(targets.positions - evaluator.first_joint, axis=-1)
    return np.maximum(distance - farthest(evaluator), 0.0).max(axis=-1)


@functools.lru_cache(maxsize=16)
def uniform_targets(name: str, count: int, middle: bool) -> Targets:
    """Return targets uniform in joint space, from random starts or the middle of the limits."""
    evaluator = evaluator_of(name)
    rng = np.random.default_rng([SEED, seed_of(name), count])
    positions, rotations = evaluator.forward(evaluator.robot.draw(rng, count))
    starts = evaluator.robot.draw(rng, count)
    if middle:
        starts[:] = (evaluator.robot.lower + evaluator.robot.upper) / 2
    return Targets(positions, rotations, starts, np.zeros(count, dtype=int))


def least_singular_values(evaluator: Evaluator, q: FloatArray) -> FloatArray:
    """Return the least singular value of each pose's Jacobian, lengths in units of the reach."""
    J = evaluator.jacobians(q)
    J[:, :, 0] /= farthest(evaluator)
    if not evaluator.robot.oriented:
        J = J[:, :, :1]
    singular_values = np.linalg.svd(J.reshape(len(q), -1, J.shape[-1]), compute_uv=False)
    return np.asarray(singular_values[:, -1], dtype=float)


def _extreme(rng: np.random.Generator, measure: FloatArray, count: int) -> FloatArray:
    order = np.argsort(measure, kind="stable")[: max(count, int(_EXTREME * len(measure)))]
    return rng.choice(order, count, replace=False)


def spread(rng: np.random.Generator, effectors: FloatArray, count: int) -> FloatArray:
    """Return the numbers of poses with the first effector spread over all occupied cells.

    A cell is drawn first, then a pose within the cell.
    """
    points = effectors[:, 0]
    edge = np.ptp(points, axis=0).max() / _CELLS
    cells = np.unique((points // edge).astype(int), axis=0, return_inverse=True)[1].ravel()
    order = rng.permutation(len(points))
    members = [order[cells[order] == cell] for cell in range(cells.max() + 1)]
    drawn = rng.integers(len(members), size=count)
    return np.array([rng.choice(members[cell]) for cell in drawn])


def _at_a_limit(rng: np.random.Generator, evaluator: Evaluator, count: int) -> FloatArray:
    robot, q = evaluator.robot, evaluator.robot.draw(rng, count)
    joint = rng.choice(np.flatnonzero(np.isfinite(robot.lower)), count)
    is_low = rng.random(count) < 0.5
    q[np.arange(count), joint] = np.where(is_low, robot.lower[joint], robot.upper[joint])
    return q


def farthest(evaluator: Evaluator) -> float:
    """Return the sum of link lengths, which bounds the reach from the first joint [m]."""
    lengths = []
    for effector in evaluator.robot.effectors:
        body, length = evaluator.model.body(effector).id, 0.0
        first = evaluator.model.jnt_bodyid[0]
        while body not in (first, 0):
            length += float(np.linalg.norm(evaluator.model.body_pos[body]))
            body = int(evaluator.model.body_parentid[body])
        lengths.append(length)
    return max(lengths)
