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

from plumbob.reference.arguments import FloatArray, IndexArray
from plumbob.reference.backend.compiled import Kernel, bind
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
# Numbers of `applied` from this one on rotate the child on the path.
GIVEN_TO_CHILD = 10
# CCD drops rotations smaller than these, by the number of `dropped` [rad]; among them are a degree,
# and the angles with the cosines 0.99999, 0.9999 and 0.999.
DROPPED = (0.0, 1e-4, 1e-3, 4.4721e-3, 1e-2, 1.41421e-2, 1.745329e-2, 4.47214e-2, 0.1)
UNCAPPED = 10.0  # an angle that no rotation has [rad]


class Switches(NamedTuple):
    """The number of the fault in each rule of a solver; 0 is right."""

    numbers: int = 0  # the order of a quaternion's numbers
    euler: int = 0  # the orders in which rotations are split and put together
    frame: int = 0  # forward kinematics: what rotates an offset
    product: int = 0  # R of R_parent and Q
    base: int = 0  # what an offset is added to
    root: int = 0  # the root's pose
    parent: int = 0  # which joint is the parent
    applied: int = 0  # CCD: what Q becomes
    angle: int = 0  # of d
    order: int = 0  # of joints in a sweep
    joints: int = 0  # which joints a sweep leaves out
    update: int = 0  # when joints are placed anew
    aim: int = 0  # the two directions that d joins
    offsets: int = 0  # what becomes of a child's offset
    dropped: int = 0  # which angle is too small to rotate by
    passes: int = 0  # FABRIK: which passes there are
    base_joint: int = 0  # where the root goes back to
    lengths: int = 0  # of links
    rotations: int = 0  # that positions stand for
    start: int = 0  # of either: from the rest pose
    effector: int = 0  # the last joint
    test: int = 0  # the end of a solve: what is compared with the tolerance
    budget: int = 0  # how many sweeps are allowed
    frame_start: int = 0  # following a curve: where a frame starts
    frame_target: int = 0  # which target a frame has
    # What honest solvers do to a rotation of CCD: scale its angle, then cap it [rad].
    gain: float = 1.0
    cap: float = UNCAPPED


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
    for j in range(len(chain.parents)):
        p = j - 1 if faults.parent == 1 else chain.parents[j]
        if p < 0:
            x, R = root_pose(chain, faults, pose, j)
        else:
            x, R = joint_pose(chain, faults, pose, j, p)
        store_vector(pose.positions, j, x)
        store_quaternion(pose.rotations, j, R)


def root_pose(chain: TextbookChain, faults: Switches, pose: TextbookPose, j: int) -> Any:
    """Return the position and the global rotation of the root."""
    Q, offset = load_quaternion(pose.local, j), load_vector(chain.offsets, j)
    if faults.product == 2:
        Q = conjugate(Q)
    rotations = (Q, Q, IDENTITY, Q)
    R = rotations[faults.root]
    places = (offset, ORIGIN, offset, rotate(R, offset))
    return places[faults.root], R


def joint_pose(chain: TextbookChain, faults: Switches, pose: TextbookPose, j: int, p: int) -> Any:
    """Return the position and the global rotation of joint j, the parent p placed before it."""
    Q, R_parent = load_quaternion(pose.local, j), load_quaternion(pose.rotations, p)
    products = (
        (R_parent, Q), (Q, R_parent), (R_parent, conjugate(Q)), (IDENTITY, Q), (R_parent, IDENTITY),
    )  # fmt: skip
    left, right = products[faults.product]
    R = multiply(left, right)
    above = chain.parents[p]
    R_above = load_quaternion(pose.rotations, above) if above >= 0 else IDENTITY
    frames = (
        R_parent, IDENTITY, R, conjugate(R_parent), R_above, load_quaternion(pose.local, p), Q,
        R_parent,
    )  # fmt: skip
    offset = load_vector(chain.offsets, j)
    if faults.frame == 7:
        offset = subtract(offset, load_vector(chain.offsets, p))
    offset = rotate(frames[faults.frame], offset)
    return add(base_of(chain, pose, p, faults.base), offset), R


def base_of(chain: TextbookChain, pose: TextbookPose, p: int, fault: int) -> Any:
    """Return what a rotated offset is added to: the parent's position, at rest (1), the root's."""
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
    n = ending.sweeps
    allowed = (n, n + 1, n - 1, n, min(n, 1), 0)
    before, i = math.inf, 0
    while i < allowed[faults.budget]:
        distance = norm(subtract(load_vector(pose.positions, chain.path[-1]), target))
        if is_reached(distance, before, ending.tolerance, i, faults.test):
            break
        before = distance
        method.sweep(chain, target, i, faults, pose)
        i += 1
    method.finish(chain, i, faults, pose)
    return i


def is_reached(distance: float, before: float, tolerance: float, sweeps: int, fault: int) -> bool:
    """Return whether the solve ends before its next sweep."""
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
) -> None:
    """Rotate each joint from the effector's parent to the root; or only one of them, the i-th."""
    links = len(chain.path) - 1
    if faults.budget == 3:
        rotate_joint(chain, links - 1 - i % links, target, faults, pose)
        return
    for link in range(links):
        k = link if faults.order == 1 else links - 1 - link
        left_out = (-1, 0, links - 1)
        if k != left_out[faults.joints]:
            rotate_joint(chain, k, target, faults, pose)
    if faults.update < 2:
        place(chain, faults, pose)


def rotate_joint(
    chain: TextbookChain, k: int, target: Any, faults: Switches, pose: TextbookPose
) -> None:
    """Rotate joint k of the path so that the effector comes nearest to the target."""
    joint = load_vector(pose.positions, chain.path[k])
    effector = load_vector(pose.positions, chain.path[-1])
    arm, direction = subtract(effector, joint), subtract(target, joint)
    parent = load_vector(pose.positions, chain.path[max(k - 1, 0)])
    child = load_vector(pose.positions, chain.path[k + 1])
    directions = (
        (arm, direction),
        (arm, target),
        (effector, direction),
        (arm, add(direction, load_vector(pose.positions, 0))),
        (arm, subtract(target, effector)),
        (subtract(effector, parent), subtract(target, parent)),
        (subtract(effector, child), subtract(target, child)),
    )
    a, b = directions[faults.aim]
    d = damped(between(a, b), faults)
    if faults.dropped > 0 and norm(logarithm(d)) < DROPPED[faults.dropped]:
        return
    turn_offset(chain, k, d, faults.offsets, pose)
    if faults.update < 3:
        apply_rotation(chain, k, d, faults.applied, pose)
    if faults.update == 0:
        place(chain, faults, pose)
    elif faults.update >= 2:
        follow_by_hand(chain, k, d, faults.update, pose)


def turn_offset(chain: TextbookChain, k: int, d: Any, fault: int, pose: TextbookPose) -> None:
    """Rotate the offset of the next joint too: in the joint's frame (1), in the world's (2)."""
    if fault == 0:
        return
    R = load_quaternion(pose.rotations, chain.path[k])
    rotations = (IDENTITY, multiply(multiply(conjugate(R), d), R), d)
    offset = rotate(rotations[fault], load_vector(chain.offsets, chain.path[k + 1]))
    store_vector(chain.offsets, chain.path[k + 1], offset)


def follow_by_hand(chain: TextbookChain, k: int, d: Any, fault: int, pose: TextbookPose) -> None:
    """Rotate the effector about joint k, or (3) every joint after it on the path."""
    last = len(chain.path) - 1
    joint = load_vector(pose.positions, chain.path[k])
    for m in range(last if fault == 2 else k + 1, last + 1):
        arm = subtract(load_vector(pose.positions, chain.path[m]), joint)
        store_vector(pose.positions, chain.path[m], add(joint, rotate(d, arm)))


def damped(d: Any, faults: Switches) -> Any:
    """Return the rotation with another angle: negative (1), doubled (2), halved (3), damped."""
    if faults.angle == 1:
        return conjugate(d)
    if faults.angle == 2:
        return multiply(d, d)
    factor = 0.5 * faults.gain if faults.angle == 3 else faults.gain
    if factor == 1.0 and faults.cap >= UNCAPPED:
        return d
    v = logarithm(d)
    angle = norm(v)
    if angle == 0.0:
        return d
    return rotation_about(scale(1.0 / angle, v), min(factor * angle, faults.cap))


def apply_rotation(chain: TextbookChain, k: int, d: Any, fault: int, pose: TextbookPose) -> None:
    """Give joint k of the path, or its child, the world rotation d."""
    j = chain.path[k]
    p = chain.parents[j]
    R, P = load_quaternion(pose.rotations, j), IDENTITY
    if p >= 0:
        P = load_quaternion(pose.rotations, p)
    if fault >= GIVEN_TO_CHILD:
        j = chain.path[k + 1]
    Q, unit = load_quaternion(pose.local, j), IDENTITY
    P_inverse, R_inverse = conjugate(P), conjugate(R)
    products = (
        (P_inverse, d, P, Q),
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
    )
    a, b, c, e = products[fault]
    store_quaternion(pose.local, j, renormalised(multiply(multiply(multiply(a, b), c), e)))


def keep(chain: TextbookChain, sweeps: int, faults: Switches, pose: TextbookPose) -> None:
    """Leave a pose of CCD as it is, unless only its effector was followed by hand."""
    if faults.update == 2:
        place(chain, faults, pose)


def sweep_fabrik(
    chain: TextbookChain, target: Any, i: int, faults: Switches, pose: TextbookPose
) -> None:
    """Pull the joints to the target, then back to the root."""
    last, positions = len(chain.path) - 1, pose.positions
    if faults.passes == 0:
        store_vector(positions, chain.path[last], target)
        for k in range(last - 1, -1, -1):
            length = link_length(chain, k, faults.lengths, positions)
            pull(positions, chain.path[k + 1], chain.path[k], length)
    root = chain.path[0]
    places = (load_vector(chain.offsets, root), load_vector(positions, root), ORIGIN)
    store_vector(positions, root, places[faults.base_joint])
    for k in range(last):
        length = link_length(chain, k, faults.lengths, positions)
        pull(positions, chain.path[k], chain.path[k + 1], length)


def link_length(chain: TextbookChain, k: int, fault: int, positions: FloatArray) -> float:
    """Return the length of link k, from joint k of the path to the next; or (3) as it is now."""
    last = len(chain.path) - 2
    links = (k, min(k + 1, last), max(k - 1, 0), k)
    if fault == 3:
        start = load_vector(positions, chain.path[k])
        return norm(subtract(load_vector(positions, chain.path[k + 1]), start))
    return norm(load_vector(chain.offsets, chain.path[links[fault] + 1]))


def pull(positions: FloatArray, fixed: int, moved: int, length: float) -> None:
    """Bring a joint to a distance from another, along the line between them."""
    start = load_vector(positions, fixed)
    direction = subtract(load_vector(positions, moved), start)
    distance = norm(direction)
    if distance > 0.0:
        store_vector(positions, moved, add(start, scale(length / distance, direction)))


def follow(chain: TextbookChain, sweeps: int, faults: Switches, pose: TextbookPose) -> None:
    """Rotate each joint of the path to its link's new direction; the path keeps its positions."""
    moved, start = pose.positions.copy(), pose.rotations.copy()
    for k in range(len(chain.path) - 1 if sweeps > 0 else 0):
        place(chain, faults, pose)
        parents_of = start if faults.rotations == 4 else pose.rotations
        point_link(chain, k, moved, faults.rotations, parents_of, pose)
    place(chain, faults, pose)
    for j in chain.path:
        store_vector(pose.positions, j, load_vector(moved, j))


def point_link(
    chain: TextbookChain,
    k: int,
    moved: FloatArray,
    fault: int,
    rotations: FloatArray,
    pose: TextbookPose,
) -> None:
    """Rotate joint k of the path, or its child (3), by global rotations as they are thought."""
    j, child = chain.path[k], chain.path[k + 1]
    p = chain.parents[j]
    offset, Q = load_vector(chain.offsets, child), load_quaternion(pose.local, j)
    R, P = load_quaternion(rotations, j), IDENTITY
    if p >= 0:
        P = load_quaternion(rotations, p)
    link = subtract(load_vector(moved, child), load_vector(moved, j))
    arc = between(rotate(R, offset), link)
    if fault == 1:
        Q = between(offset, link)
    elif fault == 2:
        Q = multiply(arc, Q)
    else:
        Q = multiply(multiply(multiply(conjugate(P), arc), P), Q)
    store_quaternion(pose.local, child if fault == 3 else j, renormalised(Q))


class Method(NamedTuple):
    """The kernels of a solver: one sweep, and what makes rotations of its last positions."""

    sweep: Any
    finish: Any


method = Method(sweep_ccd, keep)
place_all = Kernel(place, label="forward kinematics with faults")
SOLVERS = {
    "ccd": Kernel(solve, label="CCD with faults"),
    "fabrik": Kernel(bind(solve, method=Method(sweep_fabrik, follow)), label="FABRIK with faults"),
}
