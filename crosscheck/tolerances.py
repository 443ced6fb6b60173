"""Every tolerance of the cross-checks once, with the reason for its size."""

from typing import NamedTuple


class Tolerance(NamedTuple):
    """The largest difference that two right answers may show, and why it is no smaller.

    Attributes:
        value: relative to the scale that the claim names.
        reason: a sentence.
    """

    value: float
    reason: str


POSITION = Tolerance(
    1e-13,
    "of the reach: each joint adds a few roundings of 1e-16 of the reach, 50 joints about 1e-14 "
    "if none cancel, and quaternions and matrices round differently",
)
ROTATION = Tolerance(
    1e-13,
    "of one: each joint adds a few roundings of 1e-16, 50 joints about 1e-14 if none cancel, and "
    "one engine turns matrices back into quaternions",
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
    1e-11,
    "of |M (x - y)| + h² sum |spring force|: x is rounded by 1e-16 of the coordinates, and a step "
    "of 1/240 s under soft springs moves it by a ten-thousandth of them, which leaves 1e-12",
)
