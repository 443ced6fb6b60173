"""mujoco.minimize: box-constrained nonlinear least squares (Gauss-Newton with damping).

The residual is the effector's displacement and rotation vector from the target, with the Jacobians
of both. Its unknowns are coordinates, not rotations, so only hinges are possible.
"""

from typing import Any

import numpy as np

from ...problems.evaluate import mujoco_model
from ..peer import ONE_START, Peer, Run, restarted, short_attempts
from ..protocol import BenchRobot, FloatArray, PoseRequest, Solve, SolveFactory, Tolerance

PEER = Peer(
    "mujoco.minimize",
    __name__,
    "mujoco",
    "Apache-2.0",
    "damped Gauss-Newton within bounds",
    "poses and limits of one chain of hinges",
    (
        # The authors' defaults: the search found nothing better from one start.
        Run(ONE_START, {"iterations": 100, "minimum": 1e-6, "factor": 10.0**0.1, "scale": ""}),
        # The search chose a damping that changes faster, for attempts are short.
        short_attempts({"minimum": 1e-6, "factor": 2.0}),
        restarted(30, {"minimum": 1e-6, "factor": 2.0}),
    ),
    built_on="MuJoCo",
    use="own residuals on MuJoCo",
)


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 100,
    minimum: float = 1e-6,
    factor: float = 10.0**0.1,
    scale: str = "",
) -> SolveFactory:
    """Return the solver, set up for a robot.

    `minimum` is the least damping, `factor` the change of damping, `scale` the rule for
    coordinates.
    """
    from mujoco import minimize

    robot.require_chain()
    bounds = [robot.lower[:, None], robot.upper[:, None]]
    options: dict[str, Any] = {"max_iter": iterations, "verbose": minimize.Verbosity.SILENT}
    options |= {"mu_min": minimum, "mu_factor": factor, "x_scale": scale or None}
    reach = _Reach(robot)

    def make_solve(request: PoseRequest) -> Solve:
        problem = (request.start[:, None], reach.residuals, bounds, reach.jacobian)

        def solve() -> FloatArray:
            reach.aim(request.positions[0], request.rotations[0])
            return minimize.least_squares(*problem, **options)[0].ravel()

        def read(q: FloatArray) -> tuple[FloatArray, bool]:
            errors = np.linalg.norm(reach.residual(q).reshape(2, 3), axis=-1)
            return q, bool((errors <= tolerance).all())

        return Solve(solve, read)

    return make_solve


class _Reach:
    """The displacement and rotation vector of the effector from its current target."""

    def __init__(self, robot: BenchRobot) -> None:
        import mujoco

        self._mujoco, self._model = mujoco, mujoco_model(robot)
        self._data = mujoco.MjData(self._model)
        self._effector = self._model.body(robot.effectors[0]).id
        self._position, self._rotation = np.zeros(3), np.zeros(4)

    def aim(self, position: FloatArray, rotation: FloatArray) -> None:
        self._position = position
        self._mujoco.mju_mat2Quat(self._rotation, rotation.ravel())

    def residual(self, q: FloatArray) -> FloatArray:
        """Return displacement [m] and rotation vector [rad], (6,)."""
        self._update_kinematics(q)
        rotation_vector = np.empty(3)
        self._mujoco.mju_subQuat(rotation_vector, self._rotation, self._data.xquat[self._effector])
        return np.concatenate([self._data.xpos[self._effector] - self._position, rotation_vector])

    def residuals(self, columns: FloatArray) -> FloatArray:
        """Return the residual of each column, (6, column)."""
        return np.stack([self.residual(q) for q in columns.T], axis=1)

    def jacobian(self, q: FloatArray, _: FloatArray) -> FloatArray:
        """Return the residual's derivative, (6, coordinate)."""
        self._update_kinematics(q.ravel())
        self._mujoco.mj_comPos(self._model, self._data)
        linear, angular = np.empty((2, 3, self._model.nv))
        self._mujoco.mj_jacBody(self._model, self._data, linear, angular, self._effector)
        slope = np.empty((3, 3))
        self._mujoco.mjd_subQuat(self._rotation, self._data.xquat[self._effector], None, slope)
        # The derivative is by rotation vectors in the effector's frame, J is in the world's.
        R = self._data.xmat[self._effector].reshape(3, 3)
        return np.vstack([linear, slope @ R.T @ angular])

    def _update_kinematics(self, q: FloatArray) -> None:
        self._data.qpos[:] = q
        self._mujoco.mj_kinematics(self._model, self._data)
