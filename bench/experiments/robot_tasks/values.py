"""The records of solvers for tasks of arms."""

from ...harness.values import Booleans1, Floats1, Values
from . import ROBOT_TASK


class TaskWords(Values, frozen=True, kw_only=True):
    """The attempts of a solver."""

    kind: str


class TaskValues(TaskWords, frozen=True):
    """The answers of a solver to the targets of a robot, (target,)."""

    solved: Booleans1  # whether MuJoCo confirms the answer within the limits
    seconds: Floats1  # the time of a call, all attempts together [s]
    distance: Floats1  # from the middle of the limits, root mean square of all joints [rad]


KINDS = {ROBOT_TASK: TaskValues}
