"""PlaCo as a program that answers targets, run by the Python of PlaCo's own environment.

Its input and output are lines of JSON. The first is {"text": a URDF, "effector", "joints",
"iterations", "limits": [m] and [rad], "regularization", "weight", "is_metered"} and is answered by
true. A question is {"target": a transform, "start"}; the answer is whether it has arrived, the time
[s], the coordinates, and the time of PlaCo's own functions [s], 0 unless metered.
"""

import json
import os
import sys
from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any

import numpy as np
import placo


class Reacher:
    """A robot and a task, which takes its effector to a frame within the joints' limits."""

    def __init__(
        self,
        text: str,
        effector: str,
        joints: Sequence[str],
        regularization: float,
        weight: float,
        is_metered: bool,
    ) -> None:
        """Read the robot; its base stands still. Add up the time of PlaCo's functions if metered.

        Without `regularization`, the tasks of a redundant arm do not determine a step; `weight` is
        that of the effector's rotation.

        Raises:
            ValueError: if PlaCo orders the joints otherwise.
        """
        self._robot = placo.RobotWrapper("", placo.Flags.ignore_collisions, text)
        if list(self._robot.joint_names()) != list(joints):
            raise ValueError("PlaCo orders the joints otherwise")
        self._solver = placo.KinematicsSolver(self._robot)
        self._solver.mask_fbase(True)
        self._solver.enable_joint_limits(True)
        self._task = self._solver.add_frame_task(effector, np.eye(4))
        self._task.configure("effector", "soft", 1.0, weight)
        self._solver.add_regularization_task(regularization)
        self._first = self._robot.get_joint_offset(joints[0])
        self.library_seconds = 0.0
        meter = self._metered if is_metered else lambda function: function
        self._step, self._update = map(meter, (self._solver.solve, self._robot.update_kinematics))
        parts = self._task.position(), self._task.orientation()
        self._parts = [(meter(part.update), meter(part.error_norm)) for part in parts]

    def solve(
        self, target: np.ndarray, start: np.ndarray, iterations: int, limits: Sequence[float]
    ) -> tuple[bool, np.ndarray]:
        """Return whether it has arrived, and the coordinates."""
        self._task.T_world_frame = target
        q = self._robot.state.q
        q[self._first :] = start
        self._robot.state.q = q
        self._update()
        is_solved = self._is_at(limits)
        for _ in range(iterations):
            if is_solved:
                break
            self._step(True)
            self._update()
            is_solved = self._is_at(limits)
        return is_solved, self._robot.state.q[self._first :]

    def _is_at(self, limits: Sequence[float]) -> bool:
        for update, _ in self._parts:  # the errors are those of the last step until then
            update()
        parts = zip(self._parts, limits, strict=True)
        return all(error_norm() <= limit for (_, error_norm), limit in parts)

    def _metered(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            before = perf_counter()
            result = function(*arguments)
            self.library_seconds += perf_counter() - before
            return result

        return call


def main() -> None:
    """Answer questions; the output of PlaCo goes to standard error."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    task = json.loads(sys.stdin.readline())
    names = ("text", "effector", "joints", "regularization", "weight", "is_metered")
    reacher = Reacher(*(task[name] for name in names))
    print("true", file=answers, flush=True)
    for line in sys.stdin:
        question = json.loads(line)
        target, start = np.array(question["target"]), np.array(question["start"])
        before, reacher.library_seconds = perf_counter(), 0.0
        claim, q = reacher.solve(target, start, task["iterations"], task["limits"])
        seconds = perf_counter() - before
        answer = [bool(claim), seconds, q.tolist(), reacher.library_seconds]
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main()
