"""PlaCo: differential inverse kinematics by quadratic programs, iterated to a target.

Its wheels pin a Pinocchio older than ours, so it works in a process of an environment of its own,
`placo_program`, which measures its own time: what travels between processes costs it nothing.
"""

import subprocess
from pathlib import Path

import numpy as np

from plumbob.reference.arguments import FloatArray

from ...experiments.robots.evaluate import Tolerance
from ...experiments.robots.problem import Robot
from .. import environments
from .protocol import Ask, Solve, SolverOutput, UnableError, needs_a_chain

NAME = "placo"
PROGRAM = Path(__file__).with_name("placo_program.py")


def prepare(robot: Robot, tolerance: Tolerance, iterations: int = 100) -> Ask:
    """Return the solver, set up for a robot.

    Raises:
        UnableError: if the robot is no chain, or the program does not take it.
    """
    needs_a_chain(robot)
    program = _Program(robot, tolerance, iterations)

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        question = np.concatenate([positions[0], rotations[0].ravel(), start]).tobytes()

        def solve() -> SolverOutput:
            answer = program.answer(question)
            return SolverOutput(answer[2:], bool(answer[0]), float(answer[1]))

        return solve

    return ask


class _Program:
    """A process that is set up for a robot; it ends with its input."""

    def __init__(self, robot: Robot, tolerance: Tolerance, iterations: int) -> None:
        numbers = [str(iterations), *map(repr, map(float, tolerance))]
        self._size = 8 * (2 + len(robot.joints))
        self._process = subprocess.Popen(
            [environments.python(NAME), "-I", PROGRAM, robot.effectors[0], *numbers, *robot.joints],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        text = robot.text.encode()
        self._send(len(text).to_bytes(8, "little") + text)
        if self._receive(1) != b"+":
            raise UnableError("PlaCo does not read the robot, or orders its joints otherwise")

    def __del__(self) -> None:
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe:
                pipe.close()
        self._process.wait()

    def answer(self, question: bytes) -> FloatArray:
        """Return whether it has arrived, the time [s] and the coordinates.

        Raises:
            ConnectionError: if the process has ended.
        """
        self._send(question)
        answer = self._receive(self._size)
        if len(answer) < self._size:
            raise ConnectionError("the program of PlaCo has ended")
        return np.frombuffer(answer)

    def _send(self, message: bytes) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(message)
        self._process.stdin.flush()

    def _receive(self, count: int) -> bytes:
        assert self._process.stdout is not None
        return self._process.stdout.read(count)
