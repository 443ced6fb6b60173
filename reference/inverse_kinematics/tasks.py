"""Tasks of inverse kinematics: quantities for a configuration to bring to zero.

A task evaluates its residual and the residual's derivative by the velocity of `jacobians`. Exact
tasks are met; the others, such as a posture, are approached as far as exact tasks allow. With
`weight` w a task adds w |residual|² to what `solve_tasks` minimises. Residuals are in metres and
radians. Frames are joints of the model, by index or name; None is the world.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments, rotation
from ..arguments import FloatArray, KeepsReadOnly, frozen
from ..articulation import Articulation
from ..jacobians import difference, jacobians
from ..quaternion import IDENTITY, conjugate, logarithm, multiply, rotate

# What a task takes as an ArrayLike, and holds as a read-only array.
Values: TypeAlias = Any
ORIGIN = (0.0, 0.0, 0.0)
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
# Below this angle [rad] the series of the right Jacobian's last factor is exact to rounding.
SMALL_ANGLE = 1e-4


class FramePoint(NamedTuple):
    """A point fixed to a frame."""

    position: FloatArray  # in the world [m], (3,)
    matrix: FloatArray  # the frame's rotation in the world, (3, 3)
    quaternion: tuple[float, float, float, float]  # the same, w first
    linear: FloatArray  # the derivative of the position, (3, freedom)
    angular: FloatArray  # the angular velocity in the world, (3, freedom)


class Configuration(NamedTuple):
    """Coordinates with the pose and the Jacobian of every joint."""

    model: Articulation
    q: FloatArray  # (coordinate,)
    positions: FloatArray  # in the world [m], (joint, 3)
    rotations: FloatArray  # in the world, (joint, 4)
    jacobians: FloatArray  # (joint, 6, freedom)

    def frame(self, joint: int | str | None, point: ArrayLike = ORIGIN) -> FramePoint:
        """Return a point of a joint's frame, or of the world."""
        if joint is None:
            still = np.zeros((3, self.model.freedom_count))
            x = np.asarray(point, dtype=float)
            return FramePoint(x, np.eye(3), IDENTITY, still, still)
        j = self.model.index(joint, "frame")
        Q, J = tuple(self.rotations[j].tolist()), self.jacobians[j]
        R = matrix_of(Q)
        arm = R @ np.asarray(point, dtype=float)
        linear = J[:3] - cross_matrix(arm) @ J[3:]
        return FramePoint(self.positions[j] + arm, R, Q, linear, J[3:])


def configuration(model: Articulation, q: FloatArray) -> Configuration:
    """Return the configuration of checked coordinates, (coordinate,)."""
    x, R = model.forward(q)
    return Configuration(model, q, x, R, jacobians(model, q))


class IKTask(Protocol):
    """What `solve_tasks` takes: an own class may have these three members too."""

    @property
    def weight(self) -> float:
        """The weight of its squared residual."""

    @property
    def exact(self) -> bool:
        """Whether the task has to be met, not approached."""

    def evaluate(self, configuration: Configuration) -> tuple[FloatArray, FloatArray]:
        """Return the residual, (row,), and its derivative by the velocity, (row, freedom)."""


@dataclass(frozen=True, eq=False)
class FrameTask(KeepsReadOnly):
    """A position, a rotation, or both, of a frame in the world or relative to another frame.

    The position is that of `point`. Its error is along the axes of the target rotation, or of the
    reference frame if there is no target rotation. The error of the rotation is the rotation vector
    from the target, in the axes of the frame. With a free rotation about z, axis (0, 0, 1) then
    points where the target's does.

    Attributes:
        frame: the frame to be placed.
        position: target of the point in the reference frame [m], (3,); None for a free position.
        rotation: target in the reference frame, unit quaternion (4,); None for a free rotation.
        relative_to: the reference frame.
        point: in the frame [m], (3,).
        axes: factors of the six errors, three of position and three of rotation; 0 frees an axis.
        weight: of the squared error.
        exact: whether the task has to be met.
    """

    frame: int | str
    position: Values | None = None
    rotation: Values | None = None
    relative_to: int | str | None = None
    point: Values = ORIGIN
    axes: Values = (1.0,) * 6
    weight: float = 1.0
    exact: bool = True

    def __post_init__(self) -> None:
        """Check and copy; a ValueError names the argument."""
        if self.position is None and self.rotation is None:
            raise ValueError("position: expected a position or a rotation, got neither")
        _check(self)
        _keep(self, arguments.coordinates, point=3)
        _keep(self, arguments.sizes, axes=6)
        if self.position is not None:
            _keep(self, arguments.coordinates, position=3)
        if self.rotation is not None:
            Q = rotation.unit("rotation", arguments.array("rotation", self.rotation, 4))
            self.__dict__["rotation"] = frozen(Q)

    def evaluate(self, configuration: Configuration) -> tuple[FloatArray, FloatArray]:
        """Return the errors of position [m] and rotation [rad], and their derivative."""
        frame = configuration.frame(self.frame, self.point)
        base = configuration.frame(self.relative_to)
        target = None if self.rotation is None else tuple(self.rotation.tolist())
        turn = None if target is None else matrix_of(target)
        residuals, derivatives = [], []
        if self.position is not None:
            into = base.matrix.T if turn is None else turn.T @ base.matrix.T
            offset = frame.position - base.position
            J = frame.linear - base.linear + cross_matrix(offset) @ base.angular
            shift = self.position if turn is None else turn.T @ self.position
            residuals.append(self.axes[:3] * (into @ offset - shift))
            derivatives.append(self.axes[:3, None] * (into @ J))
        if turn is not None:
            relative = multiply(conjugate(base.quaternion), frame.quaternion)
            error = np.array(logarithm(multiply(conjugate(target), relative)))
            J = inverse_right_jacobian(error) @ frame.matrix.T @ (frame.angular - base.angular)
            residuals.append(self.axes[3:] * error)
            derivatives.append(self.axes[3:, None] * J)
        return np.concatenate(residuals), np.concatenate(derivatives)


@dataclass(frozen=True, eq=False)
class LookAt(KeepsReadOnly):
    """An axis of a frame points at a point of another frame, or of the world.

    The residual is the difference of the two unit directions: its length is the chord of the angle.

    Attributes:
        frame: the frame that looks.
        target: the point looked at, in `target_frame` [m], (3,).
        axis: the axis in the frame, of any length but zero, (3,).
        origin: the point of the frame to look from [m], (3,).
        target_frame: the frame of the target.
        weight: of the squared error.
        exact: whether the task has to be met.
    """

    frame: int | str
    target: Values
    axis: Values = (0.0, 0.0, 1.0)
    origin: Values = ORIGIN
    target_frame: int | str | None = None
    weight: float = 1.0
    exact: bool = True

    def __post_init__(self) -> None:
        """Check and copy; a ValueError names the argument."""
        _check(self)
        _keep(self, arguments.coordinates, target=3, axis=3, origin=3)
        length = np.linalg.norm(self.axis)
        if length == 0.0:
            raise ValueError("axis: expected a direction, got (0, 0, 0)")
        self.__dict__["axis"] = frozen(self.axis / length)

    def evaluate(self, configuration: Configuration) -> tuple[FloatArray, FloatArray]:
        """Return the axis less the direction to the target, and its derivative."""
        eye = configuration.frame(self.frame, self.origin)
        target = configuration.frame(self.target_frame, self.target)
        axis, offset = eye.matrix @ self.axis, target.position - eye.position
        distance = float(np.linalg.norm(offset)) or 1.0
        direction = offset / distance
        across = (np.eye(3) - np.outer(direction, direction)) / distance
        J = -cross_matrix(axis) @ eye.angular - across @ (target.linear - eye.linear)
        return axis - direction, J


@dataclass(frozen=True, eq=False)
class CentreOfMass(KeepsReadOnly):
    """The centre of mass at a position.

    Attributes:
        masses: of each joint's link [kg], (joint,); `Robot.masses` of a file, unless it leaves some
            to meshes, whose masses are not computed.
        centres: their centres in the frames of the joints [m], (joint, 3); `Robot.centres`.
        position: target in the world [m], (3,).
        axes: factors of the three errors; 0 frees an axis, such as the height.
        weight: of the squared error.
        exact: whether the task has to be met.
    """

    masses: Values
    centres: Values
    position: Values
    axes: Values = (1.0,) * 3
    weight: float = 1.0
    exact: bool = True

    def __post_init__(self) -> None:
        """Check and copy; a ValueError names the argument."""
        _check(self)
        unknown = np.flatnonzero(np.isnan(arguments.floats("masses", self.masses, "joint")))
        if len(unknown):
            raise ValueError(f"masses: expected that of joint {unknown[0]}, got NaN, as of a mesh")
        _keep(self, arguments.sizes, masses="joint", axes=3)
        if not self.masses.sum() > 0.0:
            raise ValueError("masses: expected a positive sum, got 0")
        _keep(self, arguments.coordinates, centres=(len(self.masses), 3), position=3)

    def evaluate(self, configuration: Configuration) -> tuple[FloatArray, FloatArray]:
        """Return the error of the position [m], and its derivative."""
        arguments.check_shape("masses", self.masses, configuration.model.joint_count)
        arms = rotation.rotate(configuration.rotations, self.centres)
        shares = self.masses / self.masses.sum()
        centre = shares @ (configuration.positions + arms)
        linear, angular = configuration.jacobians[:, :3], configuration.jacobians[:, 3:]
        J = np.einsum("j,jif->if", shares, linear + np.cross(angular, arms[:, :, None], axis=1))
        return self.axes * (centre - self.position), self.axes[:, None] * J


@dataclass(frozen=True, eq=False)
class Posture(KeepsReadOnly):
    """Coordinates to stay near, by default not exact.

    Attributes:
        coordinates: of the whole model, (coordinate,).
        axes: factors of the displacements, a number or (freedom,); 0 frees a displacement.
        weight: of the squared displacement.
        exact: whether the task has to be met.
    """

    coordinates: Values
    axes: Values = 1.0
    weight: float = 0.01
    exact: bool = False

    def __post_init__(self) -> None:
        """Check and copy; a ValueError names the argument."""
        _check(self)
        _keep(self, arguments.coordinates, coordinates="coordinate")
        _keep(self, arguments.sizes, axes="...")

    def evaluate(self, configuration: Configuration) -> tuple[FloatArray, FloatArray]:
        """Return the velocity from the posture to the configuration, and its derivative."""
        model = configuration.model
        rest = model.checked("coordinates", self.coordinates)
        residual = difference(model, configuration.q, rest)
        J = np.eye(model.freedom_count)
        for joint in np.flatnonzero([kind in ("ball", "free") for kind in model.kinds]):
            end = model.freedoms_of(int(joint)).stop
            block = slice(end - 3, end)
            J[block, block] = inverse_right_jacobian(residual[block])
        if self.axes.ndim > 0:
            arguments.check_shape("axes", self.axes, model.freedom_count)
        axes = np.broadcast_to(self.axes, residual.shape)
        return axes * residual, axes[:, None] * J


@dataclass(frozen=True, eq=False)
class Coupling(KeepsReadOnly):
    """A hinge or slide follows a polynomial of another: q - q0 = sum of c_k (leader - leader0)^k.

    Attributes:
        joint: the follower.
        leader: the leading joint; None holds the joint at q0 + c_0.
        coefficients: c_0, c_1, ..., at least c_0.
        zero: q0 [rad or m].
        leader_zero: leader0 [rad or m].
        weight: of the squared error.
        exact: whether the task has to be met.
    """

    joint: int | str
    leader: int | str | None = None
    coefficients: Values = (0.0, 1.0)
    zero: float = 0.0
    leader_zero: float = 0.0
    weight: float = 1.0
    exact: bool = True

    def __post_init__(self) -> None:
        """Check and copy; a ValueError names the argument."""
        _check(self)
        _keep(self, arguments.coordinates, coefficients="coefficient")
        if not len(self.coefficients):
            raise ValueError("coefficients: expected at least one, got none")
        for name in ("zero", "leader_zero"):
            arguments.number(name, getattr(self, name))

    def evaluate(self, configuration: Configuration) -> tuple[FloatArray, FloatArray]:
        """Return the error [rad or m], and its derivative."""
        q, J = self._coordinate(configuration, self.joint)
        polynomial = np.polynomial.Polynomial(self.coefficients)
        residual = q - self.zero - polynomial(0.0)
        if self.leader is not None:
            leader, J_leader = self._coordinate(configuration, self.leader)
            displacement = leader - self.leader_zero
            residual = q - self.zero - polynomial(displacement)
            J = J - polynomial.deriv()(displacement) * J_leader
        return np.array([residual]), J[None]

    def _coordinate(
        self, configuration: Configuration, joint: int | str
    ) -> tuple[float, FloatArray]:
        """Return a joint's coordinate, a mimic joint's too, and its derivative, (freedom,)."""
        model, j = configuration.model, configuration.model.index(joint)
        if model.kinds[j] not in ("hinge", "slide"):
            raise ValueError(f"joint: expected a hinge or a slide, got a {model.kinds[j]} joint")
        record, J = model.joints[j], np.zeros(model.freedom_count)
        J[record["freedom"]] = record["multiplier"]
        q = record["multiplier"] * configuration.q[record["coordinate"]] + record["shift"]
        return float(q), J


def matrix_of(q: tuple[float, float, float, float]) -> FloatArray:
    """Return the matrix of a single rotation, (3, 3), sooner than `rotation.to_matrix`."""
    return np.array([rotate(q, axis) for axis in AXES]).T


def cross_matrix(v: FloatArray) -> FloatArray:
    """Return the matrix of the cross product v x, (3, 3)."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def inverse_right_jacobian(v: FloatArray) -> FloatArray:
    """Return the derivative of log(exp(v) exp(w)) by w at 0, (3, 3): Sola et al. 2018."""
    angle = float(np.linalg.norm(v))
    factor = 1.0 / 12.0 + angle * angle / 720.0
    if angle > SMALL_ANGLE:
        factor = (1.0 - 0.5 * angle / np.tan(0.5 * angle)) / (angle * angle)
    K = cross_matrix(v)
    return np.eye(3) + 0.5 * K + factor * (K @ K)


def _check(task: object) -> None:
    """Check the weight and the flag of a task."""
    arguments.number("weight", task.__dict__["weight"], above=0.0)
    arguments.boolean("exact", task.__dict__["exact"])


def _keep(task: object, checked: Callable[..., FloatArray], **shapes: Any) -> None:
    """Replace arrays of a task by read-only copies, checked to have these shapes."""
    for name, shape in shapes.items():
        lengths = shape if isinstance(shape, tuple) else (shape,)
        task.__dict__[name] = frozen(checked(name, task.__dict__[name], *lengths).copy())
