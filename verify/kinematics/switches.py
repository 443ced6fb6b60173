"""The switches of the textbook's solvers: a number for each rule, 0 if it is right."""

import itertools
from typing import NamedTuple

UNCAPPED = 10.0  # an angle that no rotation has [rad]


class Switches(NamedTuple):
    """The number of the fault in each rule of a solver; 0 is right."""

    numbers: int = 0  # the order of a quaternion's numbers
    angles: int = 0  # quaternions through Euler angles in degrees, or their numbers as such angles
    euler: int = 0  # the orders in which rotations are split and put together
    multiply: int = 0  # the product of two quaternions
    cross: int = 0  # the product of two vectors
    inverse: int = 0  # of a quaternion
    rotate: int = 0  # a vector by a quaternion
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
    tip: int = 0  # how the effector follows: it is placed anew (0), rotated (1), or in frames
    spin: int = 0  # what rotates with a joint, and about which point
    offsets: int = 0  # what becomes of a child's offset
    dropped: int = 0  # which angle is too small to rotate by
    small: int = 0  # what a small angle ends, or is raised to
    returned: int = 0  # which positions are returned; FABRIK: its points, or (1) the placed joints
    stretch: int = 0  # FABRIK: when a chain is stretched instead of solved, and where to
    passes: int = 0  # which passes there are
    loop: int = 0  # which links a pass leaves out
    stale: int = 0  # which points of before the pass are used
    base_joint: int = 0  # where the root goes back to
    end: int = 0  # where the effector is put
    lengths: int = 0  # of links
    pull: int = 0  # where a point comes on a line
    link: int = 0  # the direction that a joint is rotated to
    rotations: int = 0  # that positions stand for
    start: int = 0  # of either: from the rest pose
    effector: int = 0  # the last joint
    test: int = 0  # the end of a solve: what is compared with the tolerance
    budget: int = 0  # how many sweeps are allowed
    frame_start: int = 0  # following a curve: where a frame starts
    frame_target: int = 0  # which target a frame has
    frame_solved: int = 0  # which frames are solved, and whether they share the iterations
    frame_saved: int = 0  # which pose a frame gets
    # Choices of right programs, which only show beside a fault.
    rotating: int = 0  # a vector is rotated by cross products, by (q v) q* (1) or by q (v q*) (2)
    grouping: int = 0  # ((P* d) P) Q, P* (d R), (P* d) R, (P* (d P)) Q or Q ((R* d) R)
    converted: int = 0  # FABRIK: points become rotations at the end (0), or after each sweep (1)
    unit: int = 0  # local rotations are made unit (0), none (1), or global ones too (2)
    rule: int = 0  # FABRIK: the direction of a link from which its joint is rotated
    # from new local ones (0), kept as they are made (1), or all below a joint rotate with it (2)
    global_rotations: int = 0
    # What honest solvers do to a rotation of CCD: scale its angle, then cap it [rad].
    gain: float = 1.0
    cap: float = UNCAPPED


# The orders in which a rotation is split into Euler angles, and put together: X, Y and Z in another
# order, or with an axis twice in the reverse one. As in SciPy, small letters are extrinsic orders.
EULER_ORDERS = (
    *itertools.permutations(map("".join, itertools.permutations("XYZ")), 2),
    *((f"{a}{b}{a}", f"{a}{b}{a}".lower()) for a, b in itertools.permutations("XYZ", 2)),
)


# The orders of Euler angles that are given in degrees, or of which a quaternion has the numbers.
ANGLES = tuple(
    (order, is_degrees)
    for is_degrees in (True, False)
    for order in map("".join, itertools.permutations("XYZ"))
)
