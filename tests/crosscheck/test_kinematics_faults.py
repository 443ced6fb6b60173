"""The claims about skeletons go red under the faults that real solutions make."""

from functools import partial

import numpy as np
import pytest

from plumbob.crosscheck import kinematics
from plumbob.crosscheck.claims import CLAIMS, skeleton_claims
from plumbob.crosscheck.engines import SKELETON_ENGINES
from plumbob.crosscheck.verdict import check_claim
from plumbob.reference import rotation
from plumbob.reference.inverse_kinematics import solve_ik
from plumbob.reference.kinematics import forward_kinematics
from plumbob.reference.skeleton import Pose, Skeleton

# A chain and a tree; for IK a chain by two solvers.
FEW = 2


def faulty_forward(skeleton, local, *, fault):
    positions, rotations = np.empty((*local.shape[:-1], 3)), np.empty(local.shape)
    unrotated = rotation.identity(*local.shape[:-2])
    for j, (parent, offset) in enumerate(zip(skeleton.parents, skeleton.offsets, strict=True)):
        Q = np.roll(local[..., j, :], -1, axis=-1) if fault == "xyzw" else local[..., j, :]
        R, x = (rotations[..., parent, :], positions[..., parent, :]) if j else (unrotated, 0.0)
        swapped = fault == "wrong order"
        rotations[..., j, :] = rotation.multiply(*((Q, R) if swapped else (R, Q)))
        frame = {"child's rotation": rotations[..., j, :], "no rotation": unrotated}.get(fault, R)
        at_origin = fault == "root at the origin" and parent < 0
        positions[..., j, :] = 0.0 if at_origin else x + rotation.rotate(frame, offset)
    return Pose(positions, rotations)


def faulty_local(skeleton, rotations, *, fault):
    local = np.array(rotations)
    for j in range(1, skeleton.joint_count):
        R_parent, R = rotations[..., skeleton.parents[j], :], rotations[..., j, :]
        inverse = rotation.conjugate(R_parent)
        products = {"without inverse": (R_parent, R), "from the right": (R, inverse)}
        local[..., j, :] = rotation.multiply(*products[fault])
    return local


def faulty_ik(skeleton, start, target, solver, effector, *, fault, **settings):
    tree = skeleton
    if fault == "another link's length":
        offsets = np.vstack([tree.offsets[:1], 1.1 * tree.offsets[1:]])
        tree = Skeleton(tree.parents, offsets, tree.names)
    solution = solve_ik(tree, start, target, solver, effector, **settings)
    x, Q = solution.positions, solution.local_rotations
    changes = {
        "success claimed": {"residual": 0.0},
        "residual in centimetres": {"residual": 100.0 * solution.residual},
        "root not put back": {"positions": x + 1e-6 * kinematics.full_reach(skeleton)},
        "stale joints": {"positions": forward_kinematics(skeleton, start).positions},
        "world rotations as local": {
            "local_rotations": forward_kinematics(skeleton, Q).rotations,
        },
    }
    return solution._replace(**changes.get(fault, {}))


# For each claim: the name that its comparison uses, what takes its place, and the faults of that.
FAULTS = {
    "joint positions": (
        "forward_kinematics",
        faulty_forward,
        "xyzw, wrong order, child's rotation, no rotation, root at the origin",
    ),
    "joint rotations": ("forward_kinematics", faulty_forward, "xyzw, wrong order"),
    "local rotations": ("local_from_global", faulty_local, "without inverse, from the right"),
    "IK answers": (
        "solve_ik",
        faulty_ik,
        "success claimed, residual in centimetres, root not put back, stale joints, "
        "world rotations as local, another link's length",
    ),
}


@pytest.mark.parametrize("engine", SKELETON_ENGINES)
@pytest.mark.parametrize(
    ("quantity", "fault"),
    [(quantity, fault) for quantity in FAULTS for fault in FAULTS[quantity][2].split(", ")],
)
def test_claim_goes_red_under_the_fault(monkeypatch, engine, quantity, fault):
    name, faulty, _ = FAULTS[quantity]
    monkeypatch.setattr(kinematics, name, partial(faulty, fault=fault))
    assert check_claim(CLAIMS[f"{quantity}, {engine}"], FEW).failure == "they differ"


@pytest.mark.parametrize("engine", SKELETON_ENGINES)
def test_without_a_fault_the_copy_holds(monkeypatch, engine):
    monkeypatch.setattr(kinematics, "forward_kinematics", partial(faulty_forward, fault=None))
    monkeypatch.setattr(kinematics, "solve_ik", partial(faulty_ik, fault=None))
    for quantity in ("joint positions", "joint rotations", "IK answers"):
        assert check_claim(CLAIMS[f"{quantity}, {engine}"], FEW).holds


@pytest.mark.parametrize("engine", SKELETON_ENGINES)
def test_every_claim_has_a_fault(engine):
    assert {claim.name for claim in skeleton_claims(engine)} == {f"{q}, {engine}" for q in FAULTS}


def test_positions_of_a_skeleton_are_over_the_longest_way_from_its_root():
    """Two branches of three and of four metres; the root's own offset does not count."""
    parents, lengths = [-1, 0, 1, 0, 3, 3], [9.0, 1.0, 2.0, 3.0, 1.0, 0.5]
    tree = Skeleton(parents, np.outer(lengths, [0.6, 0.0, 0.8]))
    assert kinematics.full_reach(tree) == pytest.approx(4.0)
