"""The tolerances of the cross-checks, each with the reason for its size."""

from typing import NamedTuple


class Tolerance(NamedTuple):
    """The largest difference allowed between two correct results, and the reason for it."""

    value: float  # relative to the scale of the comparison
    reason: str


POSITION = Tolerance(
    1e-13,
    "of the reach: each joint adds a few roundings of 1e-16 of the reach, 50 joints about 1e-14 "
    "if none cancel, and quaternions and matrices round differently",
)
ROTATION = Tolerance(
    1e-13,
    "of one: each joint adds a few roundings of 1e-16, 50 joints about 1e-14 if none cancel, and "
    "one engine converts matrices to quaternions",
)
JACOBIAN = Tolerance(
    1e-13,
    "of the extent of the links, and of one radian: an axis and an arm are off by a few "
    "roundings of 1e-16 a joint, as poses are, and their product by both",
)
FORCE = Tolerance(
    1e-12,
    "of the largest force: a length is rounded by 1e-16 of the coordinates, up to a thousand "
    "times its difference from the rest length",
)
ENERGY = Tolerance(
    1e-13,
    "of the sum of all its terms' magnitudes: a few hundred roundings of 1e-16, added in another "
    "order",
)
STEP = Tolerance(
    1e-12,
    "of the largest coordinate and velocity: velocities are differences of positions over h, and "
    "1e-16 of a coordinate over 1/240 s is 1e-13 of them; a linear solve adds as much",
)
BALANCE = Tolerance(
    1e-12,
    "of |M (x - y)| + h² sum |spring force|: x is rounded by 1e-16 of the coordinates, and a step "
    "of 1/240 s moves it by a thousandth of them, which leaves 1e-13",
)
STIFFNESS = Tolerance(
    5e-11,
    "of the largest: differences of forces over steps of 5e-4 carry the rounding of lengths, 1e-16 "
    "of the coordinates, two thousand times over; short springs add as much by their curvature",
)
MOTION = Tolerance(
    1e-12,
    "of the largest coordinate and velocity: each of up to 2,000 steps adds a rounding of 1e-16, "
    "and dampers keep neighbouring motions from parting further than that",
)
LINE = Tolerance(
    1e-11,
    "of the largest coordinate and velocity: in each of 100 steps a velocity is a difference of "
    "positions of up to 30 m over 1/60 s, and dampers forget all but the last of them",
)
REST = Tolerance(
    1e-12,
    "of the largest coordinate: forces are rounded by 1e-16 of stiffness times coordinate, and "
    "the softest mode is a thousand times as soft as a spring",
)
MOMENTUM = Tolerance(
    5e-12,
    "of the sum of all magnitudes: each step of implicit Euler leaves rounding of the coordinates, "
    "1e-16, divided by its length of 2e-4 s",
)
DECAY = Tolerance(
    1e-12,
    "of what is left of the energy: each of 40 steps rounds it by a few 1e-16, solved or not",
)
ORDER = Tolerance(
    0.1,
    "of one order: at h omega of 0.04 the next term of the error is a few hundredths of the first",
)
