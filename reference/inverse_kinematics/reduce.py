"""From an articulation and its effectors to the mechanism that the solvers work on."""

from typing import Any, NamedTuple

import numpy as np

from ..arguments import FloatArray, IndexArray
from ..articulation import (
    AT,
    AXIS,
    FIXED,
    FRAME,
    FREE,
    FREEDOM,
    FREEDOMS,
    HINGE,
    KIND,
    LEADER,
    LOWER,
    MULTIPLIER,
    OFFSET,
    PARENT,
    SHIFT,
    SLIDE,
    TURNED,
    UPPER,
    WIDTHS,
    Articulation,
    JointArrays,
    half_turned,
)
from ..quaternion import IDENTITY, add, load_quaternion, load_vector, multiply, rotate
from .mechanism import Mechanism

# Points are in one spot if they are no further apart than this, over the reach.
SPOT = 1e-9
# Random poses are drawn so many at a time.
BLOCK = 16


class Prepared(NamedTuple):
    """What is made once for some effectors and restarts.

    Attributes:
        mechanism: what moves the effectors.
        restarts: the mechanism's coordinates in random poses, (restart, coordinate).
        tips: where these put the effectors, positions [m] and rotations, (restart, effector, 7).
        flat: joints of the articulation and mechanism, one array or number after the other.
    """

    mechanism: Mechanism
    restarts: FloatArray
    tips: FloatArray
    flat: tuple[Any, ...]


def prepare(
    articulation: Articulation,
    effectors: tuple[int, ...],
    oriented: tuple[bool, ...],
    restarts: int = 0,
    seed: int = 0,
) -> Prepared:
    """Return what is to be made once, kept by the articulation."""
    key = effectors, oriented, restarts, seed
    if key not in articulation.mechanisms:
        mechanism, columns = _prepared(articulation, effectors, oriented)
        poses = _random_poses(articulation, restarts, seed)
        tips = np.empty((0, len(effectors), 7))
        if restarts:  # without, forward kinematics need not be compiled
            x, R = articulation.forward(poses)
            tips = np.concatenate([x, R], axis=-1)[:, list(effectors)]
        articulation.mechanisms[key] = Prepared(
            mechanism, np.ascontiguousarray(poses[:, columns]), np.ascontiguousarray(tips),
            (*articulation.arrays, *mechanism.joints, *mechanism[1:]),
        )  # fmt: skip
    return articulation.mechanisms[key]


def _random_poses(articulation: Articulation, count: int, seed: int) -> FloatArray:
    """Return random coordinates, (count, coordinate): the first of those of any larger count."""
    rng, blocks = np.random.default_rng(seed), -(-count // BLOCK)
    drawn = [articulation.random(rng, BLOCK) for _ in range(blocks)]
    return np.concatenate([*drawn, np.empty((0, articulation.coordinate_count))])[:count]


def _prepared(
    articulation: Articulation, effectors: tuple[int, ...], oriented: tuple[bool, ...]
) -> tuple[Mechanism, IndexArray]:
    whole = articulation.arrays
    active = _active(articulation, effectors, oriented)
    number = {int(j): k for k, j in enumerate(active)}
    joints, columns = _moving_joints(whole, active, number)
    hanging = [_hanging(whole, j, number) for j in effectors]
    hangs = np.array([k for k, _, _ in hanging], dtype=np.int64)
    arms = np.array([x for _, x, _ in hanging])
    moves = _moves(joints, hangs)
    ways = _ways(joints, moves, hangs, arms)
    furthest = ways + np.where(moves, _travel(joints)[:, None], 0.0).sum(axis=0)
    most = furthest.max(where=np.isfinite(furthest), initial=0.0)
    reach = float(ways.max() or most or 1.0)
    sizes = np.where(oriented, 6, 3)
    tops = [np.flatnonzero(column)[0] if column.any() else -1 for column in moves.T]
    sees, sees_tip = _sight(joints, hangs, reach)
    rows = np.cumsum(sizes) - sizes
    mechanism = Mechanism(
        joints,
        whole.integers[active, AT].copy(),
        np.column_stack([hangs, rows, oriented, tops, effectors]).astype(np.int64),
        np.column_stack([arms, [R for _, _, R in hanging], furthest]),
        np.hstack([moves + sees_tip, sees]),
        reach,
        len(columns),
        _freedoms(joints),
        int(sizes.sum()),
    )
    return mechanism, columns


def _active(
    articulation: Articulation, effectors: tuple[int, ...], oriented: tuple[bool, ...]
) -> IndexArray:
    """Return the joints that move on the ways to the effectors, and those that they follow.

    An effector's own ball or hinge turns it, but does not move it.
    """
    path, kinds = articulation.skeleton.path_array, articulation.arrays.integers[:, KIND]
    needed: set[int] = set()
    for joint, turned in zip(effectors, oriented, strict=True):
        moving = turned or kinds[joint] in (SLIDE, FREE)
        needed.update(path(joint).tolist() if moving else path(joint).tolist()[:-1])
    needed.update(articulation.arrays.integers[sorted(needed), LEADER].tolist())
    return np.array([j for j in sorted(needed) if kinds[j] != FIXED], dtype=np.int64)


def _merged(whole: JointArrays, joint: int, number: dict[int, int]):
    """Return the nearest moving joint above, and this joint's frame in the frame of that one."""
    x, R = load_vector(whole.numbers, joint, OFFSET), load_quaternion(whole.numbers, joint, FRAME)
    j = int(whole.integers[joint, PARENT])
    while j >= 0 and j not in number:
        frame = load_quaternion(whole.numbers, j, FRAME)
        x = add(load_vector(whole.numbers, j, OFFSET), rotate(frame, x))
        R = multiply(frame, R)
        j = int(whole.integers[j, PARENT])
    return number.get(j, -1), x, R


def _hanging(whole: JointArrays, joint: int, number: dict[int, int]):
    """Return the moving joint an effector hangs on, and its place in the frame of that one."""
    if joint in number:
        return number[joint], (0.0, 0.0, 0.0), IDENTITY
    return _merged(whole, joint, number)


def _moving_joints(
    whole: JointArrays, active: IndexArray, number: dict[int, int]
) -> tuple[JointArrays, IndexArray]:
    """Return the joints of the mechanism, and the columns of q that are theirs."""
    leaders = np.array([number[int(i)] for i in whole.integers[active, LEADER]], dtype=np.int64)
    own = leaders == np.arange(len(active))
    kinds, at = whole.integers[active, KIND], whole.integers[active, AT]
    widths, freedoms = np.where(own, WIDTHS[kinds], 0), np.where(own, FREEDOMS[kinds], 0)
    integers, numbers = whole.integers[active], whole.numbers[active]
    integers[:, AT] = (np.cumsum(widths) - widths)[leaders]
    integers[:, FREEDOM] = (np.cumsum(freedoms) - freedoms)[leaders]
    integers[:, LEADER] = leaders
    for k, j in enumerate(active):
        integers[k, PARENT], x, R = _merged(whole, int(j), number)
        numbers[k, OFFSET : OFFSET + 3], numbers[k, FRAME : FRAME + 4] = x, R
    frames, axes = numbers[:, FRAME : FRAME + 4], numbers[:, AXIS : AXIS + 3]
    numbers[:, TURNED : TURNED + 4] = half_turned(frames, axes)
    columns = [np.arange(a, a + w) for a, w in zip(at, widths, strict=True)]
    return JointArrays(integers, numbers), np.concatenate([*columns, np.empty(0, dtype=np.int64)])


def _moves(joints: JointArrays, hangs: IndexArray) -> IndexArray:
    moves = np.zeros((len(joints.integers), len(hangs)), dtype=np.int64)
    for e, j in enumerate(hangs):
        while j >= 0:
            moves[j, e] = 1
            j = joints.integers[j, PARENT]
    return moves


def _ways(
    joints: JointArrays, moves: IndexArray, hangs: IndexArray, arms: FloatArray
) -> FloatArray:
    """Return the length of the links from the first joint to each effector [m], (effector,)."""
    lengths = np.linalg.norm(joints.numbers[:, OFFSET : OFFSET + 3], axis=1)
    lengths[joints.integers[:, PARENT] < 0] = 0.0
    return moves.T @ lengths + np.where(hangs >= 0, np.linalg.norm(arms, axis=1), 0.0)


def _sight(joints: JointArrays, hangs: IndexArray, reach: float) -> tuple[IndexArray, IndexArray]:
    """Return `sees` and 1 where a joint sees an effector: the nearest that its turn can move.

    A point on a hinge's axis or in a ball's centre stays, so that the next ones down are looked at.
    """
    parents, leaders = joints.integers[:, PARENT], joints.integers[:, LEADER]
    count = len(parents)
    sees = np.zeros((count, count), dtype=np.int64)
    sees_tip = np.zeros((count, len(hangs)), dtype=np.int64)
    for j in range(count):
        still = {j}
        for c in range(j + 1, count):
            if parents[c] in still:
                if _stays(joints, j, c, SPOT * reach):
                    still.add(c)
                else:
                    sees[j, c] = 1
        sees_tip[j] = np.isin(hangs, list(still))
        sees[j, j] = np.count_nonzero(leaders == j) > (leaders[j] == j)
    return sees, sees_tip


def _stays(joints: JointArrays, j: int, c: int, margin: float) -> bool:
    """Return whether turning joint j leaves joint c in place, if it does so with c's parent."""
    offset = joints.numbers[c, OFFSET : OFFSET + 3]
    if joints.integers[c, KIND] in (SLIDE, FREE):
        return False
    if joints.integers[c, PARENT] == j and joints.integers[j, KIND] == HINGE:
        offset = np.cross(joints.numbers[j, AXIS : AXIS + 3], offset)
    return bool(np.linalg.norm(offset) <= margin)


def _travel(joints: JointArrays) -> FloatArray:
    """Return how far each joint can carry things by itself [m], (joint,)."""
    kinds, leaders = joints.integers[:, KIND], joints.integers[:, LEADER]
    ends = np.abs(joints.numbers[leaders][:, [LOWER, UPPER]]).max(axis=1, initial=0.0)
    factors = np.abs(joints.numbers[:, MULTIPLIER])
    with np.errstate(invalid="ignore"):  # 0 times infinity: a follower that does not move
        ways = np.where(factors > 0.0, factors * ends, 0.0) + np.abs(joints.numbers[:, SHIFT])
    return np.where(kinds == SLIDE, ways, np.where(kinds == FREE, np.inf, 0.0))


def _freedoms(joints: JointArrays) -> int:
    own = joints.integers[:, LEADER] == np.arange(len(joints.integers))
    return int(FREEDOMS[joints.integers[own, KIND]].sum())
