"""The records of published tables, measured again."""

from ...harness.values import Floats1, Values
from ..robots.values import RobotSolves
from . import FABRIK, TOOLBOX, TRAC_IK


class FabrikWords(Values, frozen=True, kw_only=True):
    """The stratum of the targets."""

    stratum: str


class FabrikSolves(FabrikWords, frozen=True):
    """The iterations of each solve, NaN if not reported, and the remaining distances [m]."""

    iterations: Floats1
    residual: Floats1


KINDS = {TRAC_IK: RobotSolves, TOOLBOX: RobotSolves, FABRIK: FabrikSolves}
