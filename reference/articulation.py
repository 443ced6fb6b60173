"""Hinge, slide, ball, free and fixed joints with limits: coordinates q to local transforms.

A joint's frame sits in its parent's at an offset and a rotation, its *frame*. The coordinates move
the frame from there: a hinge rotates about its axis and a slide moves along its axis. A ball
rotates by a unit quaternion, a free joint rotates and moves, and a fixed joint stays. A mimic joint
is a hinge or a slide that moves with a leader: its coordinate is the leader's times a multiplier,
plus a shift. The limits of a leader are narrowed so that its followers keep their limits as well.
"""

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from . import arguments, rotation
from .arguments import (
    LARGEST_COORDINATE,
    SMALLEST_POSITIVE,
    FloatArray,
    IndexArray,
    KeepsReadOnly,
    RecordArray,
    frozen,
    is_plain,
)
from .backend.compiled import Kernel
from .quaternion import (
    IDENTITY,
    add,
    dot,
    exponential,
    half_angle,
    load_quaternion,
    load_quaternion_from,
    load_vector,
    logarithm,
    made_unit,
    multiply,
    normalised,
    perpendicular,
    rotate,
    rotation_about,
    scale,
    store_quaternion,
    store_quaternion_to,
    store_vector,
)
from .skeleton import POSE_FIELDS, PoseArrays, Skeleton, checked_skeleton, pose_arrays

# The kinds of joints, by their numbers in kernels.
KINDS = "fixed", "hinge", "slide", "ball", "free"
FIXED, HINGE, SLIDE, BALL, FREE = range(5)
# The number of coordinates and of degrees of freedom of each kind.
WIDTHS = np.array([0, 1, 1, 4, 7])
FREEDOMS = np.array([0, 1, 1, 3, 6])
# A coordinate may be this far outside its limits [rad or m] and still count as within. On an arm of
# a metre this is a nanometre, and some million roundings.
LIMIT_TOLERANCE = 1e-9
# A record of a joint, for kernels.
JOINT = np.dtype(
    [
        ("kind", np.int64),
        ("parent", np.int64),  # -1 of a root
        ("leader", np.int64),  # the joint whose coordinate it moves with, or the joint itself
        ("followed", np.bool_),  # whether mimic joints move with it
        ("coordinate", np.int64),  # where its coordinates begin in q, a mimic joint's: its leader's
        ("freedom", np.int64),  # where its degrees of freedom begin in a velocity, likewise
        ("offset", np.float64, 3),  # from the parent [m]
        ("frame", np.float64, 4),  # rotation in the parent's frame where its coordinates are zero
        ("rotated", np.float64, 4),  # the frame rotated by pi about the axis
        ("axis", np.float64, 3),
        ("lower", np.float64),  # [rad or m]
        ("upper", np.float64),
        ("cone", np.float64),  # [rad]
        ("multiplier", np.float64),  # of its leader's coordinate, 1 of its own
        ("shift", np.float64),  # added to that [rad or m]
    ],
    align=True,
)
# The same with the joint's pose.
POSED = np.dtype([("joint", JOINT), *POSE_FIELDS])


class Mimic(NamedTuple):
    """A joint moving with another: q = multiplier q_leader + shift.

    Attributes:
        leader: the joint followed, by index or name.
        multiplier: of its coordinate.
        shift: added to the product [rad or m].
    """

    leader: int | str
    multiplier: float = 1.0
    shift: float = 0.0


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Articulation(KeepsReadOnly):
    """A tree of joints of several kinds, with limits.

    Its coordinates q, shape (..., coordinate), take the place of the local rotations of a Skeleton.
    Joint after joint they hold an angle [rad] of a hinge, a displacement [m] of a slide, a unit
    quaternion, w first, of a ball. A free joint has a position [m] and a quaternion, a fixed or
    mimic joint nothing. Methods raise a ValueError for an unknown joint, and for q of another
    shape, not finite, or with a quaternion further than 1e-6 from unit length.

    Attributes:
        skeleton: the tree: parents, offsets [m], names.
        kinds: each joint's kind: "fixed", "hinge", "slide", "ball" or "free".
        frames: each joint's rotation in its parent's frame at zero coordinates, (joint, 4).
        axes: unit axes of hinges and slides, and twist axes of balls, (joint, 3).
        lower: least coordinate of hinges and slides, least twist of balls, (joint,). A leader's
            limits are narrowed by the limits of its followers.
        upper: greatest of the same.
        cones: greatest tilt of the axis of a ball [rad], (joint,).
        mimics: the joints that move with their leaders.
        joints: the records (JOINT) of the kernels, a record a joint, not to be written to.
        mechanisms: cache of inverse kinematics, by effectors, of a limited size.
    """

    skeleton: Skeleton
    kinds: tuple[str, ...]
    frames: FloatArray
    axes: FloatArray
    lower: FloatArray
    upper: FloatArray
    cones: FloatArray
    mimics: dict[int, Mimic]
    joints: RecordArray
    mechanisms: dict[Any, Any]

    def __init__(
        self,
        skeleton: Skeleton,
        kinds: str | Sequence[str] = "ball",
        axes: ArrayLike = (0.0, 0.0, 1.0),
        *,
        frames: ArrayLike = IDENTITY,
        lower: ArrayLike = -np.inf,
        upper: ArrayLike = np.inf,
        cones: ArrayLike = np.inf,
        mimics: Mapping[int | str, Mimic] | None = None,
    ) -> None:
        """Check and copy; a single value holds for all joints.

        Args:
            skeleton: the tree; its offsets lead to the joints' frames.
            kinds: of each joint.
            axes: any length but zero.
            frames: unit quaternions.
            lower: limits of hinges [rad], slides [m] and of the twist of balls [rad]; the limits of
                a mimic joint narrow its leader's.
            upper: likewise.
            cones: limits of the tilt of balls [rad].
            mimics: which hinges and slides move with others.

        Raises:
            ValueError: naming the argument, if it has another shape, is out of range, or an axis is
                zero. Also if limits cross or no twist could keep them, a mimic joint or its leader
                is no hinge or slide, or a leader's coordinates cannot keep a mimic joint's limits.
        """
        count = checked_skeleton(skeleton).joint_count
        if isinstance(kinds, str):
            kinds = (kinds,) * count
        names = arguments.sequence("kinds", kinds, count, "a joint")
        names = tuple(arguments.choice("kinds", kind, KINDS) for kind in names)
        numbers = np.array([KINDS.index(kind) for kind in names])
        bounds = _checked_limits(lower, upper, numbers)
        leaders = _checked_mimics({} if mimics is None else mimics, skeleton, names)
        joints = _records(skeleton, numbers, leaders)
        joints["lower"], joints["upper"] = bounds
        _narrow_leaders(joints, skeleton.names)
        joints["frame"] = _per_joint("frames", rotation.unit("frames", frames), count, 4)
        joints["axis"] = _checked_axes(axes, count)
        joints["cone"] = tilts = _checked_bound("cones", cones, count)
        arguments.sizes("cones", np.where(tilts == np.inf, 0.0, tilts), "...")
        joints["rotated"] = rotated_by_pi(joints)
        fields = zip(("lower", "upper", "frame", "axis", "cone"),
                     ("lower", "upper", "frames", "axes", "cones"), strict=True)  # fmt: skip
        arrays = {name: frozen(joints[field].copy()) for field, name in fields}
        self.__dict__.update(
            arrays, skeleton=skeleton, kinds=names, mimics=leaders, joints=joints, mechanisms={}
        )

    @functools.cached_property
    def joint_count(self) -> int:
        """Number of joints, fixed joints and the root included."""
        return self.skeleton.joint_count

    @property
    def names(self) -> tuple[str, ...]:
        """The joints' names."""
        return self.skeleton.names

    @functools.cached_property
    def coordinate_count(self) -> int:
        """The number of coordinates q."""
        return int(WIDTHS[self.joints["kind"][self._leading]].sum())

    @functools.cached_property
    def freedom_count(self) -> int:
        """The number of degrees of freedom, the entries of a velocity."""
        return int(FREEDOMS[self.joints["kind"][self._leading]].sum())

    @property
    def limited(self) -> bool:
        """Whether any joint has limits."""
        return bool(np.isfinite([self.lower, self.upper, self.cones]).any())

    def index(self, joint: int | str, argument: str = "joint") -> int:
        """Return the index of a joint, as `Skeleton.index` does."""
        return self.skeleton.index(joint, argument)

    def coordinates_of(self, joint: int | str) -> slice:
        """Return the slice of a joint's coordinates in q, of a mimic joint its leader's."""
        return self._range("coordinate", WIDTHS, joint)

    def freedoms_of(self, joint: int | str) -> slice:
        """Return the slice of a joint's degrees of freedom in a velocity, likewise."""
        return self._range("freedom", FREEDOMS, joint)

    def _range(self, field: str, counts: IndexArray, joint: int | str) -> slice:
        j = self.index(joint)
        begin = int(self.joints[field][j])
        return slice(begin, begin + int(counts[self.joints["kind"][j]]))

    def neutral(self) -> FloatArray:
        """Return the coordinates in which every joint is at zero, or at its nearest limit."""
        return self.clamp(self.zero())

    def zero(self) -> FloatArray:
        """Return the coordinates in which every joint is at zero, limits or not."""
        q = np.zeros(self.coordinate_count)
        q[self.quaternions[:, 0]] = 1.0
        return q

    def random(self, rng: np.random.Generator, *shape: int) -> FloatArray:
        """Return coordinates drawn evenly within the limits, (..., coordinate), by a generator.

        Without limits a hinge is drawn from all angles, a slide or a free joint from within a metre
        of zero, and rotations evenly among all. A limited ball has its swing and twist drawn.
        """
        arguments.instance("rng", rng, np.random.Generator)
        shape = arguments.lengths("shape", shape)
        q = np.empty((math.prod(shape), self.coordinate_count))
        for joint in self._leading:
            q[:, self.coordinates_of(int(joint))] = _drawn(rng, self, int(joint), len(q))
        return q.reshape(*shape, self.coordinate_count)

    def clamp(self, q: ArrayLike) -> FloatArray:
        """Return coordinates with each joint brought to the nearest within its limits."""
        result = self.checked("q", q).copy()
        _clamp(self.joints, one_batch(result))
        return result

    def within_limits(self, q: ArrayLike, tolerance: float = LIMIT_TOLERANCE) -> np.ndarray:
        """Return whether each q keeps all limits to a tolerance [rad or m], shape (...)."""
        q = self.checked("q", q)
        excess = np.empty(q.shape[:-1])
        _excess(self.joints, one_batch(q), excess.reshape(-1))
        return excess <= arguments.number("tolerance", tolerance, minimum=0.0)

    def local_transforms(self, q: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return positions (..., joint, 3) [m] and rotations (..., joint, 4) in parents' frames."""
        return self._transforms(_locals, q)

    def forward(self, q: ArrayLike, out: PoseArrays = None) -> tuple[FloatArray, FloatArray]:
        """Return global positions (..., joint, 3) [m] and rotations (..., joint, 4), in `out`."""
        if out is None and is_plain(q, (self.coordinate_count,)):  # often one of many short calls
            count, unit = len(self.joints), np.empty(self.coordinate_count)
            positions, rotations = np.empty((count, 3)), np.empty((count, 4))
            if _forward_single(self.joints, unit, q, positions, rotations):
                return positions, rotations
        return self._transforms(_forward, q, out)

    def _transforms(
        self, kernel: Kernel, q: ArrayLike, out: PoseArrays = None
    ) -> tuple[FloatArray, FloatArray]:
        q = arguments.floats("q", q, "...", self.coordinate_count)
        q, positions, rotations = pose_arrays(out, q, *q.shape[:-1], self.joint_count)
        if kernel(self.joints, one_batch(q), one_batch(positions, 2), one_batch(rotations, 2)):
            return positions, rotations
        # raise, or the lengths were within rounding of the tolerance
        return self._transforms(kernel, self.checked("q", q), out)

    def checked(self, name: str, q: ArrayLike) -> FloatArray:
        """Return coordinates (..., coordinate), their quaternions made unit."""
        q = arguments.coordinates(name, q, "...", self.coordinate_count)
        if not len(self.quaternions):
            return q
        result = q.copy()
        result[..., self.quaternions] = rotation.unit(name, q[..., self.quaternions])
        return result

    @functools.cached_property
    def quaternions(self) -> IndexArray:
        """The indices of quaternions in q, (quaternion, 4)."""
        rotating = [int(joint) for joint in self._leading if self.kinds[joint] in ("ball", "free")]
        ends = [self.coordinates_of(joint).stop for joint in rotating]
        return frozen(np.array(ends, dtype=np.int64)[:, None] - np.arange(4, 0, -1))

    @functools.cached_property
    def _leading(self) -> IndexArray:
        """Return the joints with coordinates of their own."""
        own = self.joints["kind"] != FIXED
        own[list(self.mimics)] = False
        return np.flatnonzero(own)

    def __repr__(self) -> str:
        return f"Articulation({self.joint_count} joints, {self.freedom_count} degrees of freedom)"


def balls(skeleton: Skeleton) -> Articulation:
    """Return the skeleton as an Articulation of unlimited balls, cached by the skeleton."""
    cache = skeleton.__dict__
    if "balls" not in cache:
        cache["balls"] = Articulation(skeleton, "ball")
    return cache["balls"]


def one_batch(values: np.ndarray, axes: int = 1) -> np.ndarray:
    """Return a view with all leading axes joined, but for the last `axes`."""
    return values.reshape(math.prod(values.shape[:-axes]), *values.shape[-axes:])


def joint_transform(joints, j, q):
    """Return a joint's position and rotation in its parent's frame."""
    x, R = load_vector(joints["offset"], j), load_quaternion(joints["frame"], j)
    kind, at = joints["kind"][j], joints["coordinate"][j]
    if kind == HINGE:
        c, s = half_angle(joints["multiplier"][j] * q[at] + joints["shift"][j])
        P = load_quaternion(joints["rotated"], j)  # R axis
        R = c * R[0] + s * P[0], c * R[1] + s * P[1], c * R[2] + s * P[2], c * R[3] + s * P[3]
    elif kind == SLIDE:
        distance = joints["multiplier"][j] * q[at] + joints["shift"][j]
        x = add(x, rotate(R, scale(distance, load_vector(joints["axis"], j))))
    elif kind == BALL:
        R = multiply(R, load_quaternion_from(q, at))
    elif kind == FREE:
        x = add(x, rotate(R, (q[at], q[at + 1], q[at + 2])))
        R = multiply(R, load_quaternion_from(q, at + 3))
    return x, R


def rotated_by_pi(joints: RecordArray) -> FloatArray:
    """Return each joint's frame rotated by pi about its axis, (joint, 4)."""
    half = np.column_stack([np.zeros(len(joints)), joints["axis"]])
    return rotation.multiply(np.ascontiguousarray(joints["frame"]), half)


def swing_twist(Q, axis):
    """Return swing S and twist angle t [rad] of Q = S exp(t axis): first t about the axis."""
    along = dot((Q[1], Q[2], Q[3]), axis)
    if Q[0] == 0.0 and along == 0.0:  # by pi about a perpendicular axis any twist is right
        return Q, 0.0
    twist = 2.0 * math.atan2(along, Q[0])
    if twist > math.pi:
        twist -= 2.0 * math.pi
    elif twist <= -math.pi:
        twist += 2.0 * math.pi
    return multiply(Q, rotation_about(axis, -twist)), twist


def clamp_ball(Q, axis, lower, upper, cone):
    """Return the rotation with its swing cut down to the cone and its twist to its range."""
    swing, twist = swing_twist(Q, axis)
    tilt = logarithm(swing)
    angle = math.sqrt(dot(tilt, tilt))
    bounded = min(max(twist, lower), upper)
    if angle <= cone and bounded == twist:
        return Q
    if angle > cone:
        swing = exponential(scale(cone / angle, tilt))
    return normalised(multiply(swing, rotation_about(axis, bounded)))


def clamp_joint(joints, j, q):
    """Bring the coordinates of a joint within its limits."""
    kind, at = joints["kind"][j], joints["coordinate"][j]
    if joints["leader"][j] != j:
        return
    if kind in (HINGE, SLIDE):
        q[at] = min(max(q[at], joints["lower"][j]), joints["upper"][j])
    elif kind == BALL:
        bounds = joints["lower"][j], joints["upper"][j], joints["cone"][j]
        Q = clamp_ball(load_quaternion_from(q, at), load_vector(joints["axis"], j), *bounds)
        store_quaternion_to(q, at, Q)


def joint_excess(joints, j, q):
    """Return the excess [rad or m] of a joint over its limits, of a follower over its leader's."""
    kind, at, leader = joints["kind"][j], joints["coordinate"][j], joints["leader"][j]
    if kind in (HINGE, SLIDE):
        excess = max(joints["lower"][leader] - q[at], q[at] - joints["upper"][leader], 0.0)
        return abs(joints["multiplier"][j]) * excess
    if kind == BALL:
        swing, twist = swing_twist(load_quaternion_from(q, at), load_vector(joints["axis"], j))
        tilt = logarithm(swing)
        excess = math.sqrt(dot(tilt, tilt)) - joints["cone"][j]
        return max(joints["lower"][j] - twist, twist - joints["upper"][j], excess, 0.0)
    return 0.0


def normalise_start(joints, q):
    """Make quaternions unit; return whether all were unit to 1e-6, and all numbers up to 1e75."""
    valid = True
    for k in range(len(q)):
        valid &= abs(q[k]) <= LARGEST_COORDINATE
    for j in range(len(joints)):
        if joints["kind"][j] in (BALL, FREE):
            at = ball_coordinate(joints, j)
            Q, unit = made_unit(load_quaternion_from(q, at))
            store_quaternion_to(q, at, Q)
            valid &= unit
    return valid


def unit_start(joints, q, unit):
    """Fill coordinates with unit quaternions; return what `normalise_start` does."""
    for k in range(len(unit)):  # a slice would compile numba's messages about shapes
        unit[k] = q[k]
    return normalise_start(joints, unit)


def ball_coordinate(joints, j):
    """Return the index in q of the quaternion of a ball or free joint."""
    return joints["coordinate"][j] + (3 if joints["kind"][j] == FREE else 0)


def joint_in_world(joints, j, q, positions, rotations):
    """Return a joint's position and rotation in the world, from its parent's."""
    x, R = joint_transform(joints, j, q)
    parent = joints["parent"][j]
    if parent >= 0:
        R_parent = load_quaternion(rotations, parent)
        x = add(load_vector(positions, parent), rotate(R_parent, x))
        R = multiply(R_parent, R)
    return x, R


def articulated_pose(joints, q, positions, rotations):
    """Fill global positions (joint, 3) and rotations (joint, 4) from q."""
    for j in range(len(joints)):
        x, R = joint_in_world(joints, j, q, positions, rotations)
        store_vector(positions, j, x)
        store_quaternion(rotations, j, R)


def _clamp_batch(joints, q):
    for i in range(len(q)):
        for j in range(len(joints)):
            clamp_joint(joints, j, q[i])


def _excess_batch(joints, q, excess):
    for i in range(len(q)):
        excess[i] = 0.0
        for j in range(len(joints)):
            excess[i] = max(excess[i], joint_excess(joints, j, q[i]))


def _locals_batch(joints, q, offsets, rotations):
    unit = np.empty(q.shape[1])
    for i in range(len(q)):
        if not unit_start(joints, q[i], unit):
            return False
        for j in range(len(joints)):
            x, R = joint_transform(joints, j, unit)
            store_vector(offsets[i], j, x)
            store_quaternion(rotations[i], j, R)
    return True


def _forward_one(joints, unit, q, positions, rotations):
    if not unit_start(joints, q, unit):
        return False
    articulated_pose(joints, unit, positions, rotations)
    return True


def _forward_batch(joints, q, positions, rotations):
    unit, valid = np.empty(q.shape[1]), True
    for i in range(len(q)):
        valid &= _forward_one(joints, unit, q[i], positions[i], rotations[i])
    return valid


def _forward_of_posed(unit, table, q):
    posed = table.view(POSED)
    return (
        q.dtype == table.dtype
        and q.shape == unit.shape
        and _forward_one(posed["joint"], unit, q, posed["position"], posed["rotation"])
    )


_clamp = Kernel(_clamp_batch)
_excess = Kernel(_excess_batch)
_locals = Kernel(_locals_batch)
_forward = Kernel(_forward_batch, label="forward_kinematics of a batch of articulations")
_forward_single = Kernel(_forward_one, label="forward_kinematics of articulations", nogil=False)
forward_posed = Kernel(
    _forward_of_posed, label="prepared forward_kinematics of articulations", nogil=False
)


def _per_joint(name: str, values: FloatArray, count: int, *axes: int) -> FloatArray:
    """Return values, (joint, *axes), spread where a single value stands for all."""
    batch = values.shape[: values.ndim - len(axes)]
    if batch not in ((), (count,)):
        raise ValueError(f"{name}: expected one, or one for each of {count} joints, got {batch}")
    return arguments.spread(values, (count, *axes))


def _checked_axes(axes: ArrayLike, count: int) -> FloatArray:
    vectors = _per_joint("axes", arguments.coordinates("axes", axes, "...", 3), count, 3)
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    if (lengths < SMALLEST_POSITIVE).any():
        raise ValueError(
            f"axes: expected lengths of at least {SMALLEST_POSITIVE:g}, got {lengths.min():g}"
        )
    return vectors / lengths


def _checked_limits(
    lower: ArrayLike, upper: ArrayLike, kinds: IndexArray
) -> tuple[FloatArray, FloatArray]:
    """Return both limits, in order, and kept by some twist from -pi to pi of each ball."""
    count = len(kinds)
    lower, upper = _checked_bound("lower", lower, count), _checked_bound("upper", upper, count)
    for joint in np.flatnonzero(lower > upper):
        number, limit = arguments.distinct_texts(lower[joint], upper[joint])
        raise ValueError(
            f"lower: expected at most the upper limit, {limit}, got {number} for joint {joint}"
        )
    for joint in np.flatnonzero((kinds == BALL) & ((lower > np.pi) | (upper < -np.pi))):
        start, _ = arguments.distinct_texts(lower[joint], np.pi)
        end, _ = arguments.distinct_texts(upper[joint], -np.pi)
        raise ValueError(
            f"lower: expected limits of a ball's twist within -pi to pi, got {start} to "
            f"{end} for joint {joint}"
        )
    return lower, upper


def _checked_bound(name: str, value: ArrayLike, count: int) -> FloatArray:
    """Return numbers, finite or infinite, (joint,)."""
    bounds = _per_joint(name, arguments.floats(name, value, "..."), count)
    if np.isnan(bounds).any():
        raise ValueError(f"{name}: expected numbers or infinity, got NaN")
    arguments.array(name, bounds[np.isfinite(bounds)], "...")
    return bounds + 0.0  # no -0.0, from which no generator draws


def _checked_mimics(
    mimics: Mapping[int | str, Mimic], skeleton: Skeleton, kinds: tuple[str, ...]
) -> dict[int, Mimic]:
    """Return the mimics by index, each with a leader that is no mimic joint itself."""
    if not isinstance(mimics, Mapping):
        raise ValueError(f"mimics: expected a mapping of joints, got {arguments.shown(mimics)}")
    followers = {}
    for joint, mimic in mimics.items():
        if not isinstance(mimic, tuple | list) or not 1 <= len(mimic) <= 3:
            raise ValueError(f"mimics: expected a Mimic, got {arguments.shown(mimic)}")
        followers[skeleton.index(joint, "mimics")] = Mimic(*mimic)
    leaders = {joint: skeleton.index(mimic.leader, "mimics") for joint, mimic in followers.items()}
    checked: dict[int, Mimic] = {}
    for joint in followers:
        chain: dict[int, None] = {}  # towards the first leader
        while joint in leaders and joint not in checked:
            if joint in chain:
                name = skeleton.names[joint]
                raise ValueError(f"mimics: expected a leader, got {name!r} in a ring")
            chain[joint] = None
            joint = leaders[joint]
        for follower in reversed(chain):
            multiplier = arguments.number("mimics", followers[follower].multiplier)
            shift = arguments.number("mimics", followers[follower].shift)
            first, factor, offset = checked.get(leaders[follower], Mimic(leaders[follower]))
            checked[follower] = Mimic(
                first,
                arguments.number("mimics", multiplier * factor),
                arguments.number("mimics", multiplier * offset + shift),
            )
    for joint in {*followers, *leaders.values()}:
        if kinds[joint] not in ("hinge", "slide"):
            raise ValueError(
                f"mimics: expected hinges or slides, got {kinds[joint]!r} for joint {joint}"
            )
    return checked


def _records(skeleton: Skeleton, kinds: IndexArray, mimics: Mapping[int, Mimic]) -> RecordArray:
    """Return the joints with offsets, kinds and mimics; the other fields are still to be filled."""
    joints = np.zeros(len(kinds), JOINT)
    joints["parent"], joints["offset"], joints["kind"] = skeleton.parents, skeleton.offsets, kinds
    joints["leader"], joints["multiplier"] = np.arange(len(kinds)), 1.0
    for joint, (leader, multiplier, shift) in mimics.items():
        joints["leader"][joint], joints["followed"][leader] = leader, True
        joints["multiplier"][joint], joints["shift"][joint] = multiplier, shift
    number_coordinates(joints)
    return joints


def _narrow_leaders(joints: RecordArray, names: tuple[str, ...]) -> None:
    """Narrow the limits of leaders so that all followers keep their limits."""
    for j in np.flatnonzero(joints["leader"] != np.arange(len(joints))):
        leader = joints[joints["leader"][j]]
        least, greatest = _bounds_by_follower(joints[j])
        lower, upper = max(leader["lower"], least), min(leader["upper"], greatest)
        if lower > min(upper + LIMIT_TOLERANCE, LARGEST_COORDINATE) or upper < -LARGEST_COORDINATE:
            raise ValueError(
                f"mimics: expected a coordinate of {names[joints['leader'][j]]!r} that keeps the "
                f"limits of its follower {names[j]!r}, got none from {leader['lower']:g} to "
                f"{leader['upper']:g}"
            )
        if lower > upper:  # by rounding
            lower = upper = 0.5 * (lower + upper)
        leader["lower"], leader["upper"] = lower, upper


def _bounds_by_follower(follower: Any) -> tuple[float, float]:
    """Return the least and the greatest coordinate of a leader by the limits of its follower."""
    multiplier, shift = float(follower["multiplier"]), float(follower["shift"])
    least, greatest = float(follower["lower"]) - shift, float(follower["upper"]) - shift
    if multiplier == 0.0:  # the follower stays at its shift
        is_within = least <= LIMIT_TOLERANCE and greatest >= -LIMIT_TOLERANCE
        return (-math.inf, math.inf) if is_within else (math.inf, -math.inf)
    bounds = np.sort([least / multiplier, greatest / multiplier]) + 0.0  # no -0.0
    bounds[np.abs(bounds) > LARGEST_COORDINATE] *= math.inf
    return float(bounds[0]), float(bounds[1])


def number_coordinates(joints: RecordArray) -> IndexArray:
    """Fill the first coordinate and freedom of joints; return their numbers of coordinates."""
    leads = joints["leader"] == np.arange(len(joints))
    for field, counts in (("freedom", FREEDOMS), ("coordinate", WIDTHS)):
        own = np.where(leads, counts[joints["kind"]], 0)
        joints[field] = (np.cumsum(own) - own)[joints["leader"]]
    return own


def _drawn(rng: np.random.Generator, joints: Articulation, j: int, count: int) -> FloatArray:
    """Return random coordinates of a joint, (count, width)."""
    kind, lower, upper = joints.kinds[j], joints.lower[j], joints.upper[j]
    if kind in ("hinge", "slide"):
        interval = _interval(lower, upper, np.pi if kind == "hinge" else 1.0)
        return rng.uniform(*interval, (count, 1))
    if kind == "free":
        return np.hstack([rng.uniform(-1.0, 1.0, (count, 3)), rotation.random(rng, count)])
    if not np.isfinite([lower, upper, joints.cones[j]]).any():
        return rotation.random(rng, count)
    axis = joints.axes[j]
    twist = rng.uniform(*_interval(lower, upper, np.pi), (count, 1)) * axis
    heading = rng.uniform(-np.pi, np.pi, (count, 1))
    first = np.array(perpendicular(tuple(axis)))
    across = np.cos(heading) * first + np.sin(heading) * np.cross(axis, first)
    tilt = np.arccos(rng.uniform(np.cos(min(joints.cones[j], np.pi)), 1.0, (count, 1)))
    return rotation.multiply(rotation.exponential(tilt * across), rotation.exponential(twist))


def _interval(lower: float, upper: float, span: float) -> tuple[float, float]:
    """Return the limits; a missing limit is a span from the other limit, or from zero."""
    if np.isinf(lower) and np.isinf(upper):
        return -span, span
    if np.isinf(lower):
        return min(-span, upper - span), upper
    return lower, (max(span, lower + span) if np.isinf(upper) else upper)
