"""The claims about skeletons go red under the slips that real solutions make."""

from functools import partial

import numpy as np
import pytest

from crosscheck import kinematics
from crosscheck.claims import CLAIMS, skeleton_claims
from crosscheck.engines import SKELETON_ENGINES
from crosscheck.verdict import check_claim
from reference import rotation
from reference.inverse_kinematics import solve_ik
from reference.kinematics import forward_kinematics
from reference.skeleton import Pose, Skeleton

# A chain and a tree; for IK a chain by two solvers.
FEW = 2


def slipped_forward(skeleton, local, *, slip):
    positions, rotations = np.empty((*local.shape[:-1], 3)), np.empty(local.shape)
    unturned = rotation.identity(*local.shape[:-2])
    for j, (parent, offset) in enumerate(zip(skeleton.parents, skeleton.offsets, strict=True)):
        Q = np.roll(local[..., j, :], -1, axis=-1) if slip == "xyzw" else local[..., j, :]
        R, x = (rotations[..., parent, :], positions[..., parent, :]) if j else (unturned, 0.0)
        swapped = slip == "wrong order"
        rotations[..., j, :] = rotation.multiply(*((Q, R) if swapped else (R, Q)))
        frame = {"child's rotation": rotations[..., j, :], "no rotation": unturned}.get(slip, R)
        at_origin = slip == "root at the origin" and parent < 0
        positions[..., j, :] = 0.0 if at_origin else x + rotation.rotate(frame, offset)
    return Pose(positions, rotations)


def slipped_local(skeleton, rotations, *, slip):
    local = np.array(rotations)
    for j in range(1, skeleton.joint_count):
        R_parent, R = rotations[..., skeleton.parents[j], :], rotations[..., j, :]
        inverse = rotation.conjugate(R_parent)
        products = {"without inverse": (R_parent, R), "from the right": (R, inverse)}
        local[..., j, :] = rotation.multiply(*products[slip])
    return local


def slipped_ik(skeleton, start, target, solver, effector, *, slip, **settings):
    tree = skeleton
    if slip == "another link's length":
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
    return solution._replace(**changes.get(slip, {}))


# For each claim: the name that its comparison uses, what takes its place, and the slips of that.
SLIPS = {
    "joint positions": (
        "forward_kinematics",
        slipped_forward,
        ["xyzw", "wrong order", "child's rotation", "no rotation", "root at the origin"],
    ),
    "joint rotations": ("forward_kinematics", slipped_forward, ["xyzw", "wrong order"]),
    "local rotations": ("local_from_global", slipped_local, ["without inverse", "from the right"]),
    "IK answers": (
        "solve_ik",
        slipped_ik,
        [
            "success claimed",
            "residual in centimetres",
            "root not put back",
            "stale joints",
            "world rotations as local",
            "another link's length",
        ],
    ),
}


@pytest.mark.parametrize("engine", SKELETON_ENGINES)
@pytest.mark.parametrize(
    ("quantity", "slip"), [(quantity, slip) for quantity in SLIPS for slip in SLIPS[quantity][2]]
)
def test_claim_goes_red_under_the_slip(monkeypatch, engine, quantity, slip):
    name, slipped, _ = SLIPS[quantity]
    monkeypatch.setattr(kinematics, name, partial(slipped, slip=slip))
    assert check_claim(CLAIMS[f"{quantity}, {engine}"], FEW).missed == "they differ"


@pytest.mark.parametrize("engine", SKELETON_ENGINES)
def test_without_a_slip_the_copy_holds(monkeypatch, engine):
    monkeypatch.setattr(kinematics, "forward_kinematics", partial(slipped_forward, slip=None))
    monkeypatch.setattr(kinematics, "solve_ik", partial(slipped_ik, slip=None))
    for quantity in ("joint positions", "joint rotations", "IK answers"):
        assert check_claim(CLAIMS[f"{quantity}, {engine}"], FEW).holds


@pytest.mark.parametrize("engine", SKELETON_ENGINES)
def test_every_claim_has_a_slip(engine):
    assert {claim.name for claim in skeleton_claims(engine)} == {f"{q}, {engine}" for q in SLIPS}
