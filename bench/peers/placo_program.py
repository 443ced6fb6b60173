"""PlaCo as a program that answers targets, run by the Python of PlaCo's own environment.

Its input and output are lines of JSON. The first is {"text": a URDF, "effector", "joints", "parts",
"iterations", "limits": [m] and [rad], "regularization", "weight", "is_metered"} and is answered by
true. A request is {"target": a transform, "start"} or, where a goal gives the targets of the
parts, {"goal": coordinates, "start"}. The answer is whether the target is reached, the time [s],
the coordinates, and the time of PlaCo's own functions [s], 0 unless metered.
"""

import json
import os
import sys
from collections.abc import Callable, Sequence
from time import process_time
from typing import Any

import numpy as np
import placo

# Where a posture counts, iterations go on until a step is smaller than this [rad].
SETTLED_STEP = 1e-3
# PlaCo's centre of mass includes the base, which stands still: the links' is off by more.
SHARE_OF_LINKS = 0.5


class PlacoArm:
    """A robot with a fixed base, and tasks to solve within its joints' limits."""

    def __init__(self, task: dict[str, Any]) -> None:
        """Read the robot. Add up the time of PlaCo's functions if metered.

        Without `regularization`, the tasks of a redundant arm do not determine a step; `weight` is
        the weight of the effector's rotation.

        Raises:
            ValueError: if PlaCo orders the joints otherwise.
        """
        self._task, joints = task, task["joints"]
        self._robot = placo.RobotWrapper("", placo.Flags.ignore_collisions, task["text"])
        if list(self._robot.joint_names()) != joints:
            raise ValueError("PlaCo orders the joints otherwise")
        self._solver = placo.KinematicsSolver(self._robot)
        self._solver.mask_fbase(True)
        self._solver.enable_joint_limits(True)
        self._first = self._robot.get_joint_offset(joints[0])
        self.library_seconds, self._largest = 0.0, 0.0
        self._meter = self._metered if task["is_metered"] else lambda function: function
        self._step = self._meter(self._solver.solve)
        self._update = self._meter(self._robot.update_kinematics)
        self._checks: list[tuple[Callable[[], None], Callable[[], float], float]] = []
        kinds = {
            "pose": self._pose, "frame": self._frame, "centre_of_mass": self._centre,
            "posture": self._posture,
        }  # fmt: skip
        self._setters = [kinds[part["kind"]](part) for part in task["parts"]]
        self._solver.add_regularization_task(task["regularization"])

    def aim(self, request: dict[str, Any]) -> None:
        """Set the targets of a request."""
        if "goal" in request:
            self._place(request["goal"])
        for set_target in self._setters:
            set_target(request)

    def solve(self, start: Sequence[float]) -> tuple[bool, np.ndarray]:
        """Return whether the target is reached, and the coordinates."""
        self._place(start)
        largest, is_solved = self._largest, self._is_at()
        for _ in range(self._task["iterations"]):
            if is_solved and largest <= SETTLED_STEP:
                break
            step = self._step(True)
            self._update()
            largest = np.abs(step).max() if self._largest else 0.0
            is_solved = self._is_at()
        return is_solved, self._robot.state.q[self._first :]

    def _place(self, coordinates: Sequence[float]) -> None:
        q = self._robot.state.q
        q[self._first :] = coordinates
        self._robot.state.q = q
        self._update()

    def _is_at(self) -> bool:
        for update, _, _ in self._checks:  # the errors are those of the last step until then
            update()
        return all(error_norm() <= limit for _, error_norm, limit in self._checks)

    def _add(self, task: Any, limit: float, weight: float = 1.0) -> Any:
        task.configure("", "soft", weight)
        self._checks.append((self._meter(task.update), self._meter(task.error_norm), limit))
        return task

    def _pose(self, _part: dict[str, Any]) -> Callable[[dict[str, Any]], None]:
        frame = self._solver.add_frame_task(self._task["effector"], np.eye(4))
        distance, angle = self._task["limits"]
        self._add(frame.position(), distance)
        self._add(frame.orientation(), angle, self._task["weight"])
        return lambda request: setattr(frame, "T_world_frame", np.array(request["target"]))

    def _frame(self, part: dict[str, Any]) -> Callable[[dict[str, Any]], None]:
        frames, limit = (part["base"], self._task["effector"]), self._task["limits"][0]
        moves, turns = np.array(part["axes"]).reshape(2, 3) > 0.0
        position = rotation = None
        if moves.any():
            position = self._solver.add_relative_position_task(*frames, np.zeros(3))
            self._add(position, limit)
        if turns.any():
            rotation = self._solver.add_relative_orientation_task(*frames, np.eye(3))
            rotation.mask.set_axises("".join(np.array([*"xyz"])[turns]), "custom")
            self._add(rotation, limit, self._task["weight"])

        def aim(_question: dict[str, Any]) -> None:
            base, effector = map(self._robot.get_T_world_frame, frames)
            T = np.linalg.inv(base) @ effector
            if position is not None:
                position.target = T[:3, 3]
            if rotation is not None:
                rotation.R_a_b, rotation.mask.R_custom_world = T[:3, :3], T[:3, :3].T

        return aim

    def _centre(self, _part: dict[str, Any]) -> Callable[[dict[str, Any]], None]:
        centre = self._solver.add_com_task(np.zeros(3))
        self._add(centre, SHARE_OF_LINKS * self._task["limits"][0])
        return lambda _: setattr(centre, "target_world", self._robot.com_world())

    def _posture(self, part: dict[str, Any]) -> Callable[[dict[str, Any]], None]:
        self._largest = np.inf
        posture = self._solver.add_joints_task()
        posture.configure("", "soft", part["weight"])
        posture.set_joints(dict(zip(self._task["joints"], part["middle"], strict=True)))
        return lambda _: None

    def _metered(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            before = process_time()
            result = function(*arguments)
            self.library_seconds += process_time() - before
            return result

        return call


def main() -> None:
    """Answer questions; the output of PlaCo goes to standard error."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    arm = PlacoArm(json.loads(sys.stdin.readline()))
    print("true", file=answers, flush=True)
    for line in sys.stdin:
        request = json.loads(line)
        arm.aim(request)
        before, arm.library_seconds = process_time(), 0.0
        claim, q = arm.solve(request["start"])
        seconds = process_time() - before
        print(json.dumps([bool(claim), seconds, q.tolist(), arm.library_seconds]),
              file=answers, flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
