"""Proofs about a pose q: its distance from the target, and an exact solution nearby or nowhere.

F holds distances over the reach and, for a target rotation, twice the vector part of the quaternion
from target to effector. Newton's method polishes q to p within the limits. Let J be the Jacobian of
F for the joints off their limits, B an approximate right inverse, and L a Lipschitz constant of J.
With a = 1 - |I - J B| > 0 (Kantorovich 1948)

    2 L |B|² |F(p)| < a²  =>  F(p + B z) = 0 for some |z| <= r,
    r = 2 |F(p)| / (a + sqrt(a² - 2 L |B|² |F(p)|)).

Joint i moves by at most |B_i| r, which must stay within its limits. docs/certificates.md has the
proof, the constant L, and the rounding errors of forward kinematics. `reach` proves that no
configuration reaches a target.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments
from ..arguments import BoolArray, FloatArray, IndexArray
from ..articulation import BALL, FREE, FREEDOMS, HINGE, LIMIT_TOLERANCE, SLIDE, Articulation, balls
from ..implicit_euler.certificate import kantorovich_distance
from ..jacobians import difference, integrate, jacobians
from ..model import Model, checked_model, coordinates_name
from ..outcome import SentenceEnum
from ..quaternion import conjugate, multiply
from ..skeleton import Skeleton
from .problem import CheckedTarget, Target, checked_settings, single_targets
from .reach import UNIT, least_distance
from .solve import solve_checked

# Roundings of UNIT by a joint: of its quaternion, and of its offset; see docs/certificates.md.
QUATERNION_ROUNDINGS, OFFSET_ROUNDINGS = 48, 130
# Factor to cover the rounding errors of the bounds themselves.
SLACK = 1.0 + 1e-8
# The answer is polished to this distance [m] and angle [rad]. From there Newton steps, which square
# the error, come to rounding with the first; further steps repair a step along a limit.
POLISHED, NEWTON_STEPS = 1e-11, 3
# A Newton step by more leads to no solution [rad or m].
LARGEST_STEP = 1e9
# A joint this near to its limit stays where it is [rad or m]. A larger margin frees fewer joints
# and proves fewer poses, and no pose wrongly.
MARGIN = 1e-7
# Displacements [rad or m] for which lengths of slides and angles of mimic joints are bounded. No
# proof is made by larger displacements.
EXTENT = 1.0
# |F| of a point that is a solution up to rounding. The number only words the reason why a proof
# fails.
SOLVED = 1e-9


class IKCoverage(SentenceEnum):
    """What is proven about exact solutions, or why nothing is."""

    COVERED = "A pose within the limits and the distance meets the target exactly."
    IMPOSSIBLE = "No pose within the limits meets the target."
    TOO_FEW_FREEDOMS = "Open: fewer joints can move than the target has equations."
    SINGULAR = "Open: the pose is singular, or rounding hides that it is not."
    TOO_FAR = "Open: Newton's method does not find a solution from here."
    AT_LIMIT = "Open: the solution nearby may lie beyond the limits."


@dataclass(frozen=True)
class IKCertificate:
    """Proven bounds for a pose as the answer to targets, rounding included.

    Attributes:
        residual: upper bound of the distance from any effector to its target [m].
        residual_rotation: upper bound of the angle between the two [rad]; 0 with a free rotation.
        rounding: the part of `residual` that covers forward kinematics in floating point [m].
        reached: whether both are within the tolerances, and all joints within their limits.
        coverage: whether an exact solution is proven, or proven impossible, or why neither.
        distance: radius about the pose that contains an exact solution within the limits, infinite
            without a proof: the root of the sum of squares of joint displacements [rad, slides m].
        least_distance: for every pose within the limits some effector's distance [m] plus `lever`
            times its angle [rad] is at least this bound; 0 without a proof.
        lever: of the angle [m]; 0 if the rotation is free.
    """

    residual: float
    residual_rotation: float
    rounding: float
    reached: bool
    coverage: IKCoverage
    distance: float = math.inf
    least_distance: float = 0.0
    lever: float = 0.0

    @property
    def covered(self) -> bool:
        """Whether an exact solution is proven to lie within the distance."""
        return self.coverage == IKCoverage.COVERED

    @property
    def impossible(self) -> bool:
        """Whether no pose within the limits meets the targets."""
        return self.coverage == IKCoverage.IMPOSSIBLE


@np.errstate(all="ignore")  # bounds that overflow prove nothing, nor does NaN
def certify_ik(
    model: Model,
    pose: ArrayLike,
    target: ArrayLike | Target | Sequence[Target],
    effector: int | str | None = None,
    *,
    tolerance: float = 1e-4,
    tolerance_rotation: float = 1e-4,
) -> IKCertificate:
    """Return what is proven about a pose as the answer to targets, with the rounding errors.

    `pose` holds the local rotations of a Skeleton, (joint, 4), or the coordinates of an
    Articulation or a Robot, (coordinate,). Any solver may have found the pose; the other arguments
    are as for `judge_pose`. An exact solution is a pose in exact arithmetic of the model and target
    which the floating-point inputs define, quaternions and axes made unit. Without a proven
    solution, shells of reach try to prove the target impossible; a model caches the shells of an
    effector.

    Raises:
        ValueError: if an argument has another shape or is not finite, a quaternion is further than
            1e-6 from unit length, or an effector does not exist.
    """
    model = checked_model(model, "model")
    targets = single_targets(model, target, effector)
    limits = (
        arguments.number("tolerance", tolerance, minimum=0.0),
        arguments.number("tolerance_rotation", tolerance_rotation, minimum=0.0),
    )
    articulation = balls(model) if isinstance(model, Skeleton) else model
    name, shape = coordinates_name(model), (articulation.coordinate_count,)
    if isinstance(model, Skeleton):
        pose = arguments.array(name, pose, model.joint_count, 4).reshape(shape)
    q = articulation.checked(name, arguments.coordinates(name, pose, *shape))
    equations = Equations(articulation, targets, q)
    distance, angle, rounding = equations.residuals(q)
    reached = distance <= limits[0] and angle <= limits[1]
    reached &= bool(articulation.within_limits(q, LIMIT_TOLERANCE))
    coverage, radius = exact_solution(equations, q)
    bound, lever = 0.0, 0.0
    if coverage != IKCoverage.COVERED:
        bound, lever = max(
            least_distance(articulation, t.joint, t.position, t.rotation) for t in targets
        )
        coverage = IKCoverage.IMPOSSIBLE if bound > 0.0 else coverage
    return IKCertificate(distance, angle, rounding, reached, coverage, radius, bound, lever)


class Path(NamedTuple):
    """The motions by the joints of a path: one by a hinge, three by a ball, six by a free joint."""

    joints: IndexArray  # from the root on
    lengths: FloatArray  # of their offsets [m], (joint,)
    numbers: IndexArray  # the position of each motion's joint on the path, (motion,)
    turns: FloatArray  # 1 of a rotation, 0 of a translation, (motion,)
    shares: FloatArray  # of the freedoms' velocities, (motion, freedom), not negative
    is_plain: bool  # whether there are neither slides nor mimic or free joints


class PathBounds(NamedTuple):
    """Bounds within EXTENT of a pose."""

    arms: FloatArray  # from each joint on the path to the effector [m], (joint,)
    position: float  # rounding error of the effector's position [m]
    rotation: float  # of its quaternion


class Equations:
    """F(q) = 0 for targets of an articulation, and bounds of its rounding and derivatives."""

    def __init__(self, model: Articulation, targets: Sequence[CheckedTarget], q: FloatArray):
        self.model, self.targets = model, targets
        self.joints = [target.joint for target in targets]
        self.paths = [path_of(model, joint) for joint in self.joints]
        self.bounds = [path_bounds(model, path, q) for path in self.paths]
        self.count = sum(3 if target.rotation is None else 6 for target in targets)
        self.length = max(float(path.lengths[1:].sum()) for path in self.paths) or 1.0

    def residuals(self, q: FloatArray) -> tuple[float, float, float]:
        """Return upper bounds of the distance [m], the angle [rad], and the rounding error [m]."""
        x, R = self.model.forward(q)
        distances, angles, errors = [], [0.0], []
        for target, bounds in zip(self.targets, self.bounds, strict=True):
            errors.append(bounds.position + 8.0 * UNIT * float(np.linalg.norm(target.position)))
            distances.append(float(np.linalg.norm(x[target.joint] - target.position)) + errors[-1])
            if target.rotation is not None:
                _, a, b, c = _quaternion_between(target.rotation, R[target.joint])
                sine = math.hypot(a, b, c) + bounds.rotation + 16.0 * UNIT
                angles.append(2.0 * SLACK * math.asin(min(1.0, sine)))
        return max(distances) * (1.0 + 8.0 * UNIT), max(angles), max(errors)

    def evaluate(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return F, (equation,), and its Jacobian, (equation, freedom)."""
        x, R = self.model.forward(q)
        J = jacobians(self.model, q, self.joints)
        F, rows = [], []
        for target, derivative in zip(self.targets, J, strict=True):
            F.append((x[target.joint] - target.position) / self.length)
            rows.append(derivative[:3] / self.length)
            if target.rotation is not None:
                w, a, b, c = _quaternion_between(target.rotation, R[target.joint])
                F.append(2.0 * np.array([a, b, c]))
                rows.append(np.array([[w, c, -b], [-c, w, a], [b, -a, w]]) @ derivative[3:])
        return np.concatenate(F), np.concatenate(rows)

    def rounding(self) -> tuple[float, float]:
        """Return upper bounds of the rounding errors of F and of its Jacobian, in norm.

        An entry of the Jacobian is an axis, off by 6 e + 64 u, or its product with an arm.
        """
        total, total_jacobian = 0.0, 0.0
        for target, path, bounds in zip(self.targets, self.paths, self.bounds, strict=True):
            position = bounds.position + 8.0 * UNIT * float(np.linalg.norm(target.position))
            axis = 6.0 * bounds.rotation + 64.0 * UNIT
            linear = (axis + 16.0 * UNIT) * float(bounds.arms[0]) + 3.0 * position
            linear += 0.0 if path.turns.all() else axis
            total += position / self.length + 2.0 * (bounds.rotation + 16.0 * UNIT)
            shares = float(np.linalg.norm(path.shares.sum(axis=0)))
            total_jacobian += (linear / self.length + 2.0 * axis) * shares
        return SLACK * total, SLACK * total_jacobian

    def lipschitz(self, free: BoolArray) -> float:
        """Return a Lipschitz constant of the Jacobian by the free freedoms, within EXTENT."""
        squares = 0.0
        for target, path, bounds in zip(self.targets, self.paths, self.bounds, strict=True):
            arms = np.where(path.turns > 0.0, bounds.arms[path.numbers], 1.0)
            pairs = np.triu(path.turns[:, None] * arms)
            pairs += np.triu(pairs, 1).T
            shares = path.shares[:, free]
            squares += float(np.sum((shares.T @ pairs @ shares) ** 2)) / self.length**2
            if target.rotation is not None:
                squares += 0.25 * float(np.sum((path.turns @ shares) ** 2)) ** 2
        return SLACK * math.sqrt(squares)


def path_of(model: Articulation, joint: int) -> Path:
    """Return the path to a joint, kept by the model."""
    key = "path", joint
    if key not in model.mechanisms:
        joints = model.skeleton.path_array(joint)
        records = model.joints[joints]
        motions = [(k, i) for k, kind in enumerate(records["kind"]) for i in range(FREEDOMS[kind])]
        shares = np.zeros((len(motions), model.freedom_count))
        turns = np.zeros(len(motions))
        for row, (k, i) in enumerate(motions):
            kind = records["kind"][k]
            turns[row] = kind in (HINGE, BALL) or (kind == FREE and i >= 3)
            shares[row, records["freedom"][k] + i] = abs(records["multiplier"][k])
        numbers = np.array([k for k, _ in motions], dtype=np.int64)
        follows = records["leader"] != joints
        is_plain = not (follows | np.isin(records["kind"], (SLIDE, FREE))).any()
        lengths = np.linalg.norm(records["offset"], axis=1)
        model.mechanisms[key] = Path(joints, lengths, numbers, turns, shares, is_plain)
    path: Path = model.mechanisms[key]
    return path


def path_bounds(model: Articulation, path: Path, q: FloatArray) -> PathBounds:
    """Return bounds of the arms on a path and of its rounding errors, within EXTENT of q."""
    lengths, arguments_errors = path.lengths, np.zeros(len(path.lengths))
    is_hinge = np.ones(len(lengths), dtype=bool)
    if not path.is_plain:
        lengths, records = lengths.copy(), model.joints[path.joints]
        is_hinge = records["kind"] == HINGE
        for k, record in enumerate(records):
            at, product = record["coordinate"], 0.0
            if record["kind"] == FREE:
                lengths[k] += float(np.linalg.norm(q[at : at + 3])) + EXTENT
            elif record["kind"] in (HINGE, SLIDE):
                product = abs(record["multiplier"]) * (abs(q[at]) + EXTENT) + abs(record["shift"])
                arguments_errors[k] = 2.0 * UNIT * product * (record["leader"] != path.joints[k])
            if record["kind"] == SLIDE:
                lengths[k] += product
    quaternions = np.cumsum(QUATERNION_ROUNDINGS * UNIT + is_hinge * arguments_errors)
    parents = np.concatenate([[0.0], quaternions[:-1]])
    errors = lengths * (6.0 * parents + OFFSET_ROUNDINGS * UNIT) + ~is_hinge * arguments_errors
    total = SLACK * float(errors.sum() + 2.0 * UNIT * np.cumsum(lengths).sum())
    return PathBounds(lengths.sum() - np.cumsum(lengths), total, SLACK * float(quaternions[-1]))


def exact_solution(equations: Equations, q: FloatArray) -> tuple[IKCoverage, float]:
    """Return whether an exact solution is proven near q, and its distance, infinite without."""
    model, count = equations.model, equations.count
    settings = checked_settings("levenberg_marquardt", POLISHED, POLISHED, None, 0, 0, False)
    p = solve_checked(model, q, list(equations.targets), settings).coordinates
    freedoms, coordinates, lower, upper, free = _limited_freedoms(model)
    free &= np.any([path.shares.any(axis=0) for path in equations.paths], axis=0)
    room = np.minimum(p[coordinates] - lower, upper - p[coordinates])
    free[freedoms[room < MARGIN]] = False
    if free.sum() < count:
        return IKCoverage.TOO_FEW_FREEDOMS, math.inf
    error, error_jacobian = equations.rounding()
    F, J = equations.evaluate(p)
    for _ in range(NEWTON_STEPS):
        if not (np.isfinite(F).all() and np.isfinite(J).all()):
            return IKCoverage.TOO_FAR, math.inf
        B = np.linalg.pinv(J[:, free])
        if np.linalg.norm(F) <= error:
            break
        step = np.zeros(model.freedom_count)
        step[free] = -B @ F
        if not np.abs(step).max() <= LARGEST_STEP:
            return IKCoverage.TOO_FAR, math.inf
        p = integrate(model, p, step)
        F, J = equations.evaluate(p)
    J = J[:, free]
    inverse, size = SLACK * float(np.linalg.norm(B)), SLACK * (float(np.linalg.norm(F)) + error)
    products = (J.shape[1] + 2) * 2.0 * UNIT * float(np.linalg.norm(J)) * inverse
    defect = float(np.linalg.norm(np.eye(count) - J @ B)) + products + error_jacobian * inverse
    a, L = 1.0 - SLACK * defect, equations.lipschitz(free)
    if not (a > 0.0 and 2.0 * SLACK * L * inverse**2 * size < a * a):
        cause = IKCoverage.SINGULAR if size <= SOLVED else IKCoverage.TOO_FAR
        return cause, math.inf
    r = SLACK * kantorovich_distance(size / a, SLACK * L * inverse**2 * size / (a * a))
    changes = np.zeros(model.freedom_count)
    changes[free] = SLACK * r * np.linalg.norm(B, axis=1)
    room = np.minimum(p[coordinates] - lower, upper - p[coordinates])
    if (changes[freedoms] > room).any():
        return IKCoverage.AT_LIMIT, math.inf
    rounding = 64.0 * UNIT * (1 + len(free))
    distance = SLACK * (float(np.linalg.norm(difference(model, p, q))) + inverse * r) + rounding
    if distance > EXTENT and not all(path.is_plain for path in equations.paths):
        return IKCoverage.TOO_FAR, math.inf
    return IKCoverage.COVERED, distance


def _limited_freedoms(
    model: Articulation,
) -> tuple[IndexArray, IndexArray, FloatArray, FloatArray, BoolArray]:
    """Return freedoms, coordinates and limits of hinges and slides, and which freedoms may move."""
    joints = model.joints
    leads = joints["leader"] == np.arange(len(joints))
    single = joints[leads & np.isin(joints["kind"], (HINGE, SLIDE))]
    free = np.ones(model.freedom_count, dtype=bool)
    is_limited = np.isfinite([model.lower, model.upper, model.cones]).any(axis=0)
    for record in joints[(joints["kind"] == BALL) & is_limited]:
        free[record["freedom"] : record["freedom"] + 3] = False
    return single["freedom"], single["coordinate"], single["lower"], single["upper"], free


def _quaternion_between(target: FloatArray, R: FloatArray) -> tuple[float, float, float, float]:
    """Return R Q*, the rotation from a target's to an effector's, with w >= 0."""
    w, a, b, c = multiply(tuple(R.tolist()), conjugate(tuple(target.tolist())))
    return (-w, -a, -b, -c) if w < 0.0 else (w, a, b, c)
