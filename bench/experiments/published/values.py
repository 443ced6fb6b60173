"""The records of published tables, measured again."""

from ...harness.values import Details, Floats1, Kind, Values
from ..robots.values import RobotSolves
from . import FABRIK, TOOLBOX, TRAC_IK


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
    TRAC_IK: Kind(RobotSolves, TracIKDetails),
    TOOLBOX: Kind(RobotSolves, ToolboxDetails),
    FABRIK: Kind(FabrikSolves, FabrikDetails),
}
