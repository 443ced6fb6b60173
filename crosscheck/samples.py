"""The seeded random systems on which claims are judged; case i is the same in every run."""

from typing import NamedTuple

import numpy as np

from reference import rotation
from reference.arguments import FloatArray
from reference.mass_spring import MassSpring, State
from reference.skeleton import Skeleton

MOST_JOINTS = 50
MOST_PARTICLES = 30


def generator(quantity: str, case: int) -> np.random.Generator:
    """Return the random numbers of one quantity of a case, independent of all others."""
    return np.random.default_rng([20130, *quantity.encode(), case])


def skeleton(case: int) -> Skeleton:
    """Return a chain (even cases) or a tree (odd ones) of 2 to 50 joints, 50 in cases 0 and 1.

    The names are shuffled, so that neither our order nor an engine's is theirs. Small skeletons
    are more frequent: the memory Pinocchio wants grows with the cube of the joints.
    """
    rng = generator("skeleton", case)
    joints = MOST_JOINTS if case < 2 else int(2 * (MOST_JOINTS / 2) ** rng.uniform())
    parents = np.arange(joints) - 1
    if case % 2:
        parents[1:] = [rng.integers(max(0, j - 6), j) for j in range(1, joints)]
    offsets = rng.standard_normal((joints, 3)) * rng.uniform(0.05, 1.0, (joints, 1))
    return Skeleton(parents, offsets, [f"joint{i}" for i in rng.permutation(joints)])


def local_rotations(case: int, skeleton: Skeleton, *batch: int) -> FloatArray:
    """Return uniformly random local rotations, shape (*batch, joint, 4)."""
    return rotation.random(generator("pose", case), *batch, skeleton.joint_count)


class Reach(NamedTuple):
    """An inverse kinematics problem: bring the effector from the start to the target."""

    skeleton: Skeleton
    start: FloatArray
    effector: int
    target: FloatArray


def reach(case: int) -> Reach:
    """Return a problem with any joint but the root as effector; one target in four is too far."""
    rng = generator("target", case)
    tree = skeleton(case)
    effector = int(rng.integers(1, tree.joint_count))
    direction = rotation.rotate(rotation.random(rng), [1.0, 0.0, 0.0])
    distance = rng.uniform(0.05, 1.3) * tree.reach(effector)
    target = tree.offsets[0] + distance * direction
    return Reach(tree, local_rotations(case, tree), effector, target)


class Motion(NamedTuple):
    """A mass-spring system in motion, and the time step to take [s]."""

    system: MassSpring
    state: State
    external_forces: FloatArray
    h: float


def motion(case: int, *, damped: bool = True) -> Motion:
    """Return a random network of 3 to 30 particles, all of them unequal, one or two pinned.

    Every spring is stretched or squeezed by up to a third; none is at its rest length, where
    MuJoCo's integrator "discrete" sees no stiffness. In every fifth case the ends of one spring
    coincide.
    """
    rng = generator("motion", case)
    n = 3 + case * 7 % (MOST_PARTICLES - 2)
    springs = _network(rng, n)
    s = len(springs)
    x = rng.standard_normal((n, 3))
    if case % 5 == 1:
        x[springs[0, 0]] = x[springs[0, 1]]
    lengths = np.linalg.norm(x[springs[:, 0]] - x[springs[:, 1]], axis=-1)
    strain = rng.uniform(0.02, 0.33, s) * rng.choice([-1.0, 1.0], s)
    system = MassSpring(
        masses=rng.uniform(0.2, 2.0, n),
        springs=springs,
        rest_lengths=np.where(lengths > 0.0, lengths * (1.0 + strain), 0.5),
        stiffnesses=10.0 ** rng.uniform(1.0, 3.0, s),
        dampings=rng.uniform(0.1, 5.0, s) * damped,
        pinned=rng.choice(n, size=1 + case % 2, replace=False),
        gravity=rng.standard_normal(3) * 5.0,
    )
    h = float(rng.choice([1 / 240, 1 / 60, 1 / 30]))
    return Motion(system, State(x, rng.standard_normal((n, 3))), rng.standard_normal((n, 3)), h)


def _network(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return springs, (spring, 2): a spanning tree and as many others, ends in either order."""
    tree = [(int(rng.integers(i)), i) for i in range(1, n)]
    others = [tuple(map(int, rng.choice(n, 2, replace=False))) for _ in range(n)]
    pairs = sorted({(min(pair), max(pair)) for pair in tree + others})
    return rng.permuted(np.array(pairs), axis=1)
