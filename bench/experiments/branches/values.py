"""The records of solvers listing all solutions of a pose."""

from ...harness.values import Floats1, Integers1, Values
from . import BRANCHES


class BranchWords(Values, frozen=True, kw_only=True):
    """The version of the solver, and the starts of the search."""

    version: str
    starts: int


class BranchValues(BranchWords, frozen=True):
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
    wrong: Integers1
    seconds: Floats1
    singular: int


KINDS = {BRANCHES: BranchValues}
