"""Skeletons and poses for the kinematics tests."""

import numpy as np
import pytest

from reference import Skeleton, rotation


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
