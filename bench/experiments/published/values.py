"""The records of published tables that are measured again."""

from ...harness.values import Booleans1, Details, Floats1, Integers1, Kind, Values
from . import FABRIK, TOOLBOX, TRAC_IK


class Searches(Values, frozen=True, kw_only=True):
    """What became of targets: as of robots, without residuals."""

    solved: Booleans1 | None = None
    claimed: Integers1 | None = None
    seconds: Floats1 | None = None
    setup: float


class RobotDetails(Details, frozen=True):
    """The robot of TRAC-IK's table."""

    robot: str


class SearchDetails(Details, frozen=True):
    """Which share of targets was published as infeasible [%], None if none was."""

    infeasible: float | None


class Iterations(Values, frozen=True):
    """The iterations of each solve, NaN where they are unsaid, and the distances left [m]."""

    iterations: Floats1
    residual: Floats1


class IterationDetails(Details, frozen=True):
    """The stratum of the targets."""

    stratum: str


KINDS = {
    TRAC_IK: Kind(Searches, RobotDetails),
    TOOLBOX: Kind(Searches, SearchDetails),
    FABRIK: Kind(Iterations, IterationDetails),
}
