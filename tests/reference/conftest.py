"""Skeletons and poses for the kinematics tests, and a network for the mass-spring tests."""

import numpy as np
import pytest

from plumbob.reference import Articulation, Mimic, Skeleton, rotation
from plumbob.reference.mass_spring import MassSpring, State


def random_tree(rng, joints, branching=True):
    """Return a tree whose links are a tenth to one metre long, or a chain."""
    parents = [-1] + [int(rng.integers(0, j)) if branching else j - 1 for j in range(1, joints)]
    directions = rng.standard_normal((joints, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    return Skeleton(parents, directions * rng.uniform(0.1, 1.0, (joints, 1)))


@pytest.fixture(params=["chain", "tree"])
def skeleton(request, rng):
    """Return a chain and a tree of six joints."""
    return random_tree(rng, 6, branching=request.param == "tree")


@pytest.fixture
def local(rng, skeleton):
    """Return a random pose of the skeleton."""
    return rotation.random(rng, skeleton.joint_count)


def rebuilt(system, **changes):
    """Return the same system with some arguments changed."""
    names = ["masses", "springs", "rest_lengths", "stiffnesses", "dampings", "pinned", "gravity"]
    names += ["tension_only"]
    return MassSpring(**{name: changes.get(name, getattr(system, name)) for name in names})


@pytest.fixture
def altered():
    """Return the function that rebuilds a mass-spring system with some arguments changed."""
    return rebuilt


@pytest.fixture(params=["springs", "ropes"])
def network(rng, request):
    """Return seven unequal particles, one pinned, joined by damped springs, and a moving state.

    Springs are stretched and compressed by up to a half, so that the geometric stiffness has both
    signs; none is near length zero or its rest length, where its energy may lack derivatives.
    Among "ropes" every second one is tension-only.
    """
    springs = np.array([(i, j) for i in range(7) for j in range(i) if (i * j) % 4 != 3])
    corners = np.array([[i % 2, i // 2 % 2, i // 4] for i in range(7)], dtype=float)
    x = corners + rng.uniform(-0.2, 0.2, (7, 3))
    lengths = np.linalg.norm(x[springs[:, 0]] - x[springs[:, 1]], axis=1)
    system = MassSpring(
        masses=rng.uniform(0.5, 2.0, 7),
        springs=springs,
        rest_lengths=lengths * rng.uniform(0.5, 1.5, len(springs)),
        stiffnesses=rng.uniform(10.0, 100.0, len(springs)),
        dampings=rng.uniform(0.1, 1.0, len(springs)),
        pinned=[2],
        gravity=(0.3, -9.81, 0.2),
        tension_only=(np.arange(len(springs)) % 2 == 0) & (request.param == "ropes"),
    )
    return system, State(x, rng.standard_normal((7, 3)))


def random_articulation(kinds, seed):
    """Return a random tree of joints of these kinds; two in three are limited, some are mimics."""
    rng = np.random.default_rng(seed)
    count = len(kinds)
    parents = [-1] + [int(rng.integers(0, j)) for j in range(1, count)]
    limited = rng.random(count) < 2 / 3
    lower = np.where(limited, rng.uniform(-2.5, 0.5, count), -np.inf)
    upper = np.where(limited, rng.uniform(0.5, 2.5, count), np.inf)
    single = [j for j in range(count) if kinds[j] in ("hinge", "slide")]
    leaders = {j: int(rng.choice(single)) for j in single if rng.random() < 0.3}
    skeleton, axes = (
        Skeleton(parents, rng.standard_normal((count, 3))),
        rng.standard_normal((count, 3)),
    )
    frames = rotation.random(rng, count)
    cones = np.where(limited, rng.uniform(0.0, 3.0, count), np.inf)
    mimics = {
        j: Mimic(leader, *rng.uniform(-2.0, 2.0, 2))
        for j, leader in leaders.items()
        if leader not in leaders
    }
    for j, (_, multiplier, shift) in mimics.items():  # all limits hold where leaders are at 0.5
        lower[j] += 0.5 * multiplier + shift - 0.5
        upper[j] += 0.5 * multiplier + shift - 0.5
    return Articulation(
        skeleton, kinds, axes, frames=frames, lower=lower, upper=upper, cones=cones, mimics=mimics
    )


@pytest.fixture(scope="session")
def articulated():
    """Return the function that makes a random articulation of given kinds from a seed."""
    return random_articulation
