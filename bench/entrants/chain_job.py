"""Position targets of a skeleton of balls, put to an entrant one by one in a worker's process."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics
from plumbob.reference.arguments import FloatArray, IndexArray

from ..harness.stopwatch import Budget, round_trips, timed
from ..harness.worker import Done, Message, NoAnswerError, Ready, Solved, Unfit, describe
from .contestants import asked
from .entrant import Spec

TASK = "inverse_kinematics"
# Positions without rotations count if they keep every link to this share of its length.
STRETCH = 1e-6


class ChainJob(NamedTuple):
    """What an entrant is asked for.

    Attributes:
        spec: what opens it.
        method: its method.
        parents, offsets: of the skeleton.
        starts: local rotations, (target, joint, 4).
        targets: global positions [m], (target, 3).
        effector: the joint that is to reach them.
        tolerance: the distance that counts as reached [m].
        iterations: the most for each target, (target,).
        budget: no further target is begun after so long [s].
    """

    spec: Spec
    method: str
    parents: IndexArray
    offsets: FloatArray
    starts: FloatArray
    targets: FloatArray
    effector: int
    tolerance: float
    iterations: IndexArray
    budget: float

    def perform(self) -> Iterator[Message]:
        """Yield for each target the iterations, NaN if unsaid, and the joints' positions."""
        solver = asked(self.spec)
        try:
            solver.answer(TASK, self._inputs(0) | {"max_iterations": 1})  # may compile
            forward_kinematics(Skeleton(self.parents, self.offsets), self.starts[0])  # likewise
        except NoAnswerError as error:
            yield Unfit(describe(error))
            return
        yield Ready(0.0, solver.remark)
        budget = Budget(self.budget)
        for i in range(len(self.targets)):
            if budget.is_spent:
                break
            yield self._solved(i)
        yield Done()

    def _inputs(self, i: int) -> dict[str, Any]:
        return {
            "parents": self.parents,
            "offsets": self.offsets,
            "local_rotations": self.starts[i],
            "target": self.targets[i],
            "effector": self.effector,
            "tolerance": self.tolerance,
            "max_iterations": int(self.iterations[i]),
            "method": self.method,
        }

    def _solved(self, i: int) -> Solved:
        nothing = np.full(1 + 3 * len(self.parents), np.nan)
        try:
            answer, seconds = timed(lambda: asked(self.spec).answer(TASK, self._inputs(i)))
            positions = joint_positions(Skeleton(self.parents, self.offsets), answer.values)
        except (NoAnswerError, ValueError) as error:
            return Solved(nothing, -1, 0.0, describe(error))
        made = answer.values.get("iterations", np.nan)
        claimed = int(answer.values.get("converged", -1))
        q = np.concatenate([[made], positions.ravel()])
        return Solved(q, claimed, seconds, "", *round_trips())


def joint_positions(skeleton: Skeleton, values: Any) -> FloatArray:
    """Return where an answer puts the joints [m], (joint, 3): by its rotations if it has any.

    Raises:
        ValueError: if it has neither rotations nor positions, or positions that stretch links.
    """
    if "local_rotations" in values:
        return forward_kinematics(skeleton, values["local_rotations"]).positions
    if "positions" not in values:
        raise ValueError("answered neither local_rotations nor positions")
    positions = np.asarray(values["positions"], dtype=float)
    links, lengths = positions[1:] - positions[skeleton.parents[1:]], skeleton.offsets[1:]
    wanted = np.linalg.norm(lengths, axis=-1)
    stretched = np.abs(np.linalg.norm(links, axis=-1) - wanted).max(initial=0.0)
    rooted = np.linalg.norm(positions[0] - skeleton.offsets[0])
    if not max(stretched, rooted) <= STRETCH * max(wanted.sum(), 1e-30):
        raise ValueError("answered positions that do not keep the links' lengths or the root")
    return positions
