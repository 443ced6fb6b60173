"""Position targets for a chain of ten ball joints, from seeded random poses."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from plumbob.reference import Skeleton, rotation, scenes
from plumbob.reference.arguments import FloatArray, IndexArray, choice

BALLS = 10  # joints, as in Aristidou & Lasenby 2011, table 1
BEYOND = "beyond"

# How far targets lie from the root, as shares of the reach; uniform within the shell.
STRATA = {"near": (0.05, 0.4), "far": (0.6, 0.95), "edge": (0.99, 0.9999), BEYOND: (1.01, 2.0)}
SEED = 1986  # of the targets


@dataclass(frozen=True)
class TargetsForSkeleton:
    """A batch of independent position targets for the last joint."""

    name: str  # of the problem
    title: str  # how it is written
    skeleton: Skeleton  # the chain
    starts: FloatArray  # local rotations to start from, (target, joint, 4) or (joint, 4) for all
    targets: FloatArray  # global positions [m], (target, 3)

    @property
    def every_start(self) -> FloatArray:
        """The start for each target, (target, joint, 4)."""
        shape = (len(self.targets), self.skeleton.joint_count, 4)
        return np.broadcast_to(self.starts, shape)


class ChainRequest(NamedTuple):
    """A target [m], (3,), local rotations to start from, (joint, 4), and allowed iterations."""

    target: FloatArray
    start: FloatArray
    iterations: int


class ChainRequests(NamedTuple):
    """Targets as requests to a user's solver."""

    problem: TargetsForSkeleton  # the targets
    iterations: IndexArray  # how many are allowed for each of them, (target,)

    @property
    def shape(self) -> tuple[int, int]:
        """The number of targets, and of numbers of an answer: iterations, then positions."""
        return len(self.iterations), 1 + 3 * self.problem.skeleton.joint_count

    def after(self, count: int) -> "ChainRequests":
        """Return the requests after the first `count`."""
        problem, starts = self.problem, self.problem.every_start[count:]
        problem = replace(problem, starts=starts, targets=problem.targets[count:])
        return ChainRequests(problem, self.iterations[count:])

    def request(self, i: int) -> ChainRequest:
        """Return a target."""
        targets, starts = self.problem.targets, self.problem.every_start
        return ChainRequest(targets[i], starts[i], int(self.iterations[i]))


def chain_targets(stratum: str, count: int, seed: int = SEED) -> TargetsForSkeleton:
    """Return targets in a stratum of distance; directions and starts are uniform at random.

    Raises:
        ValueError: if there is no stratum of this name.
    """
    low, high = STRATA[choice("stratum", stratum, STRATA)]
    rng = np.random.default_rng([seed, list(STRATA).index(stratum)])
    skeleton, _ = scenes.ball_chain(links=BALLS)
    distances = skeleton.reach() * rng.uniform(low, high, count)
    return TargetsForSkeleton(
        f"chain/{stratum}",
        f"chain, {stratum}",
        skeleton,
        rotation.random(rng, count, skeleton.joint_count),
        distances[:, None] * unit(rng.standard_normal((count, 3))),
    )


def unit(vectors: FloatArray) -> FloatArray:
    """Return the vectors of the last axis at unit length."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
