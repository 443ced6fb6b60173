"""Forward kinematics, CCD and FABRIK as textbooks have them, with a switch for each known fault.

With every switch at 0 they are right. The switches of one tuple are independent of one another, so
that faults combine; each number of a switch is a fault of the catalogue in `faults.py`.

The solvers keep the local rotations of the whole skeleton and place all joints anew after each
rotation, as a student's program does, not the reference's chain of global rotations.
"""

import math
from typing import Any, NamedTuple

from plumbob.reference.arguments import FloatArray, IndexArray
from plumbob.reference.backend.compiled import Kernel
from plumbob.reference.quaternion import (
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


class Chain(NamedTuple):
    """A skeleton, and the joints from its root to the effector, both included."""

    parents: IndexArray
    offsets: FloatArray
    path: IndexArray


class Pose(NamedTuple):
    """Local rotations, and the global positions and rotations of all joints."""

    local: FloatArray
    positions: FloatArray
    rotations: FloatArray


class Ending(NamedTuple):
    """When a solve ends: at a distance [m], after so many sweeps, with the faults of `stop`."""

    tolerance: float
    sweeps: int
    stop: Stop


def place(chain: Chain, faults: Forward, pose: Pose) -> None:
    """Fill positions and global rotations of all joints."""
    for j in range(len(chain.parents)):
        Q, offset = load_quaternion(pose.local, j), load_vector(chain.offsets, j)
        p = j - 1 if faults.parent == 1 else chain.parents[j]
        if p < 0:
            if faults.product == 2:
                Q = conjugate(Q)
            R = IDENTITY if faults.root == 2 else Q
            x = ORIGIN if faults.root == 1 else rotate(R, offset) if faults.root == 3 else offset
        else:
            R = global_rotation(load_quaternion(pose.rotations, p), Q, faults.product)
            frame = frame_of_offset(chain, pose, p, R, Q, faults.frame)
            x = add(base_of(chain, pose, p, faults.base), rotate(frame, offset))
        store_vector(pose.positions, j, x)
        store_quaternion(pose.rotations, j, R)


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


def frame_of_offset(chain: Chain, pose: Pose, p: int, R: Any, Q: Any, fault: int) -> Any:
    """Return what rotates an offset into the world."""
    grandparent = chain.parents[p]
    if fault == 1:
        return IDENTITY
    if fault == 2:
        return R
    if fault == 3:
        return conjugate(load_quaternion(pose.rotations, p))
    if fault == 4:
        return load_quaternion(pose.rotations, grandparent) if grandparent >= 0 else IDENTITY
    if fault == 5:
        return load_quaternion(pose.local, p)
    if fault == 6:
        return Q
    return load_quaternion(pose.rotations, p)


def base_of(chain: Chain, pose: Pose, p: int, fault: int) -> Any:
    """Return what a rotated offset is added to."""
    if fault == 1:
        x = load_vector(chain.offsets, p)
        while chain.parents[p] >= 0:
            p = chain.parents[p]
            x = add(x, load_vector(chain.offsets, p))
        return x
    return load_vector(pose.positions, 0 if fault == 2 else p)


def begin(chain: Chain, forward: Forward, from_rest: bool, pose: Pose) -> None:
    """Place all joints at the start, or at rest."""
    if from_rest:
        for j in range(len(chain.parents)):
            store_quaternion(pose.local, j, IDENTITY)
    place(chain, forward, pose)


def solve_ccd(
    chain: Chain, target: Any, ending: Ending, forward: Forward, ccd: Ccd, damping: Damping,
    pose: Pose,
) -> int:  # fmt: skip
    """Sweep until the end of the solve; `pose.local` is the start and becomes the result.

    Returns the number of sweeps made.
    """
    begin(chain, forward, ccd.start == 1, pose)
    links, stop = len(chain.path) - 1, ending.stop
    before, i = math.inf, 0
    while i < allowed(ending.sweeps, stop.budget):
        distance = norm(subtract(load_vector(pose.positions, chain.path[-1]), target))
        if is_reached(distance, before, ending.tolerance, i, stop.test):
            break
        before = distance
        if stop.budget == 3:
            k = links - 1 - i % links
            rotate_joint(chain, k, target, forward, ccd, damping, pose)
        else:
            sweep_ccd(chain, target, forward, ccd, damping, pose)
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
    chain: Chain, target: Any, forward: Forward, ccd: Ccd, damping: Damping, pose: Pose
) -> None:
    """Rotate each joint from the effector's parent to the root."""
    links = len(chain.path) - 1
    for i in range(links):
        k = i if ccd.order == 1 else links - 1 - i
        if (ccd.joints == 1 and k == 0) or (ccd.joints == 2 and k == links - 1):
            continue
        rotate_joint(chain, k, target, forward, ccd, damping, pose)
    place(chain, forward, pose)


def rotate_joint(
    chain: Chain, k: int, target: Any, forward: Forward, ccd: Ccd, damping: Damping, pose: Pose
) -> None:
    """Rotate joint k of the path so that the effector comes nearest to the target."""
    joint = load_vector(pose.positions, chain.path[k])
    effector = load_vector(pose.positions, chain.path[-1])
    arm, direction = subtract(effector, joint), subtract(target, joint)
    if ccd.aim == 1:
        direction = target
    elif ccd.aim == 2:
        arm = effector
    elif ccd.aim == 3:
        direction = add(direction, load_vector(pose.positions, 0))
    elif ccd.aim == 4:
        direction = subtract(target, effector)
    d = damped(between(arm, direction), ccd.angle, damping)
    apply_rotation(chain, k, d, ccd.applied, pose)
    if ccd.update == 0:
        place(chain, forward, pose)


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


def apply_rotation(chain: Chain, k: int, d: Any, fault: int, pose: Pose) -> None:
    """Give a joint the world rotation d."""
    j = chain.path[k]
    p = chain.parents[j]
    R = load_quaternion(pose.rotations, j)
    R_parent = load_quaternion(pose.rotations, p) if p >= 0 else IDENTITY
    if fault >= 10:
        j = chain.path[k + 1]
    Q = load_quaternion(pose.local, j)
    store_quaternion(pose.local, j, renormalised(rotated(R_parent, R, d, Q, fault)))


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
    chain: Chain, target: Any, ending: Ending, forward: Forward, fabrik: Fabrik, pose: Pose
) -> int:
    """Move the joints of the path, then find their rotations; `pose.local` as for CCD.

    The positions are those that the passes leave on the path, and below it what the rotations give.
    """
    begin(chain, forward, fabrik.start == 1, pose)
    before, i = math.inf, 0
    while i < allowed(ending.sweeps, ending.stop.budget):
        distance = norm(subtract(load_vector(pose.positions, chain.path[-1]), target))
        if is_reached(distance, before, ending.tolerance, i, ending.stop.test):
            break
        before = distance
        sweep_fabrik(chain, target, fabrik, pose.positions)
        i += 1
    moved = pose.positions.copy()
    if i > 0:
        follow(chain, moved, forward, fabrik.rotations, pose)
    place(chain, forward, pose)
    for j in chain.path:
        store_vector(pose.positions, j, load_vector(moved, j))
    return i


def sweep_fabrik(chain: Chain, target: Any, fabrik: Fabrik, positions: FloatArray) -> None:
    """Pull the joints to the target, then back to the root."""
    if fabrik.passes == 0:
        pull_backward(chain, target, fabrik, positions)
    pull_forward(chain, fabrik, positions)


def pull_backward(chain: Chain, target: Any, fabrik: Fabrik, positions: FloatArray) -> None:
    """Put the effector on the target and the others after it."""
    last = len(chain.path) - 1
    store_vector(positions, chain.path[last], target)
    for k in range(last - 1, -1, -1):
        length = link_length(chain, k, fabrik.lengths, positions)
        pull(positions, chain.path[k + 1], chain.path[k], length)


def pull_forward(chain: Chain, fabrik: Fabrik, positions: FloatArray) -> None:
    """Put the root back and the others after it."""
    root = chain.path[0]
    if fabrik.root == 0:
        store_vector(positions, root, load_vector(chain.offsets, root))
    elif fabrik.root == 2:
        store_vector(positions, root, ORIGIN)
    for k in range(len(chain.path) - 1):
        length = link_length(chain, k, fabrik.lengths, positions)
        pull(positions, chain.path[k], chain.path[k + 1], length)


def link_length(chain: Chain, k: int, fault: int, positions: FloatArray) -> float:
    """Return the length of link k, from joint k of the path to the next."""
    last = len(chain.path) - 2
    if fault == 3:
        start = load_vector(positions, chain.path[k])
        return norm(subtract(load_vector(positions, chain.path[k + 1]), start))
    if fault == 1:
        k = min(k + 1, last)
    elif fault == 2:
        k = max(k - 1, 0)
    return norm(load_vector(chain.offsets, chain.path[k + 1]))


def pull(positions: FloatArray, fixed: int, moved: int, length: float) -> None:
    """Bring a joint to a distance from another, along the line between them."""
    start = load_vector(positions, fixed)
    direction = subtract(load_vector(positions, moved), start)
    distance = norm(direction)
    if distance > 0.0:
        store_vector(positions, moved, add(start, scale(length / distance, direction)))


def follow(chain: Chain, moved: FloatArray, forward: Forward, fault: int, pose: Pose) -> None:
    """Rotate each joint of the path so that its link points to where the next one has moved."""
    start = pose.rotations.copy()
    for k in range(len(chain.path) - 1):
        place(chain, forward, pose)
        j, child = chain.path[k], chain.path[k + 1]
        p = chain.parents[j]
        seen = start if fault == 4 else pose.rotations
        offset, Q = load_vector(chain.offsets, child), load_quaternion(pose.local, j)
        R = load_quaternion(seen, j)
        R_parent = load_quaternion(seen, p) if p >= 0 else IDENTITY
        link = subtract(load_vector(moved, child), load_vector(moved, j))
        arc = between(rotate(R, offset), link)
        if fault == 1:
            Q = between(offset, link)
        elif fault == 2:
            Q = multiply(arc, Q)
        else:
            Q = multiply(turned(conjugate(R_parent), arc), Q)
        store_quaternion(pose.local, child if fault == 3 else j, renormalised(Q))


place_all = Kernel(place, label="forward kinematics with faults")
ccd_all = Kernel(solve_ccd, label="CCD with faults")
fabrik_all = Kernel(solve_fabrik, label="FABRIK with faults")
