"""The faults that solvers of kinematics are known to have, and their combinations.

Those that real programs were found to have come first. A fault is one
number of one switch of `textbook.py`.
"""

import itertools
from collections.abc import Iterator, Sequence
from functools import cache
from typing import NamedTuple

from ..explain import either
from ..sentence import Sentence, sentence
from .textbook import Ccd, Fabrik, Forward, Stop


class Order(NamedTuple):
    """Switch of a quaternion's numbers, wxyz: 1 read as xyzw, 2 read and written so, 3 written."""

    numbers: int = 0


class Follow(NamedTuple):
    """Switches of following a curve.

    Attributes:
        start: where a frame starts: 1 from the first pose, 2 from the rest pose.
        aim: 1 the target of the frame before, 2 of the frame after.
    """

    start: int = 0
    aim: int = 0


class Switches(NamedTuple):
    """All switches of a solver."""

    order: Order = Order()
    forward: Forward = Forward()
    ccd: Ccd = Ccd()
    fabrik: Fabrik = Fabrik()
    stop: Stop = Stop()
    follow: Follow = Follow()


class Fault(NamedTuple):
    """A number of a switch.

    Attributes:
        key: its short name.
        part: which of Switches it belongs to.
        switch: the name of the switch there.
        number: what the switch is set to.
        sentence: what is wrong and what it should be.
        honest: whether a solver may be so on purpose: its answers still obey every law.
    """

    key: str
    part: str
    switch: str
    number: int
    sentence: Sentence
    honest: bool = False


_FORWARD = (
    Fault(
        "offset not rotated", "forward", "frame", 1,
        sentence(
            "Forward kinematics adds a joint's offset to its parent's position without rotating "
            "it. The offset is given in the parent's frame: x = x_parent + R_parent offset."
        ),
    ),
    Fault(
        "own rotation on own offset", "forward", "frame", 2,
        sentence(
            "Forward kinematics rotates a joint's offset by the joint's own global rotation. That "
            "moves only the joint's children; its own offset is rotated by the parent's: "
            "x = x_parent + R_parent offset."
        ),
    ),
    Fault(
        "product reversed", "forward", "product", 1,
        sentence(
            "Forward kinematics multiplies rotations in the wrong order, R = Q R_parent. The "
            "parent's global rotation stands on the left: R = R_parent Q."
        ),
    ),
    Fault(
        "offset rotated backwards", "forward", "frame", 3,
        sentence(
            "Forward kinematics rotates offsets by the inverse of the parent's rotation, as a "
            "transposed matrix or q* v q does. It is q v q*: x = x_parent + R_parent offset."
        ),
    ),
    Fault(
        "local rotation conjugated", "forward", "product", 2,
        sentence(
            "Forward kinematics uses the inverse of every local rotation, as with a transposed "
            "matrix or a quaternion of the other handedness. It is R = R_parent Q, not its "
            "conjugate."
        ),
    ),
    Fault(
        "rotations not accumulated", "forward", "product", 3,
        sentence(
            "Forward kinematics takes each local rotation for the global one. Rotations add up "
            "along the chain: R = R_parent Q."
        ),
    ),
    Fault(
        "own rotation missing", "forward", "product", 4,
        sentence(
            "Forward kinematics gives a joint its parent's global rotation and leaves out its own "
            "local one: R = R_parent Q."
        ),
    ),
    Fault(
        "offset by the grandparent", "forward", "frame", 4,
        sentence(
            "Forward kinematics rotates a joint's offset by the rotation of the parent's parent: "
            "one joint too far up. It is x = x_parent + R_parent offset."
        ),
    ),
    Fault(
        "offset by the parent's local rotation", "forward", "frame", 5,
        sentence(
            "Forward kinematics rotates a joint's offset by the parent's local rotation. It takes "
            "the parent's global one: x = x_parent + R_parent offset."
        ),
    ),
    Fault(
        "offset by its own local rotation", "forward", "frame", 6,
        sentence(
            "Forward kinematics rotates a joint's offset by the joint's own local rotation. It "
            "takes the parent's global one: x = x_parent + R_parent offset."
        ),
    ),
    Fault(
        "positions from rest", "forward", "base", 1,
        sentence(
            "Forward kinematics adds the rotated offset to where the parent is at rest. It is "
            "added to where the parent is in this pose."
        ),
    ),
    Fault(
        "positions from the root", "forward", "base", 2,
        sentence(
            "Forward kinematics adds every rotated offset to the root's position. It is added to "
            "the parent's: positions add up along the chain."
        ),
    ),
    Fault(
        "root offset dropped", "forward", "root", 1,
        sentence(
            "Forward kinematics puts the root at the origin. The root's offset is its global "
            "position."
        ),
    ),
    Fault(
        "root rotation dropped", "forward", "root", 2,
        sentence(
            "Forward kinematics leaves out the root's own rotation. The root has no parent, but "
            "its local rotation counts: R_root = Q_root."
        ),
    ),
    Fault(
        "root offset rotated", "forward", "root", 3,
        sentence(
            "Forward kinematics rotates the root's offset by the root's own rotation. The root's "
            "offset is its global position as it stands."
        ),
    ),
    Fault(
        "parent by index", "forward", "parent", 1,
        sentence(
            "Forward kinematics takes the joint before in the list for the parent. That holds on "
            "a chain only; on a tree the parent is parents[j]."
        ),
    ),
    Fault(
        "xyzw read", "order", "numbers", 1,
        sentence(
            "Quaternions are read as x, y, z, w, but they come as w, x, y, z. Reorder the numbers "
            "where they come in."
        ),
    ),
    Fault(
        "xyzw throughout", "order", "numbers", 2,
        sentence(
            "Quaternions are read and written as x, y, z, w, but they come and go as w, x, y, z. "
            "Reorder the numbers where they come in and where they go out."
        ),
    ),
    Fault(
        "xyzw written", "order", "numbers", 3,
        sentence(
            "The answer's quaternions are written as x, y, z, w; they are expected as w, x, y, z. "
            "Reorder the numbers where they go out."
        ),
    ),
)  # fmt: skip
_CCD = (
    Fault(
        "world rotation on the left", "ccd", "applied", 1,
        sentence(
            "Your CCD multiplies the world rotation d onto the local one on the left, Q := d Q: "
            "the parent's inverse is missing. Use Q := conj(R_parent) d R_parent Q."
        ),
    ),
    Fault(
        "world rotation on the right", "ccd", "applied", 2,
        sentence(
            "Your CCD multiplies the world rotation d onto the local one on the right, Q := Q d, "
            "as if it were given in the joint's frame. Use Q := conj(R_parent) d R_parent Q."
        ),
    ),
    Fault(
        "conjugated in reverse", "ccd", "applied", 3,
        sentence(
            "Your CCD takes the world rotation d into the wrong frame, R_parent d conj(R_parent). "
            "The inverse stands on the left: Q := conj(R_parent) d R_parent Q."
        ),
    ),
    Fault(
        "conjugated by the joint, in reverse", "ccd", "applied", 5,
        sentence(
            "Your CCD applies R d conj(R) with the joint's own rotation R. A world rotation d "
            "comes into the parent's frame: Q := conj(R_parent) d R_parent Q."
        ),
    ),
    Fault(
        "given to the child", "ccd", "applied", 10,
        sentence(
            "Your CCD gives the rotation of a joint to its child, Q_child := d Q_child. The joint "
            "about which the arm is measured is the one to rotate: "
            "Q := conj(R_parent) d R_parent Q."
        ),
    ),
    Fault(
        "given to the child, in its frame", "ccd", "applied", 11,
        sentence(
            "Your CCD gives the rotation of a joint to its child, taken into the child's parent "
            "frame. The joint about which the arm is measured is the one to rotate: "
            "Q := conj(R_parent) d R_parent Q."
        ),
    ),
    Fault(
        "conjugated by the joint", "ccd", "applied", 4,
        sentence(
            "Your CCD takes the world rotation d into the joint's own frame, conj(R) d R, and "
            "multiplies it on the left. Either use the parent's, Q := conj(R_parent) d R_parent Q, "
            "or multiply on the right, Q := Q conj(R) d R."
        ),
    ),
    Fault(
        "global rotation stored as local", "ccd", "applied", 6,
        sentence(
            "Your CCD stores the new global rotation d R as the local one. Take the parent's out: "
            "Q := conj(R_parent) d R."
        ),
    ),
    Fault(
        "parent not put back", "ccd", "applied", 7,
        sentence(
            "Your CCD multiplies conj(R_parent) d onto the local rotation: R_parent is missing on "
            "the right of d. Use Q := conj(R_parent) d R_parent Q."
        ),
    ),
    Fault(
        "old rotation overwritten", "ccd", "applied", 8,
        sentence(
            "Your CCD replaces the local rotation by the world rotation d. The rotation is made "
            "on top of the old one: Q := conj(R_parent) d R_parent Q."
        ),
    ),
    Fault(
        "parent's frame, on the right", "ccd", "applied", 9,
        sentence(
            "Your CCD takes the world rotation into the parent's frame and then multiplies it on "
            "the right. It stands on the left: Q := conj(R_parent) d R_parent Q."
        ),
    ),
    Fault(
        "rotation inverted", "ccd", "angle", 1,
        sentence(
            "Your CCD rotates away from the target: the rotation goes from the target to the "
            "effector. Rotate from (effector - joint) to (target - joint)."
        ),
    ),
    Fault(
        "angle doubled", "ccd", "angle", 2,
        sentence(
            "Your CCD rotates by twice the angle. A quaternion takes half of it: "
            "(cos(angle/2), sin(angle/2) axis)."
        ),
    ),
    Fault(
        "angle halved", "ccd", "angle", 3,
        sentence(
            "Your CCD rotates each joint by half the angle. If that is no damping on purpose, "
            "halve the angle once only: (cos(angle/2), sin(angle/2) axis)."
        ),
        honest=True,
    ),
    Fault(
        "root to tip", "ccd", "order", 1,
        sentence(
            "Your CCD goes from the root to the effector. Most go from the effector's parent to "
            "the root, which converges sooner and bends the chain's end first."
        ),
        honest=True,
    ),
    Fault(
        "root left out", "ccd", "joints", 1,
        sentence(
            "Your CCD never rotates the root. The root keeps its position but rotates like every "
            "other joint; the loop ends one joint too early."
        ),
    ),
    Fault(
        "last joint left out", "ccd", "joints", 2,
        sentence(
            "Your CCD never rotates the effector's parent. The loop starts one joint too late: "
            "the first joint to rotate is the effector's parent."
        ),
    ),
    Fault(
        "joints not placed anew", "ccd", "update", 1,
        sentence(
            "Your CCD keeps the positions of the sweep's start: after each rotation the joints "
            "below, with the effector, have to be placed anew before the next joint rotates."
        ),
    ),
    Fault(
        "target from the origin", "ccd", "aim", 1,
        sentence(
            "Your CCD takes the target's position for the direction to it. The direction starts "
            "at the joint: target - joint."
        ),
    ),
    Fault(
        "effector from the origin", "ccd", "aim", 2,
        sentence(
            "Your CCD takes the effector's position for the direction to it. The direction starts "
            "at the joint: effector - joint."
        ),
    ),
    Fault(
        "target from the root", "ccd", "aim", 3,
        sentence(
            "Your CCD takes the target relative to the root. The target is a global position: "
            "the direction is target - joint, the root's position not added."
        ),
    ),
    Fault(
        "gap as direction", "ccd", "aim", 4,
        sentence(
            "Your CCD rotates towards target - effector. The effector is to come onto the line "
            "from the joint to the target: rotate from (effector - joint) to (target - joint)."
        ),
    ),
    Fault(
        "start ignored", "ccd", "start", 1,
        sentence(
            "Your CCD starts from the rest pose, all rotations identity, instead of the given "
            "local rotations."
        ),
    ),
    Fault(
        "last joint as effector", "ccd", "effector", 1,
        sentence(
            "Your CCD takes the last joint for the effector. The request names another: use "
            "the argument effector, and the path from the root to it."
        ),
    ),
)  # fmt: skip
_FABRIK = (
    Fault(
        "root not put back", "fabrik", "root", 1,
        sentence(
            "Your FABRIK does not put the root back before the forward pass, which then changes "
            "nothing, or it ends with the backward pass: the arm comes off its base."
        ),
    ),
    Fault(
        "root put to the origin", "fabrik", "root", 2,
        sentence(
            "Your FABRIK puts the root to the origin. It goes back to where it was: the root's "
            "offset is its global position."
        ),
    ),
    Fault(
        "next link's length", "fabrik", "lengths", 1,
        sentence(
            "Your FABRIK uses the length of the next link: an index is one too high. The link "
            "from a joint to its child has the length of the child's offset."
        ),
    ),
    Fault(
        "previous link's length", "fabrik", "lengths", 2,
        sentence(
            "Your FABRIK uses the length of the link before: an index is one too low. The link "
            "from a joint to its child has the length of the child's offset, not of its own."
        ),
    ),
    Fault(
        "lengths measured too late", "fabrik", "lengths", 3,
        sentence(
            "Your FABRIK measures a link's length after one of its ends has moved, so that "
            "lengths drift. Measure them once, before the first pass, or take the offsets'."
        ),
    ),
    Fault(
        "global directions as local rotations", "fabrik", "rotations", 1,
        sentence(
            "Your FABRIK makes local rotations from global directions: the parent's rotation is "
            "not taken out. Use Q := conj(R_parent) R, with R the new global rotation."
        ),
    ),
    Fault(
        "global arc on the left", "fabrik", "rotations", 2,
        sentence(
            "Your FABRIK multiplies the global rotation d of a link onto the local one on the "
            "left: the parent's inverse is missing. Use Q := conj(R_parent) d R_parent Q."
        ),
    ),
    Fault(
        "rotation given to the child", "fabrik", "rotations", 3,
        sentence(
            "Your FABRIK gives the rotation of a link to its lower joint. The joint at the link's "
            "upper end rotates it."
        ),
    ),
    Fault(
        "parents of the start", "fabrik", "rotations", 4,
        sentence(
            "Your FABRIK makes local rotations with the parents' rotations from before the solve. "
            "Go from the root to the effector and use each parent's new rotation."
        ),
    ),
    Fault(
        "no backward pass", "fabrik", "passes", 1,
        sentence(
            "Your FABRIK never pulls the effector onto the target: the backward pass is missing, "
            "or does not start from the target."
        ),
    ),
    Fault(
        "start ignored", "fabrik", "start", 1,
        sentence(
            "Your FABRIK starts from the rest pose, all rotations identity, instead of the given "
            "local rotations."
        ),
    ),
    Fault(
        "last joint as effector", "fabrik", "effector", 1,
        sentence(
            "Your FABRIK takes the last joint for the effector. The request names another: use "
            "the argument effector, and the path from the root to it."
        ),
    ),
)  # fmt: skip
_STOP = (
    Fault(
        "tolerance against the squared distance", "stop", "test", 1,
        sentence(
            "The squared distance is compared with the tolerance, so that the solve ends too "
            "soon. Compare the distance, or the squared distance with tolerance * tolerance."
        ),
    ),
    Fault(
        "tolerance squared", "stop", "test", 2,
        sentence(
            "The distance is compared with the tolerance's square, so that the solve ends too "
            "late or never. Compare the distance with the tolerance."
        ),
        honest=True,
    ),
    Fault(
        "stall test for the tolerance", "stop", "test", 3,
        sentence(
            "The solve ends when the distance changes by less than the tolerance. That is a test "
            "of a stall; compare the distance to the target with the tolerance."
        ),
    ),
    Fault(
        "tolerance grows", "stop", "test", 4,
        sentence(
            "The tolerance grows with every sweep, so that the solve ends too soon. Keep it as "
            "it is given."
        ),
    ),
    Fault(
        "one sweep more", "stop", "budget", 1,
        sentence(
            "It makes one sweep more than max_iterations: the count starts or ends off by one."
        ),
        honest=True,
    ),
    Fault(
        "one sweep less", "stop", "budget", 2,
        sentence(
            "It makes one sweep less than max_iterations: the count starts or ends off by one."
        ),
        honest=True,
    ),
    Fault(
        "a joint for a sweep", "stop", "budget", 3,
        sentence(
            "One of its iterations rotates a single joint. An iteration of CCD is a sweep over "
            "all joints, from the effector's parent to the root."
        ),
        honest=True,
    ),
)  # fmt: skip

_TRACK = (
    Fault(
        "frames start anew", "follow", "start", 1,
        sentence(
            "Every frame starts from the first pose. Start it from the frame before, and the "
            "joints do not jump."
        ),
        honest=True,
    ),
    Fault(
        "frames start at rest", "follow", "start", 2,
        sentence(
            "Every frame starts from the rest pose. Start the first from the given rotations and "
            "the others from the frame before."
        ),
    ),
    Fault(
        "one frame late", "follow", "aim", 1,
        sentence(
            "Every frame reaches for the target of the frame before: an index is one too low."
        ),
    ),
    Fault(
        "one frame early", "follow", "aim", 2,
        sentence(
            "Every frame reaches for the target of the frame after: an index is one too high."
        ),
    ),
)  # fmt: skip

# The faults that each method may have, the most frequent first.
FAULTS: dict[str, tuple[Fault, ...]] = {
    "forward": _FORWARD,
    "ccd": (*_CCD, *_FORWARD, *_STOP),
    "fabrik": (*_FABRIK, *_FORWARD, *_STOP[:-1]),
}
FAULTS |= {f"track {method}": (*_TRACK, *FAULTS[method]) for method in ("ccd", "fabrik")}


@cache
def by_key(method: str) -> dict[str, Fault]:
    """Return the faults of a method by their keys."""
    return {fault.key: fault for fault in FAULTS[method]}


def switches(faults: Sequence[Fault]) -> Switches:
    """Return the switches that faults set."""
    found = Switches()
    for fault in faults:
        part = getattr(found, fault.part)._replace(**{fault.switch: fault.number})
        found = found._replace(**{fault.part: part})
    return found


def combinations(method: str) -> Iterator[tuple[Fault, ...]]:
    """Yield none, each, every two and likely threes of a method's faults, of different switches."""
    faults = FAULTS[method]
    yield ()
    yield from ((fault,) for fault in faults)
    pairs = filter(_are_independent, itertools.combinations(faults, 2))
    if method.startswith("track "):  # what else is wrong shows in single solves
        yield from (pair for pair in pairs if pair[0].part == "follow")
        return
    yield from pairs
    yield from (three for three in itertools.combinations(faults, 3) if _is_likely(three))


def _are_independent(faults: Sequence[Fault]) -> bool:
    return len({(fault.part, fault.switch) for fault in faults}) == len(faults)


def _is_likely(three: Sequence[Fault]) -> bool:
    """Return whether a method's own rotations, another of its steps and its kinematics are wrong.

    These are the threes that real programs have; all of them are ten times as many.
    """
    own, other, kinematics = three
    return (
        own.switch in ("applied", "rotations")
        and other.part == own.part
        and kinematics.part in ("forward", "order")
        and _are_independent(three)
    )


def describe(method: str, keys: Sequence[str]) -> Sentence:
    """Return the sentences of a class of faults that no answer tells apart."""
    return either([list(_describe(method, key)) for key in keys])


def _describe(method: str, key: str) -> Iterator[Sentence]:
    if not key:
        yield sentence("It does what the textbook does.")
    yield from (by_key(method)[one].sentence for one in key.split(" + ") if one)
