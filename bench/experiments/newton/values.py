"""The records of one step of a heavy cloth: an answer, and what is proven of it."""

from ...harness.values import Details, Kind, Values


class Certified(Values, frozen=True):
    """One solver's answer to the step.

    Attributes:
        size: particles along a side.
        iterations: that the solver made.
        residual: |grad g| over its value at the start.
        at_floor: whether the residual is at the rounding floor.
        balance: the residual in MuJoCo's forces.
        distance: within which a minimiser is proven to be, infinite without a bound [m].
        curvature: the least eigenvalue of the Hessian, as far as it is proven.
        lipschitz: how fast the Hessian may change.
        newton_step: the length of the Newton step [m].
        apart: the distance from Newton's answer [m].
        error: |x - x*| / |y - x*|.
        above: g above that of Newton's answer [kg m²].
        covered: whether there is a bound.
        same: whether it is proven to belong to Newton's minimiser.
        different: whether it is proven not to.
    """

    size: int
    iterations: int
    residual: float
    at_floor: bool
    balance: float
    distance: float
    curvature: float
    lipschitz: float
    newton_step: float
    apart: float
    error: float
    above: float
    covered: bool
    same: bool
    different: bool


class CertifiedDetails(Details, frozen=True):
    """The cloth's stiffness [N/m], the tolerance and start of the solve, and the kind of bound."""

    stiffness: float
    tolerance: float
    start: str
    coverage: str = ""
    why: str = ""


KINDS = {"": Kind(Certified, CertifiedDetails)}
