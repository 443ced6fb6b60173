"""The records of published tables that are measured again."""

import msgspec

from ...harness.values import Booleans1, Details, Floats1, Integers1, Kind, Values
from . import FABRIK, TOOLBOX, TRAC_IK


class RobotSearches(Values, frozen=True, kw_only=True):
    """Searches for targets of a robot, as in `RobotSolves`, without residuals."""

    solved: Booleans1 | None = None
    claims: Integers1 | None = msgspec.field(default=None, name="claimed")
    seconds: Floats1 | None = None
    setup: float


class TracIKDetails(Details, frozen=True):
    """The robot of TRAC-IK's table."""

    robot: str


class ToolboxDetails(Details, frozen=True):
    """The published share of infeasible targets [%], None if there is none."""

    infeasible: float | None


class FabrikSolves(Values, frozen=True):
    """The iterations of each solve, NaN if not reported, and the remaining distances [m]."""

    iterations: Floats1
    residual: Floats1


class FabrikDetails(Details, frozen=True):
    """The stratum of the targets."""

    stratum: str


KINDS = {
    TRAC_IK: Kind(RobotSearches, TracIKDetails),
    TOOLBOX: Kind(RobotSearches, ToolboxDetails),
    FABRIK: Kind(FabrikSolves, FabrikDetails),
}
