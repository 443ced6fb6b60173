"""Closed forms of arms of six hinges: a spherical wrist, or three parallel axes.

With every joint at zero, joint i rotates about an axis a_i through a point o_i. The effector's
displacement from there to its target is G = E1(q1) ... E6(q6), a product of exponentials, E_i a
rotation about the axis of joint i (Paden 1986). Lengths are over the reach.

An arm whose first three axes meet, or whose third to fifth are parallel, is solved backwards. The
inverse of G is also a product of exponentials, with the joints in reverse order and opposite axes.
"""

import math
from typing import Any

import numpy as np

from ...arguments import FloatArray, RecordArray
from ...articulation import HINGE, JOINT, articulated_pose
from ...quaternion import (
    add,
    conjugate,
    dot,
    load_quaternion,
    load_vector,
    multiply,
    perpendicular,
    rotate,
    scale,
    subtract,
)
from ...rotation import rotate as rotate_vectors
from ..mechanism import EFFECTOR, TARGET, Mechanism
from .subproblems import (
    CERTAIN,
    angle_between,
    conic_roots,
    line_roots,
    product,
    projection,
    rotated,
    rotated_back,
    rotated_back_about,
    weighted_sum,
)

# As many as a pose has equations.
HINGES = 6
WRIST, PARALLEL = 0, 1
FORMS = "spherical wrist", "three parallel axes"
# Axes meet or are parallel within EXACT, over the reach: no more than rounding. Within NEAR the
# closed form gives starts for Newton's method, and no proof.
EXACT, NEAR = 1e-9, 1e-5
# No arm of six joints has more isolated solutions (Primrose 1986); rows of candidates, of which
# double roots may fill two.
LARGEST_COUNT, CANDIDATES = 16, 32
# Columns of solutions behind the coordinates: distance [m], angle [rad], and how many candidates
# came there.
FIGURES = 3
# A record of an arm with a known closed form, for kernels, which solve for its target.
ARM: Any = np.dtype(
    [
        # those of Mechanism, without bools, of which numba has no arrays in records
        ("joints", JOINT, HINGES),
        ("columns", np.int64, HINGES),
        ("effectors", EFFECTOR, 1),
        ("moves", np.int8, (HINGES, 1)),
        ("adjacent", np.int8, (HINGES, HINGES + 1)),
        ("reach", np.float64),
        # the closed form, with the joints in the order of solution
        ("form", np.int64),  # WRIST or PARALLEL
        ("backwards", np.int64),  # 1 if the joints are in reverse order, else 0
        ("axes", np.float64, (HINGES, 3)),  # unit axes
        ("signs", np.float64, HINGES),  # -1 of an axis opposite to the joint's, else 1
        ("points", np.float64, (HINGES, 3)),  # points on them, over the reach
        ("home", TARGET, 1),  # the effector at zero coordinates
        ("deviation", np.float64),  # how far the axes are from those of the form, over the reach
        ("target", TARGET, 1),
        ("status", np.int64, 1),  # how certain the number of solutions is
        # rows for the kernels to write to: angles as cosines and sines, candidates, solutions
        ("first", np.float64, (24, 2)),  # the roots of the angle that is solved for first
        ("second", np.float64, (2, 2)),  # of the next
        ("third", np.float64, (2, 2)),
        ("quartic", np.float64, (5, 12)),
        ("candidates", np.float64, (CANDIDATES, HINGES)),
        ("solutions", np.float64, (CANDIDATES, HINGES + FIGURES)),
    ],
    align=True,
)
# Where target and solutions begin in a record as floats, of 8 bytes.
TARGET_AT, SOLUTIONS_AT = (ARM.fields[name][1] // 8 for name in ("target", "solutions"))


def closed_form(mechanism: Mechanism) -> RecordArray | None:
    """Return a record of a mechanism with its most exact closed form, (1,), or None without any."""
    joints, ends = mechanism.joints, mechanism.effectors
    is_chain = np.array_equal(joints["parent"], np.arange(-1, HINGES - 1))
    is_plain = (joints["kind"] == HINGE).all() and not joints["followed"].any()
    if not (is_chain and is_plain and ends["joint"][0] == len(mechanism.columns) - 1):
        return None
    x, R = np.empty((HINGES, 3)), np.empty((HINGES, 4))
    articulated_pose(joints, np.zeros(HINGES), x, R)
    arm = np.zeros(1, ARM)
    for name in ("joints", "columns", "effectors", "moves", "adjacent", "reach"):
        arm[name] = getattr(mechanism, name)
    arm["home"]["position"] = x[-1] + rotate_vectors(R[-1], ends["position"][0])
    arm["home"]["rotation"] = multiply(R[-1], ends["rotation"][0])
    arm["target"]["weight"], arm["deviation"] = 1.0, np.inf
    axes, points = rotate_vectors(R, joints["axis"]), x / mechanism.reach
    for backwards in (False, True):
        for form, fill in ((WRIST, _wrist), (PARALLEL, _parallel)):
            own, o = (-axes[::-1], points[::-1]) if backwards else (axes, points)
            a, o = own.copy(), o.copy()
            deviation = fill(a, o)
            if deviation < arm["deviation"]:
                arm["form"], arm["backwards"], arm["deviation"] = form, backwards, deviation
                arm["axes"], arm["points"], arm["signs"] = a, o, (own * a).sum(axis=1)
    return arm if arm["deviation"] <= NEAR else None


def _wrist(axes: FloatArray, points: FloatArray) -> float:
    """Move points to where the last three axes meet and to the feet of the first two; see NEAR."""
    across = np.eye(3) - axes[3:, :, None] * axes[3:, None, :]
    center = np.linalg.lstsq(across.sum(axis=0), (across @ points[3:, :, None]).sum(axis=0))[0]
    distances = np.linalg.norm(np.cross(axes[3:], center[:, 0] - points[3:]), axis=1)
    points[3:] = center[:, 0]
    points[:2] = _feet(axes[:2], points[:2])
    gap, sine = np.linalg.norm([points[1] - points[0], np.cross(axes[0], axes[1])], axis=1)
    deviation = sum(size for size in (gap, sine) if size <= NEAR)  # which counts as zero
    coaxial = _coaxial(axes, points, (0, 1), (3, 4), (4, 5))
    return float(distances.max() + deviation + coaxial)


def _parallel(axes: FloatArray, points: FloatArray) -> float:
    """Move the last point to where the last two axes meet, turn parallels one way; see NEAR."""
    axes[2:4] *= np.copysign(1.0, axes[2:4] @ axes[1])[:, None]
    feet = _feet(axes[4:], points[4:])
    points[5], angles = feet[1], np.linalg.norm(np.cross(axes[1], axes[2:4]), axis=1)
    gap = np.linalg.norm(feet[1] - feet[0])
    return float(angles.max() + gap + _coaxial(axes, points, (1, 2), (2, 3), (4, 5)))


def _coaxial(axes: FloatArray, points: FloatArray, *pairs: tuple[int, int]) -> float:
    """Return infinity if two neighbours have a common axis, which no closed form allows, else 0."""
    for i, j in pairs:
        distance = np.linalg.norm(np.cross(axes[i], points[j] - points[i]))
        if np.linalg.norm(np.cross(axes[i], axes[j])) + distance < NEAR:
            return np.inf
    return 0.0


def _feet(axes: FloatArray, points: FloatArray) -> FloatArray:
    """Return the nearest points of two axes; of parallels the first stays."""
    (a, b), (o, p) = axes, points
    n, arm = np.cross(a, b), p - o
    square = n @ n
    t = np.cross(arm, b) @ n / square if square > NEAR * NEAR else 0.0
    foot = o + t * a
    return np.array([foot, p + ((foot - p) @ b) * b])


def fill_candidates(arm):
    """Fill the candidates for the target, and the status; return their number.

    A candidate stands for its continuum: an undetermined angle is zero.
    """
    arm["status"][0] = CERTAIN
    home, target = arm["home"], arm["target"]
    R_home = load_quaternion(home["rotation"], 0)
    R = multiply(load_quaternion(target["rotation"], 0), conjugate(R_home))
    x = rotate(R, load_vector(home["position"], 0))
    x = scale(1.0 / arm["reach"], subtract(load_vector(target["position"], 0), x))
    if arm["backwards"]:
        R = conjugate(R)
        x = scale(-1.0, rotate(R, x))
    if arm["form"] == WRIST:
        return solve_wrist(arm, R, x)
    return solve_parallel(arm, R, x)


def axis_of(arm, i):
    """Return the axis of a joint."""
    return load_vector(arm["axes"], i)


def point_on(arm, i):
    """Return a point on the axis of a joint."""
    return load_vector(arm["points"], i)


def solve_wrist(arm, R, x):
    """Solve an arm whose last three axes meet in w (Pieper 1968): E1 E2 E3 w = G w.

    The first rotation leaves height and length of the goal, E1^-1 G w less the foot on its axis.
    Both equations for v = E3 w less the foot on the second axis are linear in cosine and sine of
    q2. Their coefficients are linear in cosine and sine of q3.
    """
    w, o1, o2, o3 = point_on(arm, 3), point_on(arm, 0), point_on(arm, 1), point_on(arm, 2)
    a1, a2, a3 = axis_of(arm, 0), axis_of(arm, 1), axis_of(arm, 2)
    normal, goal = subtract(o2, o1), subtract(add(rotate(R, w), x), o1)
    # the normal leads from foot to foot; then the part of the first axis across the second
    shoulder = a1, a2, normal, flat(a2, a1), goal
    upper, lower = subtract(o3, o2), subtract(w, o3)
    total = 0
    for i in range(third_angles(arm, shoulder, upper, lower)):
        third = arm["first"][i, 0], arm["first"][i, 1]
        v = add(upper, rotated(a3, third, lower))
        for j in range(second_angles(arm, shoulder, v)):
            second = arm["second"][j, 0], arm["second"][j, 1]
            first = angle_between(arm, a1, add(normal, rotated(a2, second, v)), goal)
            total = solve_orientation(arm, R, (first, second, third), total)
    return total


def third_angles(arm, shoulder, upper, lower):
    """Fill the third angles, of v = upper + R3 lower; see `line_roots` for what is returned."""
    a1, a2, normal, across, goal = shoulder
    a3, roots = axis_of(arm, 2), arm["first"]
    k, c, s = projection(upper, a3, lower)
    length2 = dot(upper, upper) + dot(lower, lower) + 2.0 * k, 2.0 * c, 2.0 * s  # |v|²
    k, c, s = projection(a2, a3, lower)
    along = dot(a2, upper) + k, c, s  # a2 · v
    square, gap2, sine2 = dot(goal, goal), dot(normal, normal), dot(across, across)
    if gap2 <= NEAR * NEAR:
        return line_roots(arm, length2[0] - square, length2[1], length2[2], roots)
    height, cosine = dot(a1, goal), dot(a1, a2)
    if sine2 <= NEAR * NEAR:
        return line_roots(arm, along[0] - cosine * height, along[1], along[2], roots)
    # R2 v has these products with twice the normal and with the part of a1 across a2
    f = square - gap2 - length2[0], -length2[1], -length2[2]
    g = height - cosine * along[0], -cosine * along[1], -cosine * along[2]
    # what is left of |v|² beside the product with a2
    conic = weighted_sum(1.0, product(along, along), -1.0, product(length2, (1.0, 0.0, 0.0)))
    conic = weighted_sum(4.0 * gap2 * sine2, conic, sine2, product(f, f))
    conic = weighted_sum(1.0, conic, 4.0 * gap2, product(g, g))
    return conic_roots(arm, conic, roots)


def second_angles(arm, shoulder, v):
    """Fill the second angles; see `line_roots` for what is returned."""
    a1, a2, normal, across, goal = shoulder
    gap2, sine2, roots = dot(normal, normal), dot(across, across), arm["second"]
    f = 0.5 * (dot(goal, goal) - gap2 - dot(v, v))  # the product with the normal
    g = dot(a1, goal) - dot(a1, a2) * dot(a2, v)  # with the part of a1 across a2
    if gap2 <= NEAR * NEAR:
        k, c, s = projection(across, a2, v)
        return line_roots(arm, k - g, c, s, roots)
    if sine2 <= NEAR * NEAR:
        k, c, s = projection(normal, a2, v)
        return line_roots(arm, k - f, c, s, roots)
    image = add(scale(f / gap2, normal), scale(g / sine2, across))
    roots[0, 0], roots[0, 1] = angle_between(arm, a2, v, image)
    return 1


def solve_orientation(arm, R, angles, total):
    """Add the candidates of three angles; return the number of all.

    R4 R5 R6 is known: its effect on the last axis, then on a vector across it.
    """
    a4, a5, a6 = axis_of(arm, 3), axis_of(arm, 4), axis_of(arm, 5)
    across = perpendicular(a6)
    last, other = rotate(R, a6), rotate(R, across)
    for i in range(3):
        axis = axis_of(arm, i)
        last, other = rotated_back(axis, angles[i], last), rotated_back(axis, angles[i], other)
    k, c, s = projection(a4, a5, a6)
    for i in range(line_roots(arm, k - dot(a4, last), c, s, arm["third"])):
        fifth = arm["third"][i, 0], arm["third"][i, 1]
        fourth = angle_between(arm, a4, rotated(a5, fifth, a6), last)
        image = rotated_back(a5, fifth, rotated_back(a4, fourth, other))
        sixth = angle_between(arm, a6, across, image)
        total = store_candidate(arm, total, (*angles, fourth, fifth, sixth))
    return total


def solve_parallel(arm, R, x):
    """Solve an arm whose axes 2 to 4 are parallel to a, and whose last two meet (Elias & Wen 2022).

    P = E2 E3 E4 = E1^-1 G E6^-1 E5^-1 leaves a, and heights along a. The height of o6, where the
    last two axes meet, depends on q1 only; the height of a6 on q5 as well.
    """
    a1, a, a5 = axis_of(arm, 0), axis_of(arm, 1), axis_of(arm, 4)
    a6, o1, o6 = axis_of(arm, 5), point_on(arm, 0), point_on(arm, 5)
    k, c, s = projection(subtract(add(rotate(R, o6), x), o1), a1, a)
    total = 0
    for i in range(line_roots(arm, k - dot(a, subtract(o6, o1)), c, s, arm["first"])):
        first = arm["first"][i, 0], arm["first"][i, 1]
        normal = rotate(conjugate(R), rotated(a1, first, a))  # a before P, E5 and E6
        k, c, s = projection(a, a5, a6)
        for j in range(line_roots(arm, k - dot(normal, a6), c, s, arm["second"])):
            fifth = arm["second"][j, 0], arm["second"][j, 1]
            sixth = angle_between(arm, a6, normal, rotated_back(a5, fifth, a))
            total = solve_plane(arm, R, x, (first, fifth, sixth), total)
    return total


def solve_plane(arm, R, x, angles, total):
    """Add the candidates of the first, fifth and sixth angle, which leave a motion of the plane.

    Returns the number of all. In the plane across a the arm of two links has an elbow on either
    side (subproblem 3).
    """
    first, fifth, sixth = angles
    a1, a, a5, a6 = axis_of(arm, 0), axis_of(arm, 1), axis_of(arm, 4), axis_of(arm, 5)
    o1, o2, o3 = point_on(arm, 0), point_on(arm, 1), point_on(arm, 2)
    o4, o6, across = point_on(arm, 3), point_on(arm, 5), perpendicular(a)
    image = rotate(R, rotated_back(a6, sixth, rotated_back(a5, fifth, across)))
    whole = angle_between(arm, a, across, rotated_back(a1, first, image))
    place = rotated_back_about(a6, o6, sixth, rotated_back_about(a5, o6, fifth, o4))
    place = rotated_back_about(a1, o1, first, add(rotate(R, place), x))
    goal = flat(a, subtract(place, o2))
    upper, lower = flat(a, subtract(o3, o2)), flat(a, subtract(o4, o3))
    k, c, s = projection(upper, a, lower)
    rest = 0.5 * (dot(goal, goal) - dot(upper, upper) - dot(lower, lower))
    for i in range(line_roots(arm, k - rest, c, s, arm["third"])):
        third = arm["third"][i, 0], arm["third"][i, 1]
        second = angle_between(arm, a, add(upper, rotated(a, third, lower)), goal)
        fourth = difference(difference(whole, second), third)
        total = store_candidate(arm, total, (first, second, third, fourth, fifth, sixth))
    return total


def store_candidate(arm, total, angles):
    """Write the angles of a candidate, if a row is left; return the number of candidates."""
    if total == CANDIDATES:
        return total
    for i in range(HINGES):
        joint = HINGES - 1 - i if arm["backwards"] else i
        arm["candidates"][total, joint] = arm["signs"][i] * math.atan2(angles[i][1], angles[i][0])
    return total + 1


def flat(a, v):
    """Return the part of a vector across a unit axis."""
    return subtract(v, scale(dot(a, v), a))


def difference(a, b):
    """Return the angle a - b."""
    return a[0] * b[0] + a[1] * b[1], a[1] * b[0] - a[0] * b[1]
