"""Evaluate solutions of inverse kinematics by engines that share no code with the solver.

MuJoCo is the arbiter of solvers built on Pinocchio, Pinocchio of all others. Both place every
answer, so their disagreements are known. Where Pinocchio is absent, MuJoCo evaluates all answers.
Every solver is measured alike: the distance and the angle of each effector from its target, and the
excess of joints over their limits.
"""

import functools
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np
import scipy

from plumbob.reference.arguments import FloatArray

from .robots import LIMIT_TOLERANCE, BenchRobot, robot

MUJOCO, PINOCCHIO = "MuJoCo", "Pinocchio"
HAS_PINOCCHIO = find_spec("pinocchio") is not None
# The engines place an effector alike to this [m], [rad]: some hundred roundings of a metre.
AGREEMENT = 1e-12


class Tolerance(NamedTuple):
    """When an effector has reached its target: a distance [m] and an angle [rad]."""

    position: float
    rotation: float


class PoseRequest(NamedTuple):
    """A target pose of each effector, and the configuration to start from."""

    positions: FloatArray  # of the effectors [m], (effector, 3)
    rotations: FloatArray  # of the effectors, (effector, 3, 3)
    start: FloatArray  # coordinates to start from, (coordinate,)

    @property
    def poses(self) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Position and rotation of each effector."""
        return zip(self.positions, self.rotations, strict=True)

    @property
    def matrix(self) -> FloatArray:
        """The pose of the first effector, (4, 4)."""
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = self.rotations[0], self.positions[0]
        return T

    @property
    def quaternion(self) -> FloatArray:
        """The rotation of the first effector, w last, (4,)."""
        return scipy.spatial.transform.Rotation.from_matrix(self.rotations[0]).as_quat()


class Targets(NamedTuple):
    """The targets of a robot's effectors."""

    positions: FloatArray  # [m], (target, effector, 3)
    rotations: FloatArray  # matrices, (target, effector, 3, 3)
    starts: FloatArray  # coordinates to start from, (target, coordinate)
    strata: np.ndarray  # the number of each target's stratum, (target,)

    @property
    def shape(self) -> tuple[int, int]:
        """The number of targets, and of coordinates."""
        return len(self.starts), self.starts.shape[-1]

    def request(self, i: int) -> PoseRequest:
        """Return a target."""
        return PoseRequest(self.positions[i], self.rotations[i], self.starts[i].copy())

    def after(self, count: int) -> "Targets":
        """Return the targets after the first `count`."""
        return Targets(*(part[count:] for part in self))


class Evaluation(NamedTuple):
    """The errors of the answers, an entry for each target."""

    # the largest distance of an effector from its target [m]; NaN without an answer
    position: FloatArray
    # the largest angle of an effector from its target [rad]; zero without a target rotation
    rotation: FloatArray
    beyond: FloatArray  # by how much the worst joint is beyond its limit [rad]
    solved: np.ndarray  # whether all three are within tolerance
    # by how much the two engines place an effector differently [m] or [rad]; zero without an answer
    # or a second engine
    difference: FloatArray


def mujoco_model(robot: BenchRobot) -> Any:
    """Return the robot in MuJoCo with all of its links."""
    import mujoco

    tree = ElementTree.fromstring(robot.text)
    if robot.is_chain:
        extension = ElementTree.SubElement(tree, "mujoco")
        ElementTree.SubElement(extension, "compiler", fusestatic="false")
    return mujoco.MjModel.from_xml_string(ElementTree.tostring(tree, encoding="unicode"))


def arbiter_of(engine: str) -> str:
    """Return the engine that evaluates the answers of a solver built on an engine."""
    return PINOCCHIO if HAS_PINOCCHIO and engine != PINOCCHIO else MUJOCO


def pinocchio_model(robot: BenchRobot) -> Any:
    """Return the robot in Pinocchio.

    Raises:
        ValueError: if Pinocchio orders its joints otherwise.
    """
    import pinocchio

    if robot.is_chain:
        model = pinocchio.buildModelFromXML(robot.text)
    else:
        with robot.file() as file:
            model = pinocchio.buildModelFromMJCF(file)
    robot.check_order(PINOCCHIO, list(model.names)[1:])
    return model


def to_pinocchio(robot: BenchRobot, q: FloatArray) -> FloatArray:
    """Return coordinates, (coordinate,), with w at the end of quaternions."""
    permuted = q.copy()
    for i in robot.balls:
        permuted[i : i + 4] = q[[i + 1, i + 2, i + 3, i]]
    return permuted


def from_pinocchio(robot: BenchRobot, q: FloatArray) -> FloatArray:
    """Return coordinates, (coordinate,), with w at the start of quaternions."""
    permuted = q.copy()
    for i in robot.balls:
        permuted[i : i + 4] = q[[i + 3, i, i + 1, i + 2]]
    return permuted


class Evaluator:
    """The kinematics of a robot in both engines."""

    def __init__(self, robot: BenchRobot) -> None:
        import mujoco

        self.robot, self._mujoco = robot, mujoco
        self.model = mujoco_model(robot)
        self._data = mujoco.MjData(self.model)
        self._effectors = [self.model.body(effector).id for effector in robot.effectors]
        mujoco.mj_kinematics(self.model, self._data)
        self.first_joint = self._data.xanchor[0].copy()  # its position, which is fixed [m], (3,)

    def forward(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the effectors' positions [m], (..., effector, 3), and rotations, (..., 3, 3)."""
        shape = (*q.shape[:-1], len(self._effectors))
        positions, rotations = np.empty((*shape, 3)), np.empty((*shape, 9))
        for i in np.ndindex(q.shape[:-1]):
            self._update_kinematics(q[i])
            positions[i] = self._data.xpos[self._effectors]
            rotations[i] = self._data.xmat[self._effectors]
        return positions, rotations.reshape(*shape, 3, 3)

    def forward_by_pinocchio(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what `forward` returns, by Pinocchio, of coordinates (row, coordinate)."""
        import pinocchio

        model, data, frames = self._pinocchio
        placements = []
        for row in q:
            pinocchio.framesForwardKinematics(model, data, to_pinocchio(self.robot, row))
            placements.append([data.oMf[frame].homogeneous for frame in frames])
        poses = np.reshape(placements, (len(q), len(frames), 4, 4))
        return poses[..., :3, 3], poses[..., :3, :3]

    @functools.cached_property
    def _pinocchio(self) -> tuple[Any, Any, list[int]]:
        model = pinocchio_model(self.robot)
        return model, model.createData(), [model.getFrameId(e) for e in self.robot.effectors]

    def jacobians(self, q: FloatArray) -> FloatArray:
        """Return the Jacobians of positions and rotations, (row, effector, 2, 3, freedom)."""
        J = np.empty((len(q), len(self._effectors), 2, 3, self.model.nv))
        for i, row in enumerate(q):
            self._update_kinematics(row)
            self._mujoco.mj_comPos(self.model, self._data)
            for k, effector in enumerate(self._effectors):
                self._mujoco.mj_jacBody(self.model, self._data, *J[i, k], effector)
        return J

    def evaluate(
        self, targets: Targets, q: FloatArray, tolerance: Tolerance, arbiter: str = ""
    ) -> Evaluation:
        """Return the errors of answers (target, coordinate) to the first targets; NaN is none.

        The arbiter is an engine, by default our solvers' arbiter.
        """
        is_answered, count = np.asarray(np.isfinite(q).all(axis=-1)), len(q)
        poses = np.where(is_answered[:, None], q, targets.starts[:count])
        by_engine = {MUJOCO: self.forward(poses)}
        if HAS_PINOCCHIO:
            by_engine[PINOCCHIO] = self.forward_by_pinocchio(poses)
        target_poses = targets.positions[:count], targets.rotations[:count]
        distance, angle = _distances(by_engine[arbiter or arbiter_of("")], target_poses)
        first, last = by_engine[MUJOCO], by_engine.get(PINOCCHIO, by_engine[MUJOCO])
        difference = np.maximum(*_distances(first, last))
        excess = np.maximum(self.robot.lower - q, q - self.robot.upper).max(axis=-1).clip(0.0)
        errors = np.stack([distance, angle * self.robot.oriented, excess])
        errors[:, ~is_answered] = np.nan
        limits = np.array([*tolerance, LIMIT_TOLERANCE])[:, None]
        position, rotation, beyond = errors
        solved = np.asarray((errors <= limits).all(axis=0))
        return Evaluation(position, rotation, beyond, solved, difference * is_answered)

    def _update_kinematics(self, q: FloatArray) -> None:
        self._data.qpos[:] = q
        self._mujoco.mj_kinematics(self.model, self._data)


def _distances(
    poses: tuple[FloatArray, FloatArray], targets: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return the largest distance [m] and angle [rad] between the effectors' poses, (row,)."""
    distance = np.linalg.norm(poses[0] - targets[0], axis=-1).max(axis=-1)
    return distance, angle_between(poses[1], targets[1]).max(axis=-1)


def angle_between(A: FloatArray, B: FloatArray) -> FloatArray:
    """Return the angle of the rotation from A to B [rad], exact also where tiny, (...).

    |A - B| in the norm of Frobenius is 2 sqrt 2 sin(angle / 2).
    """
    distance = np.linalg.norm(A - B, axis=(-2, -1))
    return 2.0 * np.arcsin(np.minimum(distance / np.sqrt(8.0), 1.0))


@functools.cache
def evaluator_of(name: str) -> Evaluator:
    """Return the evaluator of a robot by name."""
    return Evaluator(robot(name))
