"""Forward kinematics, CCD and FABRIK as textbooks have them, with a switch for each known fault.

With every switch at 0 they are right. The switches of one tuple are independent of one another, so
that faults combine; each number of a switch is a fault of the catalogue in `faults.py`.

The solvers keep the local rotations of the whole skeleton and place all joints anew after each
rotation, as a student's program does, not the reference's chain of global rotations.
"""

import math
from typing import Any, NamedTuple

from reference.arguments import FloatArray, IndexArray
from reference.backend.compiled import Kernel
from reference.quaternion import (
    IDENTITY,
    add,
    between,
    conjugate,
    load_quaternion,
    load_vector,
    logarithm,
    multiply,
    norm,
    renormalised,
    rotate,
    rotation_about,
    scale,
    store_quaternion,
    store_vector,
    subtract,
)

ORIGIN = (0.0, 0.0, 0.0)


class Forward(NamedTuple):
    """Switches of forward kinematics: x = x_p + R_p offset, R = R_p Q, with p the parent.

    Attributes:
        frame: what rotates an offset: 1 nothing, 2 the joint's own R, 3 the parent's inverse, 4 the
            grandparent's R, 5 the parent's local Q, 6 the joint's own Q.
        product: R is 1 Q R_p, 2 R_p Q*, 3 Q only, 4 R_p only.
        base: what an offset is added to: 1 the parent's place at rest, 2 the root.
        root: the root's 1 offset is dropped, 2 rotation is dropped, 3 offset is rotated by it.
        parent: 1 the joint before in the list.
    """

    frame: int = 0
    product: int = 0
    base: int = 0
    root: int = 0
    parent: int = 0


class Ccd(NamedTuple):
    """Switches of CCD, where d is the world rotation of joint j, R its global rotation.

    Attributes:
        applied: Q becomes, instead of R_p* d R_p Q: 1 d Q, 2 Q d, 3 R_p d R_p* Q, 4 R* d R Q,
            5 R d R* Q, 6 d R, 7 R_p* d Q, 8 d, 9 Q R_p* d R_p; that of the child on the path
            becomes 10 d Q, 11 R* d R Q.
        angle: of d: 1 negative, 2 doubled, 3 halved.
        order: 1 root to tip.
        joints: 1 without the root, 2 without the effector's parent.
        update: 1 the joints are not placed anew until the end of a sweep.
        aim: the two directions: 1 the target from the origin, 2 the effector from the origin, 3 the
            target counted from the root, 4 the gap between effector and target.
        start: 1 the rest pose.
        effector: 1 the last joint.
    """

    applied: int = 0
    angle: int = 0
    order: int = 0
    joints: int = 0
    update: int = 0
    aim: int = 0
    start: int = 0
    effector: int = 0


class Damping(NamedTuple):
    """What honest solvers do to a rotation of CCD: scale its angle, then cap it [rad]."""

    gain: float = 1.0
    most: float = 10.0


class Fabrik(NamedTuple):
    """Switches of FABRIK.

    Attributes:
        passes: 1 no backward pass.
        root: 1 not put back, so that the forward pass finds nothing to do, 2 put to the origin.
        lengths: of a link: 1 the next one's, 2 the one's before, 3 as after the joint has moved.
        rotations: 1 from the offset to the global direction, without the parents, 2 a global arc
            multiplied onto the local rotation on its left, 3 given to the child, 4 with the parents
            as they were at the start.
        start: 1 the rest pose.
        effector: 1 the last joint.
    """

    passes: int = 0
    root: int = 0
    lengths: int = 0
    rotations: int = 0
    start: int = 0
    effector: int = 0


class Stop(NamedTuple):
    """Switches of the end of a solve.

    Attributes:
        test: 1 the squared distance is held against the tolerance, 2 the distance against its
            square, 3 the change of distance against it, 4 it grows with every sweep.
        budget: 1 one sweep more, 2 one less, 3 a joint counts as a sweep.
    """

    test: int = 0
    budget: int = 0


def place(
    parents: IndexArray,
    offsets: FloatArray,
    local: FloatArray,
    faults: Forward,
    positions: FloatArray,
    rotations: FloatArray,
) -> None:
    """Fill positions and global rotations of all joints."""
    for j in range(len(parents)):
        Q, offset = load_quaternion(local, j), load_vector(offsets, j)
        p = j - 1 if faults.parent == 1 else parents[j]
        if p < 0:
            if faults.product == 2:
                Q = conjugate(Q)
            R = IDENTITY if faults.root == 2 else Q
            x = ORIGIN if faults.root == 1 else rotate(R, offset) if faults.root == 3 else offset
        else:
            R = global_rotation(load_quaternion(rotations, p), Q, faults.product)
            x = add(
                base_of(parents, offsets, positions, p, faults.base),
                rotate(frame_of_offset(parents, local, rotations, p, R, Q, faults.frame), offset),
            )
        store_vector(positions, j, x)
        store_quaternion(rotations, j, R)


def global_rotation(R_parent: Any, Q: Any, fault: int) -> Any:
    """Return R from R_p and Q."""
    if fault == 1:
        return multiply(Q, R_parent)
    if fault == 2:
        return multiply(R_parent, conjugate(Q))
    if fault == 3:
        return Q
    if fault == 4:
        return R_parent
    return multiply(R_parent, Q)


def frame_of_offset(
    parents: IndexArray,
    local: FloatArray,
    rotations: FloatArray,
    p: int,
    R: Any,
    Q: Any,
    fault: int,
) -> Any:
    """Return what rotates an offset into the world."""
    if fault == 1:
        return IDENTITY
    if fault == 2:
        return R
    if fault == 3:
        return conjugate(load_quaternion(rotations, p))
    if fault == 4:
        return load_quaternion(rotations, parents[p]) if parents[p] >= 0 else IDENTITY
    if fault == 5:
        return load_quaternion(local, p)
    if fault == 6:
        return Q
    return load_quaternion(rotations, p)


def base_of(
    parents: IndexArray, offsets: FloatArray, positions: FloatArray, p: int, fault: int
) -> Any:
    """Return what a rotated offset is added to."""
    if fault == 1:
        x = load_vector(offsets, p)
        while parents[p] >= 0:
            p = parents[p]
            x = add(x, load_vector(offsets, p))
        return x
    if fault == 2:
        return load_vector(positions, 0)
    return load_vector(positions, p)


def solve_ccd(
    parents: IndexArray,
    offsets: FloatArray,
    path: IndexArray,
    target: Any,
    tolerance: float,
    sweeps: int,
    forward: Forward,
    ccd: Ccd,
    stop: Stop,
    damping: Damping,
    local: FloatArray,
    positions: FloatArray,
    rotations: FloatArray,
) -> int:
    """Sweep until the end of the solve; `local` is the start and becomes the result.

    Returns the number of sweeps made.
    """
    if ccd.start == 1:
        for j in range(len(parents)):
            store_quaternion(local, j, IDENTITY)
    place(parents, offsets, local, forward, positions, rotations)
    end, links = path[-1], len(path) - 1
    before, i = math.inf, 0
    while i < allowed(sweeps, stop.budget):
        distance = norm(subtract(load_vector(positions, end), target))
        if is_reached(distance, before, tolerance, i, stop.test):
            break
        before = distance
        if stop.budget == 3:
            k = links - 1 - i % links
            rotate_joint(
                parents,
                offsets,
                path,
                k,
                target,
                forward,
                ccd,
                damping,
                local,
                positions,
                rotations,
            )
        else:
            sweep_ccd(
                parents, offsets, path, target, forward, ccd, damping, local, positions, rotations
            )
        i += 1
    return i


def allowed(sweeps: int, fault: int) -> int:
    """Return how many sweeps a solve may make."""
    if fault == 1:
        return sweeps + 1
    if fault == 2:
        return sweeps - 1
    return sweeps


def is_reached(distance: float, before: float, tolerance: float, made: int, fault: int) -> bool:
    """Return whether the solve ends before its next sweep."""
    if fault == 1:
        return distance * distance <= tolerance
    if fault == 2:
        return distance <= tolerance * tolerance
    if fault == 3:
        return abs(before - distance) <= tolerance
    if fault == 4:
        return distance <= tolerance * (made + 1)
    return distance <= tolerance


def sweep_ccd(
    parents: IndexArray,
    offsets: FloatArray,
    path: IndexArray,
    target: Any,
    forward: Forward,
    ccd: Ccd,
    damping: Damping,
    local: FloatArray,
    positions: FloatArray,
    rotations: FloatArray,
) -> None:
    """Rotate each joint from the effector's parent to the root."""
    links = len(path) - 1
    for i in range(links):
        k = i if ccd.order == 1 else links - 1 - i
        if (ccd.joints == 1 and k == 0) or (ccd.joints == 2 and k == links - 1):
            continue
        rotate_joint(
            parents, offsets, path, k, target, forward, ccd, damping, local, positions, rotations
        )
    place(parents, offsets, local, forward, positions, rotations)


def rotate_joint(
    parents: IndexArray,
    offsets: FloatArray,
    path: IndexArray,
    k: int,
    target: Any,
    forward: Forward,
    ccd: Ccd,
    damping: Damping,
    local: FloatArray,
    positions: FloatArray,
    rotations: FloatArray,
) -> None:
    """Rotate joint k of the path so that the effector comes nearest to the target."""
    joint, effector = load_vector(positions, path[k]), load_vector(positions, path[-1])
    arm, direction = subtract(effector, joint), subtract(target, joint)
    if ccd.aim == 1:
        direction = target
    elif ccd.aim == 2:
        arm = effector
    elif ccd.aim == 3:
        direction = add(direction, load_vector(positions, 0))
    elif ccd.aim == 4:
        direction = subtract(target, effector)
    d = damped(between(arm, direction), ccd.angle, damping)
    apply_rotation(parents, path, k, d, ccd.applied, local, rotations)
    if ccd.update == 0:
        place(parents, offsets, local, forward, positions, rotations)


def damped(d: Any, fault: int, damping: Damping) -> Any:
    """Return the rotation with another angle."""
    if fault == 1:
        return conjugate(d)
    if fault == 2:
        return multiply(d, d)
    factor = 0.5 * damping.gain if fault == 3 else damping.gain
    if factor == 1.0 and damping.most >= 10.0:
        return d
    v = logarithm(d)
    angle = norm(v)
    if angle == 0.0:
        return d
    return rotation_about(scale(1.0 / angle, v), min(factor * angle, damping.most))


def apply_rotation(
    parents: IndexArray,
    path: IndexArray,
    k: int,
    d: Any,
    fault: int,
    local: FloatArray,
    rotations: FloatArray,
) -> None:
    """Give a joint the world rotation d."""
    j = path[k]
    R, Q = load_quaternion(rotations, j), load_quaternion(local, j)
    R_parent = load_quaternion(rotations, parents[j]) if parents[j] >= 0 else IDENTITY
    if fault >= 10:
        j = path[k + 1]
        Q = load_quaternion(local, j)
    store_quaternion(local, j, renormalised(rotated(R_parent, R, d, Q, fault)))


def rotated(R_parent: Any, R: Any, d: Any, Q: Any, fault: int) -> Any:
    """Return a local rotation after the world rotation d."""
    if fault == 1 or fault == 10:
        return multiply(d, Q)
    if fault == 2:
        return multiply(Q, d)
    if fault == 3:
        return multiply(turned(R_parent, d), Q)
    if fault == 4 or fault == 11:
        return multiply(turned(conjugate(R), d), Q)
    if fault == 5:
        return multiply(turned(R, d), Q)
    if fault == 6:
        return multiply(d, R)
    if fault == 7:
        return multiply(multiply(conjugate(R_parent), d), Q)
    if fault == 8:
        return d
    if fault == 9:
        return multiply(Q, turned(conjugate(R_parent), d))
    return multiply(turned(conjugate(R_parent), d), Q)


def turned(R: Any, d: Any) -> Any:
    """Return R d R*."""
    return multiply(multiply(R, d), conjugate(R))


def solve_fabrik(
    parents: IndexArray,
    offsets: FloatArray,
    path: IndexArray,
    target: Any,
    tolerance: float,
    sweeps: int,
    forward: Forward,
    fabrik: Fabrik,
    stop: Stop,
    local: FloatArray,
    positions: FloatArray,
    rotations: FloatArray,
) -> int:
    """Move the joints of the path, then find their rotations; `local` as for CCD.

    `positions` are those that the passes leave on the path, and below it what the rotations give.
    """
    if fabrik.start == 1:
        for j in range(len(parents)):
            store_quaternion(local, j, IDENTITY)
    place(parents, offsets, local, forward, positions, rotations)
    before, i = math.inf, 0
    while i < allowed(sweeps, stop.budget):
        distance = norm(subtract(load_vector(positions, path[-1]), target))
        if is_reached(distance, before, tolerance, i, stop.test):
            break
        before = distance
        sweep_fabrik(offsets, path, target, fabrik, positions)
        i += 1
    moved = positions.copy()
    if i > 0:
        follow(
            parents, offsets, path, moved, forward, fabrik.rotations, local, positions, rotations
        )
    place(parents, offsets, local, forward, positions, rotations)
    for k in range(len(path)):
        store_vector(positions, path[k], load_vector(moved, path[k]))
    return i


def sweep_fabrik(
    offsets: FloatArray, path: IndexArray, target: Any, fabrik: Fabrik, positions: FloatArray
) -> None:
    """Pull the joints to the target, then back to the root."""
    root = load_vector(offsets, path[0])
    if fabrik.passes == 0:
        pull_backward(offsets, path, target, fabrik, positions)
    pull_forward(offsets, path, root, fabrik, positions)


def pull_backward(
    offsets: FloatArray, path: IndexArray, target: Any, fabrik: Fabrik, positions: FloatArray
) -> None:
    """Put the effector on the target and the others after it."""
    last = len(path) - 1
    old = positions.copy()
    store_vector(positions, path[last], target)
    for k in range(last - 1, -1, -1):
        length = link_length(offsets, path, k, fabrik.lengths, positions, old)
        pull(positions, path[k + 1], path[k], length)


def pull_forward(
    offsets: FloatArray, path: IndexArray, root: Any, fabrik: Fabrik, positions: FloatArray
) -> None:
    """Put the root back and the others after it."""
    old = positions.copy()
    if fabrik.root == 0:
        store_vector(positions, path[0], root)
    elif fabrik.root == 2:
        store_vector(positions, path[0], ORIGIN)
    for k in range(len(path) - 1):
        length = link_length(offsets, path, k, fabrik.lengths, positions, old)
        pull(positions, path[k], path[k + 1], length)


def link_length(
    offsets: FloatArray,
    path: IndexArray,
    k: int,
    fault: int,
    positions: FloatArray,
    old: FloatArray,
) -> float:
    """Return the length of link k, from joint k of the path to the next."""
    last = len(path) - 2
    if fault == 3:
        a, b = load_vector(positions, path[k]), load_vector(positions, path[k + 1])
        return norm(subtract(b, a))
    if fault == 1:
        k = min(k + 1, last)
    elif fault == 2:
        k = max(k - 1, 0)
    return norm(load_vector(offsets, path[k + 1]))


def pull(positions: FloatArray, fixed: int, moved: int, length: float) -> None:
    """Bring a joint to a distance from another, along the line between them."""
    start = load_vector(positions, fixed)
    way = subtract(load_vector(positions, moved), start)
    distance = norm(way)
    if distance > 0.0:
        store_vector(positions, moved, add(start, scale(length / distance, way)))


def follow(
    parents: IndexArray,
    offsets: FloatArray,
    path: IndexArray,
    moved: FloatArray,
    forward: Forward,
    fault: int,
    local: FloatArray,
    positions: FloatArray,
    rotations: FloatArray,
) -> None:
    """Rotate each joint of the path so that its link points to where the next one has moved."""
    start = rotations.copy()
    for k in range(len(path) - 1):
        place(parents, offsets, local, forward, positions, rotations)
        j = path[k]
        offset, Q = load_vector(offsets, path[k + 1]), load_quaternion(local, j)
        R, R_parent = load_quaternion(rotations, j), IDENTITY
        if parents[j] >= 0:
            R_parent = load_quaternion(start if fault == 4 else rotations, parents[j])
        if fault == 4:
            R = load_quaternion(start, j)
        link = subtract(load_vector(moved, path[k + 1]), load_vector(moved, j))
        arc = between(rotate(R, offset), link)
        if fault == 1:
            Q = between(offset, link)
        elif fault == 2:
            Q = multiply(arc, Q)
        else:
            Q = multiply(turned(conjugate(R_parent), arc), Q)
        store_quaternion(local, path[k + 1] if fault == 3 else j, renormalised(Q))


place_all = Kernel(place, label="forward kinematics with faults")
ccd_all = Kernel(solve_ccd, label="CCD with faults")
fabrik_all = Kernel(solve_fabrik, label="FABRIK with faults")
