"""Subproblems of closed forms: angles that solve one or two geometric equations.

An angle is a pair of its cosine and sine: most steps need no trigonometry. The subproblems are from
Paden (1986) and Kahan (1983) and, with a quartic, from Elias & Wen (2022).
"""

import math

from ...quaternion import add, cross, dot, scale, subtract

# Coefficients up to this are zero, relative to coefficients of lengths and rotations near 1: some
# thousand roundings, more than a chain of six rotations loses.
ZERO = 1e-12
# A quartic this near to zero at an extremum has a double root there.
DOUBLE_ROOT = 1e-14
# Angles within this of a double root [rad] are taken for the root: it has half the digits of
# DOUBLE_ROOT.
SAME_ROOT = 1e-7
# A cosine beyond 1 by less is 1: an earlier angle may be off by as much.
CLAMPED = 1e-7
# The certainty of a number of roots: certain; in doubt; every angle is a root. The status of an arm
# is the greatest of all its angles.
CERTAIN, DOUBTFUL, EVERY_ANGLE = range(3)
# The number is in doubt with a cosine within this of 1, a quartic as near to zero, or vectors as
# near to the axis. Two roots are then within 2.8e-4 rad of each other. Doubt only starts a search.
NEARLY_DOUBLE = 1e-8
# A vector has no angle about an axis if its part across the axis is no longer than this.
SINGULAR = 1e-7
# Halvings of an interval with a root, from its length down to rounding, 2**-53, with some to spare.
HALVINGS = 60


def rotated(axis, angle, v):
    """Return a vector rotated about a unit axis by an angle (Rodrigues' formula)."""
    c, s = angle
    along = scale((1.0 - c) * dot(axis, v), axis)
    return add(add(scale(c, v), scale(s, cross(axis, v))), along)


def rotated_back(axis, angle, v):
    """Return a vector rotated about a unit axis by minus an angle."""
    return rotated(axis, (angle[0], -angle[1]), v)


def rotated_back_about(axis, point, angle, x):
    """Return a point rotated by minus an angle about the axis through another point."""
    return add(point, rotated_back(axis, angle, subtract(x, point)))


def projection(u, axis, v):
    """Return k, a, b of u · R v = k + a cos + b sin, R the rotation about an axis."""
    k = dot(axis, u) * dot(axis, v)
    return k, dot(u, v) - k, dot(u, cross(axis, v))


def angle_between(arm, axis, v, w):
    """Return the angle about an axis from v to the half-plane of w (subproblem 1).

    Raises the arm's status: if v or w is on the axis, every angle is a solution, here zero.
    """
    c, s = dot(v, w) - dot(axis, v) * dot(axis, w), dot(axis, cross(v, w))
    product = math.sqrt(c * c + s * s)
    if product <= NEARLY_DOUBLE:
        raise_status(arm, EVERY_ANGLE if product <= SINGULAR * SINGULAR else DOUBTFUL)
    if product <= ZERO * ZERO:
        return 1.0, 0.0
    return c / product, s / product


def line_roots(arm, k, a, b, roots):
    """Fill the angles of k + a cos + b sin = 0 (subproblems 3 and 4); return their number.

    The deviation of the arm may hide or part a double root: the angles are then near it. Raises the
    arm's status; if every angle is a root, fills in zero.
    """
    r = math.sqrt(a * a + b * b)
    if r <= ZERO:
        return every_angle(arm, roots) if abs(k) <= ZERO else 0
    if r <= SINGULAR and abs(k) <= SINGULAR:  # rounding alone determines the angles
        raise_status(arm, EVERY_ANGLE)
    deviation = arm["deviation"] / r
    x, a, b, largest = -k / r, a / r, b / r, 1.0 - min(1.0, deviation)
    excess = abs(x) - 1.0
    if excess > CLAMPED + deviation:
        return 0
    if excess >= -NEARLY_DOUBLE:
        raise_status(arm, DOUBTFUL)
    x = min(max(x, -largest), largest)
    y = math.sqrt(1.0 - x * x)
    if y <= SAME_ROOT:
        sign = math.copysign(1.0, x)
        roots[0, 0], roots[0, 1] = sign * a, sign * b
        return 1
    roots[0, 0], roots[0, 1] = x * a - y * b, x * b + y * a
    roots[1, 0], roots[1, 1] = x * a + y * b, x * b - y * a
    return 2


def every_angle(arm, roots):
    """Fill in the angle zero for all angles; see `line_roots`."""
    raise_status(arm, EVERY_ANGLE)
    roots[0, 0], roots[0, 1] = 1.0, 0.0
    return 1


def raise_status(arm, certainty):
    """Note a number of roots that is less certain than those before."""
    arm["status"][0] = max(arm["status"][0], certainty)


def product(f, g):
    """Return the product of two linear forms k + a cos + b sin, as taken by `conic_roots`.

    The product is p0 + p1 cos + p2 sin + p3 cos 2 + p4 sin 2.
    """
    cosines, sines = f[1] * g[1], f[2] * g[2]
    return (
        f[0] * g[0] + 0.5 * (cosines + sines),
        f[0] * g[1] + f[1] * g[0],
        f[0] * g[2] + f[2] * g[0],
        0.5 * (cosines - sines),
        0.5 * (f[1] * g[2] + f[2] * g[1]),
    )


def weighted_sum(s, p, t, q):
    """Return s p + t q of two products."""
    return (
        s * p[0] + t * q[0], s * p[1] + t * q[1], s * p[2] + t * q[2], s * p[3] + t * q[3],
        s * p[4] + t * q[4],
    )  # fmt: skip


def conic_roots(arm, p, roots):
    """Fill the angles of p0 + p1 cos + p2 sin + p3 cos 2 + p4 sin 2 = 0, as `line_roots` does.

    These are the intersections of a conic with the unit circle (Elias & Wen 2022, subproblems 5 and
    6). In t, the tangent of half the angle, the equation is a quartic. Two intervals t in [-1, 1],
    about 0 and about pi, cover the circle; a root at an end may come twice.
    """
    size = abs(p[0]) + abs(p[1]) + abs(p[2]) + abs(p[3]) + abs(p[4])
    if size <= ZERO * ZERO:
        return every_angle(arm, roots)
    count, work = 0, arm["quartic"]
    for side in (1.0, -1.0):
        p1, p2 = side * p[1], side * p[2]
        quartic = (
            p[0] + p1 + p[3], 2.0 * p2 + 4.0 * p[4], 2.0 * p[0] - 6.0 * p[3],
            2.0 * p2 - 4.0 * p[4], p[0] - p1 + p[3],
        )  # fmt: skip
        n, nearest = quartic_roots(quartic, (DOUBLE_ROOT + arm["deviation"]) * size, work)
        if nearest <= NEARLY_DOUBLE * size:
            raise_status(arm, DOUBTFUL)
        for i in range(n):
            t = work[0, i]
            c, s = (1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t)
            roots[count, 0], roots[count, 1] = side * c, side * s
            count += 1
    return count


def quartic_roots(a, margin, work):
    """Fill work[0] with the roots of a0 + a1 t + ... + a4 t^4 in [-1, 1]; return their number.

    The other rows of `work`, (5, 12), are for roots of the derivatives. Also return the least
    absolute value at an extremum or the right end.

    Between extrema, the roots of the derivative, a polynomial has a root where its sign changes. A
    value within the margin at an extremum or an end is a double root or a root at the end.
    """
    # the polynomial and its derivatives
    chain = (
        a,
        (a[1], 2.0 * a[2], 3.0 * a[3], 4.0 * a[4], 0.0),
        (2.0 * a[2], 6.0 * a[3], 12.0 * a[4], 0.0, 0.0),
        (6.0 * a[3], 24.0 * a[4], 0.0, 0.0, 0.0),
        (24.0 * a[4], 0.0, 0.0, 0.0, 0.0),
    )
    work[4, 0], count, nearest = 1.0, 0, math.inf
    for order in (3, 2, 1, 0):
        f, slope, allowance = chain[order], chain[order + 1], margin if order == 0 else 0.0
        extrema, work[order + 1, count] = count, 1.0
        row, left, count = work[order], -1.0, 0
        f_left = value(f, left, allowance)
        if f_left == 0.0:
            row[0], count = left, 1
        for i in range(extrema + 1):
            right = work[order + 1, i]
            f_right = value(f, right, allowance)
            if order == 0:
                nearest = min(nearest, abs(f_right))
            if f_right == 0.0:
                row[count] = right
                count += 1
            elif f_left * f_right < 0.0:
                row[count] = root_between(f, slope, left, right, f_left)
                count += 1
            left, f_left = right, f_right
    return count, nearest


def value(a, t, margin):
    """Return a0 + a1 t + ... + a4 t^4, zero within a margin."""
    f = (((a[4] * t + a[3]) * t + a[2]) * t + a[1]) * t + a[0]
    return 0.0 if abs(f) <= margin else f


def root_between(f, slope, left, right, f_left):
    """Return the only root between two points of opposite sign: Newton's method, else halving."""
    t = 0.5 * (left + right)
    for _ in range(HALVINGS):
        f_t = value(f, t, 0.0)
        if f_t * f_left > 0.0:
            left = t
        else:
            right = t
        gradient = value(slope, t, 0.0)
        step = f_t / gradient if gradient != 0.0 else 2.0
        following = t - step
        if not left < following < right:
            following = 0.5 * (left + right)
        if following == t or abs(following - t) <= 1e-16:
            break
        t = following
    return t
