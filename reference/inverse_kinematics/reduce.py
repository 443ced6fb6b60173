"""From an articulation and its effectors to the mechanism that the solvers work on."""

import functools
from typing import Any, NamedTuple

import numpy as np

from ..arguments import BoolArray, FloatArray, IndexArray, RecordArray
from ..articulation import (
    FIXED,
    FREE,
    FREEDOMS,
    HINGE,
    SLIDE,
    Articulation,
    number_coordinates,
    rotated_by_pi,
)
from ..quaternion import IDENTITY, add, load_quaternion, load_vector, multiply, rotate
from ..skeleton import Skeleton
from .chain import packed_chain
from .mechanism import EFFECTOR, Mechanism, Problem, packed_problem

# Points coincide if their distance is at most this, over the reach.
SPOT = 1e-9
# Random poses are drawn so many at a time.
BLOCK = 16
# Further starts of Levenberg-Marquardt, and the part of the joints' ranges that they take: near a
# limit a start soon ends at the limit. Chosen on the bench's tuning robots alone.
FURTHER_STARTS, SPREAD = 7, 0.5
# An articulation keeps this many prepared mechanisms, the latest: each seed makes a new one.
LARGEST_CACHE = 256


class IKProblem(NamedTuple):
    """A model and its effectors, as the kernels of the solvers read the two.

    Attributes:
        memory: what a kernel reads, in a single block.
        joints: the number of the model's joints.
        coordinates: the number of an Articulation's coordinates; 0 of a chain of unlimited balls,
            whose only effector has a position to reach.
        effectors: joints.
        oriented: whether targets of the effectors have rotations.
        mechanism: of an Articulation.
        restarts: of an Articulation, the mechanism's coordinates in random poses, (restart,
            coordinate).
    """

    memory: FloatArray
    joints: int
    coordinates: int
    effectors: tuple[int, ...]
    oriented: tuple[bool, ...]
    mechanism: Any = None  # Mechanism | None, which type checkers cannot tell apart
    restarts: Any = None


def prepare_chain(skeleton: Skeleton, effector: int) -> IKProblem:
    """Return the chain up to an effector, cached by the skeleton."""
    chains = skeleton.__dict__.setdefault("chains", {})
    problem = chains.get(effector)
    if problem is None:
        memory = packed_chain(skeleton, effector)
        problem = IKProblem(memory, skeleton.joint_count, 0, (effector,), (False,))
        chains[effector] = problem
    return problem


def prepare(
    articulation: Articulation,
    effectors: tuple[int, ...],
    oriented: tuple[bool, ...],
    restarts: int = 0,
    seed: int = 0,
) -> IKProblem:
    """Return the mechanism that moves the effectors and its restarts, cached by the articulation.

    An articulation keeps LARGEST_CACHE problems, the latest.
    """
    key = effectors, oriented, restarts, seed
    problems = articulation.mechanisms
    problem = problems.get(key)
    if problem is None:
        mechanism = _mechanism(articulation, effectors, oriented)
        poses = random_poses(articulation, restarts, seed)
        frames = np.empty((0, len(effectors), 7))
        if restarts:  # without, forward kinematics need not be compiled
            x, R = articulation.forward(poses)
            frames = np.concatenate([x, R], axis=-1)[:, list(effectors)]
        width, drawn = articulation.coordinate_count, poses[:, mechanism.columns]
        shares = further_shares(len(mechanism.joints))
        memory = packed_problem(
            Problem(articulation.joints, width, mechanism, drawn, frames, shares)
        )
        count = articulation.joint_count
        problem = IKProblem(memory, count, width, effectors, oriented, mechanism, drawn)
        keys = [old for old, entry in list(problems.items()) if isinstance(entry, IKProblem)]
        for old in keys[: max(0, len(keys) + 1 - LARGEST_CACHE)]:
            problems.pop(old, None)
        problems[key] = problem
    return problem


def random_poses(articulation: Articulation, count: int, seed: int) -> FloatArray:
    """Return coordinates of restarts, the first the same for any count, (count, coordinate).

    The articulation keeps the last.
    """
    key, poses = articulation.mechanisms.get("restarts", (None, None))
    if key != (count, seed):
        rng = np.random.default_rng(seed)
        blocks = [articulation.random(rng, BLOCK) for _ in range(-(-count // BLOCK))]
        poses = np.concatenate([*blocks, np.empty((0, articulation.coordinate_count))])[:count]
        articulation.mechanisms["restarts"] = (count, seed), poses
    return poses


@functools.cache
def further_shares(joints: int) -> FloatArray:
    """Return the shares of the joints' ranges at further starts, (FURTHER_STARTS, joint).

    They fill the middle of a cube evenly, by an additive recurrence (Roberts 2018). Its step along
    axis i is phi^-i, where phi^(joint + 1) = phi + 1. The first is the centre.
    """
    phi = 2.0
    for _ in range(60):  # each halves the error at least
        phi = (1.0 + phi) ** (1.0 / (joints + 1))
    steps = phi ** -np.arange(1.0, joints + 1)
    places = (0.5 + np.arange(FURTHER_STARTS)[:, None] * steps) % 1.0
    return 0.5 + SPREAD * (places - 0.5)


def _mechanism(
    articulation: Articulation, effectors: tuple[int, ...], oriented: tuple[bool, ...]
) -> Mechanism:
    """Return the mechanism that moves some effectors."""
    whole = articulation.joints
    moving = _moving(articulation, effectors, oriented)
    number = {int(joint): index for index, joint in enumerate(moving)}
    joints, columns = _moving_joints(whole, moving, number)
    ends = _attached(whole, effectors, oriented, number)
    moves = np.zeros((len(joints), len(ends)), dtype=bool)
    for effector, joint in enumerate(ends["joint"]):
        while joint >= 0:
            moves[joint, effector] = True
            joint = joints["parent"][joint]
    ends["first"] = np.where(moves.any(axis=0), moves.argmax(axis=0), -1) if len(joints) else -1
    links = np.linalg.norm(joints["offset"], axis=1)
    links[joints["parent"] < 0] = 0.0
    last = np.where(ends["joint"] >= 0, np.linalg.norm(ends["position"], axis=1), 0.0)
    lengths = moves.astype(np.int64).T @ links + last
    ends["reach"] = lengths + np.where(moves, _travel(joints)[:, None], 0.0).sum(axis=0)
    furthest = ends["reach"].max(where=np.isfinite(ends["reach"]), initial=0.0)
    reach = float(lengths.max() or furthest or 1.0)
    leads = joints["leader"] == np.arange(len(joints))
    return Mechanism(
        joints, columns, ends, moves, _adjacent(joints, ends, SPOT * reach), reach,
        int(FREEDOMS[joints["kind"][leads]].sum()), int(np.where(oriented, 6, 3).sum()),
    )  # fmt: skip


def _moving(
    articulation: Articulation, effectors: tuple[int, ...], oriented: tuple[bool, ...]
) -> IndexArray:
    """Return the moving joints on the paths to the effectors, and their leaders.

    An effector's own ball or hinge only rotates the effector.
    """
    path, kinds = articulation.skeleton.path_array, articulation.joints["kind"]
    needed: set[int] = set()
    for joint, has_rotation in zip(effectors, oriented, strict=True):
        moving = has_rotation or kinds[joint] in (SLIDE, FREE)
        needed.update(path(joint).tolist() if moving else path(joint).tolist()[:-1])
    needed.update(articulation.joints["leader"][sorted(needed)].tolist())
    return np.array([joint for joint in sorted(needed) if kinds[joint] != FIXED], dtype=np.int64)


def _merged(whole: RecordArray, joint: int, number: dict[int, int]) -> tuple[int, Any, Any]:
    """Return the nearest moving joint above, and this joint's frame in its frame."""
    x, R = load_vector(whole["offset"], joint), load_quaternion(whole["frame"], joint)
    ancestor = int(whole["parent"][joint])
    while ancestor >= 0 and ancestor not in number:
        frame = load_quaternion(whole["frame"], ancestor)
        x = add(load_vector(whole["offset"], ancestor), rotate(frame, x))
        R = multiply(frame, R)
        ancestor = int(whole["parent"][ancestor])
    return number.get(ancestor, -1), x, R


def _attached(
    whole: RecordArray,
    effectors: tuple[int, ...],
    oriented: tuple[bool, ...],
    number: dict[int, int],
) -> RecordArray:
    """Return the effectors, each with the moving joint that carries it and its pose there."""
    ends = np.zeros(len(effectors), EFFECTOR)
    ends["source"], ends["oriented"] = effectors, oriented
    sizes = np.where(oriented, 6, 3)
    ends["row"] = np.cumsum(sizes) - sizes
    for index, joint in enumerate(effectors):
        attached = (number.get(joint, -1), (0.0, 0.0, 0.0), IDENTITY)
        if joint not in number:
            attached = _merged(whole, joint, number)
        ends["joint"][index], ends["position"][index], ends["rotation"][index] = attached
    return ends


def _moving_joints(
    whole: RecordArray, moving: IndexArray, number: dict[int, int]
) -> tuple[RecordArray, IndexArray]:
    """Return the joints of the mechanism, and their columns of q."""
    joints, starts = whole[moving], whole["coordinate"][moving]
    joints["leader"] = [number[int(leader)] for leader in joints["leader"]]
    followers = joints["leader"] != np.arange(len(joints))
    joints["followed"] = False
    joints["followed"][joints["leader"][followers]] = True
    widths = number_coordinates(joints)
    for index, joint in enumerate(moving):
        joints["parent"][index], joints["offset"][index], joints["frame"][index] = _merged(
            whole, joint, number
        )
    joints["rotated"] = rotated_by_pi(joints)
    columns = [np.arange(start, start + width) for start, width in zip(starts, widths, strict=True)]
    return joints, np.concatenate([*columns, np.empty(0, dtype=np.int64)])


def _adjacent(joints: RecordArray, ends: RecordArray, margin: float) -> BoolArray:
    """Return which joints and effectors each joint moves as the last joint above.

    A point on a hinge's axis or in a ball's centre stays, and the next joints down are adjacent.
    """
    count = len(joints)
    adjacent = np.zeros((count, count + len(ends)), dtype=bool)
    for j in range(count):
        fixed = {j}
        for c in range(j + 1, count):
            if joints["parent"][c] in fixed:
                offset = joints["offset"][c]
                if joints["parent"][c] == j and joints["kind"][j] == HINGE:
                    offset = np.cross(joints["axis"][j], offset)
                if joints["kind"][c] in (SLIDE, FREE) or np.linalg.norm(offset) > margin:
                    adjacent[j, c] = True
                else:
                    fixed.add(c)
        adjacent[j, count:] = np.isin(ends["joint"], list(fixed))
    return adjacent


def _travel(joints: RecordArray) -> FloatArray:
    """Return the largest translation by each joint [m], (joint,)."""
    kinds, leaders, factors = joints["kind"], joints["leader"], np.abs(joints["multiplier"])
    ends = np.maximum(np.abs(joints["lower"]), np.abs(joints["upper"]))[leaders]
    with np.errstate(invalid="ignore"):  # 0 times infinity: a follower that does not move
        travel = np.where(factors > 0.0, factors * ends, 0.0) + np.abs(joints["shift"])
    return np.where(kinds == SLIDE, travel, np.where(kinds == FREE, np.inf, 0.0))
