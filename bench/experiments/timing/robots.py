"""Forward kinematics and Jacobians of robots and a character: single poses, and batches."""

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from typing import Any

import mujoco
import numpy as np

from plumbob.crosscheck.engines import ABSENT
from plumbob.reference import forward_kinematics, prepare
from plumbob.reference.arguments import FloatArray
from plumbob.reference.formats import mjcf, urdf
from plumbob.reference.jacobians import jacobian

from ...problems.evaluate import MUJOCO, PINOCCHIO, mujoco_model, pinocchio_model, to_pinocchio
from ...problems.robots import CHARACTER, BenchRobot, is_installed, robot
from .case import COMPILED, PREPARED, TimedCase, TimedWork

ROBOTS = ("iiwa14", "human", CHARACTER)
POSES = 1_000
Calls = dict[str, Callable[[FloatArray], Any]]  # by subject


def cases() -> Iterator[TimedCase]:
    """Yield a pose and a batch of each robot, by us and by the engines."""
    subjects, counts = ("kinematics", "jacobians"), (1, POSES)
    for name, subject, count in product(filter(is_installed, ROBOTS), subjects, counts):
        group = f"{robot(name).title}, {len(robot(name).joints)} joints"
        title = "one pose a call" if count == 1 else f"{count:,} poses a call"
        work = TimedWork(f"{subject}/{name}/{title}", subject, group, title)
        solvers = CALLS if subject == "kinematics" else (COMPILED, PINOCCHIO, MUJOCO)
        for solver in (solver for solver in solvers if solver not in ABSENT):
            call = partial(timed_call, subject, solver, name, count)
            yield TimedCase(work, solver, call, count)


def timed_call(subject: str, solver: str, name: str, count: int) -> Callable[[], Any]:
    """Return the work of random poses: our compiled call takes a batch at once, others loop."""
    bench_robot = robot(name)
    q = bench_robot.draw(np.random.default_rng(0), POSES)[:count]
    if solver == PINOCCHIO:
        q = np.array([to_pinocchio(bench_robot, row) for row in q])
    call = CALLS[solver](bench_robot)[subject]
    if count == 1:
        return partial(call, q[0])
    return partial(call, q) if solver == COMPILED else lambda: [*map(call, q)]


def our_calls(bench_robot: BenchRobot, is_prepared: bool = False) -> Calls:
    """Return our forward kinematics of all links, and our Jacobian of the first effector."""
    model = (urdf.parse if bench_robot.is_chain else mjcf.parse)(bench_robot.text).articulation
    return {
        "kinematics": prepare(model) if is_prepared else partial(forward_kinematics, model),
        "jacobians": partial(jacobian, model, effector=model.index(bench_robot.effectors[0])),
    }


def pinocchio_calls(bench_robot: BenchRobot) -> Calls:
    """Return Pinocchio's forward kinematics of all frames, and its Jacobian."""
    import pinocchio

    model, axes = pinocchio_model(bench_robot), pinocchio.LOCAL_WORLD_ALIGNED
    data, frame = model.createData(), model.getFrameId(bench_robot.effectors[0])
    return {
        "kinematics": partial(pinocchio.framesForwardKinematics, model, data),
        "jacobians": lambda q: pinocchio.computeFrameJacobian(model, data, q, frame, axes),
    }


def mujoco_calls(bench_robot: BenchRobot) -> Calls:
    """Return MuJoCo's forward kinematics, and its Jacobian, in the same memory every time."""
    model = mujoco_model(bench_robot)
    data, body = mujoco.MjData(model), model.body(bench_robot.effectors[0]).id
    J = np.empty((6, model.nv))
    linear, angular = J[:3], J[3:]

    def forward(q: FloatArray) -> Any:
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        return data

    def derivative(q: FloatArray) -> FloatArray:
        forward(q)
        mujoco.mj_comPos(model, data)
        mujoco.mj_jacBody(model, data, linear, angular, body)
        return J

    return {"kinematics": forward, "jacobians": derivative}


CALLS: dict[str, Callable[[BenchRobot], Calls]] = {
    COMPILED: our_calls,
    PREPARED: partial(our_calls, is_prepared=True),
    PINOCCHIO: pinocchio_calls,
    MUJOCO: mujoco_calls,
}
