"""Motion of a scene by a user's solver, opened as by `plumbob verify`."""

from collections.abc import Callable, Sequence
from typing import Any, Self

import numpy as np

from plumbob.reference import MassSpring, Skeleton, State, forward_kinematics
from plumbob.reference.arguments import FloatArray
from plumbob.text.printable import one_line
from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.connections import open_connection
from plumbob.verify.exchange import Connection, Failure, NoGreetingError

from ..peers.user_cloth import state_inputs, system_inputs
from ..peers.user_solver import CHAIN_TASK, MOTION_TASK, STEP_TASK

TRACK = "track"
# The tasks for scenes: a scene needs any of these.
ARM_TASKS, CLOTH_TASKS = (TRACK, CHAIN_TASK), (STEP_TASK, MOTION_TASK)
TOLERANCE, MAX_ITERATIONS = 1e-4, 100  # the defaults of `solve_ik`
# The step of a cloth [s].
H = 1 / 60
Progress = Callable[[int, int], None]


class SceneSolver:
    """A solver judged by its answers, open until `close`.

    Attributes:
        address: as the user gave it.
        name: as the solver gave it, else its address.
        tasks: as offered.
    """

    def __init__(self, address: str, solver: Connection) -> None:
        """Ask a solver for its name and tasks.

        Raises:
            ValueError: if it does not describe itself.
        """
        self.address, self._solver = address, solver
        try:
            self._greeting = self._solver.greeting
        except NoGreetingError as error:
            self.close()
            reason = one_line(str(error.failure.sentence), 500)
            raise ValueError(f"with: expected a solver, got {self.address}: {reason}") from None
        self.tasks = self._greeting.tasks
        self.name = self.address if self._greeting.name == "solver" else self._greeting.name

    @classmethod
    def open(cls, words: Sequence[str]) -> Self:
        """Open a file, a module or a program.

        Raises:
            ValueError: if there is no solver, or it does not describe itself.
        """
        return cls(" ".join(words), open_connection(words[0] if len(words) == 1 else words))

    def close(self) -> None:
        """End the solver and its processes."""
        self._solver.close()

    @property
    def scene(self) -> str:
        """The default scene of the solver."""
        task = self.offered("an arm or a cloth", ARM_TASKS + CLOTH_TASKS)
        return "arm" if task in ARM_TASKS else "cloth"

    def offered(self, scene: str, tasks: Sequence[str]) -> str:
        """Return the first of some tasks that the solver offers.

        Raises:
            ValueError: if none is offered.
        """
        for task in tasks:
            if task in self.tasks:
                return task
        raise ValueError(
            f"with: expected a solver with a function {' or '.join(tasks)} for {scene}, got "
            f"{self.address}, which has {', '.join(self.tasks)}; plumbob verify --list "
            "describes the arguments and results of each"
        )

    def follow_curve(
        self, skeleton: Skeleton, rest: FloatArray, curve: FloatArray, progress: Progress
    ) -> FloatArray:
        """Return the positions of the joints along a curve, (frame, joint, 3)."""
        inputs = {
            "parents": skeleton.parents,
            "offsets": skeleton.offsets,
            "local_rotations": rest,
            "effector": len(skeleton.parents) - 1,
            "tolerance": TOLERANCE,
            "max_iterations": MAX_ITERATIONS,
            "method": self._greeting.methods[0] if self._greeting.methods else "",
        }
        if TRACK in self.tasks:
            answer = self._answer(TRACK, {**inputs, "curve": curve}, "the curve")
            return _joint_positions(skeleton, answer)
        frames = []
        for i, target in enumerate(curve):
            request = f"frame {i + 1} of {len(curve)}"
            answer = self._answer(CHAIN_TASK, {**inputs, "target": target}, request)
            frames.append(_joint_positions(skeleton, answer))
            if "local_rotations" in answer:  # each frame starts from the one before
                inputs["local_rotations"] = answer["local_rotations"]
            progress(i + 1, len(curve))
        return np.array(frames)

    def step_cloth(
        self, system: MassSpring, start: State, steps: int, progress: Progress
    ) -> FloatArray:
        """Return the positions after each step, the start first, (frame, particle, 3).

        Positions are NaN from the first step with a non-finite position.
        """
        inputs = system_inputs(system, H, self._greeting)
        if self._greeting.system.rest_lengths == "measured":
            inputs["rest_positions"] = start.positions
        x, v = start.positions, start.velocities
        if self.offered("a cloth", CLOTH_TASKS) == MOTION_TASK:
            request = {**inputs, "steps": steps, **state_inputs(x, v, H, self._greeting)}
            answer = self._answer(MOTION_TASK, request, "the motion")
            return np.array([x, *_array(answer, "positions")])
        frames = np.full((steps + 1, *x.shape), np.nan)
        frames[0] = x
        for i in range(steps):
            request = inputs | state_inputs(x, v, H, self._greeting)
            answer = self._answer(STEP_TASK, request, f"step {i + 1} of {steps}")
            positions = _array(answer, "positions")
            x, v = positions, answer.get("velocities", (positions - x) / H)
            if not np.isfinite(x).all():
                break
            frames[i + 1] = x
            progress(i + 1, steps)
        return frames

    def _answer(self, task: str, inputs: dict[str, Any], request: str) -> dict[str, Any]:
        """Return the answer to a request, which error messages name."""
        answer = self._solver.answer(Case(request, task, inputs, "show", sentence("")))
        if isinstance(answer, Failure):
            reason = one_line(str(answer.sentence), 300)
            raise ValueError(
                f"with: expected an answer to {request}, got none from {self.address}: {reason}"
            )
        return dict(answer.values)


def _joint_positions(skeleton: Skeleton, answer: dict[str, Any]) -> FloatArray:
    """Return the positions of joints, by the answer's rotations if any."""
    if "local_rotations" not in answer:
        return _array(answer, "positions")
    rotations = answer["local_rotations"]
    with np.errstate(all="ignore"):
        unit = rotations / np.linalg.norm(rotations, axis=-1, keepdims=True)
    valid = np.isfinite(unit).all(axis=(-2, -1))
    unit[~valid] = [1.0, 0.0, 0.0, 0.0]
    positions = np.array(forward_kinematics(skeleton, unit).positions)
    positions[~valid] = np.nan
    return positions


def _array(answer: dict[str, Any], name: str) -> FloatArray:
    if name not in answer:
        raise ValueError(f"with: expected {name} in the answer, got {', '.join(answer)}")
    array: FloatArray = answer[name]
    return array
