"""Products, rotations and arcs of quaternions, with a switch for each known fault.

With every switch at 0 they are those of the reference's `quaternion.py`.
"""

import math
from typing import Any

from plumbob.reference.quaternion import (
    IDENTITY,
    add,
    between,
    conjugate,
    cross,
    dot,
    logarithm,
    magnitude,
    multiply,
    norm,
    normalised,
    rotate,
    rotation_about,
    scale,
    subtract,
)

from .switches import UNCAPPED, Switches

# Of `multiply`, from these numbers on each of the 16 terms a_i b_j has the wrong sign, and each
# component of a x b; of `cross`, from the last on each of the six terms.
FIRST_TERM, FIRST_COMPONENT, FIRST_CROSS_TERM = 5, 21, 5
# Of `rotate`, the first number of an element of a matrix that has the wrong sign.
FIRST_ELEMENT = 4
# Up to this number `angle` changes the angle of the right arc.
OF_THE_ARC = 3
DEGREE = math.pi / 180.0
# Of `angle`, the number of an angle that is 90 degrees throughout, the first with the sign of a
# component of the axis, the first of a rotation in a plane, and the first with a sine or a cosine
# of directions that are not unit.
QUARTER_TURN, SIGNED, IN_PLANE, UNEQUAL = 19, 21, 24, 27
# The first with the length of a cross product in it, as of a rotation vector's axis.
OF_VECTORS = 33


def product(a: Any, b: Any, faults: Switches) -> Any:
    """Return a b: reversed (1), w with a plus (2), by components (3), without a x b (4) ..."""
    k = faults.multiply
    if k == 0 and faults.cross == 0:
        return multiply(a, b)
    if k == 1:
        return multiply(b, a)
    if k == 3:
        return a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]
    w, x, y, z = multiply(a, b)
    if k == 2:
        return 2.0 * a[0] * b[0] - w, x, y, z
    if k >= FIRST_COMPONENT:
        c = k - FIRST_COMPONENT
        p, q, r = cross((a[1], a[2], a[3]), (b[1], b[2], b[3]))
        return w, x - 2.0 * p * (c == 0), y - 2.0 * q * (c == 1), z - 2.0 * r * (c == 2)
    if k >= FIRST_TERM:
        i, j = (k - FIRST_TERM) // 4, (k - FIRST_TERM) % 4
        is_negative = i > 0 and j > 0 and (i == j or (i - j) % 3 == 1)
        flip, c = (-2.0 if is_negative else 2.0) * a[i] * b[j], i ^ j
        return w - flip * (c == 0), x - flip * (c == 1), y - flip * (c == 2), z - flip * (c == 3)
    u, v = (a[1], a[2], a[3]), (b[1], b[2], b[3])
    x, y, z = add(scale(a[0], v), scale(b[0], u))
    if k != 4:
        x, y, z = add((x, y, z), cross_product(u, v, faults))
    return w, x, y, z


def cross_product(a: Any, b: Any, faults: Switches) -> Any:
    """Return a x b: negative (1), a component negative (2 to 4), or a term of a component."""
    x, y, z = cross(a, b)
    k = faults.cross
    if k == 1:
        return -x, -y, -z
    if k >= FIRST_CROSS_TERM:
        c, is_second = (k - FIRST_CROSS_TERM) // 2, (k - FIRST_CROSS_TERM) % 2
        i, j = (c + 1) % 3, (c + 2) % 3
        flip = -2.0 * a[j] * b[i] if is_second else 2.0 * a[i] * b[j]
        return x - flip * (c == 0), y - flip * (c == 1), z - flip * (c == 2)
    return (-x if k == 2 else x), (-y if k == 3 else y), (-z if k == 4 else z)


def inverse(q: Any, faults: Switches) -> Any:
    """Return q*: all four negative (1), none (2), only w (3), or x, y or z left as it is (4-6)."""
    w, x, y, z = q
    k = faults.inverse
    if k == 1:
        return -w, -x, -y, -z
    if k == 2:
        return w, x, y, z
    if k == 3:
        return -w, x, y, z
    return w, (x if k == 4 else -x), (y if k == 5 else -y), (z if k == 6 else -z)


def rotated(q: Any, v: Any, faults: Switches) -> Any:
    """Return the vector v rotated by q; or the vector part of q v (1), or rotated back (2).

    Or by a matrix without its factors of 2 (3), or with a wrong sign in one element (4 to 9).
    """
    if faults.rotate == 2:
        return rotate(conjugate(q), v)
    if faults.rotate > 2:
        return by_matrix(q, v, faults.rotate)
    if faults.rotate == 0 and faults.rotating == 0:
        if faults.cross == 0:
            return rotate(q, v)
        u = (q[1], q[2], q[3])
        t = scale(2.0, cross_product(u, v, faults))
        return add(add(v, scale(q[0], t)), cross_product(u, t, faults))
    pure = (0.0, v[0], v[1], v[2])
    if faults.rotate == 1:
        _, x, y, z = product(q, pure, faults)
    elif faults.rotating == 1:
        _, x, y, z = product(product(q, pure, faults), inverse(q, faults), faults)
    else:
        _, x, y, z = product(q, product(pure, inverse(q, faults), faults), faults)
    return x, y, z


def by_matrix(q: Any, v: Any, k: int) -> Any:
    """Return a vector times the matrix of q, wrong by the number of `rotate`."""
    u, right = (q[1], q[2], q[3]), rotate(q, v)
    if k == 3:
        return scale(0.5, add(v, right))
    row, is_second = (k - FIRST_ELEMENT) // 2, (k - FIRST_ELEMENT) % 2
    column = (row + 2 - is_second) % 3
    sign = -1.0 if is_second else 1.0  # of 2 w u in the element of row and column
    flip = -4.0 * q[0] * sign * u[3 - row - column] * v[column]
    x, y, z = right
    return x + flip * (row == 0), y + flip * (row == 1), z + flip * (row == 2)


def made_unit(q: Any) -> Any:
    """Return a quaternion of length 1; zero, or without a length, as it is."""
    length = magnitude(q)
    return normalised(q) if 0.0 < length < math.inf else q


def arc(a: Any, b: Any, faults: Switches) -> Any:
    """Return the shortest rotation from the direction of a to that of b."""
    if faults.angle <= OF_THE_ARC and faults.cross == 0:
        return damped(between(a, b), faults)
    length_a, length_b = norm(a), norm(b)
    if length_a == 0.0 or length_b == 0.0:
        return IDENTITY
    unit_a, unit_b = scale(1.0 / length_a, a), scale(1.0 / length_b, b)
    across = cross_product(unit_a, unit_b, faults)
    sine = norm(across)
    if sine == 0.0:
        return IDENTITY
    axis, cosine = scale(1.0 / sine, across), dot(unit_a, unit_b)
    if faults.angle <= OF_THE_ARC:
        return damped(rotation_about(axis, arc_cosine(cosine)), faults)
    return wrong_arc(a, b, axis, sine, cosine, faults.angle)


def arc_cosine(number: float) -> float:
    """Return the arc cosine of a number, clamped to [-1, 1]."""
    return math.acos(max(-1.0, min(1.0, number)))


def wrong_arc(a: Any, b: Any, axis: Any, sine: float, cosine: float, k: int) -> Any:
    """Return an arc with a wrong angle (4 to 10), or wrong numbers."""
    angle, raw = arc_cosine(cosine), norm(a) * norm(b)
    angles = (
        math.asin(min(1.0, sine)), angle / DEGREE, angle * DEGREE, arc_cosine(raw * cosine),
        arc_cosine(norm(b) * cosine), arc_cosine(norm(a) * cosine), sine,
    )  # fmt: skip
    if k - OF_THE_ARC <= len(angles):
        return rotation_about(axis, angles[k - OF_THE_ARC - 1])
    c, s = math.cos(0.5 * angle), math.sin(0.5 * angle)
    root = arc_cosine(raw * cosine)
    numbers = (
        (c, s * sine), (c, s * sine * raw), (c, math.sin(angle)), (math.cos(angle), s), (s, c),
        (1.0 + raw * cosine, raw * sine), (raw * raw + raw * cosine, raw * sine),
        (math.cos(0.5 * root), math.sin(0.5 * root) * sine * raw),
    )  # fmt: skip
    if k >= QUARTER_TURN:
        return other_arc(a, b, axis, angle, k)
    w, length = numbers[k - OF_THE_ARC - 1 - len(angles)]
    x, y, z = scale(length, axis)
    return (w, x, y, z) if k < 16 or k == 18 else made_unit((w, x, y, z))


def other_arc(a: Any, b: Any, axis: Any, angle: float, k: int) -> Any:
    """Return a quarter turn (19), an arc of whole degrees (20), or of another sign or axis.

    The sign is that of the axis' x, y or z (21 to 23); about z, x or y alone (24 to 26) the angle
    is the difference of two polar angles. The sine (27 to 29) or the cosine (30 to 32) has in it
    the length of the first vector, of the second or of both. Or the angle is multiplied by the sine
    (33), or by the length of the cross product (34).
    """
    if k >= OF_VECTORS:
        length = norm(a) * norm(b) if k > OF_VECTORS else 1.0
        return rotation_about(axis, angle * math.sin(angle) * length)
    if k >= UNEQUAL:
        lengths = (norm(a), norm(b), norm(a) * norm(b))
        length, is_sine = lengths[(k - UNEQUAL) % 3], k < UNEQUAL + 3
        sine, cosine = math.sin(angle), math.cos(angle)
        ratio = length if is_sine else 1.0 / length
        return rotation_about(axis, math.atan2(ratio * sine, cosine))
    if k >= IN_PLANE:
        i = k - IN_PLANE
        j, m = (i + 1) % 3, (i + 2) % 3
        angle = math.atan2(b[j], b[i]) - math.atan2(a[j], a[i])
        return rotation_about((1.0 * (m == 0), 1.0 * (m == 1), 1.0 * (m == 2)), angle)
    if k >= SIGNED:
        return rotation_about(axis, math.copysign(angle, axis[k - SIGNED]))
    degrees = math.floor(angle / DEGREE)
    return rotation_about(axis, 0.5 * math.pi if k == QUARTER_TURN else degrees * DEGREE)


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


def pulled(fixed: Any, moved: Any, length: float, fault: int) -> Any:
    """Return the point at a distance from a fixed one, on the line to another.

    Faulty: as far from the other (1), the ratio upside down (2), on the other side (3), without the
    division by the distance (4).
    """
    direction = subtract(moved, fixed)
    distance = norm(direction)
    if distance == 0.0 or (fault == 2 and length == 0.0):
        return moved
    ratio = length / distance
    if fault == 1:
        return subtract(moved, scale(ratio, direction))
    if fault == 2:
        ratio = distance / length
    elif fault == 3:
        ratio = -ratio
    elif fault == 4:
        ratio = length
    return add(fixed, scale(ratio, direction))
