"""Plumbob's solvers, and a loop on each engine, for chains of balls, target by target."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from plumbob.crosscheck.engines import SKELETON_ENGINES, forward_kinematics_by
from plumbob.crosscheck.engines.skeleton_engine import coordinates
from plumbob.reference import Skeleton, solve_ik

from ..problems.chains import ChainRequest
from ..problems.evaluate import arbiter_of
from .levenberg_marquardt import LoopOutput, levenberg_marquardt, within_reach
from .protocol import FloatArray, Solve


def prepare(
    skeleton: Skeleton, tolerance: float, solver: str = "", engine: str = ""
) -> Callable[[ChainRequest], Solve]:
    """Return a solver of ours by its name, or the loop on an engine by the engine's name.

    An output holds the number of iterations, and the joints' positions in a row; the positions of a
    loop come from another engine's kinematics.
    """
    if engine:
        return _loop(skeleton, tolerance, engine)

    def make_solve(request: ChainRequest) -> Solve:
        target, start, iterations = request
        options: dict[str, Any] = {"tolerance": tolerance, "max_iterations": iterations}

        call = partial(solve_ik, skeleton, start, target, solver, **options)
        return Solve(call, lambda s: (np.append(s.iterations, s.positions), None))

    return make_solve


def _loop(skeleton: Skeleton, tolerance: float, name: str) -> Callable[[ChainRequest], Solve]:
    engine: Any = SKELETON_ENGINES[name](skeleton)
    arbiter = SKELETON_ENGINES[arbiter_of(name)](skeleton)
    effector, root = skeleton.joint_count - 1, skeleton.offsets[0]

    def make_solve(request: ChainRequest) -> Solve:
        target = within_reach(request.target, root, skeleton.reach())
        q = coordinates(engine, request.start)
        limits: dict[str, Any] = {"tolerance": tolerance, "max_iterations": request.iterations}

        def read(answer: LoopOutput) -> tuple[FloatArray, None]:
            positions = forward_kinematics_by(arbiter, answer.q[engine.columns]).positions
            return np.append(answer.iterations, positions), None

        call = partial(levenberg_marquardt, engine, q, target, effector, **limits)
        return Solve(call, read)

    return make_solve
