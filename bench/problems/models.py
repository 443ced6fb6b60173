"""Problems from model files: a robot of URDF or MJCF, a skeleton of BVH."""

import itertools
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from plumbob import reference
from plumbob.reference.formats import bvh, mjcf, urdf
from plumbob.reference.rotation import roll_pitch_yaw

from . import own
from .robots import TWO_REVOLUTIONS, BenchRobot, chain_of

_SEED = 1986  # of random poses


def robot(path: Path, name: str, effector: str | None) -> BenchRobot:
    """Return the chain of hinges of a URDF or MJCF file, from its root to the effector.

    Raises:
        ValueError: if it cannot be read, has no link of this name, or other joints than hinges on
        the path.
    """
    read = urdf.read if path.suffix.lower() == ".urdf" else mjcf.read
    model = read(path).articulation
    steps = _path(model.skeleton, effector)
    kinds = ["mimic joint" if j in model.mimics else model.kinds[j] for j in steps]
    wrong = [f"a {kind}" for kind in kinds if kind not in ("hinge", "fixed")]
    if wrong or "hinge" not in kinds:
        got = [*wrong, "none"][0]
        raise ValueError(f"{path}: expected hinges to {model.names[steps[-1]]!r}, got {got}")
    return chain_of(name, name, "base", list(_joints(model, steps)))


def _path(skeleton: reference.Skeleton, effector: str | None) -> list[int]:
    """Return the joints up to a named joint, else up to the leaf with the most joints before."""
    if effector is not None:
        return skeleton.path(effector).tolist()
    leaves = sorted({*range(skeleton.joint_count)} - {*skeleton.parents.tolist()})
    return max((skeleton.path(leaf).tolist() for leaf in leaves), key=len)


def _joints(model: reference.Articulation, steps: list[int]) -> Iterator[ElementTree.Element]:
    """Yield the joints of a path as URDF, which begins at the link `base`."""
    links = ["base", *(f"{i}_{model.names[j]}" for i, j in enumerate(steps))]
    for j, (parent, child) in zip(steps, itertools.pairwise(links), strict=True):
        rpy = roll_pitch_yaw(reference.rotation.to_matrix(model.frames[j]))
        parts = {"origin": {"xyz": _numbers(model.skeleton.offsets[j]), "rpy": _numbers(rpy)}}
        parts |= {"parent": {"link": parent}, "child": {"link": child}}
        if model.kinds[j] == "hinge":
            limits = np.array([model.lower[j], model.upper[j]])
            lower, upper = np.clip(limits, -TWO_REVOLUTIONS / 2, TWO_REVOLUTIONS / 2).tolist()
            parts |= {"axis": {"xyz": _numbers(model.axes[j])}}
            parts |= {"limit": {"lower": repr(lower), "upper": repr(upper)}}
        kind = "revolute" if model.kinds[j] == "hinge" else "fixed"
        joint = ElementTree.Element("joint", name=f"joint_{child}", type=kind)
        for tag, attributes in parts.items():
            ElementTree.SubElement(joint, tag, attributes)
        yield joint


def _numbers(vector: Iterable[float]) -> str:
    return " ".join(repr(float(x)) for x in vector)


def skeleton(path: Path, name: str, effector: str | None, count: int = 100) -> own.OwnProblem:
    """Return targets for the balls of a BVH file, from random poses.

    Raises:
        ValueError: if it cannot be read, or has no joint of this name.
    """
    tree, rng = bvh.read(path).skeleton, np.random.default_rng(_SEED)
    tip = _path(tree, effector)[-1]
    poses, starts = reference.rotation.random(rng, 2, count, tree.joint_count)
    targets = reference.forward_kinematics(tree, poses).positions[:, tip]
    fields = {"parents": tree.parents, "offsets": tree.offsets, "targets": targets}
    return own.skeleton(name, **fields, starts=starts, effector=tip)
