"""Forward kinematics, CCD and FABRIK as textbooks have them, with a switch for each known fault.

With every switch at 0 they are right. Switches are independent, so that faults combine;
`faults.toml` describes each number of a switch. Where faults are other choices of one quantity, the
code lists the choices in the order of their numbers, the right choice first.

The solvers keep the local rotations of the whole skeleton and place all joints anew after each
rotation, as a student's program does, not the reference's chain of global rotations. In CCD, d is
the world rotation of a joint, R its global and Q its local rotation.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray, IndexArray
from plumbob.reference.backend.compiled import Kernel, bind
from plumbob.reference.quaternion import (
    IDENTITY,
    add,
    conjugate,
    cross,
    load_quaternion,
    load_vector,
    logarithm,
    norm,
    rotation_about,
    scale,
    store_quaternion,
    store_vector,
    subtract,
)

from .algebra import arc, inverse, made_unit, product, pulled, rotated
from .switches import Switches

ORIGIN = (0.0, 0.0, 0.0)
# Of `applied`, the numbers that rotate the child on the path.
GIVEN_TO_CHILD = (10, 13)
# Of `rotations`, those from this number on rotate a link from its present or its first direction.
OF_GLOBAL_LINKS = 13
# CCD drops rotations smaller than these, by the number of `dropped` [rad]; among them are 1 and 5
# degrees, and the angles with the cosines 0.99999, 0.9999, 0.999 and 0.99.
DROPPED = (
    0.0, 1e-4, 1e-3, 4.4721e-3, 1e-2, 1.41421e-2, 1.745329e-2, 4.47214e-2, 0.1, 5e-2, 8.726646e-2,
    0.141539,
)  # fmt: skip
# Angles smaller than these end a sweep, end the solve or are raised to them, by `small` [rad].
SMALL = (1e-4, 1e-3, 1e-2, 1.745329e-2, 5e-2)
# The distances at which a solve ends whatever the tolerance, by `test` from `FIXED_TEST` on [m].
FIXED, FIXED_TEST = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2), 5
# Of `aim` and of FABRIK's `rotations` from these numbers on, the frames of two directions, and what
# becomes of Q by the arc d between them: P* d P Q (0), Q d (1) or d Q (2). The frames are the
# world's (0), the joint's (1) or its parent's (2), with R or P not inverted (3, 4), or the target
# in either frame minus the joint in the world's (5, 6).
MIXED_FRAMES, MIXED_LINKS = 13, 28
FRAMES = (
    (0, 1, 1), (1, 0, 1), (0, 2, 2), (2, 0, 2), (0, 0, 0), (3, 3, 1), (1, 2, 1), (1, 2, 2),
    (2, 1, 1), (2, 1, 2), (0, 1, 2), (1, 0, 2), (0, 2, 1), (2, 0, 1), (0, 1, 0), (1, 0, 0),
    (0, 2, 0), (2, 0, 0), (1, 2, 0), (2, 1, 0), (4, 4, 2), (1, 3, 1), (3, 1, 1), (2, 4, 2),
    (4, 2, 2), (1, 5, 1), (2, 6, 2),
)  # fmt: skip
LINK_FRAMES = (
    (1, 0, 1), (1, 0, 2), (0, 1, 0), (0, 1, 1), (0, 1, 2), (2, 0, 0), (2, 0, 1), (2, 0, 2),
    (0, 2, 0), (0, 2, 1), (0, 2, 2), (1, 2, 0), (1, 2, 1), (1, 2, 2), (2, 1, 0), (2, 1, 1),
    (2, 1, 2),
)  # fmt: skip
# Of `tip`, those from this number on carry the effector from frame to frame.
IN_FRAMES = 2
# Of `rotations`, the first and the last that rotate a link's lower joint.
LINK_OF_CHILD = (22, 25)


class TextbookChain(NamedTuple):
    """A skeleton, and the joints from its root to the effector, both included."""

    parents: IndexArray
    offsets: FloatArray
    path: IndexArray


class TextbookPose(NamedTuple):
    """Local rotations, and the global positions and rotations of all joints."""

    local: FloatArray
    positions: FloatArray
    rotations: FloatArray


class Ending(NamedTuple):
    """When a solve ends: at a distance [m], or after so many sweeps."""

    tolerance: float
    sweeps: int


def place(chain: TextbookChain, faults: Switches, pose: TextbookPose) -> None:
    """Fill positions and global rotations of all joints."""
    joints = len(chain.parents)
    order = np.arange(joints)
    if faults.parent >= 4:
        order = by_depth(chain.parents, faults.parent % 2 == 0)
    # a joint placed before j may have a higher number: then each pass places at least one more
    for i in range(joints * joints if faults.parent == 3 else joints):
        j = order[i % joints]
        visited = order[i - 1] if i > 0 else -1
        number = j - 1 if i > 0 else -1
        before = before_in_depth(chain, j) if faults.parent == 3 else -1
        p = (chain.parents[j], j - 1, -1, before, visited, visited, number, number)[faults.parent]
        if p < 0:
            x, R = root_pose(chain, faults, pose, j)
        else:
            x, R = joint_pose(chain, faults, pose, j, p)
        store_vector(pose.positions, j, x)
        store_quaternion(pose.rotations, j, R)
        if faults.base == 7 and p >= 0:  # in place of a copy
            store_vector(pose.positions, p, x)


def by_depth(parents: IndexArray, is_queue: bool) -> IndexArray:
    """Return the joints by depth, those of one depth in the order of a queue or of numbers."""
    order, depths, count = np.zeros_like(parents), np.zeros_like(parents), 1
    for j in range(1, len(parents)):
        depths[j] = depths[parents[j]] + 1
    for i in range(len(parents)):
        for j in range(1, len(parents)):
            if (parents[j] == order[i]) if is_queue else (depths[j] == i):
                order[count] = j
                count += 1
    return order


def before_in_depth(chain: TextbookChain, j: int) -> int:
    """Return the joint before j, depth first: the last one below the sibling before it."""
    p, before = chain.parents[j], -1
    for k in range(j):
        if chain.parents[k] == p:
            before = k
    if before < 0 or p < 0:
        return int(p)
    while True:
        last = -1
        for k in range(before + 1, len(chain.parents)):
            if chain.parents[k] == before:
                last = k
        if last < 0:
            return before
        before = last


def root_pose(chain: TextbookChain, faults: Switches, pose: TextbookPose, j: int) -> Any:
    """Return the position and the global rotation of the root."""
    Q, offset = load_quaternion(pose.local, j), load_vector(chain.offsets, j)
    if faults.product == 2:
        Q = conjugate(Q)
    rotations = (Q, Q, IDENTITY, Q)
    R = rotations[faults.root]
    places = (offset, ORIGIN, offset, rotated(R, offset, faults))
    return places[3 if faults.frame == 9 else faults.root], R


def joint_pose(chain: TextbookChain, faults: Switches, pose: TextbookPose, j: int, p: int) -> Any:
    """Return the position and the global rotation of joint j, the parent p placed before it."""
    Q, R_parent = load_quaternion(pose.local, j), load_quaternion(pose.rotations, p)
    products = (
        (R_parent, Q), (Q, R_parent), (R_parent, conjugate(Q)), (IDENTITY, Q), (R_parent, IDENTITY),
    )  # fmt: skip
    if faults.base == 4:  # matrices multiplied in the other order
        x = rotated(Q, load_vector(pose.positions, p), faults)
        return add(load_vector(chain.offsets, j), x), product(Q, R_parent, faults)
    left, right = products[faults.product]
    R = product(left, right, faults)
    if faults.unit == 2:
        R = made_unit(R)
    above = chain.parents[p]
    R_above = load_quaternion(pose.rotations, above) if above >= 0 else IDENTITY
    Q_parent = load_quaternion(pose.local, p)
    frames = (
        R_parent, IDENTITY, R, conjugate(R_parent), R_above, Q_parent, Q, R_parent,
        R_above if above >= 0 else R_parent, R, product(R_parent, Q_parent, faults), R_parent,
    )  # fmt: skip
    offset = load_vector(chain.offsets, j)
    if faults.frame == 7:
        offset = subtract(offset, load_vector(chain.offsets, p))
    elif faults.frame == 11:
        offset = scale(-1.0, offset)
    if faults.base == 6:
        offset = add(offset, load_vector(pose.positions, p))
    if faults.base == 3:
        return offset, R
    offset = rotated(frames[faults.frame], offset, faults)
    return add(base_of(chain, pose, p, faults.base), offset), R


def base_of(chain: TextbookChain, pose: TextbookPose, p: int, fault: int) -> Any:
    """Return what a rotated offset is added to: the parent's position, at rest (1), the root's.

    Or nothing (5, 6).
    """
    if fault in (5, 6):
        return ORIGIN
    if fault == 1:
        x = load_vector(chain.offsets, p)
        while chain.parents[p] >= 0:
            p = chain.parents[p]
            x = add(x, load_vector(chain.offsets, p))
        return x
    return load_vector(pose.positions, 0 if fault == 2 else p)


def solve(
    chain: TextbookChain, target: Any, ending: Ending, faults: Switches, pose: TextbookPose
) -> int:
    """Solve in place, `pose` from the start to the result, and return the number of sweeps."""
    if faults.start == 1:
        for j in range(len(chain.parents)):
            store_quaternion(pose.local, j, IDENTITY)
    place(chain, faults, pose)
    if method.stretch(chain, target, faults, pose):
        method.finish(chain, -1, faults, pose)
        return 1
    n = ending.sweeps
    allowed = (n, n + 1, n - 1, n, min(n, 1), 0)
    before, i = math.inf, 0
    while i < allowed[faults.budget]:
        distance = norm(subtract(load_vector(pose.positions, chain.path[-1]), target))
        if is_reached(distance, before, ending.tolerance, i, faults.test):
            break
        before = distance
        i += 1
        if method.sweep(chain, target, i - 1, faults, pose):
            break
    method.finish(chain, i, faults, pose)
    return i


def is_reached(distance: float, before: float, tolerance: float, sweeps: int, fault: int) -> bool:
    """Return whether the solve ends before its next sweep."""
    if fault >= FIXED_TEST:
        return distance <= FIXED[fault - FIXED_TEST]
    tests = (
        (distance, tolerance),
        (distance * distance, tolerance),
        (distance, tolerance * tolerance),
        (abs(before - distance), tolerance),
        (distance, tolerance * (sweeps + 1)),
    )
    error, bound = tests[fault]
    return error <= bound


def sweep_ccd(
    chain: TextbookChain, target: Any, i: int, faults: Switches, pose: TextbookPose
) -> bool:
    """Rotate each joint from the effector's parent to the root; or only one of them, the i-th.

    Return whether the solve ends, as no right one does.
    """
    links = len(chain.path) - 1
    if faults.budget == 3:
        return rotate_joint(chain, links - 1 - i % links, target, faults, pose)
    if faults.tip >= IN_FRAMES:
        sweep_in_frames(chain, target, faults, pose)
        return False
    is_over = False
    for link in range(links):
        k = link if faults.order == 1 else links - 1 - link
        left_out = (-1, 0, links - 1, -1)
        if k != left_out[faults.joints] and (faults.joints != 3 or link == 0):
            is_over = rotate_joint(chain, k, target, faults, pose)
        if is_over:
            break
    if faults.update < 2 and faults.global_rotations == 0:
        place(chain, faults, pose)
    return is_over and faults.small > len(SMALL)


def sweep_in_frames(
    chain: TextbookChain, target: Any, faults: Switches, pose: TextbookPose
) -> None:
    """Rotate each joint in its parent's or its own frame (3), up which the effector is carried.

    Faulty: joints' offsets are left out on the way (4), or it begins at its parent's offset (5).
    """
    last = len(chain.path) - 1
    tip = load_vector(chain.offsets, chain.path[last - 1 if faults.tip == 5 else last])
    for k in range(last - 1, -1, -1):
        j = chain.path[k]
        p, Q = chain.parents[j], load_quaternion(pose.local, j)
        to_target = subtract(target, load_vector(pose.positions, j))
        if faults.tip == 3:
            R = load_quaternion(pose.rotations, j)
            Q = product(Q, arc(tip, rotated(inverse(R, faults), to_target, faults), faults), faults)
        else:
            P = load_quaternion(pose.rotations, p) if p >= 0 else IDENTITY
            to_target = rotated(inverse(P, faults), to_target, faults)
            Q = product(arc(rotated(Q, tip, faults), to_target, faults), Q, faults)
        Q = Q if faults.unit == 1 else made_unit(Q)
        store_quaternion(pose.local, j, Q)
        tip = rotated(Q, tip, faults)
        if faults.tip != 4:
            tip = add(tip, load_vector(chain.offsets, j))
    place(chain, faults, pose)


def rotate_joint(
    chain: TextbookChain, k: int, target: Any, faults: Switches, pose: TextbookPose
) -> bool:
    """Rotate joint k of the path so that the effector comes nearest to the target.

    Return whether the angle is too small, by the number of `small`.
    """
    a, b = directions_of(chain, k, target, faults, pose)
    d = arc(a, b, faults)
    if faults.dropped > 0 and norm(logarithm(d)) < DROPPED[faults.dropped]:
        return False
    if faults.small > 0 and norm(logarithm(d)) < SMALL[(faults.small - 1) % len(SMALL)]:
        if faults.small <= 2 * len(SMALL):
            return True
        d = raised(a, b, SMALL[(faults.small - 1) % len(SMALL)])
    if faults.global_rotations == 1:
        rotate_below(chain, chain.path[k], d, faults, pose)
        return False
    rotate_offset(chain, k, d, faults, pose)
    if faults.update < 3:
        apply_rotation(chain, k, d, faults, pose)
    if faults.global_rotations == 2:
        rotate_below(chain, chain.path[k], d, faults, pose)
    elif faults.update == 0 and faults.tip == 0:
        place(chain, faults, pose)
    elif faults.update >= 2 or faults.tip == 1:
        follow_by_hand(chain, k, d, faults, pose)
    return False


def directions_of(
    chain: TextbookChain, k: int, target: Any, faults: Switches, pose: TextbookPose
) -> Any:
    """Return the two directions that the rotation of joint k of the path joins, by `aim`."""
    joint = load_vector(pose.positions, chain.path[k])
    effector = load_vector(pose.positions, chain.path[-1])
    arm, direction = subtract(effector, joint), subtract(target, joint)
    parent = load_vector(pose.positions, chain.path[max(k - 1, 0)])
    child, root = load_vector(pose.positions, chain.path[k + 1]), load_vector(pose.positions, 0)
    directions = (
        (arm, direction),
        (arm, target),
        (effector, direction),
        (arm, add(direction, root)),
        (arm, subtract(target, effector)),
        (subtract(effector, parent), subtract(target, parent)),
        (subtract(effector, child), subtract(target, child)),
        (subtract(child, joint), direction),
        (arm, subtract(target, parent)),
        (arm, subtract(target, child)),
        (arm, subtract(target, root)),
        (subtract(effector, root), direction),
        (subtract(effector, root), subtract(target, root)),
        (arm, subtract(direction, root)),
    )
    if faults.aim < MIXED_FRAMES or faults.aim == 17:
        return directions[min(faults.aim, MIXED_FRAMES)]
    first, second, _ = FRAMES[faults.aim - MIXED_FRAMES]
    j = chain.path[k]
    p, R = chain.parents[j], load_quaternion(pose.rotations, j)
    P = load_quaternion(pose.rotations, p) if p >= 0 else IDENTITY
    if second >= 5:
        frame = rotated(inverse(R if second == 5 else P, faults), target, faults)
        return in_frame(first, arm, R, P, faults), subtract(frame, joint)
    return in_frame(first, arm, R, P, faults), in_frame(second, direction, R, P, faults)


def in_frame(frame: int, v: Any, R: Any, P: Any, faults: Switches) -> Any:
    """Return a vector in any of the first five frames of `FRAMES`."""
    if frame == 0:
        return v
    rotations = (R, inverse(R, faults), inverse(P, faults), R, P)
    return rotated(rotations[frame], v, faults)


def raised(a: Any, b: Any, angle: float) -> Any:
    """Return the rotation from a direction towards another by an angle."""
    axis = cross(a, b)
    sine = norm(axis)
    return IDENTITY if sine == 0.0 else rotation_about(scale(1.0 / sine, axis), angle)


def rotate_below(
    chain: TextbookChain, j: int, d: Any, faults: Switches, pose: TextbookPose
) -> None:
    """Rotate joint j and all below it about its position, in global rotations and positions.

    By the number of `spin` only it and its children (1) or it alone (2) rotate, or all about the
    root (3), or about the origin (4) and then by the joint's position (5).
    """
    x = load_vector(pose.positions, 0 if faults.spin == 3 else j)
    start = x if faults.spin < 4 else ORIGIN
    for m in range(j, len(chain.parents)):
        above = m
        while above > j and not (faults.spin == 1 and above < m):
            above = chain.parents[above]
        if above == j and (faults.spin != 2 or m == j):
            arm = subtract(load_vector(pose.positions, m), start)
            end = ORIGIN if faults.spin == 4 else x
            store_vector(pose.positions, m, add(end, rotated(d, arm, faults)))
            R = load_quaternion(pose.rotations, m)
            store_quaternion(pose.rotations, m, product(d, R, faults))


def rotate_offset(
    chain: TextbookChain, k: int, d: Any, faults: Switches, pose: TextbookPose
) -> None:
    """Rotate the offset of the next joint too: in the joint's frame (1), in the world's (2)."""
    if faults.offsets == 0:
        return
    R = load_quaternion(pose.rotations, chain.path[k])
    local = product(product(inverse(R, faults), d, faults), R, faults)
    offset = load_vector(chain.offsets, chain.path[k + 1])
    offset = rotated(local if faults.offsets == 1 else d, offset, faults)
    store_vector(chain.offsets, chain.path[k + 1], offset)


def follow_by_hand(
    chain: TextbookChain, k: int, d: Any, faults: Switches, pose: TextbookPose
) -> None:
    """Rotate the effector about joint k, or (3) every joint after it on the path."""
    last = len(chain.path) - 1
    joint = load_vector(pose.positions, chain.path[k])
    for m in range(last if faults.update == 2 else k + 1, last + 1):
        arm = subtract(load_vector(pose.positions, chain.path[m]), joint)
        store_vector(pose.positions, chain.path[m], add(joint, rotated(d, arm, faults)))


def apply_rotation(
    chain: TextbookChain, k: int, d: Any, faults: Switches, pose: TextbookPose
) -> None:
    """Give joint k of the path, or its child, the world rotation d."""
    j = chain.path[k]
    p = chain.parents[j]
    R, P = load_quaternion(pose.rotations, j), IDENTITY
    if p >= 0:
        P = load_quaternion(pose.rotations, p)
    if GIVEN_TO_CHILD[0] <= faults.applied <= GIVEN_TO_CHILD[1]:
        j = chain.path[k + 1]
    Q = load_quaternion(pose.local, j)
    if faults.aim >= MIXED_FRAMES:
        Q = beside(FRAMES[faults.aim - MIXED_FRAMES][2], P, d, Q, R, faults)
    elif faults.applied == 0:
        Q = from_world(P, d, Q, R, faults)
    else:
        Q = wrong_rotation(P, d, Q, R, faults)
    store_quaternion(pose.local, j, Q if faults.unit == 1 else made_unit(Q))


def beside(side: int, P: Any, d: Any, Q: Any, R: Any, faults: Switches) -> Any:
    """Return P* d P Q, Q d (1) or d Q (2)."""
    if side == 0:
        return from_world(P, d, Q, R, faults)
    return product(Q, d, faults) if side == 1 else product(d, Q, faults)


def from_world(P: Any, d: Any, Q: Any, R: Any, faults: Switches) -> Any:
    """Return P* d P Q, where R is P Q, in a grouping of programs."""
    inverse_P = inverse(P, faults)
    if faults.grouping == 1:
        return product(inverse_P, product(d, R, faults), faults)
    if faults.grouping == 2:
        return product(product(inverse_P, d, faults), R, faults)
    if faults.grouping == 3:
        return product(product(inverse_P, product(d, P, faults), faults), Q, faults)
    if faults.grouping == 4:
        inner = product(product(inverse(R, faults), d, faults), R, faults)
        return product(Q, inner, faults)
    return product(product(product(inverse_P, d, faults), P, faults), Q, faults)


def wrong_rotation(P: Any, d: Any, Q: Any, R: Any, faults: Switches) -> Any:
    """Return the local rotation Q after the world rotation d, by the number of `applied`."""
    unit, P_inverse, R_inverse = IDENTITY, inverse(P, faults), inverse(R, faults)
    products = (
        (unit, unit, unit, Q),
        (unit, unit, d, Q),
        (unit, unit, Q, d),
        (P, d, P_inverse, Q),
        (R_inverse, d, R, Q),
        (R, d, R_inverse, Q),
        (unit, unit, d, R),
        (unit, P_inverse, d, Q),
        (unit, unit, unit, d),
        (Q, P_inverse, d, P),
        (unit, unit, d, Q),
        (R_inverse, d, R, Q),
        (P_inverse, d, P, Q),
        (unit, unit, Q, d),
        (unit, P, d, R),
        (unit, d, R, P_inverse),
        (unit, R_inverse, d, R),
        (unit, unit, R, d),
        (unit, P_inverse, d, P),
        (unit, R, d, P_inverse),
        (unit, P, d, Q),
        (unit, unit, inverse(product(d, R, faults), faults), P),
        (Q, P, d, P_inverse),
        (Q, R, d, R_inverse),
        (Q, Q, d, inverse(Q, faults)),
        (inverse(Q, faults), d, Q, Q),
    )
    a, b, c, e = products[faults.applied]
    return product(product(product(a, b, faults), c, faults), e, faults)


def keep(chain: TextbookChain, sweeps: int, faults: Switches, pose: TextbookPose) -> None:
    """Leave a pose of CCD, unless its effector was followed by hand, or all global rotations."""
    if faults.update == 2 or faults.global_rotations == 2:
        place(chain, faults, pose)
    if faults.global_rotations == 1:
        for j in range(1, len(chain.parents)):
            R = load_quaternion(pose.rotations, j)
            P = load_quaternion(pose.rotations, chain.parents[j])
            store_quaternion(pose.local, j, local_from_global(P, R, faults))
        store_quaternion(pose.local, 0, load_quaternion(pose.rotations, 0))


def local_from_global(P: Any, R: Any, faults: Switches) -> Any:
    """Return P* R; or by the number of `applied` R (6), P R (14), R P* (15) or R* P (21)."""
    if faults.applied == 6:
        return R
    if faults.applied == 14:
        return product(P, R, faults)
    if faults.applied == 15:
        return product(R, inverse(P, faults), faults)
    if faults.applied == 21:
        return product(inverse(R, faults), P, faults)
    return product(inverse(P, faults), R, faults)


def sweep_fabrik(
    chain: TextbookChain, target: Any, i: int, faults: Switches, pose: TextbookPose
) -> bool:
    """Pull the joints to the target, then back to the root."""
    positions, before = pose.positions, pose.positions.copy()
    if faults.passes == 0:
        pull_to_target(chain, target, faults, positions, before)
    pull_to_root(chain, faults, positions, before)
    if faults.converted == 1:
        follow(chain, 1, faults, pose)
        place(chain, faults, pose)
    return False


def never(chain: TextbookChain, target: Any, faults: Switches, pose: TextbookPose) -> bool:
    """Return False: CCD stretches no chain."""
    return False


def stretch(chain: TextbookChain, target: Any, faults: Switches, pose: TextbookPose) -> bool:
    """Stretch a chain towards a target beyond its reach, and return whether it has been stretched.

    Aristidou & Lasenby 2011, Algorithm 1, has this step, which the sweeps approach without it. By
    the number of `stretch` it is always made (1), where the distance is squared (2) or from the
    effector (3), where the reach lacks the last (4) or the first link (5); or its direction is that
    from the effector (6), or each link begins at the root (7) or has the next one's length (8). A
    right program has it (9) with the lengths of `lengths`; or it stretches away from the target
    (10), or leaves the chain as it is (11), or measures from the origin (12), or keeps each length
    from the target (13), or leaves the last (14) or the first link (15) as it is.
    """
    k = faults.stretch
    if k == 0:
        return False
    last, reach = len(chain.path) - 1, 0.0
    for m in range(last):
        if not (k == 4 and m == last - 1) and not (k == 5 and m == 0):
            kind = in_pass(faults.lengths, 0) if k == 9 else 0
            reach += link_length(chain, m, kind, pose.positions)
    root = load_vector(pose.positions, chain.path[0])
    effector = load_vector(pose.positions, chain.path[last])
    to_target = subtract(target, root)
    distance = norm(subtract(target, effector if k == 3 else ORIGIN if k == 12 else root))
    if k != 1 and (distance * distance if k == 2 else distance) < reach:
        return False
    direction = subtract(target, effector) if k == 6 else to_target
    length = -norm(direction) if k == 10 else norm(direction)
    if length == 0.0 or k == 11:
        return k == 11
    first = 1 if k == 15 else 0
    x = load_vector(pose.positions, chain.path[first])
    for m in range(first, last - 1 if k == 14 else last):
        stretched = link_length(chain, m, 8 if k == 8 else 0, pose.positions)
        if k == 13:
            x = pulled(target, x, stretched, 0)
        else:
            x = add(root if k == 7 else x, scale(stretched / length, direction))
        store_vector(pose.positions, chain.path[m + 1], x)
    return True


def pull_to_target(
    chain: TextbookChain, target: Any, faults: Switches, positions: FloatArray, before: FloatArray
) -> None:
    """Put the effector on the target, and pull each joint to the one after it."""
    last, root = len(chain.path) - 1, load_vector(before, chain.path[0])
    ends = (target, add(target, root), subtract(target, root))
    store_vector(positions, chain.path[last], ends[faults.end])
    kind = in_pass(faults.pull, 1)
    for i in range(last - 1, 1 if faults.loop == 4 else -1, -1):
        k = last - 1 - i if faults.loop == 6 else i
        length = link_length(chain, k, in_pass(faults.lengths, 1), positions)
        j, fixed = chain.path[k], load_vector(positions, chain.path[k + 1])
        moved = load_vector(positions, j)
        if faults.stale == 1:  # the direction between both points before the pass
            moved = add(fixed, subtract(moved, load_vector(before, chain.path[k + 1])))
        elif faults.stale == 2 and k < last - 1:
            fixed = load_vector(before, chain.path[k + 1])
        elif faults.stale == 3:
            fixed = target
        elif faults.stale == 5:
            moved = add(fixed, subtract(moved, target))
        store_vector(positions, j, pulled(fixed, moved, length, kind))


def pull_to_root(
    chain: TextbookChain, faults: Switches, positions: FloatArray, before: FloatArray
) -> None:
    """Put the root back, and pull each joint to the one before it."""
    last, root = len(chain.path) - 1, chain.path[0]
    places = (load_vector(before, root), load_vector(positions, root), ORIGIN)
    store_vector(positions, root, places[faults.base_joint])
    kind = in_pass(faults.pull, 2)
    for i in range(1 if faults.loop == 3 else 0, last - (1 if faults.loop == 2 else 0)):
        k = last - 1 - i if faults.loop == 5 else i
        length = link_length(chain, k, in_pass(faults.lengths, 2), positions)
        child, start = chain.path[k + 1], chain.path[0 if faults.stale == 4 else k]
        moved, fixed = load_vector(positions, child), load_vector(positions, start)
        if faults.stale == 6:
            moved = add(fixed, subtract(moved, load_vector(positions, root)))
        store_vector(positions, child, pulled(fixed, moved, length, kind))


def in_pass(number: int, which: int) -> int:
    """Return the kind of a fault that is in both passes, in the backward (1) or the forward (2).

    Its number is three times the kind, and the pass.
    """
    return number // 3 if number % 3 in (0, which) else 0


def link_length(chain: TextbookChain, k: int, kind: int, positions: FloatArray) -> float:
    """Return the length of link k, from joint k of the path to the next, or a wrong one.

    It is the next link's (1), the previous link's (2), that of now (3), the first link's (4), the
    mean (5), 1 (6), that of the offset of the link's first joint (7), or the next one's, 0 if there
    is none (8); in a list that is rolled either way (9, 10) or reversed (11), another length of an
    offset (from 12 on), or the previous link's, 0 if there is none (22).
    """
    last = len(chain.path) - 2
    before, after = max(k - 1, 0), min(k + 1, last)
    rolled = (k - 1 if k > 0 else last, k + 1 if k < last else 0)
    links = (k, after, before, k, 0, k, k, k - 1, after, rolled[0], rolled[1], last - k)
    if 11 < kind < 22:
        return other_length(load_vector(chain.offsets, chain.path[k + 1]), kind)
    if (kind == 8 and k == last) or (kind == 22 and k == 0):
        return 0.0
    if kind == 3:
        start = load_vector(positions, chain.path[k])
        return norm(subtract(load_vector(positions, chain.path[k + 1]), start))
    if kind == 5:
        total = 0.0
        for j in chain.path[1:]:
            total += norm(load_vector(chain.offsets, j))
        return total / (last + 1)
    link = links[2 if kind == 22 else kind]
    return 1.0 if kind == 6 else norm(load_vector(chain.offsets, chain.path[link + 1]))


def other_length(offset: Any, kind: int) -> float:
    """Return a wrong length of an offset as of programs, by the kind of `link_length`.

    It is |x|, |y| or |z| (12 to 14), their sum (15), the square (16), the length without z (17), or
    the length in whole metres, cut (18) or rounded (19), or to decimetres or centimetres (20, 21).
    """
    x, y, z = abs(offset[0]), abs(offset[1]), abs(offset[2])
    length = norm(offset)
    lengths = (
        x, y, z, x + y + z, length * length, math.sqrt(x * x + y * y), float(math.floor(length)),
        float(math.floor(length + 0.5)), math.floor(10.0 * length + 0.5) / 10.0,
        math.floor(100.0 * length + 0.5) / 100.0,
    )  # fmt: skip
    return lengths[kind - 12]


class SolvedPath(NamedTuple):
    """The points of FABRIK's last sweep, and the pose that it started from."""

    points: FloatArray
    positions: FloatArray
    rotations: FloatArray


def finish_fabrik(chain: TextbookChain, sweeps: int, faults: Switches, pose: TextbookPose) -> None:
    """Rotate the joints, unless each sweep has done so; after a stretch `sweeps` is -1."""
    if faults.converted == 0 or sweeps < 0:
        follow(chain, abs(sweeps), faults, pose)


def follow(chain: TextbookChain, sweeps: int, faults: Switches, pose: TextbookPose) -> None:
    """Rotate each joint of the path to its link's new direction; the path keeps its positions."""
    points = pose.positions.copy()
    place(chain, faults, pose)
    solved = SolvedPath(points, pose.positions.copy(), pose.rotations.copy())
    links = len(chain.path) - 1
    first, end = int(faults.link == 5), links - int(faults.link == 6)  # links that are left out
    for k in range(first, end if sweeps > 0 else 0):
        if faults.global_rotations == 0 or (faults.global_rotations == 1 and faults.rule == 5):
            place(chain, faults, pose)
        point_link(chain, k, solved, faults, pose)
    place(chain, faults, pose)
    for j in chain.path if faults.returned == 0 else chain.path[:0]:
        store_vector(pose.positions, j, load_vector(points, j))


def point_link(
    chain: TextbookChain, k: int, solved: SolvedPath, faults: Switches, pose: TextbookPose
) -> None:
    """Rotate joint k of the path, or its child (3), by a rule of programs."""
    j, child = chain.path[k], chain.path[k + 1]
    p = chain.parents[j]
    Q, R, P = load_quaternion(pose.local, j), load_quaternion(pose.rotations, j), IDENTITY
    if p >= 0 and faults.rotations != 20:
        P = load_quaternion(solved.rotations if faults.rotations in (4, 26) else pose.rotations, p)
    if faults.rotations == 20 or faults.global_rotations == 1:
        R = product(P, Q, faults)
    rest, link = compared_links(chain, k, P, R, solved, faults, pose)
    d = arc(rest, link, faults)
    if faults.rule in (3, 4) or faults.rotations == 26:
        R = load_quaternion(solved.rotations, j)
    elif faults.rule in (1, 2):
        R = IDENTITY
    if faults.rotations >= MIXED_LINKS:
        first, second, side = LINK_FRAMES[faults.rotations - MIXED_LINKS]
        rest = in_frame(first, rotated(R, load_vector(chain.offsets, child), faults), R, P, faults)
        d = arc(rest, in_frame(second, link, R, P, faults), faults)
        Q = beside(side, P, d, Q, R, faults)
    elif faults.rotations in (0, 3, 4, 9, 18, 19, 20, 21, 26):
        Q = local_of(P, d, Q, R, faults)
    else:
        Q = wrong_local(chain, k, P, d, R, faults, pose)
    Q = Q if faults.unit == 1 else made_unit(Q)
    is_lower = faults.rotations == 3 or LINK_OF_CHILD[0] <= faults.rotations <= LINK_OF_CHILD[1]
    rotated_joint = child if is_lower else j
    store_quaternion(pose.local, rotated_joint, Q)
    if faults.global_rotations == 2:
        rotate_below(chain, rotated_joint, d, faults, pose)
    elif faults.global_rotations == 1:
        store_quaternion(pose.rotations, j, global_of(P, d, R, faults))


def compared_links(
    chain: TextbookChain,
    k: int,
    P: Any,
    R: Any,
    solved: SolvedPath,
    faults: Switches,
    pose: TextbookPose,
) -> Any:
    """Return the directions of link k between which its joint rotates, before and after.

    Or of the link before (18), or the new direction from where the joint was at the start (26).
    """
    if faults.rotations == 18:
        rest = link_of(chain, k, solved.positions, 3)
        return rest, link_of(chain, k, solved.points, 3) if k > 0 else rest
    rest = rest_of(chain, k, R, solved, faults, pose)
    link = link_of(chain, k, solved.points, faults.link)
    if faults.rotations == 26:
        j, child = chain.path[k], chain.path[k + 1]
        start = load_vector(solved.positions, j)
        link = subtract(load_vector(solved.points, child), start)
    if faults.rule == 1:  # in the parent's frame
        link = rotated(P if faults.rotations == 9 else inverse(P, faults), link, faults)
    return rest, link


def global_of(P: Any, d: Any, R: Any, faults: Switches) -> Any:
    """Return the new global rotation of a joint: d R, d alone (15) or R d (16)."""
    if faults.rule == 1:
        return product(P, d, faults)
    if faults.rotations == 15:
        return d
    return product(R, d, faults) if faults.rotations == 16 else product(d, R, faults)


def rest_of(
    chain: TextbookChain, k: int, R: Any, solved: SolvedPath, faults: Switches, pose: TextbookPose
) -> Any:
    """Return the direction of link k that its new one is compared with.

    By the number of `rule` it is that of the present pose, at rest in the parent's frame or in the
    world's, that of the start; or the one between the positions of the start or of the present.
    """
    j, child = chain.path[k], chain.path[k + 1]
    offset = load_vector(chain.offsets, child)
    if faults.rule in (1, 2) or faults.rotations in (1, 19):
        return offset
    if faults.rule == 3 or faults.rotations in (21, 26):
        R = load_quaternion(solved.rotations, j)
    if faults.rule in (0, 3):
        return rotated(R, offset, faults)
    x = solved.positions if faults.rule == 4 else pose.positions
    return subtract(load_vector(x, child), load_vector(x, j))


def link_of(chain: TextbookChain, k: int, points: FloatArray, fault: int) -> Any:
    """Return the direction of link k; or the opposite (1), the next (2) or previous link's (3).

    Or that from the root to the link's end (4).
    """
    last = len(chain.path) - 2
    if fault == 4:
        root = load_vector(points, chain.path[0])
        return subtract(load_vector(points, chain.path[k + 1]), root)
    links = (k, k, min(k + 1, last), max(k - 1, 0))
    link = links[fault if fault <= 3 else 0]
    start, end = chain.path[link], chain.path[link + 1]
    if fault == 1:
        start, end = end, start
    return subtract(load_vector(points, end), load_vector(points, start))


def local_of(P: Any, d: Any, Q: Any, R: Any, faults: Switches) -> Any:
    """Return the local rotation after the arc d, in the parent's frame or the world's."""
    if faults.rule == 1:
        return d
    if faults.rule == 2:
        return product(inverse(P, faults), d, faults)
    if faults.rule in (0, 5):
        return from_world(P, d, Q, R, faults)
    inverse_P = inverse(P, faults)
    if faults.grouping == 0:
        return product(inverse_P, product(d, R, faults), faults)
    return product(product(inverse_P, d, faults), R, faults)


def wrong_local(
    chain: TextbookChain,
    k: int,
    P: Any,
    d: Any,
    R: Any,
    faults: Switches,
    pose: TextbookPose,
) -> Any:
    """Return a wrong local rotation after the arc d, by the number of `rotations`."""
    j, unit, P_inverse = chain.path[k], IDENTITY, inverse(P, faults)
    Q, Q_parent = load_quaternion(pose.local, j), IDENTITY
    Q_child = load_quaternion(pose.local, chain.path[k + 1])
    if chain.parents[j] >= 0:
        Q_parent = load_quaternion(pose.local, chain.parents[j])
    alone = (unit, unit, d)  # of the numbers that are no products
    products = (
        alone, alone, (unit, d, Q), alone,
        alone, (P, d, R), (d, R, P_inverse), (unit, Q, d),
        (P_inverse, d, P), alone, (P_inverse, d, Q), (P, d, product(P_inverse, Q, faults)),
        (inverse(Q_parent, faults), d, R), alone, (unit, d, R), (unit, P_inverse, d),
        (P_inverse, R, d), (unit, inverse(product(d, R, faults), faults), P), alone, alone,
        alone, alone, (unit, d, Q_child), (product(inverse(R, faults), d, faults), R, Q_child),
        (product(P_inverse, d, faults), P, Q_child), (unit, Q_child, d), alone,
        (product(Q, P_inverse, faults), d, P),
    )  # fmt: skip
    if faults.rotations == 17 and chain.parents[j] < 0:
        return product(d, R, faults)
    a, b, c = products[faults.rotations]
    return product(product(a, b, faults), c, faults)


class Method(NamedTuple):
    """The kernels of a solver: a sweep, what makes rotations of positions, what comes first."""

    sweep: Any
    finish: Any
    stretch: Any


method = Method(sweep_ccd, keep, never)
FABRIK = Method(sweep_fabrik, finish_fabrik, stretch)
# Inlined wherever they are called, products with faults would take a minute to compile and not ten
# seconds; a solve is a tenth slower so.
INLINED_SIZE = 300
place_all = Kernel(place, label="forward kinematics with faults", inlined_size=INLINED_SIZE)
SOLVERS = {
    "ccd": Kernel(solve, label="CCD with faults", inlined_size=INLINED_SIZE),
    "fabrik": Kernel(
        bind(solve, method=FABRIK), label="FABRIK with faults", inlined_size=INLINED_SIZE
    ),
}
