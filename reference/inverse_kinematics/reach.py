"""Proven bounds of the distances that a chain of limited joints can give: shells of reach.

Let P be a point fixed to the end of a chain, C a point fixed to its base, and r = |P - C|. In a box
of coordinates of half-widths w, with g the gradient of r² in its middle,

    |r² - r²(middle)| <= |g| w + w H w / 2,    H_ij = 2 D_min(i,j) d_max(i,j).

D_i bounds the distance of C from the axis of joint i over all configurations, and d_i the distance
of P; the lengths of a slide are 1. Boxes are halved until a bound is accurate, or a fixed number of
boxes is used up. Mimic joints count as independent joints. docs/certificates.md has the proof, with
the rounding errors.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from .. import rotation
from ..arguments import FloatArray
from ..articulation import HINGE, SLIDE, Articulation
from ..jacobians import jacobians
from ..quaternion import add, rotate
from ..skeleton import Skeleton

UNIT = 2.0**-53  # the largest relative error of a rounding
ROUNDINGS = 3000  # of UNIT by a joint; see docs/certificates.md
# The accuracy of a shell, over the length of the chain, and the boxes for a shell and for a target.
# All are limits of time: a bound with fewer boxes is wider, and as valid.
ACCURACY, SHELL_BOXES, TARGET_BOXES = 1e-3, 20_000, 2_000
# Factor to cover the rounding errors of widths and lengths, some thousand.
WIDER = 1.0 + 1e-12
# Axes count as parallel if the squared sine between them is smaller.
PARALLEL = 1e-6


class ReachShell(NamedTuple):
    """The shell of a point on a path, by the joints above within their limits."""

    base: FloatArray  # its centre, in the world [m], (3,)
    joint: int  # whose axis the point is on, by its position on the path; beyond it the effector's
    point: FloatArray  # in the frame of that joint [m], (3,)
    smallest: float  # distance from the base [m]
    largest: float
    # from the effector to the point, in the effector's frame [m]; None if joints between them move
    arm: tuple[float, ...] | None


class Reach(NamedTuple):
    """The shells of the points on a path.

    The first shells are about a point on the axis of the first moving joint, which changes no
    distance from that point. The other shells are about points around it, and show the joint's
    limits.
    """

    path: list[int]  # joints from the root on
    length: float  # of all offsets on the path [m]
    shells: list[ReachShell]


class Axes(NamedTuple):
    """The joints of a path where all coordinates are zero, in the world."""

    kinds: list[str]
    origins: FloatArray  # [m], (joint, 3)
    directions: FloatArray  # (joint, 3)

    def nearest(self, k: int, other: int) -> FloatArray:
        """Return the point of a hinge's axis nearest to another axis, from its origin [m].

        The origin itself of other joints, and where the axes are parallel.
        """
        if self.kinds[k] != "hinge" or k == other:
            return np.zeros(3)
        a, b, v = self.directions[k], self.directions[other], self.origins[other] - self.origins[k]
        if self.kinds[other] != "hinge":
            return a * float(a @ v)
        cosine = float(a @ b)
        square = 1.0 - cosine * cosine
        return a * float(a @ v - cosine * (b @ v)) / square if square > PARALLEL else np.zeros(3)


def least_distance(
    model: Articulation, joint: int, position: Any, Q: Any, whole: bool = True
) -> tuple[float, float]:
    """Return a bound [m] and a lever [m]: distance + lever angle >= bound for every pose.

    Without the whole reach only the first shell is tried, in microseconds.

    For any pose within the limits, these are the effector's distance [m] and angle [rad] from its
    target. The bound is 0 without a proof, the lever 0 without a target rotation.

    Proof: the effector's pose fixes the centre of a shell in the effector's frame. As the centre is
    `lever` from the target, it is known up to the distance plus the lever times the angle. The
    joints above keep a point on an axis within its shell. The joints below would have to bring the
    point there for the effector to be at its target; `separation` bounds their failure. Where no
    joint below moves, the effector's pose fixes the point, and the lever is its arm.
    """
    reach = reach_of(model, joint, Q is not None, whole)
    for shell in reach.shells:
        if shell.arm is not None:
            centre = position if Q is None else add(position, rotate(Q, shell.arm))
            r, lever = math.dist(shell.base, centre), math.hypot(*shell.arm)
            gap = max(r - shell.largest, shell.smallest - r)
        else:
            offset = shell.base - position
            lever = float(np.linalg.norm(offset))
            below, interval = reach.path[shell.joint + 1 :], (shell.smallest, shell.largest)
            point = rotation.rotate(rotation.conjugate(Q), offset)
            gap = separation(model, below, shell.point, point, interval)
        vectors = shell.base, shell.point, position
        gap -= ROUNDINGS * UNIT * (reach.length + sum(math.hypot(*vector) for vector in vectors))
        if gap > 0.0:
            return gap, lever * WIDER
    return 0.0, 0.0


def reach_of(model: Articulation, joint: int, oriented: bool, whole: bool = True) -> Reach:
    """Return the shells of the points on the path to a joint, kept by the model.

    With a rotation to reach, every hinge and ball has a shell, the last first, of the point on its
    axis nearest to the next axis. Otherwise the only shell is of the effector's origin. Unless
    `whole`, only the first shell is returned, if its point is fixed to the effector.
    """
    key = "reach", joint, oriented, whole
    if key not in model.mechanisms:
        path, offsets = model.skeleton.path_array(joint).tolist(), model.skeleton.offsets
        x, R = (part[path] for part in model.forward(model.zero()))
        axes = Axes([model.kinds[j] for j in path], x, rotation.rotate(R, model.axes[path]))
        moving = [k for k, kind in enumerate(axes.kinds) if kind != "fixed"]
        base = x[0]
        if moving:
            base = x[moving[0]] + axes.nearest(moving[0], moving[min(1, len(moving) - 1)])
        points: list[Any] = [] if oriented else [(len(path), np.zeros(3), np.zeros(3), (0.0,) * 3)]
        for i in reversed(range(len(moving) if oriented else 0)):
            k = moving[i]
            if axes.kinds[k] in ("hinge", "ball"):
                other = moving[i + 1] if i + 1 < len(moving) else moving[max(i - 1, 0)]
                point = rotation.rotate(rotation.conjugate(R[k]), axes.nearest(k, other))
                end = offsets[path[k]] + rotation.rotate(model.frames[path[k]], point)
                arm = None
                if moving[-1] == k:
                    place = x[k] + rotation.rotate(R[k], point) - x[-1]
                    arm = tuple(rotation.rotate(rotation.conjugate(R[-1]), place).tolist())
                points.append((k, point, end, arm))
        length = float(np.linalg.norm(offsets[path], axis=1).sum())
        around = length * np.vstack([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
        if not whole:
            around, points = around[:1], [first for first in points[:1] if first[3] is not None]
        shells = [
            ReachShell(centre, k, point, *span(model, path[:k], centre, end), arm)
            for centre in base + around
            for k, point, end, arm in points
        ]
        model.mechanisms[key] = Reach(path, length, shells)
    reach: Reach = model.mechanisms[key]
    return reach


def span(
    model: Articulation, joints: list[int], base: FloatArray, point: FloatArray
) -> tuple[float, float]:
    """Return bounds of the distance from a base point to a point at the end of a chain [m].

    At a ball the chain is cut, and the parts may point in any direction: limits of balls do not
    count. A free joint, or a slide without limits, reaches everything.
    """
    parts, first, smallest, largest = [], 0, 0.0, 0.0
    for k, j in enumerate(joints):
        if model.kinds[j] == "free":
            return 0.0, math.inf
        if model.kinds[j] == "ball":
            parts.append((joints[first:k], base, model.skeleton.offsets[j]))
            first, base = k + 1, np.zeros(3)
    for part in (*parts, (joints[first:], base, point)):
        least, greatest = _span(model, *part)
        smallest = max(0.0, smallest - greatest, least - largest)
        largest += greatest
    return smallest, largest


def _span(
    model: Articulation, joints: list[int], base: FloatArray, point: FloatArray
) -> tuple[float, float]:
    """Return the same of a chain without balls."""
    if not joints:
        length = float(np.linalg.norm(point - base))
        return length / WIDER, length * WIDER
    chain = _chain(model, joints, point)
    longest = _Bounds(chain, base).longest
    if not math.isfinite(longest):
        return 0.0, math.inf
    smallest = _separation(chain, base, (-math.inf, 0.0), SHELL_BOXES)
    return smallest, longest - _separation(chain, base, (longest, math.inf), SHELL_BOXES)


def separation(
    model: Articulation, joints: list[int], base: FloatArray, point: FloatArray,
    interval: tuple[float, float],
) -> float:  # fmt: skip
    """Return a lower bound of how far all distances from base to point are from an interval [m]."""
    if any(model.kinds[j] in ("ball", "free") for j in joints):
        smallest, largest = span(model, joints, base, point)
        return max(0.0, smallest - interval[1], interval[0] - largest)
    return _separation(_chain(model, joints, point), base, interval, TARGET_BOXES)


def _chain(model: Articulation, joints: list[int], point: FloatArray) -> Articulation:
    """Return hinges, slides and fixed joints of a path as a chain of its own, to a point."""
    records = model.joints[joints]
    leaders = records["leader"]
    ends = np.array([model.joints["lower"][leaders], model.joints["upper"][leaders]])
    with np.errstate(invalid="ignore"):  # 0 times infinity: a follower that does not move
        ends = np.where(records["multiplier"] == 0.0, 0.0, records["multiplier"] * ends)
    ends = np.sort(ends + records["shift"], axis=0)
    whole = (records["kind"] == HINGE) & ~(ends[1] - ends[0] < 2.0 * np.pi)
    ends[:, whole] = np.array([[-np.pi], [np.pi]]) * WIDER
    count = len(joints) + 1
    return Articulation(
        Skeleton(np.arange(count) - 1, np.vstack([records["offset"], point])),
        [*(model.kinds[j] for j in joints), "fixed"],
        np.vstack([records["axis"], [0.0, 0.0, 1.0]]),
        frames=np.vstack([records["frame"], [1.0, 0.0, 0.0, 0.0]]),
        lower=np.append(ends[0], 0.0),
        upper=np.append(ends[1], 0.0),
    )


class _Bounds:
    """Bounds of the distance r from a base point to the end of a chain, in boxes."""

    def __init__(self, chain: Articulation, base: FloatArray) -> None:
        joints, self.chain, self.base = chain.joints, chain, base
        moving = np.flatnonzero(np.isin(joints["kind"], (HINGE, SLIDE)))
        self.lower, self.upper = joints["lower"][moving], joints["upper"][moving]
        x, R = chain.forward(chain.zero())
        axes, is_slide = rotation.rotate(R, chain.axes), joints["kind"] == SLIDE
        travel = np.where(is_slide, np.maximum(-joints["lower"], joints["upper"]), 0.0)
        scale = np.linalg.norm(joints["offset"], axis=1).sum() + np.abs(travel).sum()
        scale += np.linalg.norm(base)
        self.rounding = float(ROUNDINGS * UNIT * len(joints) * scale)  # [m]
        self.scale = float(scale)
        D, longest = self._lengths(base, x, axes, travel, moving, x[-1])
        d, _ = self._lengths(x[-1], x, axes, travel, moving[::-1], base)
        self.longest = longest
        self.slopes, d = np.minimum(D, d[::-1]), d[::-1]
        above = np.triu(np.outer(D, d))
        self.H = 2.0 * (above + np.triu(above, 1).T)

    def _lengths(
        self, start: FloatArray, x: FloatArray, axes: FloatArray, travel: FloatArray,
        moving: Any, end: FloatArray,
    ) -> tuple[FloatArray, float]:  # fmt: skip
        """Return bounds of the distance of a start from each axis, 1 for slides, and of an end."""
        length, bounds = self.rounding, []
        for j in moving:
            if self.chain.kinds[j] == "slide":
                length += float(travel[j])
                bounds.append(1.0)
                continue
            anchor = x[j] + axes[j] * float((start - x[j]) @ axes[j])
            length += float(np.linalg.norm(anchor - start)) * WIDER + self.rounding
            bounds.append(length)
            start = anchor
        return np.array(bounds), length + float(np.linalg.norm(end - start)) * WIDER

    def __call__(self, q: FloatArray, w: FloatArray) -> tuple[FloatArray, ...]:
        """Return r in the middle, its bounds in the box, and each joint's share of their width."""
        last = self.chain.joint_count - 1
        v = self.chain.forward(q)[0][:, -1] - self.base
        J = jacobians(self.chain, q, [last])[:, 0, :3]
        square, w = np.sum(v * v, axis=1), w * WIDER
        shares = 2.0 * np.abs(np.einsum("ni,nij->nj", v, J)) * w + 0.5 * w * (w @ self.H)
        width = WIDER * shares.sum(axis=1) + self.rounding * self.scale * (1.0 + w.sum(axis=1))
        r, change = np.sqrt(square), w @ self.slopes + self.rounding
        smallest = np.maximum(np.sqrt(np.maximum(square - width, 0.0)), r - change)
        largest = np.minimum(np.sqrt(square + width) * WIDER, r + change)
        return r, smallest, np.minimum(largest, self.longest), shares


def _separation(
    chain: Articulation, base: FloatArray, interval: tuple[float, float], boxes: int
) -> float:
    """Return a lower bound of how far r is from an interval, by branch and bound."""
    bounds = _Bounds(chain, base)
    if not np.isfinite([bounds.lower, bounds.upper]).all():
        return 0.0
    middle = 0.5 * (bounds.lower + bounds.upper)[None]
    half = 0.5 * (bounds.upper - bounds.lower)[None]
    nearest, closed_gap, count = math.inf, math.inf, 1
    while True:
        r, smallest, largest, shares = bounds(middle, half)
        nearest = min(nearest, np.maximum(r - interval[1], interval[0] - r).min())
        gaps = np.maximum(smallest - interval[1], interval[0] - largest)
        close = gaps >= nearest - min(ACCURACY * bounds.longest, 0.5 * nearest)
        closed_gap = min(closed_gap, gaps[close].min(initial=math.inf))
        middle, half, shares, gaps = (a[~close] for a in (middle, half, shares, gaps))
        count += 2 * len(gaps)
        if nearest <= 0.0 or not shares.size or count > boxes:
            return max(0.0, float(np.append(gaps, closed_gap).min()))  # 0 if it is NaN
        rows, widest = np.arange(len(gaps)), shares.argmax(axis=1)
        half = half.copy()
        half[rows, widest] *= 0.5
        step = np.zeros_like(half)
        step[rows, widest] = half[rows, widest]
        middle, half = np.vstack([middle - step, middle + step]), np.vstack([half, half])
