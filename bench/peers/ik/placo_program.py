"""PlaCo as a program that answers targets, run by the Python of PlaCo's own environment.

    python placo_program.py EFFECTOR ITERATIONS TOLERANCE TOLERANCE_ROTATION JOINT...

First comes a URDF, its length ahead in eight bytes, and is answered by "+". A question is the
target's position, rotation matrix and a start in double precision; the answer is whether it has
arrived, the time [s], and the coordinates.
"""

import os
import sys
from collections.abc import Iterator, Sequence
from time import perf_counter

import numpy as np
import placo

# Without it, the tasks of a redundant arm do not determine a step.
REGULARIZATION = 1e-6


class Reacher:
    """A robot and one task, which takes its effector to a frame within the joints' limits."""

    def __init__(self, text: str, effector: str, joints: Sequence[str]) -> None:
        """Read the robot; its base stands still.

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
        self._task.configure("effector", "soft", 1.0, 1.0)
        self._solver.add_regularization_task(REGULARIZATION)
        self._parts = self._task.position(), self._task.orientation()
        self._first = self._robot.get_joint_offset(joints[0])

    def solve(
        self, target: np.ndarray, start: np.ndarray, iterations: int, limits: Sequence[float]
    ) -> tuple[bool, np.ndarray]:
        """Return whether it has arrived, and the coordinates."""
        self._task.T_world_frame = target
        q = self._robot.state.q
        q[self._first :] = start
        self._robot.state.q = q
        self._robot.update_kinematics()
        done = self._is_at(limits)
        for _ in range(iterations):
            if done:
                break
            self._solver.solve(True)
            self._robot.update_kinematics()
            done = self._is_at(limits)
        return done, self._robot.state.q[self._first :]

    def _is_at(self, limits: Sequence[float]) -> bool:
        for part in self._parts:  # the errors are those of the last step until then
            part.update()
        return all(
            part.error_norm() <= limit for part, limit in zip(self._parts, limits, strict=True)
        )


def questions(size: int) -> Iterator[np.ndarray]:
    """Yield questions of so many numbers until the input ends."""
    while len(question := sys.stdin.buffer.read(8 * size)) == 8 * size:
        yield np.frombuffer(question)


def main(effector: str, iterations: str, position: str, rotation: str, *joints: str) -> None:
    """Answer questions; what PlaCo prints goes to standard error."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    text = sys.stdin.buffer.read(int.from_bytes(sys.stdin.buffer.read(8), "little"))
    reacher, limits = Reacher(text.decode(), effector, joints), (float(position), float(rotation))
    answers.write(b"+")
    answers.flush()
    for question in questions(12 + len(joints)):
        target = np.eye(4)
        target[:3, 3], target[:3, :3] = question[:3], question[3:12].reshape(3, 3)
        before = perf_counter()
        done, q = reacher.solve(target, question[12:], int(iterations), limits)
        answers.write(np.concatenate([[done, perf_counter() - before], q]).tobytes())
        answers.flush()


if __name__ == "__main__":
    main(*sys.argv[1:])
