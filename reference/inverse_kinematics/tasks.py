"""Tasks of inverse kinematics: quantities for a configuration to bring to zero.

A task evaluates its residual and the residual's derivative by the velocity of `jacobians`. Exact
tasks are met; the others, such as a posture, are approached as far as exact tasks allow. With
`weight` w a task adds w |residual|² to what `solve_tasks` minimises. Residuals are in metres and
radians. Frames are joints of the model, by index or name; None is the world.
"""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments, rotation
from ..arguments import FloatArray, KeepsReadOnly, frozen
from ..articulation import Articulation
from ..jacobians import jacobians
from .descent import new_state
from .task_errors import (
    CENTRE_OF_MASS,
    COUPLING,
    FRAME,
    LOOK_AT,
    POSTURE,
    evaluation_kernel,
    task_arrays,
)

# What a task takes as an ArrayLike, and holds as a read-only array.
Values: TypeAlias = Any
ORIGIN = (0.0, 0.0, 0.0)


class FramePoint(NamedTuple):
    """A point fixed to a frame."""

    position: FloatArray  # in the world [m], (3,)
    matrix: FloatArray  # the frame's rotation in the world, (3, 3)
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
        x = np.asarray(point, dtype=float)
        if joint is None:
            still = np.zeros((3, self.model.freedom_count))
            return FramePoint(x, np.eye(3), still, still)
        j = self.model.index(joint, "frame")
        R, J = rotation.to_matrix(self.rotations[j]), self.jacobians[j]
        linear = J[:3] + np.cross(J[3:], R @ x, axis=0)
        return FramePoint(self.positions[j] + R @ x, R, linear, J[3:])


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


class BuiltInTask(KeepsReadOnly):
    """A task of Plumbob, which kernels evaluate."""

    kind: ClassVar[int]
    weight: float
    exact: bool

    def evaluate(self, configuration: Configuration) -> tuple[FloatArray, FloatArray]:
        """Return the residual, (row,), and its derivative by the velocity, (row, freedom)."""
        model, q, positions, rotations, _ = configuration
        arrays = task_arrays(model, [self], [self.kind], [self.factors(model)])
        arrays.records["weight"] = 1.0
        nothing = np.empty((0, model.coordinate_count)), np.empty((0, model.joint_count))
        state = new_state(model, arrays, *nothing)
        state.data.q[:], state.data.positions[:] = q, positions
        state.data.rotations[:] = rotations
        evaluation_kernel(state, state.current)
        return state.current.r, state.current.J.T

    @abstractmethod
    def factors(self, model: Articulation) -> FloatArray:
        """Return the factors of the residual, (row,); raise an error if another model is meant."""


@dataclass(frozen=True, eq=False)
class FrameTask(BuiltInTask):
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

    kind: ClassVar[int] = FRAME
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

    def factors(self, model: Articulation) -> FloatArray:
        """Return the factors of the residual, (row,)."""
        return self.axes[3 * (self.position is None) : 3 + 3 * (self.rotation is not None)]


@dataclass(frozen=True, eq=False)
class LookAt(BuiltInTask):
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

    kind: ClassVar[int] = LOOK_AT
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

    def factors(self, model: Articulation) -> FloatArray:
        """Return the factors of the residual, (row,)."""
        return np.ones(3)


@dataclass(frozen=True, eq=False)
class CentreOfMass(BuiltInTask):
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

    kind: ClassVar[int] = CENTRE_OF_MASS
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

    def factors(self, model: Articulation) -> FloatArray:
        """Return the factors of the residual, (row,)."""
        arguments.check_shape("masses", self.masses, model.joint_count)
        return self.axes


@dataclass(frozen=True, eq=False)
class Posture(BuiltInTask):
    """Coordinates to stay near, by default not exact.

    Attributes:
        coordinates: of the whole model, (coordinate,).
        axes: factors of the displacements, a number or (freedom,); 0 frees a displacement.
        weight: of the squared displacement.
        exact: whether the task has to be met.
    """

    kind: ClassVar[int] = POSTURE
    coordinates: Values
    axes: Values = 1.0
    weight: float = 0.01
    exact: bool = False

    def __post_init__(self) -> None:
        """Check and copy; a ValueError names the argument."""
        _check(self)
        _keep(self, arguments.coordinates, coordinates="coordinate")
        _keep(self, arguments.sizes, axes="...")

    def factors(self, model: Articulation) -> FloatArray:
        """Return the factors of the residual, (row,)."""
        if self.axes.ndim > 0:
            arguments.check_shape("axes", self.axes, model.freedom_count)
        return np.broadcast_to(self.axes, model.freedom_count)


@dataclass(frozen=True, eq=False)
class Coupling(BuiltInTask):
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

    kind: ClassVar[int] = COUPLING
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

    def factors(self, model: Articulation) -> FloatArray:
        """Return the factors of the residual, (row,)."""
        for joint in (self.joint, self.joint if self.leader is None else self.leader):
            kind = model.kinds[model.index(joint)]
            if kind not in ("hinge", "slide"):
                raise ValueError(f"joint: expected a hinge or a slide, got a {kind} joint")
        return np.ones(1)


def _check(task: object) -> None:
    """Check the weight and the flag of a task."""
    arguments.number("weight", task.__dict__["weight"], above=0.0)
    arguments.boolean("exact", task.__dict__["exact"])


def _keep(task: object, checked: Callable[..., FloatArray], **shapes: Any) -> None:
    """Replace arrays of a task by read-only copies, checked to have these shapes."""
    for name, shape in shapes.items():
        lengths = shape if isinstance(shape, tuple) else (shape,)
        task.__dict__[name] = frozen(checked(name, task.__dict__[name], *lengths).copy())
