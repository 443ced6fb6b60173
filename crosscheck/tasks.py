"""Comparisons of the tasks of inverse kinematics with engines, on random trees in MJCF."""

import functools
import tempfile
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

from plumbob.reference import rotation, tasks
from plumbob.reference.arguments import FloatArray
from plumbob.reference.formats import mjcf
from plumbob.reference.formats.robot import Robot

from . import samples
from .engines import ROBOT_ENGINES
from .engines.robot_engine import RobotEngine
from .robots.models import moving_joints
from .verdict import Comparison

BODIES, CONFIGURATIONS = 8, 3
# Equalities of the sort of bodies that MuJoCo reads, with places for six random numbers.
EQUALITIES = """
<connect body1="b2" body2="b7" anchor="{} {} {}"/>
<weld body1="b3" body2="b6" anchor="{} {} {}"/>
<weld body1="b1" body2="b5" anchor="{} {} {}" relpose="{} {} {} .5 .5 .5 .5"/>
<weld body1="b4"/>
<joint joint1="j3" joint2="j6" polycoef="{} {} {} 0.1"/>
<joint joint1="j2" polycoef="{}"/>"""


def relative_frames(engine: str, case: int) -> Comparison:
    """Compare the place of a point in another link's frame, its rotation, and both derivatives."""
    robot, adapter, rows = _sample(engine, case)
    point = samples.generator("point", case).normal(size=3)
    freedoms = {j.name: j.freedoms.stop - j.freedoms.start for j in moving_joints(robot)}
    task = tasks.FrameTask("b7", (0, 0, 0), (1, 0, 0, 0), relative_to="b3", point=point)

    def expected(q: FloatArray) -> FloatArray:
        _set(robot, adapter, q)
        (x, x_base), (R, R_base) = adapter.link_poses(["b7", "b3"])
        J, J_base = adapter.jacobians(["b7", "b3"], freedoms)
        offset = x + R @ point - x_base
        velocity = J[:3] + np.cross(J[3:].T, R @ point).T - J_base[:3]
        velocity -= np.cross(J_base[3:].T, offset).T
        matrix, angular = R_base.T @ R, R_base.T @ (J[3:] - J_base[3:])
        parts = R_base.T @ offset, matrix, R_base.T @ velocity, angular
        return np.concatenate([part.ravel() for part in parts])

    def actual(q: FloatArray) -> FloatArray:
        residual, J = _evaluate(robot, q, task)
        Q = rotation.exponential(residual[3:])
        # back from the rate of the rotation vector to the angular velocity
        angular = rotation.to_matrix(Q) @ np.linalg.solve(
            tasks.inverse_right_jacobian(residual[3:]), J[3:]
        )
        parts = residual[:3], rotation.to_matrix(Q), J[:3], angular
        return np.concatenate([part.ravel() for part in parts])

    return _compared(robot, rows, actual, expected)


def centre_of_mass(engine: str, case: int) -> Comparison:
    """Compare the centre of mass."""
    robot, adapter, rows = _sample(engine, case)
    task = tasks.CentreOfMass(robot.masses, robot.centres, (0.0, 0.0, 0.0))

    def expected(q: FloatArray) -> FloatArray:
        _set(robot, adapter, q)
        return adapter.centre_of_mass()

    return _compared(robot, rows, lambda q: _evaluate(robot, q, task)[0], expected)


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
    """Compare two functions of the coordinates; nothing would move if all were those of home."""
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


def _set(robot: Robot, adapter: RobotEngine, q: FloatArray) -> None:
    adapter.update_kinematics({j.name: q[j.coordinates] for j in moving_joints(robot)})


def _rows(robot: Robot, case: int) -> FloatArray:
    return robot.articulation.random(samples.generator("rows", case), CONFIGURATIONS)


@functools.cache
def _sample(engine: str, case: int) -> tuple[Robot, RobotEngine, FloatArray]:
    """Return a random tree as the reference and an engine read it, and configurations."""
    text = _text(case)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "tree.xml")
        path.write_text(text, encoding="utf-8")
        adapter = ROBOT_ENGINES[engine](path)
    robot = mjcf.parse(text)
    return robot, adapter, _rows(robot, case)


def _text(case: int, equality: str = "") -> str:
    """Return a random tree of hinges and slides with masses, as MJCF."""
    rng = samples.generator("tree", case)
    children: list[list[int]] = [[] for _ in range(BODIES)]
    for body in range(1, BODIES):
        children[rng.integers(max(0, body - 3), body)].append(body)

    def element(body: int) -> str:
        numbers = [" ".join(map(repr, rng.normal(size=n).tolist())) for n in (3, 4, 3, 3)]
        position, quaternion, axis, centre = numbers
        kind = "slide" if rng.random() < 0.25 else "hinge"
        inside = "".join(map(element, children[body]))
        return (
            f'<body name="b{body}" pos="{position}" quat="{quaternion}">'
            f'<joint name="j{body}" type="{kind}" axis="{axis}"/><inertial pos="{centre}" '
            f'mass="{rng.uniform(0.5, 2.0)!r}" diaginertia="1 1 1"/>{inside}</body>'
        )

    bodies = element(0)
    return f"<mujoco><worldbody>{bodies}</worldbody><equality>{equality}</equality></mujoco>"
