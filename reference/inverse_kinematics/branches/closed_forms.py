"""Closed forms of arms of six hinges: a spherical wrist, or three parallel axes.

With every joint at zero, joint i rotates about an axis a_i through a point o_i. The effector's
displacement from there to its target is G = E1(q1) ... E6(q6), a product of exponentials, E_i a
rotation about the axis of joint i (Paden 1986). Lengths are over the reach.

An arm whose first three axes meet, or whose third to fifth are parallel, is solved backwards. The
inverse of G is also a product of exponentials, with the joints in reverse order and opposite axes.
"""

import math
from typing import NamedTuple

import numpy as np

from ...arguments import FloatArray
from ...articulation import HINGE, articulated_pose
from ...quaternion import (
    add,
    conjugate,
    cross,
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
from ..mechanism import Mechanism
from .subproblems import (
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


class ClosedForm(NamedTuple):
    """An arm with a known closed form; the joints are in the order of solution."""

    form: int  # WRIST or PARALLEL
    backwards: bool  # whether the joints are in reverse order
    # unit axes, and points on them over the reach, (6, 6); then the effector at zero coordinates,
    # position [m] and, in a row of its own, rotation
    geometry: FloatArray  # (8, 6)
    deviation: float  # how far the axes are from those of the form, over the reach


class AngleRoots(NamedTuple):
    """Rows for the kernels to write to: angles as cosines and sines, and candidates."""

    first: FloatArray  # the roots of the angle that is solved for first, (24, 2)
    second: FloatArray  # of the next, (2, 2)
    third: FloatArray  # (2, 2)
    quartic: FloatArray  # (5, 12)
    candidates: FloatArray  # (CANDIDATES, 6)


def new_roots():
    """Return the rows, not filled, in a single block of memory."""
    block = np.empty(116 + HINGES * CANDIDATES)
    return AngleRoots(
        block[:48].reshape(24, 2), block[48:52].reshape(2, 2), block[52:56].reshape(2, 2),
        block[56:116].reshape(5, 12), block[116:].reshape(CANDIDATES, HINGES),
    )  # fmt: skip


def closed_form(mechanism: Mechanism) -> ClosedForm | None:
    """Return the closed form of a mechanism, the most exact if there are several, or None."""
    joints, ends = mechanism.joints, mechanism.effectors
    is_chain = np.array_equal(joints["parent"], np.arange(-1, HINGES - 1))
    if not is_chain or (joints["kind"] != HINGE).any() or ends["joint"][0] != HINGES - 1:
        return None
    if joints["followed"].any() or len(mechanism.columns) != HINGES:
        return None
    x, R = np.empty((HINGES, 3)), np.empty((HINGES, 4))
    articulated_pose(joints, np.zeros(HINGES), x, R)
    effector = x[-1] + rotate_vectors(R[-1], ends["position"][0])
    home = np.zeros((2, HINGES))
    home[0, :3], home[1, :4] = effector, multiply(R[-1], ends["rotation"][0])
    axes, points = rotate_vectors(R, joints["axis"]), x / mechanism.reach
    forms = []
    for backwards in (False, True):
        for form, fill in ((WRIST, _wrist), (PARALLEL, _parallel)):
            a, o = (-axes[::-1], points[::-1]) if backwards else (axes, points)
            o = o.copy()
            deviation = fill(a, o)
            geometry = np.vstack([np.hstack([a, o]), home])
            forms.append(ClosedForm(form, backwards, geometry, deviation))
    best = min(forms, key=lambda form: form.deviation)
    return best if best.deviation <= NEAR else None


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
    """Move the last point to where the last two axes meet; see NEAR."""
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


def fill_candidates(arm, reach, target, work):
    """Fill the candidates for a target; return their number and its certainty.

    A candidate stands for its continuum: an undetermined angle is zero.
    """
    R = multiply(
        load_quaternion(target["rotation"], 0), conjugate(load_quaternion(arm.geometry, HINGES + 1))
    )
    x = subtract(load_vector(target["position"], 0), rotate(R, load_vector(arm.geometry, HINGES)))
    x = scale(1.0 / reach, x)
    if arm.backwards:
        R = conjugate(R)
        x = scale(-1.0, rotate(R, x))
    if arm.form == WRIST:
        return solve_wrist(arm, R, x, work)
    return solve_parallel(arm, R, x, work)


def axis_of(arm, i):
    """Return the axis of a joint."""
    return load_vector(arm.geometry, i)


def point_on(arm, i):
    """Return a point on the axis of a joint."""
    return load_vector(arm.geometry, i, 3)


class Shoulder(NamedTuple):
    """The first two axes, and the point to which they bring a point of the third link."""

    first: tuple[float, float, float]  # their axes
    second: tuple[float, float, float]
    normal: tuple[float, float, float]  # between them, from foot to foot
    across: tuple[float, float, float]  # the part of the first axis across the second
    cosine: float  # of the angle between them
    sine2: float  # the square of its sine
    gap2: float  # the square of the length of the normal
    goal: tuple[float, float, float]  # from the foot on the first axis to the point
    height: float  # of the goal along the first axis
    square: float  # of its length


def solve_wrist(arm, R, x, work):
    """Solve an arm whose last three axes meet in w (Pieper 1968): E1 E2 E3 w = G w.

    The first rotation leaves height and length of the goal, E1^-1 G w less the foot on its axis.
    Both equations for v = E3 w less the foot on the second axis are linear in cosine and sine of
    q2. Their coefficients are linear in cosine and sine of q3.
    """
    w, o1, o2, o3 = point_on(arm, 3), point_on(arm, 0), point_on(arm, 1), point_on(arm, 2)
    a1, a2, a3 = axis_of(arm, 0), axis_of(arm, 1), axis_of(arm, 2)
    normal, goal = subtract(o2, o1), subtract(add(rotate(R, w), x), o1)
    cosine, perpendicular_part = dot(a1, a2), cross(a1, a2)
    shoulder = Shoulder(
        a1, a2, normal, subtract(a1, scale(cosine, a2)), cosine,
        dot(perpendicular_part, perpendicular_part), dot(normal, normal), goal, dot(a1, goal),
        dot(goal, goal),
    )  # fmt: skip
    upper, lower = subtract(o3, o2), subtract(w, o3)
    count, status = third_angles(arm, shoulder, upper, lower, work)
    total = 0
    for i in range(count):
        third = work.first[i, 0], work.first[i, 1]
        v = add(upper, rotated(a3, third, lower))
        inner, certainty = second_angles(arm, shoulder, v, work.second)
        status = max(status, certainty)
        for j in range(inner):
            second = work.second[j, 0], work.second[j, 1]
            first, certainty = angle_between(a1, add(normal, rotated(a2, second, v)), goal)
            status = max(status, certainty)
            total, certainty = solve_orientation(arm, R, (first, second, third), total, work)
            status = max(status, certainty)
    return total, status


def third_angles(arm, shoulder, upper, lower, work):
    """Fill the third angles, of v = upper + R3 lower; see `line_roots` for what is returned."""
    a3 = axis_of(arm, 2)
    k, c, s = projection(upper, a3, lower)
    length2 = dot(upper, upper) + dot(lower, lower) + 2.0 * k, 2.0 * c, 2.0 * s  # |v|²
    k, c, s = projection(shoulder.second, a3, lower)
    along = dot(shoulder.second, upper) + k, c, s  # a2 · v
    square, gap2, sine2 = shoulder.square, shoulder.gap2, shoulder.sine2
    if gap2 <= NEAR * NEAR:
        return line_roots(length2[0] - square, length2[1], length2[2], arm.deviation, work.first)
    height, cosine = shoulder.height, shoulder.cosine
    if sine2 <= NEAR * NEAR:
        return line_roots(along[0] - cosine * height, along[1], along[2], arm.deviation, work.first)
    # R2 v has these products with twice the normal and with the part of a1 across a2
    f = square - gap2 - length2[0], -length2[1], -length2[2]
    g = height - cosine * along[0], -cosine * along[1], -cosine * along[2]
    # what is left of |v|² beside the product with a2
    conic = weighted_sum(1.0, product(along, along), -1.0, product(length2, (1.0, 0.0, 0.0)))
    conic = weighted_sum(4.0 * gap2 * sine2, conic, sine2, product(f, f))
    conic = weighted_sum(1.0, conic, 4.0 * gap2, product(g, g))
    return conic_roots(conic, arm.deviation, work.first, work.quartic)


def second_angles(arm, shoulder, v, roots):
    """Fill the second angles; see `line_roots` for what is returned."""
    gap2, sine2, a2 = shoulder.gap2, shoulder.sine2, shoulder.second
    f = 0.5 * (shoulder.square - gap2 - dot(v, v))  # the product with the normal
    g = shoulder.height - shoulder.cosine * dot(a2, v)  # with the part of a1 across a2
    if gap2 <= NEAR * NEAR:
        k, c, s = projection(shoulder.across, a2, v)
        return line_roots(k - g, c, s, arm.deviation, roots)
    if sine2 <= NEAR * NEAR:
        k, c, s = projection(shoulder.normal, a2, v)
        return line_roots(k - f, c, s, arm.deviation, roots)
    image = add(scale(f / gap2, shoulder.normal), scale(g / sine2, shoulder.across))
    (c, s), certainty = angle_between(a2, v, image)
    roots[0, 0], roots[0, 1] = c, s
    return 1, certainty


def solve_orientation(arm, R, angles, total, work):
    """Add the candidates of three angles; return their number and its certainty.

    R4 R5 R6 is known: its effect on the last axis, then on a vector across it.
    """
    a4, a5, a6 = axis_of(arm, 3), axis_of(arm, 4), axis_of(arm, 5)
    across = perpendicular(a6)
    last, other = rotate(R, a6), rotate(R, across)
    for i in range(3):
        axis = axis_of(arm, i)
        last, other = rotated_back(axis, angles[i], last), rotated_back(axis, angles[i], other)
    k, c, s = projection(a4, a5, a6)
    count, status = line_roots(k - dot(a4, last), c, s, arm.deviation, work.third)
    for i in range(count):
        fifth = work.third[i, 0], work.third[i, 1]
        fourth, certainty = angle_between(a4, rotated(a5, fifth, a6), last)
        status = max(status, certainty)
        image = rotated_back(a5, fifth, rotated_back(a4, fourth, other))
        sixth, _ = angle_between(a6, across, image)
        total = store_candidate(arm, total, (*angles, fourth, fifth, sixth), work)
    return total, status


def solve_parallel(arm, R, x, work):
    """Solve an arm whose axes 2 to 4 are parallel to a, and whose last two meet (Elias & Wen 2022).

    P = E2 E3 E4 = E1^-1 G E6^-1 E5^-1 leaves a, and heights along a. The height of o6, where the
    last two axes meet, depends on q1 only; the height of a6 on q5 as well.
    """
    a1, a, a5 = axis_of(arm, 0), axis_of(arm, 1), axis_of(arm, 4)
    a6, o1, o6 = axis_of(arm, 5), point_on(arm, 0), point_on(arm, 5)
    k, c, s = projection(subtract(add(rotate(R, o6), x), o1), a1, a)
    count, status = line_roots(k - dot(a, subtract(o6, o1)), c, s, arm.deviation, work.first)
    total = 0
    for i in range(count):
        first = work.first[i, 0], work.first[i, 1]
        normal = rotate(conjugate(R), rotated(a1, first, a))  # a before P, E5 and E6
        k, c, s = projection(a, a5, a6)
        inner, certainty = line_roots(k - dot(normal, a6), c, s, arm.deviation, work.second)
        status = max(status, certainty)
        for j in range(inner):
            fifth = work.second[j, 0], work.second[j, 1]
            sixth, certainty = angle_between(a6, normal, rotated_back(a5, fifth, a))
            status = max(status, certainty)
            total, certainty = solve_plane(arm, R, x, (first, fifth, sixth), total, work)
            status = max(status, certainty)
    return total, status


def solve_plane(arm, R, x, angles, total, work):
    """Add the candidates of the first, fifth and sixth angle, which leave a motion of the plane.

    Returns their number and its certainty. In the plane across a the arm of two links has an elbow
    on either side (subproblem 3).
    """
    first, fifth, sixth = angles
    a1, a, a5, a6 = (
        axis_of(arm, 0), axis_of(arm, 1), axis_of(arm, 4),
        axis_of(arm, 5),
    )  # fmt: skip
    o1, o2, o3 = point_on(arm, 0), point_on(arm, 1), point_on(arm, 2)
    o4, o6 = point_on(arm, 3), point_on(arm, 5)
    across = perpendicular(a)
    image = rotate(R, rotated_back(a6, sixth, rotated_back(a5, fifth, across)))
    whole, _ = angle_between(a, across, rotated_back(a1, first, image))
    place = rotated_back_about(a6, o6, sixth, rotated_back_about(a5, o6, fifth, o4))
    place = rotated_back_about(a1, o1, first, add(rotate(R, place), x))
    goal = flat(a, subtract(place, o2))
    upper, lower = flat(a, subtract(o3, o2)), flat(a, subtract(o4, o3))
    k, c, s = projection(upper, a, lower)
    rest = 0.5 * (dot(goal, goal) - dot(upper, upper) - dot(lower, lower))
    count, status = line_roots(k - rest, c, s, arm.deviation, work.third)
    for i in range(count):
        third = work.third[i, 0], work.third[i, 1]
        second, certainty = angle_between(a, add(upper, rotated(a, third, lower)), goal)
        status = max(status, certainty)
        fourth = difference(whole, (second[0] * third[0] - second[1] * third[1],
                                    second[0] * third[1] + second[1] * third[0]))  # fmt: skip
        third = third[0], third[1] * sign_of(arm, a, 2)
        fourth = fourth[0], fourth[1] * sign_of(arm, a, 3)
        total = store_candidate(arm, total, (first, second, third, fourth, fifth, sixth), work)
    return total, status


def store_candidate(arm, total, angles, work):
    """Write the angles of a candidate, if a row is left; return the number of candidates."""
    if total == CANDIDATES:
        return total
    for i in range(HINGES):
        joint = HINGES - 1 - i if arm.backwards else i
        work.candidates[total, joint] = math.atan2(angles[i][1], angles[i][0])
    return total + 1


def flat(a, v):
    """Return the part of a vector across a unit axis."""
    return subtract(v, scale(dot(a, v), a))


def difference(a, b):
    """Return the angle a - b."""
    return a[0] * b[0] + a[1] * b[1], a[1] * b[0] - a[0] * b[1]


def sign_of(arm, a, i):
    """Return 1 if an axis has the direction of its parallel a, else -1."""
    return 1.0 if dot(a, axis_of(arm, i)) > 0.0 else -1.0
