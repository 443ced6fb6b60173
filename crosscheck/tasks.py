"""Comparisons of the tasks of inverse kinematics with engines, on random trees in MJCF."""

import functools
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from plumbob.reference import rotation, tasks
from plumbob.reference.arguments import FloatArray
from plumbob.reference.formats import mjcf
from plumbob.reference.inverse_kinematics.task_errors import inverse_right_jacobian
from plumbob.reference.model import Robot

from . import samples
from .engines import ROBOT_ENGINES
from .engines.robot_engine import RobotEngine
from .robots.models import moving_joints
from .verdict import Comparison

# Bodies of a random tree, and its random configurations.
BODIES, CONFIGURATIONS = 8, 3
BALLS = (1, 4, 5)  # bodies on balls or slides, others are on hinges or slides
# Equalities of bodies as read by MuJoCo, with places for six random numbers.
EQUALITIES = """
<connect body1="b2" body2="b7" anchor="{} {} {}"/>
<weld body1="b3" body2="b6" anchor="{} {} {}"/>
<weld body1="b1" body2="b5" anchor="{} {} {}" relpose="{} {} {} .5 .5 .5 .5"/>
<weld body1="b4"/>
<joint joint1="j3" joint2="j6" polycoef="{} {} {} 0.1"/>
<joint joint1="j2" polycoef="{}"/>"""
CLOSURES = '<connect body1="b2" body2="b7" anchor="{}"/><weld body1="b3" body2="b6" anchor="{}"/>'


class EngineFrame(NamedTuple):
    """A link in an engine."""

    position: FloatArray  # [m], (3,)
    matrix: FloatArray  # (3, 3)
    linear: FloatArray  # the derivative of the position, (3, freedom)
    angular: FloatArray  # the angular velocity, (3, freedom)

    def place(self, point: FloatArray) -> FloatArray:
        """Return where a point of the link is [m], (3,)."""
        return self.position + self.matrix @ point

    def velocity(self, point: FloatArray) -> FloatArray:
        """Return the derivative of the position, (3, freedom)."""
        return self.linear + np.cross(self.angular.T, self.matrix @ point).T


def relative_frames(engine: str, case: int) -> Comparison:
    """Compare the place of a point in another link's frame, its rotation, and both derivatives."""
    robot, adapter, rows = _sample(engine, case)
    point = samples.generator("point", case).normal(size=3)
    task = tasks.FrameTask("b7", (0, 0, 0), (1, 0, 0, 0), relative_to="b3", point=point)

    def expected(q: FloatArray) -> FloatArray:
        frame, base = _frames(robot, adapter, q)
        offset = frame.place(point) - base.position
        velocity = frame.velocity(point) - base.linear - np.cross(base.angular.T, offset).T
        into = base.matrix.T
        parts = into @ offset, into @ frame.matrix, into @ velocity
        return _joined(*parts, into @ (frame.angular - base.angular))

    def actual(q: FloatArray) -> FloatArray:
        residual, J = _evaluate(robot, q, task)
        Q = rotation.exponential(residual[3:])
        # back from the rate of the rotation vector to the angular velocity
        columns = [inverse_right_jacobian(residual[3:], axis) for axis in np.eye(3)]
        angular = rotation.to_matrix(Q) @ np.linalg.solve(np.transpose(columns), J[3:])
        return _joined(residual[:3], rotation.to_matrix(Q), J[:3], angular)

    return _compared(robot, rows, actual, expected)


def look_at(engine: str, case: int) -> Comparison:
    """Compare an axis less the direction to a point of another link, and the derivative."""
    robot, adapter, rows = _sample(engine, case)
    target, axis, origin = samples.generator("look-at", case).normal(size=(3, 3))
    axis /= np.linalg.norm(axis)
    task = tasks.LookAt("b7", target, axis, origin, "b3")

    def expected(q: FloatArray) -> FloatArray:
        eye, base = _frames(robot, adapter, q)
        offset = base.place(target) - eye.place(origin)
        velocity, distance = base.velocity(target) - eye.velocity(origin), np.linalg.norm(offset)
        direction = offset / distance
        across = velocity - np.outer(direction, direction @ velocity)
        rate = np.cross(eye.angular.T, eye.matrix @ axis).T - across / distance
        return _joined(eye.matrix @ axis - direction, rate)

    return _compared(robot, rows, lambda q: _joined(*_evaluate(robot, q, task)), expected)


def centre_of_mass(engine: str, case: int) -> Comparison:
    """Compare the centre of mass and its derivative."""
    robot, adapter, rows = _sample(engine, case)
    task = tasks.CentreOfMass(robot.masses, robot.centres, (0.0, 0.0, 0.0))

    def expected(q: FloatArray) -> FloatArray:
        adapter.update_kinematics(_coordinates(robot, q))
        return _joined(adapter.centre_of_mass(), adapter.centre_of_mass_jacobian(_freedoms(robot)))

    return _compared(robot, rows, lambda q: _joined(*_evaluate(robot, q, task)), expected)


def postures(engine: str, case: int) -> Comparison:
    """Compare the residual of a posture, the displacement from the posture, with the engine's."""
    robot, adapter, rows = _sample(engine, case)
    posture = robot.articulation.random(samples.generator("posture", case))

    def expected(q: FloatArray) -> FloatArray:
        adapter.update_kinematics(_coordinates(robot, q))
        return adapter.displacement(_coordinates(robot, posture), _freedoms(robot))

    task = tasks.Posture(posture)
    return _compared(robot, rows, lambda q: _evaluate(robot, q, task)[0], expected)


def closures(engine: str, case: int) -> Comparison:
    """Compare by how much links violate connect and weld."""
    anchor, anchor_weld = samples.generator("closures", case).normal(size=(2, 3))
    links = ["b2", "b7", "b3", "b6"]
    numbers = [" ".join(map(repr, point.tolist())) for point in (anchor, anchor_weld)]
    robot = mjcf.parse(_text(case, CLOSURES.format(*numbers)))
    _, adapter, rows = _sample(engine, case)

    def places(q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the anchors in frames of the other links, and the rotation of the weld."""
        adapter.update_kinematics(_coordinates(robot, q))
        x, R = adapter.link_poses(links)
        connected = R[1].T @ (x[0] + R[0] @ anchor - x[1])
        return connected, R[2].T @ (x[3] + R[3] @ anchor_weld - x[2]), R[2].T @ R[3]

    closed = places(robot.home)

    def expected(q: FloatArray) -> FloatArray:
        connected, welded, turn = places(q)
        gaps = [np.linalg.norm(connected - closed[0]), np.linalg.norm(welded - closed[1])]
        return np.array([*gaps, np.linalg.norm(turn - closed[2]) / 8.0**0.5])

    def actual(q: FloatArray) -> FloatArray:
        connect, weld = (_evaluate(robot, q, task)[0] for task in robot.equalities)
        return np.concatenate([[np.linalg.norm(connect)], _measures(weld, True)])

    return _compared(robot, rows, actual, expected)


def equalities(case: int) -> Comparison:
    """Compare the residuals of loop closures and couplings: lengths of vectors, signed numbers."""
    numbers = samples.generator("equalities", case).normal(size=EQUALITIES.count("{}"))
    text = _text(case, EQUALITIES.format(*numbers))
    robot, model = mjcf.parse(text), mujoco.MjModel.from_xml_string(text)
    data, rows = mujoco.MjData(model), _rows(robot, case)

    def actual(q: FloatArray) -> FloatArray:
        residuals = [_evaluate(robot, q, task)[0] for task in robot.equalities]
        return np.concatenate([_measures(residual, True) for residual in residuals])

    def expected(q: FloatArray) -> FloatArray:
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        sizes = np.cumsum([3, 6, 6, 6, 1])
        parts = np.split(data.efc_pos[: data.ne], sizes)
        return np.concatenate([_measures(part, False) for part in parts])

    return _compared(robot, rows, actual, expected)


def _compared(
    robot: Robot,
    rows: FloatArray,
    actual: Callable[[FloatArray], FloatArray],
    expected: Callable[[FloatArray], FloatArray],
) -> Comparison:
    """Compare two functions of the coordinates, with home as baseline."""
    return Comparison(
        np.array([actual(q) for q in rows]),
        np.array([expected(q) for q in rows]),
        np.array([actual(robot.home)] * len(rows)),
        scale=float(BODIES),
    )


def _measures(residual: FloatArray, is_vector: bool) -> FloatArray:
    """Return the distance and the sine of half the angle of a closure; a coupling's own error.

    MuJoCo takes the vector part of the quaternion where the task takes the rotation vector.
    """
    if len(residual) == 1:
        return residual
    angle = np.linalg.norm(residual[3:])
    return np.array([np.linalg.norm(residual[:3]), np.sin(angle / 2.0) if is_vector else angle])


def _evaluate(robot: Robot, q: FloatArray, task: tasks.IKTask) -> tuple[FloatArray, FloatArray]:
    return task.evaluate(tasks.configuration(robot.articulation, q))


def _joined(*parts: FloatArray) -> FloatArray:
    return np.concatenate([part.ravel() for part in parts])


def _coordinates(robot: Robot, q: FloatArray) -> dict[str, FloatArray]:
    return {j.name: q[j.coordinates] for j in moving_joints(robot)}


def _freedoms(robot: Robot) -> dict[str, int]:
    return {j.name: j.freedoms.stop - j.freedoms.start for j in moving_joints(robot)}


def _frames(robot: Robot, adapter: RobotEngine, q: FloatArray) -> Iterator[EngineFrame]:
    """Yield links b7 and b3 of an engine at q."""
    adapter.update_kinematics(_coordinates(robot, q))
    x, R = adapter.link_poses(["b7", "b3"])
    J = adapter.jacobians(["b7", "b3"], _freedoms(robot))
    return map(EngineFrame, x, R, J[:, :3], J[:, 3:])


def _rows(robot: Robot, case: int) -> FloatArray:
    return robot.articulation.random(samples.generator("rows", case), CONFIGURATIONS)


@functools.cache
def _sample(engine: str, case: int) -> tuple[Robot, RobotEngine, FloatArray]:
    """Return a random tree as read by the reference and an engine, and configurations."""
    text = _text(case)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "tree.xml")
        path.write_text(text, encoding="utf-8")
        adapter = ROBOT_ENGINES[engine](path)
    robot = mjcf.parse(text)
    return robot, adapter, _rows(robot, case)


def _text(case: int, equality: str = "") -> str:
    """Return a random tree of hinges, slides and balls with masses, as MJCF."""
    rng = samples.generator("tree", case)
    children: list[list[int]] = [[] for _ in range(BODIES)]
    for body in range(1, BODIES):
        children[rng.integers(max(0, body - 3), body)].append(body)

    def element(body: int) -> str:
        numbers = [" ".join(map(repr, rng.normal(size=n).tolist())) for n in (3, 4, 3, 3)]
        position, quaternion, axis, centre = numbers
        kind = "slide" if rng.random() < 0.25 else "ball" if body in BALLS else "hinge"
        inside = "".join(map(element, children[body]))
        return (
            f'<body name="b{body}" pos="{position}" quat="{quaternion}">'
            f'<joint name="j{body}" type="{kind}" axis="{axis}"/><inertial pos="{centre}" '
            f'mass="{rng.uniform(0.5, 2.0)!r}" diaginertia="1 1 1"/>{inside}</body>'
        )

    bodies = element(0)
    return f"<mujoco><worldbody>{bodies}</worldbody><equality>{equality}</equality></mujoco>"
