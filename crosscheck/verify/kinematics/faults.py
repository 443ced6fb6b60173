"""The faults that solvers of kinematics are known to have, and their combinations.

Those that real programs were found to have come first. A fault is one number of one switch of
`textbook.py`.
"""

import itertools
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple

from ..explain import either
from ..sentence import Sentence, sentence
from .textbook import Switches

__all__ = ["FAULTS", "Fault", "Switches", "by_key", "combinations", "describe", "switches"]


class Fault(NamedTuple):
    """A number of a switch."""

    part: str  # the table that it is in: "forward", "ccd", "fabrik", "stop" or "follow"
    key: str  # its short name
    switch: str  # the field of Switches
    number: int  # what the switch is set to
    sentence: Sentence  # what is wrong and what it should be
    honest: bool = False  # a solver may be so on purpose: its answers still obey every law


def _table(part: str, rows: Sequence[tuple[Any, ...]]) -> tuple[Fault, ...]:
    """Return faults from rows of the other attributes."""
    return tuple(Fault(part, *row) for row in rows)


_FORWARD = _table("forward", (
    ("offset not rotated", "frame", 1, sentence(
        "Forward kinematics adds a joint's offset to its parent's position without rotating it. "
        "The offset is given in the parent's frame: x = x_parent + R_parent offset.")),
    ("own rotation on own offset", "frame", 2, sentence(
        "Forward kinematics rotates a joint's offset by the joint's own global rotation. That "
        "moves only the joint's children; its own offset is rotated by the parent's: x = x_parent "
        "+ R_parent offset.")),
    ("product reversed", "product", 1, sentence(
        "Forward kinematics multiplies rotations in the wrong order, R = Q R_parent. The parent's "
        "global rotation stands on the left: R = R_parent Q.")),
    ("offset rotated backwards", "frame", 3, sentence(
        "Forward kinematics rotates offsets by the inverse of the parent's rotation, as a "
        "transposed matrix or q* v q does. It is q v q*: x = x_parent + R_parent offset.")),
    ("local rotation conjugated", "product", 2, sentence(
        "Forward kinematics uses the inverse of every local rotation, as with a transposed matrix "
        "or a quaternion of the other handedness. It is R = R_parent Q, not its conjugate.")),
    ("rotations not accumulated", "product", 3, sentence(
        "Forward kinematics takes each local rotation for the global one. Rotations add up along "
        "the chain: R = R_parent Q.")),
    ("own rotation missing", "product", 4, sentence(
        "Forward kinematics gives a joint its parent's global rotation and leaves out its own "
        "local one: R = R_parent Q.")),
    ("offset by the grandparent", "frame", 4, sentence(
        "Forward kinematics rotates a joint's offset by the rotation of the parent's parent: one "
        "joint too far up. It is x = x_parent + R_parent offset.")),
    ("offset by the parent's local rotation", "frame", 5, sentence(
        "Forward kinematics rotates a joint's offset by the parent's local rotation. It takes the "
        "parent's global one: x = x_parent + R_parent offset.")),
    ("offset by its own local rotation", "frame", 6, sentence(
        "Forward kinematics rotates a joint's offset by the joint's own local rotation. It takes "
        "the parent's global one: x = x_parent + R_parent offset.")),
    ("positions from rest", "base", 1, sentence(
        "Forward kinematics adds the rotated offset to where the parent is at rest. It is added "
        "to where the parent is in this pose.")),
    ("positions from the root", "base", 2, sentence(
        "Forward kinematics adds every rotated offset to the root's position. It is added to the "
        "parent's: positions add up along the chain.")),
    ("root offset dropped", "root", 1, sentence(
        "Forward kinematics puts the root at the origin. The root's offset is its global "
        "position.")),
    ("root rotation dropped", "root", 2, sentence(
        "Forward kinematics leaves out the root's own rotation. The root has no parent, but its "
        "local rotation counts: R_root = Q_root.")),
    ("root offset rotated", "root", 3, sentence(
        "Forward kinematics rotates the root's offset by the root's own rotation. The root's "
        "offset is its global position as it stands.")),
    ("parent by index", "parent", 1, sentence(
        "Forward kinematics takes the joint before in the list for the parent. That holds on a "
        "chain only; on a tree the parent is parents[j].")),
    ("xyzw read", "numbers", 1, sentence(
        "Quaternions are read as x, y, z, w, but they come as w, x, y, z. Reorder the numbers "
        "where they come in.")),
    ("xyzw throughout", "numbers", 2, sentence(
        "Quaternions are read and written as x, y, z, w, but they come and go as w, x, y, z. "
        "Reorder the numbers where they come in and where they go out.")),
    ("xyzw written", "numbers", 3, sentence(
        "The answer's quaternions are written as x, y, z, w; they are expected as w, x, y, z. "
        "Reorder the numbers where they go out.")),
))  # fmt: skip
_CCD = _table("ccd", (
    ("world rotation on the left", "applied", 1, sentence(
        "Your CCD multiplies the world rotation d onto the local one on the left, Q := d Q: the "
        "parent's inverse is missing. Use Q := conj(R_parent) d R_parent Q.")),
    ("world rotation on the right", "applied", 2, sentence(
        "Your CCD multiplies the world rotation d onto the local one on the right, Q := Q d, as "
        "if it were given in the joint's frame. Use Q := conj(R_parent) d R_parent Q.")),
    ("conjugated in reverse", "applied", 3, sentence(
        "Your CCD takes the world rotation d into the wrong frame, R_parent d conj(R_parent). The "
        "inverse stands on the left: Q := conj(R_parent) d R_parent Q.")),
    ("conjugated by the joint, in reverse", "applied", 5, sentence(
        "Your CCD applies R d conj(R) with the joint's own rotation R. A world rotation d comes "
        "into the parent's frame: Q := conj(R_parent) d R_parent Q.")),
    ("given to the child", "applied", 10, sentence(
        "Your CCD gives the rotation of a joint to its child, Q_child := d Q_child. The joint "
        "about which the arm is measured is the one to rotate: Q := conj(R_parent) d R_parent Q.")),
    ("given to the child, in its frame", "applied", 11, sentence(
        "Your CCD gives the rotation of a joint to its child, taken into the child's parent "
        "frame. The joint about which the arm is measured is the one to rotate: Q := "
        "conj(R_parent) d R_parent Q.")),
    ("conjugated by the joint", "applied", 4, sentence(
        "Your CCD takes the world rotation d into the joint's own frame, conj(R) d R, and "
        "multiplies it on the left. Either use the parent's, Q := conj(R_parent) d R_parent Q, or "
        "multiply on the right, Q := Q conj(R) d R.")),
    ("global rotation stored as local", "applied", 6, sentence(
        "Your CCD stores the new global rotation d R as the local one. Take the parent's out: Q "
        ":= conj(R_parent) d R.")),
    ("parent not put back", "applied", 7, sentence(
        "Your CCD multiplies conj(R_parent) d onto the local rotation: R_parent is missing on the "
        "right of d. Use Q := conj(R_parent) d R_parent Q.")),
    ("old rotation overwritten", "applied", 8, sentence(
        "Your CCD replaces the local rotation by the world rotation d. The rotation is made on "
        "top of the old one: Q := conj(R_parent) d R_parent Q.")),
    ("parent's frame, on the right", "applied", 9, sentence(
        "Your CCD takes the world rotation into the parent's frame and then multiplies it on the "
        "right. It stands on the left: Q := conj(R_parent) d R_parent Q.")),
    ("rotation inverted", "angle", 1, sentence(
        "Your CCD rotates away from the target: the rotation goes from the target to the "
        "effector. Rotate from (effector - joint) to (target - joint).")),
    ("angle doubled", "angle", 2, sentence(
        "Your CCD rotates by twice the angle. A quaternion takes half of it: (cos(angle/2), "
        "sin(angle/2) axis).")),
    ("angle halved", "angle", 3, sentence(
        "Your CCD rotates each joint by half the angle. If that is no damping on purpose, halve "
        "the angle once only: (cos(angle/2), sin(angle/2) axis)."), True),
    ("root to tip", "order", 1, sentence(
        "Your CCD goes from the root to the effector. Most go from the effector's parent to the "
        "root, which converges sooner and bends the chain's end first."), True),
    ("root left out", "joints", 1, sentence(
        "Your CCD never rotates the root. The root keeps its position but rotates like every "
        "other joint; the loop ends one joint too early.")),
    ("last joint left out", "joints", 2, sentence(
        "Your CCD never rotates the effector's parent. The loop starts one joint too late: the "
        "first joint to rotate is the effector's parent.")),
    ("joints not placed anew", "update", 1, sentence(
        "Your CCD keeps the positions of the sweep's start: after each rotation the joints below, "
        "with the effector, have to be placed anew before the next joint rotates.")),
    ("target from the origin", "aim", 1, sentence(
        "Your CCD takes the target's position for the direction to it. The direction starts at "
        "the joint: target - joint.")),
    ("effector from the origin", "aim", 2, sentence(
        "Your CCD takes the effector's position for the direction to it. The direction starts at "
        "the joint: effector - joint.")),
    ("target from the root", "aim", 3, sentence(
        "Your CCD takes the target relative to the root. The target is a global position: the "
        "direction is target - joint, the root's position not added.")),
    ("gap as direction", "aim", 4, sentence(
        "Your CCD rotates towards target - effector. The effector is to come onto the line from "
        "the joint to the target: rotate from (effector - joint) to (target - joint).")),
    ("start ignored", "start", 1, sentence(
        "Your CCD starts from the rest pose, all rotations identity, instead of the given local "
        "rotations.")),
    ("last joint as effector", "effector", 1, sentence(
        "Your CCD takes the last joint for the effector. The request names another: use the "
        "argument effector, and the path from the root to it.")),
))  # fmt: skip
_FABRIK = _table("fabrik", (
    ("root not put back", "base_joint", 1, sentence(
        "Your FABRIK does not put the root back before the forward pass, which then changes "
        "nothing, or it ends with the backward pass: the arm comes off its base.")),
    ("root put to the origin", "base_joint", 2, sentence(
        "Your FABRIK puts the root to the origin. It goes back to where it was: the root's offset "
        "is its global position.")),
    ("next link's length", "lengths", 1, sentence(
        "Your FABRIK uses the length of the next link: an index is one too high. The link from a "
        "joint to its child has the length of the child's offset.")),
    ("previous link's length", "lengths", 2, sentence(
        "Your FABRIK uses the length of the link before: an index is one too low. The link from a "
        "joint to its child has the length of the child's offset, not of its own.")),
    ("lengths measured too late", "lengths", 3, sentence(
        "Your FABRIK measures a link's length after one of its ends has moved, so that lengths "
        "drift. Measure them once, before the first pass, or take the offsets'.")),
    ("global directions as local rotations", "rotations", 1, sentence(
        "Your FABRIK makes local rotations from global directions: the parent's rotation is not "
        "taken out. Use Q := conj(R_parent) R, with R the new global rotation.")),
    ("global arc on the left", "rotations", 2, sentence(
        "Your FABRIK multiplies the global rotation d of a link onto the local one on the left: "
        "the parent's inverse is missing. Use Q := conj(R_parent) d R_parent Q.")),
    ("rotation given to the child", "rotations", 3, sentence(
        "Your FABRIK gives the rotation of a link to its lower joint. The joint at the link's "
        "upper end rotates it.")),
    ("parents of the start", "rotations", 4, sentence(
        "Your FABRIK makes local rotations with the parents' rotations from before the solve. Go "
        "from the root to the effector and use each parent's new rotation.")),
    ("no backward pass", "passes", 1, sentence(
        "Your FABRIK never pulls the effector onto the target: the backward pass is missing, or "
        "does not start from the target.")),
    ("start ignored", "start", 1, sentence(
        "Your FABRIK starts from the rest pose, all rotations identity, instead of the given "
        "local rotations.")),
    ("last joint as effector", "effector", 1, sentence(
        "Your FABRIK takes the last joint for the effector. The request names another: use the "
        "argument effector, and the path from the root to it.")),
))  # fmt: skip
_STOP = _table("stop", (
    ("tolerance against the squared distance", "test", 1, sentence(
        "The squared distance is compared with the tolerance, so that the solve ends too soon. "
        "Compare the distance, or the squared distance with tolerance * tolerance.")),
    ("tolerance squared", "test", 2, sentence(
        "The distance is compared with the tolerance's square, so that the solve ends too late or "
        "never. Compare the distance with the tolerance."), True),
    ("stall test for the tolerance", "test", 3, sentence(
        "The solve ends when the distance changes by less than the tolerance. That is a test of a "
        "stall; compare the distance to the target with the tolerance.")),
    ("tolerance grows", "test", 4, sentence(
        "The tolerance grows with every sweep, so that the solve ends too soon. Keep it as it is "
        "given.")),
    ("one sweep more", "budget", 1, sentence(
        "It makes one sweep more than max_iterations: the count starts or ends off by one."), True),
    ("one sweep less", "budget", 2, sentence(
        "It makes one sweep less than max_iterations: the count starts or ends off by one."), True),
    ("a joint for a sweep", "budget", 3, sentence(
        "One of its iterations rotates a single joint. An iteration of CCD is a sweep over all "
        "joints, from the effector's parent to the root."), True),
))  # fmt: skip
_TRACK = _table("follow", (
    ("frames start anew", "frame_start", 1, sentence(
        "Every frame starts from the first pose. Start it from the frame before, and the joints "
        "do not jump."), True),
    ("frames start at rest", "frame_start", 2, sentence(
        "Every frame starts from the rest pose. Start the first from the given rotations and the "
        "others from the frame before.")),
    ("one frame late", "frame_target", 1, sentence(
        "Every frame reaches for the target of the frame before: an index is one too low.")),
    ("one frame early", "frame_target", 2, sentence(
        "Every frame reaches for the target of the frame after: an index is one too high.")),
))  # fmt: skip

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
    return Switches(**{fault.switch: fault.number for fault in faults})


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
    yield from filter(_is_likely, itertools.combinations(faults, 3))


def _are_independent(faults: Sequence[Fault]) -> bool:
    return len({fault.switch for fault in faults}) == len(faults)


def _is_likely(three: Sequence[Fault]) -> bool:
    """Return whether a method's own rotations, another of its steps and its kinematics are wrong.

    These are the threes that real programs have; all of them are ten times as many.
    """
    own, other, kinematics = three
    return (
        own.switch in ("applied", "rotations")
        and other.part == own.part
        and kinematics.part == "forward"
        and _are_independent(three)
    )


def describe(method: str, keys: Sequence[str]) -> Sentence:
    """Return the sentences of a class of faults that no answer tells apart."""
    return either([_sentences(method, key) for key in keys])


def _sentences(method: str, key: str) -> list[Sentence]:
    if not key:
        return [sentence("It does what the textbook does.")]
    return [by_key(method)[name].sentence for name in key.split(" + ")]
