"""A proven upper bound on the distance from positions x to a minimiser of g.

Let mu > 0 be a lower bound of the smallest eigenvalue of H, the Hessian of g at x over the free
particles. Let eta be an upper bound of |H^-1 grad g(x)|, the length of the Newton step. Let L be a
Lipschitz constant of the Hessian within 2 eta of x. Then (Kantorovich 1948)

    L eta < mu / 2  =>  a minimiser lies within d = 2 eta / (1 + (1 - 2 L eta / mu)^1/2),

and no other stationary point within 2 eta. docs/certificates.md has the proof. The bounds include
the rounding errors of the effective springs, gradient, Hessian, Cholesky factor (Rump 2006) and
linear solve.
"""

import contextlib
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arguments import BoolArray, FloatArray, IndexArray, coordinates, instance, number
from ..backend.compiled import Kernel
from ..mass_spring import lengths
from ..outcome import SentenceEnum
from ..sparse import CholeskyFactor, NotPositiveDefiniteError
from .objective import Objective
from .terms import hessian_rounding

EPS = float(np.finfo(float).eps)
# A term of the gradient takes at most 27 roundings of EPS/2 each: 27 / 2 < 16.
GRADIENT_ROUNDING = 16
# Factor to cover the rounding errors of the bounds themselves, for millions of particles.
SLACK = 1.0 + 1e-8
# The norm of the third derivative of the length |p| is this over |p|².
THIRD_DERIVATIVE = 2.0 / math.sqrt(3.0)
# The first shift tried as a lower bound of the smallest eigenvalue, relative to its estimate, and
# the relative accuracy of the estimate. The shift leaves out twice the error of the estimate.
FIRST_SHIFT, ESTIMATE_TOLERANCE = 0.98, 1e-2
# Free particles beyond which a proof without the factor of H is tried first. Of a cloth of 10,000
# the proof with it takes 0.7 s, 20 times as long, and grows faster.
MANY_PARTICLES = 10_000


class Coverage(SentenceEnum):
    """Whether the distance to a minimiser is bounded, or why not."""

    COVERED = "A minimiser of g lies within the distance, and it is the only one near."
    OVERFLOWN = "No bound: g or its gradient is not finite here or where the step starts."
    PINS_ASTRAY = "No bound: a pinned particle is not where the step takes it."
    NOT_CONVEX = "No bound: the Hessian of g is not positive definite here, or rounding hides it."
    COINCIDENT = (
        "No bound: a spring with a rest length may shrink to a point as near as the minimiser, "
        "and there g has no derivative."
    )
    KINK = (
        "No bound: a tension-only spring may go slack, or taut, as near as the minimiser, and "
        "there the Hessian jumps."
    )
    TOO_FAR = "No bound: the Hessian may change too much along the Newton step."


@dataclass(frozen=True)
class Certificate:
    """Proven bounds for positions x as the result of a step.

    Distances are Euclidean norms over all coordinates, and so bound the distance of every particle.

    Attributes:
        residual: |grad g(x)| / max(|grad g(y)|, floor), infinite if g overflows.
        coverage: whether there is a bound, or why not.
        distance: radius about x that contains a minimiser of g [m]; infinite without a bound.
        unique_within: radius about x without another stationary point [m]; 0 without a bound.
        newton_step: eta, an upper bound of the length of the Newton step [m]; NaN if unknown.
        curvature: mu, a lower bound of the eigenvalues of the Hessian [kg]; 0 if none is positive.
        lipschitz: L, a Lipschitz constant of the Hessian within 2 eta of x [kg/m]; NaN if unknown.
    """

    residual: float
    coverage: Coverage
    distance: float = math.inf
    unique_within: float = 0.0
    newton_step: float = math.nan
    curvature: float = 0.0
    lipschitz: float = math.nan

    @property
    def covered(self) -> bool:
        """Whether there is a bound."""
        return self.coverage == Coverage.COVERED

    def shares_minimiser(self, other: "Certificate", distance: float) -> bool | None:
        """Return whether two results of the same step have the same minimiser nearby.

        `distance` is the distance between the two results [m]. None means that neither is proven,
        as when a certificate has no bound.
        """
        instance("other", other, Certificate)
        return self.shares_minimiser_within(other, number("distance", distance, minimum=0.0))

    def shares_minimiser_within(self, other: "Certificate", distance: float) -> bool | None:
        """Do the same as `shares_minimiser` for an unchecked distance."""
        if not (self.covered and other.covered):
            return None
        reach = distance * SLACK
        if (
            reach + other.distance <= self.unique_within
            or reach + self.distance <= other.unique_within
        ):
            return True
        return False if distance > (self.distance + other.distance) * SLACK else None


@np.errstate(all="ignore")  # bounds that overflow prove nothing, nor does NaN
def certify(objective: Objective, positions: ArrayLike) -> Certificate:
    """Return the certificate of positions, shape (particle, 3) [m], as the result of a step.

    The cost is two or three Cholesky factorisations of the Hessian and 20 to 60 solves. Beyond
    `MANY_PARTICLES` a matrix with a third of the rows takes its place, if that suffices. Positions
    of another shape or not finite are a ValueError.
    """
    system = instance("objective", objective, Objective).system
    x = coordinates("positions", positions, system.particle_count, 3)
    iterate = objective.iterate_at(x)
    if not (iterate.finite and objective.inertial.finite):
        return Certificate(math.inf, Coverage.OVERFLOWN)
    residual = objective.residual(iterate)
    if not np.array_equal(x[system.pinned], objective.y[system.pinned]):
        return Certificate(residual, Coverage.PINS_ASTRAY)
    if not system.free.any():
        return Certificate(residual, Coverage.COVERED, 0.0, math.inf, 0.0, math.inf, 0.0)
    smooth, _ = hessian_change(objective, x, 0.0)
    if smooth != Coverage.COVERED:
        return Certificate(residual, smooth)
    return _certify_smooth(objective, x, iterate.gradient, residual)


def _certify_smooth(
    objective: Objective, x: FloatArray, gradient: FloatArray, residual: float
) -> Certificate:
    """Return the certificate of positions at which g is twice differentiable."""
    system, errors = objective.system, rounding_errors(objective, x)
    if system.free.sum() > MANY_PARTICLES:
        mu, _ = least_curvature(scalar_bound(objective, x), errors.hessian)
        if mu > 0.0:
            eta = SLACK * (float(np.linalg.norm(gradient)) + errors.gradient) / mu
            known = _certify_within(objective, x, residual, mu, eta)
            if known.covered:
                return known
    free = np.repeat(system.free, 3)
    H = objective.hessian_at(x)[free][:, free].tocsc()
    mu, factor = least_curvature(H, errors.hessian)
    if factor is None:
        return Certificate(residual, Coverage.NOT_CONVEX)
    eta = newton_length(H, factor, gradient.ravel()[free], mu, errors)
    return _certify_within(objective, x, residual, mu, eta)


def _certify_within(
    objective: Objective, x: FloatArray, residual: float, mu: float, eta: float
) -> Certificate:
    """Return the certificate by bounds of the curvature and of the length of the Newton step."""
    coverage, L = hessian_change(objective, x, 2.0 * eta)
    ratio = SLACK * L * eta / mu
    if coverage == Coverage.COVERED and not 2.0 * ratio < 1.0:
        coverage = Coverage.TOO_FAR
    if coverage != Coverage.COVERED:
        return Certificate(residual, coverage, newton_step=eta, curvature=mu, lipschitz=L)
    distance = min(SLACK * kantorovich_distance(eta, ratio), 2.0 * eta)
    return Certificate(residual, coverage, distance, 2.0 * eta, eta, mu, L)


def scalar_bound(objective: Objective, x: FloatArray) -> Any:
    """Return S with H >= S x I [kg], sparse CSC, a row for each free particle.

    A spring's block is k (1 - r/l) I + k r/l u u', the second part positive semidefinite. S is M
    and the sum of h² k (1 - r/l) A_i A_i': of hardly compressed springs it is close to M or above.
    The rounding error of S is below the bound for H, whose entries take more roundings.
    """
    system, springs = objective.system, objective.effective
    r, length = springs.rest_lengths, lengths(springs, x)
    weights = objective.h**2 * springs.stiffnesses
    weights[springs.tension_only & (length < r)] = 0.0
    acts = (weights > 0.0) & (r > 0.0)
    weights[acts] *= 1.0 - r[acts] / length[acts]
    blocks = system.with_separate_dampers.free_blocks
    return blocks.scalar_matrix(weights, system.free_masses)[system.free][:, system.free].tocsc()


def kantorovich_distance(eta: float, ratio: float) -> float:
    """Return d = 2 eta / (1 + (1 - 2 ratio)^1/2) for the ratio L eta / mu."""
    return 2.0 * eta / (1.0 + math.sqrt(1.0 - 2.0 * ratio))


def least_curvature(H: Any, error: float) -> tuple[float, CholeskyFactor | None]:
    """Return a positive lower bound of the smallest eigenvalue and the factor of H, or 0 and None.

    The bound holds for every matrix within `error` of H in norm. Lanczos estimates the eigenvalue.
    A successful Cholesky factorisation of H - shift I proves the bound, up to the rounding error of
    the factorisation, at most (n + 1) EPS times the trace (Rump 2006).
    """
    n = H.shape[0]
    allowance = error + (n + GRADIENT_ROUNDING) * EPS * float(H.trace())
    try:
        factor = CholeskyFactor(H)
        shift = FIRST_SHIFT * _estimate_smallest_eigenvalue(factor, n)
        while shift > allowance:
            with contextlib.suppress(NotPositiveDefiniteError):
                factor.refactorize(H - shift * scipy.sparse.eye_array(n, format="csc"))
                return shift - allowance, factor
            shift /= 2.0
    except NotPositiveDefiniteError:
        pass
    return 0.0, None


def newton_length(
    H: Any, factor: CholeskyFactor, gradient: FloatArray, mu: float, errors: "RoundingErrors"
) -> float:
    """Return an upper bound of |H^-1 grad g| [m], namely |p| + |grad g + H p| / mu."""
    p = -factor.solve(gradient)
    length = float(np.linalg.norm(p))
    remainder = float(np.linalg.norm(gradient + H @ p)) + errors.gradient + errors.hessian * length
    return SLACK * (length + remainder / mu)


def hessian_change(objective: Objective, x: FloatArray, radius: float) -> tuple[Coverage, float]:
    """Return L [kg/m], a Lipschitz constant of the Hessian of g within a radius of x.

    Only the second part of a spring's block k I - k r/l (I - u u') depends on x. This part is k r
    times the second derivative of l. It changes by at most k r THIRD_DERIVATIVE / l² times the
    relative displacement of the ends, at most 2^1/2 |z - x|, or |z - x| if one end is pinned. With
    c_i the product of these factors and W = sum of c_i A_i A_i', -|z - x| W x I <= H(z) - H(x) <=
    |z - x| W x I. L is the norm of W.

    Returns:
        COVERED and L, or the reason why g may not be twice differentiable there and NaN.
    """
    system, ends = objective.effective, objective.effective.springs
    k, r, length = objective.h**2 * system.stiffnesses, system.rest_lengths, lengths(system, x)
    free_ends = system.free[ends].sum(axis=1)
    error = GRADIENT_ROUNDING * EPS * (length + _rest_length_terms(objective))
    reach = SLACK * np.sqrt(free_ends) * radius + error
    acts = (k > 0) & (r > 0) & (free_ends > 0)
    rope = acts & system.tension_only
    if (rope & (np.abs(length - r) <= reach)).any():
        return Coverage.KINK, math.nan
    acts &= ~(rope & (length < r))
    if (acts & (length <= reach)).any():
        return Coverage.COINCIDENT, math.nan
    c = np.zeros(len(k))
    nearest = (length - reach)[acts]
    c[acts] = (k * (r + error) * np.sqrt(free_ends))[acts] * THIRD_DERIVATIVE / nearest**2
    return Coverage.COVERED, SLACK * laplacian_norm(system.free, ends, c)


def laplacian_norm(free: BoolArray, springs: IndexArray, weights: FloatArray) -> float:
    """Return a bound of the norm of sum c_i A_i A_i' over the free particles, by Gershgorin."""
    i, j = springs.T
    rows = _sum_over_springs(len(free), springs, weights * (1 + free[j]), weights * (1 + free[i]))
    return float(rows[free].max())


class RoundingErrors(NamedTuple):
    """Upper bounds of the rounding errors of the gradient [kg m] and the Hessian [kg], in norm."""

    gradient: float
    hessian: float


def rounding_errors(objective: Objective, x: FloatArray) -> RoundingErrors:
    """Return upper bounds of the rounding errors of the gradient and the Hessian at x.

    The error of a spring is relative to its length, not to its coordinates as in the floor of a
    residual: differences of coordinates are rounded only once. The bounds include the rounding
    errors of y, of the external forces and of the effective springs.
    """
    system, h, springs = objective.system, objective.h, objective.effective.springs
    k, length = h * h * objective.effective.stiffnesses, lengths(objective.effective, x)
    rest_terms, m, free = _rest_length_terms(objective), system.masses, system.free
    coordinate_norms = _norms(x) + _norms(objective.y) + _norms(objective.x_n)
    loads = _norms(objective.external) + m * np.linalg.norm(system.gravity)
    pulls = k * (length + rest_terms)
    gradient = m * coordinate_norms + h * h * loads
    gradient += _sum_over_springs(len(m), springs, pulls, pulls)
    rest_lengths = objective.system.with_separate_dampers.rest_lengths
    most_springs = int(np.bincount(springs.ravel(), minlength=1).max())
    return RoundingErrors(
        (GRADIENT_ROUNDING + most_springs) * EPS * float(np.linalg.norm(gradient[free])),
        _hessian_rounding(x, rest_lengths, objective.terms, free, most_springs, np.empty(len(m))),
    )


def _rest_length_terms(objective: Objective) -> FloatArray:
    """Return r + effective r [m], to which the rounding of r + share (l_n - r) is relative."""
    return objective.system.with_separate_dampers.rest_lengths + objective.effective.rest_lengths


def _estimate_smallest_eigenvalue(factor: CholeskyFactor, n: int) -> float:
    """Return an estimate from above of the smallest eigenvalue, by Lanczos with the inverse."""
    inverse = scipy.sparse.linalg.LinearOperator((n, n), matvec=factor.solve, dtype=float)
    start = np.random.default_rng(n).standard_normal(n)
    (largest,) = scipy.sparse.linalg.eigsh(
        inverse, k=1, which="LA", v0=start, tol=ESTIMATE_TOLERANCE, return_eigenvectors=False
    )
    return 1.0 / float(largest)


def _sum_over_springs(
    count: int, springs: IndexArray, at_first: FloatArray, at_second: FloatArray
) -> FloatArray:
    """Return the sum over each particle's springs of the value at its end, shape (particle,)."""
    ends = np.column_stack([at_first, at_second]).ravel()
    return np.asarray(np.bincount(springs.ravel(), ends, count), dtype=np.float64)


def _norms(vectors: FloatArray) -> FloatArray:
    return np.linalg.norm(vectors, axis=1)


_hessian_rounding = Kernel(hessian_rounding)
