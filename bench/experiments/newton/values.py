"""The records of one step of a heavy cloth: an answer, and what is proven of it."""

from ...harness.values import Details, Kind, Values


class Certified(Values, frozen=True):
    """One solver's answer to the step; lengths in metres."""

    size: int  # particles along a side
    iterations: int
    residual: float
    at_floor: bool  # whether the residual is at the rounding floor
    balance: float  # the residual in MuJoCo's forces
    distance: float  # within which a minimiser is proven to be, infinite without a bound
    curvature: float  # the least eigenvalue of the Hessian, as far as it is proven
    lipschitz: float  # how fast the Hessian may change
    newton_step: float  # its length
    apart: float  # the distance from Newton's answer
    error: float  # |x - x*| / |y - x*|
    above: float  # g above that of Newton's answer [kg m²]
    covered: bool  # whether there is a bound
    same: bool  # whether it is proven to belong to Newton's minimiser
    different: bool  # whether it is proven not to


class CertifiedDetails(Details, frozen=True):
    """The cloth's stiffness [N/m], the tolerance and start of the solve, and the kind of bound."""

    stiffness: float
    tolerance: float
    start: str
    coverage: str = ""


KINDS = {"": Kind(Certified, CertifiedDetails)}
