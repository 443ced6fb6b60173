"""The records of solvers listing all solutions of a pose."""

import msgspec

from ...harness.values import Details, Floats1, Integers1, Kind, Values
from . import BRANCHES


class BranchValues(Values, frozen=True):
    """The lists of a solver, an entry for each target with isolated solutions.

    Attributes:
        solutions: how many solutions it lists, of those that any solver or the search finds.
        missing: how many of those it does not list.
        wrong: how many of its solutions do not reach the target.
        seconds: how long a call takes, the median of all rounds [s].
        singular: how many further targets lie on a continuum of solutions.
    """

    solutions: Integers1
    missing: Integers1
    wrong: Integers1 = msgspec.field(name="false")
    seconds: Floats1
    singular: int


class BranchDetails(Details, frozen=True):
    """The version of the solver, the starts of the search, and why a robot is not taken."""

    version: str
    starts: int
    remark: str = ""


KINDS = {BRANCHES: Kind(BranchValues, BranchDetails)}
