"""The records of a step of a heavy cloth: the solution, and bounds on its error."""

from ...harness.values import Values


class CertifiedWords(Values, frozen=True, kw_only=True):
    """The cloth's stiffness [N/m], the tolerance and start of the solve, and the kind of bound."""

    stiffness: float
    tolerance: float
    start: str
    coverage: str = ""


class CertifiedStep(CertifiedWords, frozen=True, kw_only=True):
    """A solver's solution of the step; lengths in metres."""

    size: int  # particles along a side
    iterations: int
    residual: float
    at_floor: bool  # whether the residual is at the rounding floor
    balance: float  # the residual in MuJoCo's forces
    distance: float  # proven bound on the distance to a minimiser, infinite if there is none
    curvature: float  # proven lower bound on the smallest eigenvalue of the Hessian
    lipschitz: float  # Lipschitz constant of the Hessian
    newton_step: float  # its length
    newton_distance: float  # to Newton's solution
    error: float  # |x - x*| / |y - x*|
    above: float  # g above that of Newton's solution [kg m²]
    covered: bool  # whether there is a bound
    same: bool  # whether it provably belongs to Newton's minimiser
    different: bool  # whether it provably does not


KINDS = {"": CertifiedStep}
