"""Compile the kernels of the reference in a process of its own, while other work goes on.

Compiled kernels are stored on disk for later calls. Run as a module, this file compiles and exits.
"""

import contextlib
import functools
import subprocess
import sys
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def compiling_ahead() -> Iterator[Callable[[], object]]:
    """Compile in a process while the block runs; yield a function to wait for its end.

    The process reports no failure: the first caller of the kernel will meet the failure again.
    """
    command = [sys.executable, "-m", __name__]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process.wait
    finally:
        process.kill()
        process.wait()


def compile_kernels() -> None:
    """Solve a small problem with each solver, the slowest to compile and last needed first."""
    import numpy as np

    from plumbob import reference

    cloth, state = reference.scenes.lab_cloth(damping=0.2)
    for name in reference.STEP_SOLVERS:
        reference.ImplicitEuler(cloth, h=1 / 60, solver=name, max_iterations=2).step(state)
    links = reference.Skeleton([-1, 0, 1, 2], [[0, 0, 0.3], [0, 0, 0.4], [0.4, 0, 0], [0.3, 0, 0]])
    axes = [[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0]]
    robot = reference.Articulation(links, "hinge", axes=axes, lower=-2.5, upper=2.5)
    arm, rest = reference.scenes.lab_arm()
    target = np.array([0.4, 0.2, 0.5])
    for name in reference.IK_SOLVERS:
        solve = functools.partial(reference.solve_ik, solver=name, max_iterations=2)
        solve(robot, robot.neutral(), reference.Target(target))
        solve(arm, rest, target)
    reference.track(arm, reference.curves["heart"]())


if __name__ == "__main__":
    compile_kernels()
