"""A user's solver for chains of balls: its answers are the joints' positions."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from plumbob.crosscheck.engines import SKELETON_ENGINES, SkeletonEngine, forward_kinematics_by
from plumbob.reference import Skeleton, forward_kinematics, rotation
from plumbob.reference.arguments import FloatArray

from ..problems.chains import ChainRequest
from ..problems.evaluate import arbiter_of
from .connection import connection
from .protocol import SolverOutput
from .user_solver import CHAIN_TASK, Spec

# Positions without rotations must keep every link's length to this share.
STRETCH = 1e-6


def prepare(
    skeleton: Skeleton, tolerance: float, spec: Spec = "", method: str = ""
) -> Callable[[ChainRequest], Callable[[], SolverOutput]]:
    """Return a user's solver, set up for a skeleton that ends at its effector.

    An output holds the iterations, NaN if unstated, and the joints' positions in a row.

    Raises:
        NoAnswerError: if there is no answer with an iteration allowed.
    """
    solver, arbiter = connection(spec), SKELETON_ENGINES[arbiter_of("")](skeleton)
    constants = {"parents": skeleton.parents, "offsets": skeleton.offsets, "tolerance": tolerance}
    constants |= {"effector": skeleton.joint_count - 1, "method": method}

    def inputs(target: FloatArray, start: FloatArray, iterations: int) -> dict[str, Any]:
        variables = {"local_rotations": start, "target": target, "max_iterations": iterations}
        return {**constants, **variables}

    def make_solve(request: ChainRequest) -> Callable[[], SolverOutput]:
        def solve() -> SolverOutput:
            answer, time = solver.answer(CHAIN_TASK, inputs(*request))
            positions = joint_positions(skeleton, answer, arbiter)
            q = np.append(answer.get("iterations", np.nan), positions)
            return SolverOutput(q, answer.get("converged"), time)

        return solve

    rest = np.tile([1.0, 0.0, 0.0, 0.0], (skeleton.joint_count, 1))
    effector = forward_kinematics(skeleton, rest).positions[-1]
    solver.answer(CHAIN_TASK, inputs(0.5 * (skeleton.offsets[0] + effector), rest, 1))
    return make_solve


def joint_positions(
    skeleton: Skeleton, answer: Mapping[str, Any], arbiter: SkeletonEngine
) -> FloatArray:
    """Return where an answer puts the joints [m], (joint, 3).

    If the answer has rotations, an engine's kinematics of the rotations counts.

    Raises:
        ValueError: if there are neither rotations nor positions, or positions stretch links.
    """
    if "local_rotations" in answer:
        local = rotation.unit("local_rotations", answer["local_rotations"])
        return forward_kinematics_by(arbiter, local).positions
    if "positions" not in answer:
        raise ValueError("answered neither local_rotations nor positions")
    positions = np.asarray(answer["positions"], dtype=float)
    links = positions[1:] - positions[skeleton.parents[1:]]
    lengths = np.linalg.norm(skeleton.offsets[1:], axis=-1)
    stretch = np.abs(np.linalg.norm(links, axis=-1) - lengths).max(initial=0.0)
    shift = np.linalg.norm(positions[0] - skeleton.offsets[0])
    if not max(stretch, shift) <= STRETCH * max(lengths.sum(), 1e-30):
        raise ValueError("answered positions that do not keep the links' lengths or the root")
    return positions
