"""Solvers, mechanisms and targets for the inverse kinematics tests."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from plumbob.reference import (
    IK_SOLVERS,
    Articulation,
    Skeleton,
    Target,
    forward_kinematics,
    rotation,
    set_backend,
)
from plumbob.reference.inverse_kinematics.far_step import FAR_STEP
from plumbob.reference.inverse_kinematics.mechanism import (
    TARGET,
    gather,
    new_data,
    update_forward_kinematics,
)
from plumbob.reference.inverse_kinematics.reduce import prepare
from plumbob.reference.inverse_kinematics.solve_mechanism import new_workspace

# Compiling these takes longer than their tests, which are left to the slow tests.
RARE = ("damped_least_squares", "jacobian_transpose", "anderson_ccd")
SOLVERS = [
    pytest.param(name, marks=pytest.mark.slow if name in RARE else ()) for name in IK_SOLVERS
]


@pytest.fixture(params=SOLVERS)
def solver(request):
    return request.param


@pytest.fixture(params=IK_SOLVERS)
def any_solver(request):
    """Yield each solver; rare solvers run in the interpreter, which spares their compilation."""
    with set_backend("python" if request.param in RARE else "numba"):
        yield request.param


def targets_by_pose(model, rng, count=1, oriented=0.5):
    """Return targets for some joints that one pose within the limits reaches, and that pose."""
    q = model.random(rng)
    pose = forward_kinematics(model, q)
    effectors = rng.choice(model.joint_count, min(count, model.joint_count), replace=False)
    return [
        Target(
            pose.positions[e],
            pose.rotations[e] if rng.random() < oriented else None,
            int(e),
            float(10.0 ** rng.uniform(-0.5, 0.5)),
        )
        for e in effectors
    ], q


def joints_that_move(model, targets):
    """Return the joints that may be moved: those above the effectors, and leaders of those."""
    found = set()
    for target in targets:
        path = [int(j) for j in model.skeleton.path(target.effector)]
        own = target.rotation is not None or model.kinds[path[-1]] in ("slide", "free")
        found.update(path if own else path[:-1])
    found.update(model.mimics[j].leader for j in list(found) if j in model.mimics)
    return found - set(model.mimics)


def outside(model, rng, *shape):
    """Return coordinates without regard to limits, (..., coordinate)."""
    free = Articulation(model.skeleton, model.kinds, mimics=model.mimics)
    q = free.random(rng, *shape)
    for j, kind in enumerate(model.kinds):
        if kind in ("hinge", "slide") and j not in model.mimics:
            q[..., model.coordinates_of(j)] *= 2.0
    return q


def chain_of(kind, rng, links=4, **limits):
    """Return a chain of joints of one kind with random axes and links of 0.3 to 0.7 m."""
    directions = rng.standard_normal((links + 1, 3))
    offsets = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    offsets *= rng.uniform(0.3, 0.7, (links + 1, 1))
    axes = rotation.rotate(rotation.random(rng, links + 1), [0.0, 0.0, 1.0])
    return Articulation(Skeleton(range(-1, links), offsets), kind, axes, **limits)


class Machine(NamedTuple):
    """What a kernel that updates a mechanism is given."""

    mechanism: Any
    target: np.ndarray
    data: Any
    workspace: Any

    @property
    def far_step(self) -> np.ndarray:
        """Return the record of a step that has not been made."""
        return np.zeros(1, FAR_STEP)


def machine_of(model, q, targets):
    """Return the mechanism that moves some effectors, placed, and a workspace for every solver."""
    oriented = tuple(target.rotation is not None for target in targets)
    mechanism = prepare(model, tuple(target.effector for target in targets), oriented).mechanism
    target_rows = np.zeros(len(targets), TARGET)
    for e, (position, Q, _, weight) in enumerate(targets):
        target_rows[e] = position, rotation.identity() if Q is None else Q, weight
    data = new_data(mechanism)
    gather(mechanism, np.array(q), data.q)
    update_forward_kinematics(mechanism, data)
    return Machine(mechanism, target_rows, data, new_workspace(mechanism))


def without_limits(model):
    """Return the same articulation, its limits left out."""
    return Articulation(
        model.skeleton, model.kinds, model.axes, frames=model.frames, mimics=model.mimics
    )


# Fixtures that are the functions above, for the tests of several files.
reachable = pytest.fixture(scope="session")(lambda: targets_by_pose)
moving_joints = pytest.fixture(scope="session")(lambda: joints_that_move)
beyond_limits = pytest.fixture(scope="session")(lambda: outside)
chain_of_joints = pytest.fixture(scope="session")(lambda: chain_of)
machine = pytest.fixture(scope="session")(lambda: machine_of)
unlimited = pytest.fixture(scope="session")(lambda: without_limits)
