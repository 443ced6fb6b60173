"""How far a step's answer is from a minimiser of g at most: a proof, where one can be given.

Let mu be a lower bound of the smallest eigenvalue of H, the Hessian of g at x over the free
particles, let eta be at least |H^-1 grad g(x)|, the length of the Newton step, and let the Hessian
change by no more than L times the distance within 2 eta of x. Then

    L eta < mu / 2  =>  a minimiser lies within d = 2 eta / (1 + (1 - 2 L eta / mu)^1/2),

and no other stationary point within 2 eta (Kantorovich 1948). Proof: let N(z) = z - H^-1 grad g(z).
Within 2 eta of x, |N'(z)| = |H^-1 (H - H(z))| <= 2 L eta / mu < 1 and, by integration from x,
|N(z) - x| <= eta + L |z - x|² / (2 mu) <= 2 eta: N contracts that ball into itself and has one
fixed point there. Its distance t from x has t <= eta + L t² / (2 mu) and t <= 2 eta < mu / L, so
that t <= d, the smaller root; and H(z) >= mu - L d = mu (1 - 2 L eta / mu)^1/2 > 0 there.

Since eta <= |grad g(x)| / mu, it covers all that the convexity of g on a ball of radius
2 |grad g(x)| / mu does, and says more: the Newton step knows which directions are stiff.

Every number here is a bound in exact arithmetic of the g that the given floats define: rounding of
x_n + h v_n, of the effective springs, of the gradient, of the Hessian, of its Cholesky factor (Rump
2006, "Verification of Positive Definiteness") and of the linear solve is allowed for.
"""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arguments import BoolArray, FloatArray, IndexArray, coordinates, floats, instance
from ..mass_spring import lengths
from ..sparse.linear_solver import Factor, NotPositiveDefiniteError, factorize
from .objective import Objective

EPS = float(np.finfo(float).eps)
# A term of the gradient is made by at most 27 roundings of half an EPS, and an entry of a spring's
# block by at most 60; a block's norm is at most three times its largest entry.
GRADIENT_ROUNDING = 16
HESSIAN_ROUNDING = 128
# What the sums and roots of the bounds themselves may be off by, with millions of particles.
SLACK = 1.0 + 1e-8
# The norm of the third derivative of the length |p| is this over |p|².
THIRD_DERIVATIVE = 2.0 / math.sqrt(3.0)
# Lengths are no shorter than this [m] where one divides by them.
TINY = 1e-150
# Where the shift that proves the smallest eigenvalue begins, and how close its estimate is.
SHARE, ESTIMATE = 0.98, 1e-2


class Coverage(IntEnum):
    """Whether there is a bound on the distance to a minimiser, or why not."""

    COVERED = 0
    OVERFLOWN = 1
    PINS_ASTRAY = 2
    NOT_CONVEX = 3
    COINCIDENT = 4
    KINK = 5
    TOO_FAR = 6

    @property
    def sentence(self) -> str:
        """The answer in one sentence."""
        return _SENTENCES[self]


_SENTENCES = {
    Coverage.COVERED: "A minimiser of g lies within the distance, and it is the only one near.",
    Coverage.OVERFLOWN: "No bound: g or its gradient is not finite here or where the step starts.",
    Coverage.PINS_ASTRAY: "No bound: a pinned particle is not where the step takes it.",
    Coverage.NOT_CONVEX: "No bound: the Hessian of g is not positive definite here, or rounding "
    "hides it.",
    Coverage.COINCIDENT: "No bound: a spring with a rest length may shrink to a point as near as "
    "the minimiser, and there g has no derivative.",
    Coverage.KINK: "No bound: a tension-only spring may go slack, or taut, as near as the "
    "minimiser, and there the Hessian jumps.",
    Coverage.TOO_FAR: "No bound: the Hessian may change too much on the way of a Newton step.",
}


@dataclass(frozen=True)
class Certificate:
    """What is known for sure about an answer x to a step.

    Distances are Euclidean norms over all coordinates, so that no particle is further away.

    Attributes:
        residual: |grad g(x)| / max(|grad g(y)|, floor), infinite if g overflows.
        coverage: whether there is a bound, or why not.
        distance: within which a minimiser of g lies [m]; infinite if there is no bound.
        alone_within: no stationary point but this minimiser is so near to x [m]; 0 without a bound.
        newton_step: eta, at least the length of the Newton step [m]; not a number if there is none.
        curvature: mu, below every eigenvalue of the Hessian [kg]; 0 if it may not be positive.
        lipschitz: L, by which the Hessian changes at most per distance within `alone_within` or,
            without a bound, within 2 eta [kg/m]; not a number where it has none.
    """

    residual: float
    coverage: Coverage
    distance: float = math.inf
    alone_within: float = 0.0
    newton_step: float = math.nan
    curvature: float = 0.0
    lipschitz: float = math.nan

    @property
    def covered(self) -> bool:
        """Whether there is a bound."""
        return self.coverage == Coverage.COVERED

    def shares_minimiser(self, other: "Certificate", apart: float) -> bool | None:
        """Return whether the minimisers near two answers to the same step are one and the same.

        `apart` is the distance of the two answers [m]. None means that this is not proven either
        way, as where one of them has no bound.

        Raises:
            ValueError: if the other is no certificate, or the distance no number of at least 0.
        """
        instance("other", other, Certificate)
        apart = float(floats("apart", apart))
        if not apart >= 0.0:
            raise ValueError(f"apart: expected a distance of at least 0, got {apart}")
        if not (self.covered and other.covered):
            return None
        one, two = apart * SLACK + other.distance, apart * SLACK + self.distance
        if one <= self.alone_within or two <= other.alone_within:
            return True
        return False if apart > (self.distance + other.distance) * SLACK else None


def certify(objective: Objective, positions: ArrayLike) -> Certificate:
    """Return what is known for sure about positions, shape (particle, 3), as the end of a step.

    It takes two or three Cholesky factorisations of the Hessian and some 20 to 60 solves with one.

    Raises:
        ValueError: if the positions have a wrong shape or are not finite.
    """
    system = instance("objective", objective, Objective).system
    x = coordinates("positions", positions, system.particle_count, 3)
    with np.errstate(over="ignore", invalid="ignore"):
        here = objective._evaluate(x)
        if not (here.finite and objective.inertial.finite):
            return Certificate(math.inf, Coverage.OVERFLOWN)
    residual = objective.residual(here)
    if not np.array_equal(x[system.pinned], objective.y[system.pinned]):
        return Certificate(residual, Coverage.PINS_ASTRAY)
    if not system.free.any():
        return Certificate(residual, Coverage.COVERED, 0.0, math.inf, 0.0, math.inf, 0.0)
    smooth, _ = hessian_change(objective, x, 0.0)
    if smooth != Coverage.COVERED:
        return Certificate(residual, smooth)
    return _near(objective, x, here.gradient, residual)


def _near(
    objective: Objective, x: FloatArray, gradient: FloatArray, residual: float
) -> Certificate:
    """Return the certificate of finite positions where g has a Hessian and something is free."""
    free, doubts = np.repeat(objective.system.free, 3), rounding(objective, x)
    H = objective._hessian(x)[free][:, free].tocsc()
    mu, factor = least_curvature(H, doubts.hessian)
    if factor is None:
        return Certificate(residual, Coverage.NOT_CONVEX)
    eta = newton_length(H, factor, gradient.ravel()[free], mu, doubts)
    coverage, L = hessian_change(objective, x, 2.0 * eta)
    share = SLACK * L * eta / mu
    if coverage == Coverage.COVERED and not 2.0 * share < 1.0:
        coverage = Coverage.TOO_FAR
    if coverage != Coverage.COVERED:
        return Certificate(residual, coverage, newton_step=eta, curvature=mu, lipschitz=L)
    distance = min(SLACK * kantorovich_distance(eta, share), 2.0 * eta)
    return Certificate(residual, coverage, distance, 2.0 * eta, eta, mu, L)


def kantorovich_distance(eta: float, share: float) -> float:
    """Return d = 2 eta / (1 + (1 - 2 share)^1/2), the share being L eta / mu."""
    return 2.0 * eta / (1.0 + math.sqrt(1.0 - 2.0 * share))


def least_curvature(H: Any, doubt: float) -> tuple[float, Factor | None]:
    """Return a lower bound of the smallest eigenvalue and the factor of H; 0 and None if none.

    The bound holds for every matrix within `doubt` of H in norm. An estimate by Lanczos is no
    bound, but that H less so much of the identity has a Cholesky factor is one: the product of the
    factor is off by at most (n + 1) EPS of the trace (Rump 2006).
    """
    n = H.shape[0]
    allowance = doubt + (n + GRADIENT_ROUNDING) * EPS * float(H.trace())
    try:
        factor = factorize(H)
        shift = SHARE * _estimate(factor, n)
        while shift > allowance:
            if _is_definite(factor, H - shift * scipy.sparse.eye_array(n, format="csc")):
                return shift - allowance, factor
            shift /= 2.0
    except NotPositiveDefiniteError:
        pass
    return 0.0, None


def newton_length(
    H: Any, factor: Factor, gradient: FloatArray, mu: float, doubts: "Rounding"
) -> float:
    """Return at least |H^-1 grad g| [m] of the true H and gradient: |p| + |grad g + H p| / mu."""
    p = -factor.solve(gradient)
    length = float(np.linalg.norm(p))
    left = float(np.linalg.norm(gradient + H @ p)) + doubts.gradient + doubts.hessian * length
    return SLACK * (length + left / mu)


def hessian_change(objective: Objective, x: FloatArray, radius: float) -> tuple[Coverage, float]:
    """Return L [kg/m]: by how much the Hessian changes at most, per distance, within a radius.

    Of a spring's block k I - k r/l (I - u u') only the second part changes, k r times the second
    derivative of the length l: by at most k r THIRD_DERIVATIVE / l² times what one end moves
    against the other. That is at most 2^1/2 times the distance, or once if one end is pinned. So
    H(z) - H(x) lies between plus and minus |z - x| (W x I), W = sum of c_i A_i A_i' for these c.

    Returns:
        COVERED and L, or why g may lack a second derivative in there and not a number.
    """
    system, ends = objective.effective, objective.effective.springs
    k, r, length = objective.h**2 * system.stiffnesses, system.rest_lengths, lengths(system, x)
    free_ends = system.free[ends].sum(axis=1)
    doubt = GRADIENT_ROUNDING * EPS * (length + _makings(objective))
    reach = SLACK * np.sqrt(free_ends) * radius + doubt
    acts = (k > 0) & (r > 0) & (free_ends > 0)
    rope = acts & system.tension_only
    if (rope & (np.abs(length - r) <= reach)).any():
        return Coverage.KINK, math.nan
    acts &= ~(rope & (length < r))
    if (acts & (length <= reach)).any():
        return Coverage.COINCIDENT, math.nan
    c = np.zeros(len(k))
    nearest = (length - reach)[acts]
    c[acts] = (k * (r + doubt) * np.sqrt(free_ends))[acts] * THIRD_DERIVATIVE / nearest**2
    return Coverage.COVERED, SLACK * laplacian_norm(system.free, ends, c)


def laplacian_norm(free: BoolArray, springs: IndexArray, weights: FloatArray) -> float:
    """Return at least the largest eigenvalue of the sum of c_i A_i A_i', pins eliminated.

    By Gershgorin: a particle's springs weigh c_i on the diagonal and, but for pins, beside it.
    """
    i, j = springs.T
    rows = _gathered(len(free), springs, weights * (1 + free[j]), weights * (1 + free[i]))
    return float(rows[free].max())


class Rounding(NamedTuple):
    """How far the computed gradient [kg m] and Hessian [kg] may be from the true ones, in norm."""

    gradient: float
    hessian: float


def rounding(objective: Objective, x: FloatArray) -> Rounding:
    """Return what rounding can do to the gradient and to the Hessian at x.

    Unlike the floor of a residual it counts a spring by its lengths and not by its coordinates,
    whose differences are exact to their last digit, and it counts what rounding has done before:
    to y, to the external forces and to the effective springs.
    """
    system, h, springs = objective.system, objective.h, objective.effective.springs
    k, length = h * h * objective.effective.stiffnesses, lengths(objective.effective, x)
    made, m, free = _makings(objective), system.masses, system.free
    places = _norms(x) + _norms(objective.y) + _norms(objective.x_n)
    given = _norms(objective.external) + m * np.linalg.norm(system.gravity)
    pulls = k * (length + made)
    acts = (k > 0) & (made > 0) & free[springs].any(axis=1)
    acts &= ~(objective.effective.tension_only & (length < objective.effective.rest_lengths))
    bent = np.zeros_like(length)
    bent[acts] = made[acts] / np.maximum(length[acts], TINY)
    blocks = 2.0 * k * (1.0 + bent)
    gradient = m * places + h * h * given + _gathered(len(m), springs, pulls, pulls)
    hessian = m + _gathered(len(m), springs, blocks, blocks)
    busiest = int(np.bincount(springs.ravel(), minlength=1).max())
    return Rounding(
        (GRADIENT_ROUNDING + busiest) * EPS * float(np.linalg.norm(gradient[free])),
        (HESSIAN_ROUNDING + busiest) * EPS * float(hessian[free].max()),
    )


def _makings(objective: Objective) -> FloatArray:
    """Return what each effective rest length is made from [m], shape (spring,).

    A blend r + share (l_n - r) is rounded as r is and as itself, which is no less than share l_n.
    """
    return objective.system.dampers_apart.rest_lengths + objective.effective.rest_lengths


def _estimate(factor: Factor, n: int) -> float:
    """Return about the smallest eigenvalue, and not less, by Lanczos with the inverse."""
    inverse = scipy.sparse.linalg.LinearOperator((n, n), matvec=factor.solve, dtype=float)
    start = np.random.default_rng(n).standard_normal(n)
    (largest,) = scipy.sparse.linalg.eigsh(
        inverse, k=1, which="LA", v0=start, tol=ESTIMATE, return_eigenvectors=False
    )
    return 1.0 / float(largest)


def _is_definite(factor: Factor, matrix: Any) -> bool:
    try:
        factor.refactorize(matrix)
    except NotPositiveDefiniteError:
        return False
    return True


def _gathered(
    count: int, springs: IndexArray, at_first: FloatArray, at_second: FloatArray
) -> FloatArray:
    """Return the sum over each particle's springs of what they bring to it, shape (particle,)."""
    i, j = springs.T
    total = np.zeros(count)
    np.add.at(total, i, at_first)
    np.add.at(total, j, at_second)
    return total


def _norms(vectors: FloatArray) -> FloatArray:
    return np.linalg.norm(vectors, axis=1)
