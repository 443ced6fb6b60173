"""The records of solvers for tasks of arms."""

from ...harness.values import Booleans1, Details, Floats1, Kind, Values
from . import ROBOT_TASK


class TaskValues(Values, frozen=True):
    """The answers of a solver to the targets of a robot, (target,)."""

    solved: Booleans1  # whether MuJoCo confirms the answer within the limits
    seconds: Floats1  # the time of a call, all attempts together [s]
    distance: Floats1  # from the middle of the limits, root mean square of all joints [rad]


class TaskDetails(Details, frozen=True):
    """The attempts of a solver, and why a task is not taken."""

    kind: str
    remark: str = ""


KINDS = {ROBOT_TASK: Kind(TaskValues, TaskDetails)}
