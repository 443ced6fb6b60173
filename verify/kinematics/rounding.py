"""Bounds of rounding errors in kinematics: the work done times an ulp of the size."""

# Rotating an offset and adding it rounds about ten times; products of unit quaternions as often.
# Inputs rounded to the solver's precision add as much again.
ROUNDINGS_A_JOINT = 16.0
# Rotations with a length error e stretch what they rotate by up to this times e at every joint.
STRETCH = 4.0
# Rounding alone takes thousands of products in single precision to a length error of this size. A
# quaternion with a larger error was never made unit, and is judged unchanged.
LARGEST_DRIFT = 1e-3
# Helpers for a rotation between two directions return the identity below about sqrt(epsilon): 5e-4
# rad in single precision, 1.5e-8 in double precision. Students' own helpers often test the cross
# product against 1e-6.
DEAD_ANGLE = {"single": 5e-4, "double": 1e-6}
# A solver without rotations below the dead angle comes to rest about a reach times this angle from
# its target. On a nearly straight chain the distance is larger.
STALL = {"single": 4e-3, "double": 1e-5}
# Rotations by arc cosine and sine lose digits near 0 and pi. The cases of single sweeps keep a
# distance of 0.1 rad from both, where the loss is a factor of ten.
SWEEP_ROUNDINGS = 10.0 * ROUNDINGS_A_JOINT


def positions(epsilon: float, joints: int, size: float, drift: float = 0.0) -> float:
    """Return how far rounding moves a joint [m] if rotations are off unit length by `drift`."""
    return joints * (ROUNDINGS_A_JOINT * epsilon + STRETCH * min(drift, LARGEST_DRIFT)) * size


def rotations(epsilon: float, joints: int) -> float:
    """Return the angle by which rounding rotates a joint [rad]."""
    return ROUNDINGS_A_JOINT * joints * epsilon


def lengths(epsilon: float, joints: int, sweeps: int) -> float:
    """Return how far rounding takes quaternions from unit length if none is made unit.

    A sweep multiplies the rotation of each joint by a product of up to `joints` quaternions. The
    roundings of single sweeps add up over all sweeps, at worst with equal signs. Reversed products
    with global rotations enlarge an error in every sweep: such a drift is no rounding any more.
    """
    return min(joints * sweeps * rotations(epsilon, joints), LARGEST_DRIFT)


def repeats(epsilon: float, size: float) -> float:
    """Return how far two answers to a request may differ: threads may add up in another order."""
    return ROUNDINGS_A_JOINT * epsilon * max(size, 1.0)


def sweep(epsilon: float, joints: int, size: float, amplification: float) -> float:
    """Return how far rounding moves a joint in a sweep that enlarges small changes [m]."""
    return SWEEP_ROUNDINGS * joints * epsilon * size * max(1.0, amplification)
