"""Unit quaternions and vectors as tuples of components: the algebra inside the kernels.

Hamilton product, (w, x, y, z), active: `rotate(q, v)` rotates v by q, and `multiply(a, b)` rotates
by b, then by a. The components may be floats or arrays of a common shape; `between`, `exponential`
and `logarithm` branch on values and take floats. See `rotation.py` for arrays of quaternions.
"""

import math

IDENTITY = (1.0, 0.0, 0.0, 0.0)

# Below this the sine of half the angle is its argument to the last bit: x - x^3/6 rounds to x.
SMALL_ANGLE = 1e-8
# Below this square of an angle, of up to pi/4, the series of sine and cosine take less time than
# the library's functions.
SHORT = 0.62
# Below this |a| |b| + a.b, over |a| |b|, has lost some digits: |a + b| is 0.14 then, over |a|.
NEARLY_OPPOSITE = 1e-2
# Below this the product of two lengths has lost some.
TINY = 1e-140
# How far from unit length a quaternion in an argument may be.
UNIT_TOLERANCE = 1e-6


def load_quaternion(q, j, k=0):
    """Return row j of an array (joint, 4), or four entries from the k-th on, as a tuple."""
    return q[j, k], q[j, k + 1], q[j, k + 2], q[j, k + 3]


def load_vector(p, j, k=0):
    """Return row j of an array (joint, 3), or three entries from the k-th on, as a tuple."""
    return p[j, k], p[j, k + 1], p[j, k + 2]


def store_quaternion(q, j, quaternion):
    """Write a tuple into row j of an array (joint, 4)."""
    q[j, 0], q[j, 1], q[j, 2], q[j, 3] = quaternion


def store_vector(p, j, vector):
    """Write a tuple into row j of an array (joint, 3)."""
    p[j, 0], p[j, 1], p[j, 2] = vector


def load_quaternion_from(q, k):
    """Return four entries of an array from the k-th on, as a tuple."""
    return q[k], q[k + 1], q[k + 2], q[k + 3]


def store_quaternion_to(q, k, quaternion):
    """Write a tuple into four entries of an array from the k-th on."""
    q[k], q[k + 1], q[k + 2], q[k + 3] = quaternion


def add(a, b):
    """Return the sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def subtract(a, b):
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scale(s, a):
    """Return the vector s a."""
    return s * a[0], s * a[1], s * a[2]


def dot(a, b):
    """Return the scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    """Return the vector product of two vectors."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a):
    """Return the length of a vector of floats."""
    return math.sqrt(dot(a, a))


def multiply(a, b):
    """Return the Hamilton product a b."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def conjugate(q):
    """Return the inverse of a unit quaternion."""
    return q[0], -q[1], -q[2], -q[3]


def rotate(q, v):
    """Return q v q*: with u the vector part, v + w t + u x t where t = 2 u x v."""
    w, x, y, z = q
    vx, vy, vz = v
    tx = 2.0 * (y * vz - z * vy)
    ty = 2.0 * (z * vx - x * vz)
    tz = 2.0 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def magnitude(q):
    """Return the length of a quaternion of floats."""
    return math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])


def normalised(q):
    """Return q over its length, which must not be zero."""
    length = magnitude(q)
    return q[0] / length, q[1] / length, q[2] / length, q[3] / length


def made_unit(q):
    """Return a quaternion made unit, and whether its length was within 1e-6 of 1.

    1/|q| is the series of (1 + e)^-1/2 in e = |q|^2 - 1. For so small an e three terms are exact to
    rounding, and need neither a root nor a division. Lengths within t of 1 have |e - t^2| <= 2 t.
    """
    w, x, y, z = q
    t, e = UNIT_TOLERANCE, (w * w + x * x) + (y * y + z * z) - 1.0
    s = 1.0 - e * (0.5 - e * 0.375)
    return (s * w, s * x, s * y, s * z), within(e - t * t, 2.0 * t)


def within(number, bound):
    """Return whether |number| <= bound; NaN is not."""
    return abs(number) <= bound


def perpendicular(a):
    """Return a fixed unit vector perpendicular to a: along a x e, e the axis a is least along."""
    x, y, z = abs(a[0]), abs(a[1]), abs(a[2])
    if x <= y and x <= z:
        across = cross(a, (1.0, 0.0, 0.0))
    elif y <= z:
        across = cross(a, (0.0, 1.0, 0.0))
    else:
        across = cross(a, (0.0, 0.0, 1.0))
    length = norm(across)
    if length == 0.0:
        return 1.0, 0.0, 0.0
    return scale(1.0 / length, across)


def renormalised(q):
    """Return a quaternion made unit, which only rounding has taken from unit length."""
    unit, _ = made_unit(q)
    return unit


def between(a, b):
    """Return the shortest-arc rotation from the direction of a to the direction of b.

    The rotation is (|a| |b| + a.b, a x b) made unit: no trigonometry, and accurate for small
    angles. A zero vector has no direction and gives the identity.
    """
    lengths = math.sqrt(dot(a, a) * dot(b, b))
    w = lengths + dot(a, b)
    if lengths < TINY or w < NEARLY_OPPOSITE * lengths:
        return between_opposite(a, b)
    x, y, z = cross(a, b)
    s = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return s * w, s * x, s * y, s * z


def between_opposite(a, b):
    """Return the same where |a| |b| + a.b would cancel or underflow.

    With unit vectors, w = |a + b| / 2 and the vector part is (a x b) / |a + b|. Antiparallel
    vectors are rotated by pi about `perpendicular(a)`.
    """
    length_a, length_b = norm(a), norm(b)
    if length_a == 0.0 or length_b == 0.0:
        return 1.0, 0.0, 0.0, 0.0
    a = scale(1.0 / length_a, a)
    b = scale(1.0 / length_b, b)
    s = norm(add(a, b))
    if s < SMALL_ANGLE:
        x, y, z = perpendicular(a)
        return 0.0, x, y, z
    x, y, z = scale(1.0 / s, cross(a, b))
    return normalised((0.5 * s, x, y, z))


def exponential(v):
    """Return the rotation by |v| radians about v."""
    square = 0.25 * dot(v, v)
    if square < SHORT:
        s, c = sine_over_angle(square), cosine(square)
    else:
        half = math.sqrt(square)
        s, c = math.sin(half) / half, math.cos(half)
    s *= 0.5
    return c, s * v[0], s * v[1], s * v[2]


def sine_over_angle(t):
    """Return sin x / x of x² = t < SHORT by the series, exact to rounding; no test for zero."""
    s = 1.0 / 6227020800.0 - t * (1.0 / 1307674368000.0)
    s = t * s - 1.0 / 39916800.0
    s = t * s + 1.0 / 362880.0
    s = t * s - 1.0 / 5040.0
    s = t * s + 1.0 / 120.0
    s = t * s - 1.0 / 6.0
    return t * s + 1.0


def cosine(t):
    """Return cos x of x² = t < SHORT likewise."""
    c = t * (1.0 / 20922789888000.0) - 1.0 / 87178291200.0
    c = t * c + 1.0 / 479001600.0
    c = t * c - 1.0 / 3628800.0
    c = t * c + 1.0 / 40320.0
    c = t * c - 1.0 / 720.0
    c = t * c + 1.0 / 24.0
    c = t * c - 1.0 / 2.0
    return t * c + 1.0


def rotation_about(axis, angle):
    """Return the rotation by an angle [rad] about a unit axis."""
    c, s = half_angle(angle)
    return c, s * axis[0], s * axis[1], s * axis[2]


def half_angle(angle):
    """Return cosine and sine of half an angle; up to pi by the series of its quarter."""
    quarter = 0.25 * angle
    t = quarter * quarter
    if t < SHORT:
        s = quarter * sine_over_angle(t)
        return 1.0 - 2.0 * s * s, 2.0 * s * cosine(t)
    return math.cos(0.5 * angle), math.sin(0.5 * angle)


def logarithm(q):
    """Return the rotation vector of least length, at most pi."""
    w, x, y, z = q
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    sine = math.sqrt(x * x + y * y + z * z)
    s = 2.0 if sine < SMALL_ANGLE else 2.0 * math.atan2(sine, w) / sine
    return s * x, s * y, s * z
