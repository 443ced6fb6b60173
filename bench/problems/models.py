"""Problems from model files: a robot of URDF or MJCF, a skeleton of BVH, a cloth of OBJ."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from plumbob import reference
from plumbob.reference.arguments import FloatArray, IndexArray, name_list
from plumbob.reference.formats import bvh, mjcf, read_obj, urdf
from plumbob.reference.rotation import roll_pitch_yaw

from .chains import TargetsForSkeleton
from .robots import TWO_REVOLUTIONS, BenchRobot, chain_of

# Springs [N/m] and mass [kg] of cloths from meshes.
STIFFNESS, MASS = 1000.0, 1.0
# The share of a mesh's height that counts as its highest point.
_TOP = 1e-3
# Poses for each target of a skeleton, of which those that reach far or near are taken.
_POOL, _EXTREME = 40, 0.05
_SEED = 1986
ANYWHERE, OUTER, INNER = "joint space", "outer shell", "near the root"


def robot(path: Path, name: str, effector: str | None) -> BenchRobot:
    """Return the chain of hinges of a URDF or MJCF file, from its root to the effector.

    Raises:
        ValueError: if it cannot be read, has no link of this name, or other joints than hinges on
        the path.
    """
    read = urdf.read if path.suffix.lower() == ".urdf" else mjcf.read
    model = read(path).articulation
    tip = _effector(model.skeleton, model.names, effector)
    steps = [int(j) for j in model.skeleton.path(tip)]
    kinds = ["mimic joint" if j in model.mimics else model.kinds[j] for j in steps]
    wrong = [f"a {kind}" for kind in kinds if kind not in ("hinge", "fixed")]
    if wrong or "hinge" not in kinds:
        got = [*wrong, "none"][0]
        raise ValueError(f"{path}: expected hinges to {model.names[tip]!r}, got {got}")
    return chain_of(name, name, "base", list(_joints(model, steps)))


def _effector(skeleton: reference.Skeleton, names: tuple[str, ...], effector: str | None) -> int:
    """Return a joint by name, else the leaf with the most joints before it."""
    if effector is not None:
        if effector not in names:
            raise ValueError(f"effector: expected one of {name_list(names[:20])}, got {effector!r}")
        return names.index(effector)
    leaves = set(range(len(names))) - set(skeleton.parents.tolist())
    return max(sorted(leaves), key=lambda leaf: len(skeleton.path(leaf)))


def _joints(model: reference.Articulation, steps: list[int]) -> Iterator[ElementTree.Element]:
    """Yield the joints of a path as URDF, which begins at the link `base`."""
    parent, half = "base", TWO_REVOLUTIONS / 2
    for i, j in enumerate(steps):
        child, kind = f"{i}_{model.names[j]}", "revolute" if model.kinds[j] == "hinge" else "fixed"
        R = reference.rotation.to_matrix(model.frames[j])
        joint = ElementTree.Element("joint", name=f"joint_{child}", type=kind)
        origin = {"xyz": _numbers(model.skeleton.offsets[j]), "rpy": _numbers(roll_pitch_yaw(R))}
        ElementTree.SubElement(joint, "origin", origin)
        ElementTree.SubElement(joint, "parent", link=parent)
        ElementTree.SubElement(joint, "child", link=child)
        if kind == "revolute":
            ElementTree.SubElement(joint, "axis", xyz=_numbers(model.axes[j]))
            lower, upper = (float(np.clip(x[j], -half, half)) for x in (model.lower, model.upper))
            ElementTree.SubElement(joint, "limit", lower=repr(lower), upper=repr(upper))
        yield joint
        parent = child


def _numbers(vector: Iterable[float]) -> str:
    return " ".join(repr(float(x)) for x in vector)


def skeletons(
    path: Path, title: str, effector: str | None, count: int = 100
) -> list[TargetsForSkeleton]:
    """Return targets for the balls of a BVH file, from random poses: anywhere, far out, near.

    Raises:
        ValueError: if it cannot be read, or has no joint of this name.
    """
    skeleton = bvh.read(path).skeleton
    tip = _effector(skeleton, skeleton.names, effector)
    chain = path_to(skeleton, tip)
    rng = np.random.default_rng(_SEED)
    pool = reference.rotation.random(rng, _POOL * count, chain.joint_count)
    reached = reference.forward_kinematics(chain, pool).positions[:, -1]
    order = np.argsort(np.linalg.norm(reached - chain.offsets[0], axis=-1))
    few = max(count, round(_EXTREME * len(order)))
    strata = {
        ANYWHERE: np.arange(count),
        OUTER: rng.choice(order[-few:], count, replace=False),
        INNER: rng.choice(order[:few], count, replace=False),
    }
    starts = reference.rotation.random(rng, count, chain.joint_count)
    return [
        TargetsForSkeleton(
            f"chain/{title}, {name}", f"{title}, {name}", chain, starts, reached[poses]
        )
        for name, poses in strata.items()
    ]


def path_to(skeleton: reference.Skeleton, effector: int) -> reference.Skeleton:
    """Return the joints from the root to an effector: no other moves it."""
    path = skeleton.path(effector)
    return reference.Skeleton(np.arange(len(path)) - 1, skeleton.offsets[path])


def cloth(path: Path, pins: str | None) -> tuple[reference.MassSpring, reference.State]:
    """Return the cloth of an OBJ file: its edges are springs at rest, its masses are equal.

    Raises:
        ValueError: if it cannot be read, or the pins are no rule and no particles.
    """
    mesh = read_obj(path)
    x, sides = mesh.vertices, mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    used, edges = np.unique(np.unique(np.sort(sides, axis=1), axis=0), return_inverse=True)
    x, edges = x[used], edges.reshape(-1, 2)
    rest = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    masses = np.full(len(x), MASS / len(x))
    system = reference.MassSpring(masses, edges, rest, STIFFNESS, pinned=_pins(x, pins))
    return system, reference.State(x, np.zeros_like(x))


def _pins(x: FloatArray, rule: str | None) -> IndexArray:
    if rule in (None, "far"):
        first = int(np.argmax(np.linalg.norm(x - x.mean(axis=0), axis=1)))
        second = int(np.argmax(np.linalg.norm(x - x[first], axis=1)))
        return np.unique([first, second])
    if rule == "top":
        height = x[:, 1]
        return np.flatnonzero(height >= height.max() - _TOP * max(np.ptp(height), 1e-12))
    words = str(rule).split(",")
    if not all(word.strip().isdecimal() and int(word) < len(x) for word in words):
        raise ValueError(f"pins: expected far, top, or indices below {len(x)}, got {rule!r}")
    return np.unique([int(word) for word in words])
