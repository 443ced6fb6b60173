"""The objective g that an implicit Euler step minimises: value, gradient, Hessian, rounding error.

With y = x_n + h v_n, and f_ext the sum of gravity and external forces (Liu et al. 2013)

    g(x) = 1/2 (x - y)' M (x - y) + h² E(x),    E(x) = sum of k/2 (l(x) - r)² - f_ext' x.

A damper adds c/(2h) (l(x) - l_n)² to E, l_n the length at x_n. A damped spring hence acts as a
spring of stiffness k + c/h and rest length (k r + c l_n/h) / (k + c/h), and the damper of a
tension-only spring as a spring of its own. Pinned particles are not variables: y holds their
positions at the end of the step, and their rows of the gradient are zero. See
docs/implicit_euler.md.
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from .. import mass_spring
from ..arguments import FloatArray, boolean, choice, coordinates, instance, number
from ..backend.compiled import Kernel
from ..backend.partition import Regions
from ..backend.threads import in_slices
from ..explicit import explicit_positions
from .terms import (
    EPS,
    SUM_ROUNDING,
    blend_dampers,
    evaluate_regions,
    fill_gradient,
    is_finite,
    join_regions,
    rounding_bounds,
    rounding_coefficients,
)

STARTS = ("y", "x_n", "explicit")


@dataclass(eq=False)
class Iterate:
    """Positions with g and its gradient there."""

    positions: FloatArray  # x, shape (particle, 3) [m]
    gradient: FloatArray  # grad g(x), shape (particle, 3) [kg m], zero at the pins
    value: float  # g(x) [kg m²]
    gradient_norm: float  # |grad g(x)|
    floor_bound: float  # an upper bound of `floor` that is cheaper to compute
    # bounds on the rounding errors of |grad g(x)| and of g(x), from x
    rounding_of: Callable[[FloatArray], tuple[float, float]]

    @functools.cached_property
    def _rounding(self) -> tuple[float, float]:
        return self.rounding_of(self.positions)

    @property
    def floor(self) -> float:
        """Bound on the rounding error of |grad g(x)|."""
        return self._rounding[0]

    @property
    def value_floor(self) -> float:
        """Bound on the rounding error of g(x)."""
        return self._rounding[1]

    @property
    def finite(self) -> bool:
        """Whether g, its gradient and the squared terms of the floor are finite."""
        return is_finite(self.value, self.gradient_norm, self.floor_bound)

    @property
    def at_floor(self) -> bool:
        """Whether the gradient is no larger than its rounding error."""
        return self.within(1.0)

    @property
    def at_rest(self) -> bool:
        """Whether the gradient is within EPS of its terms, as at the floats next to a minimiser."""
        return self.within(EPS / SUM_ROUNDING)

    def within(self, share: float) -> bool:
        """Return whether the norm of the gradient is at most `share` times the floor."""
        norm = self.gradient_norm  # its bound is tried before the floor, which costs more
        return norm <= share * self.floor_bound and norm <= share * self.floor

    def is_above(self, other: "Iterate") -> bool:
        """Return whether g is NaN or, beyond rounding, greater than at the other iterate."""
        return not (self.value <= other.value or self.value <= other.value + self.value_floor)


def _finite_result(method: Callable[..., Any]) -> Callable[..., Any]:
    """Let a method of an Objective raise a FloatingPointError where its result overflows."""

    @functools.wraps(method)
    def checked(*arguments: Any, **options: Any) -> Any:
        with np.errstate(all="ignore"):
            result = method(*arguments, **options)
        if not np.isfinite(result.data if scipy.sparse.issparse(result) else result).all():
            raise FloatingPointError(f"{method.__name__}: a number left the finite ones")
        return result

    return checked


class Objective:
    """g of a step, in SI units.

    Where g or its derivatives overflow, methods raise a FloatingPointError; an iterate reports
    overflow in `finite`. Positions of another shape or not finite are a ValueError.

    Attributes:
        system: particles and springs.
        h: the step [s].
        x_n: positions at the start of the step, shape (particle, 3).
        y: x_n + h v_n, with pins at the end of their path, shape (particle, 3).
        external: gravity and external forces [N], shape (particle, 3), not to be written to.
        effective: the system with its dampers replaced by springs, as above; the dampers of
            tension-only springs follow all other springs.
        inertial: the iterate at y, to which residuals are relative.
        terms: the arguments of kernels after the positions, see `terms`.
    """

    def __init__(
        self,
        system: mass_spring.MassSpring,
        state: mass_spring.State,
        h: float,
        external_forces: ArrayLike | None = None,
        pin_positions: ArrayLike | None = None,
        start: str = "y",
    ) -> None:
        """Set up the step of length h from a state; `start` is in `STARTS`, see `ImplicitEuler`.

        Raise a ValueError if h is not positive, the state has another number of particles, or an
        array has another shape or is not finite. External forces [N] have shape (particle, 3), the
        pins' positions at the end of the step [m] (pinned, 3).
        """
        self.system = system
        self.h = h = number("h", h, above=0)
        self.x_n, v_n = mass_spring.checked_state(system, state)
        self.y = np.multiply(v_n, h, out=v_n)
        self.y += self.x_n
        if pin_positions is not None:
            self.y[system.pinned] = mass_spring.pin_targets(system, pin_positions)
        self.external = system.weights
        if external_forces is not None:
            self.external = mass_spring.constant_forces(system, external_forces)
        self.effective, constant = _effective(system, self.x_n, h)
        arrays = self.effective.arrays
        particles = self.y, self.external, arrays.masses
        elastic = arrays.rest_lengths, arrays.stiffnesses, arrays.tension_only
        self.terms = h, constant, particles, arrays.springs, elastic, arrays.pinned
        self._floor_coefficients = _rounding_coefficients(
            self.y, self.external, h, arrays.masses, self.effective.spring_sums, system.free
        )
        self._begin = begin_at(start, system, state, h, external_forces, pin_positions)
        self.inertial = self.iterate_at(self.y)

    @functools.cached_property
    def start(self) -> Iterate:
        """The first iterate, with the pins where y has them."""
        if self._begin is None:
            return self.inertial
        return self.iterate_at(np.where(self.system.free[:, None], self._begin, self.y))

    def evaluate(self, positions: ArrayLike) -> Iterate:
        """Return g and its gradient at positions of shape (particle, 3) [m]."""
        return self.iterate_at(self._positions(positions))

    def iterate_at(self, positions: FloatArray) -> Iterate:
        """Return g and its gradient at positions neither checked nor copied."""
        regions, gradient = self.system.with_separate_dampers.regions, np.empty(positions.shape)
        if regions is None:
            numbers = _fill_gradient(positions, self.terms, gradient)
        else:
            numbers = _fill_in_parallel(positions, self.terms, regions, gradient)
        return self.iterate_of(positions, gradient, *numbers)

    def iterate_of(
        self, x: FloatArray, gradient: FloatArray, value: float, norm: float, reach: float
    ) -> Iterate:
        """Return the iterate of positions with their gradient and the result of `fill_gradient`."""
        a, b = self._floor_coefficients
        return Iterate(x, gradient, value, norm, a + b * reach, self._rounding)

    def _rounding(self, positions: FloatArray) -> tuple[float, float]:
        """Return bounds on the rounding errors of the gradient's norm and of g."""
        return _rounding_bounds(positions, self.terms, np.empty((2, len(positions))))

    def residual(self, iterate: Iterate) -> float:
        """Return |grad g(x)| / max(|grad g(y)|, floor), infinite if g overflows at x or at y."""
        if instance("iterate", iterate, Iterate).gradient_norm == 0.0:
            return 0.0
        if not (iterate.finite and self.inertial.finite):
            return math.inf
        scale = self.inertial.gradient_norm
        if scale < iterate.floor_bound:
            scale = max(scale, iterate.floor)
        return float(iterate.gradient_norm / scale)

    @_finite_result
    def value(self, positions: ArrayLike) -> float:
        """Return g(x) [kg m²], up to a constant that depends on the pins."""
        return self.evaluate(positions).value

    @_finite_result
    def gradient(self, positions: ArrayLike) -> FloatArray:
        """Return grad g(x) = M (x - y) - h² f(x) [kg m], shape (particle, 3), zero at the pins."""
        return self.evaluate(positions).gradient

    @_finite_result
    def hessian(self, positions: ArrayLike, *, geometric: bool = True) -> Any:
        """Return M + h² K [kg], sparse (3 particle, 3 particle); an identity at the pins.

        K is the stiffness matrix at x, exact, or without its geometric terms (Gauss-Newton).
        """
        geometric = boolean("geometric", geometric)
        return self.hessian_at(self._positions(positions), geometric=geometric)

    def hessian_at(self, x: FloatArray, *, geometric: bool = True) -> Any:
        """Return the Hessian at unchecked positions."""
        springs = self.system.with_separate_dampers.free_blocks
        hessian = springs.matrix(
            self.h * self.h * mass_spring.blocks(x, self.effective.arrays, geometric)
        )
        hessian.data[springs.diagonal] += np.repeat(self.system.free_masses, 3)
        return hessian

    def pin_gradient_at(self, x: FloatArray) -> FloatArray:
        """Return h² K times the displacement of the pins from x_n to y, shape (particle, 3) [kg m].

        It is the contribution of the pins to the gradient at the free particles, zero at the pins,
        with springs linearised at x, which is not checked. K has no geometric terms.
        """
        displacement = np.where(self.system.free[:, None], 0.0, self.y - self.x_n)
        if not displacement.any():
            return displacement
        i, j = self.effective.springs.T
        K = self.h * self.h * mass_spring.blocks(x, self.effective.arrays, False)
        pulls = np.einsum("sab,sb->sa", K, displacement[i] - displacement[j])
        return self.system.with_separate_dampers.free_incidence @ pulls

    def _positions(self, positions: ArrayLike) -> FloatArray:
        return coordinates("positions", positions, self.system.particle_count, 3)


def begin_at(
    start: str,
    system: mass_spring.MassSpring,
    state: mass_spring.State,
    h: float,
    external_forces: ArrayLike | None,
    pin_positions: ArrayLike | None,
) -> FloatArray | None:
    """Return where the free particles begin, (particle, 3), or None for y."""
    if choice("start", start, STARTS) == "explicit":
        return explicit_positions(system, state, h, external_forces, pin_positions)
    return state.positions if start == "x_n" else None


def global_matrix(system: mass_spring.MassSpring, h: float) -> Any:
    """Return M + h² L of the effective springs [kg], sparse (particle, particle).

    This is the Hessian of g for constant directions of the springs (Liu et al. 2013), the same for
    each coordinate and all steps of length h. The rows and columns of pins are the identity's.
    """
    weights = h * h * effective_stiffnesses(system, h)
    return system.free_blocks.scalar_matrix(weights, system.free_masses)


def effective_stiffnesses(system: mass_spring.MassSpring, h: float) -> FloatArray:
    """Return k + c/h, shape (spring,) [N/m]."""
    return system.stiffnesses + system.dampings / h


def _effective(
    system: mass_spring.MassSpring, x_n: FloatArray, h: float
) -> tuple[mass_spring.MassSpring, float]:
    """Return the system with dampers replaced by springs, and the constant this leaves out of E."""
    if not system.damped:
        return system, 0.0
    separate = system.with_separate_dampers
    stiffnesses = effective_stiffnesses(separate, h)
    rest_lengths, constant = _blend(x_n, h, stiffnesses, separate.arrays)
    springs = {"rest_lengths": rest_lengths, "stiffnesses": stiffnesses}
    return separate.replaced(**springs, dampings=np.zeros(len(stiffnesses))), constant


def _fill_in_parallel(
    x: FloatArray, terms: tuple[Any, ...], regions: Regions, gradient: FloatArray
) -> tuple[float, float, float]:
    """Do the same as `fill_gradient`, with the regions shared among threads."""
    h, constant, particles, _, elastic, pinned = terms
    sums, step = np.empty((len(regions.particles) - 1, 2)), (x, h, particles, elastic, regions)
    in_slices(
        _regions, len(sums), lambda part: (*step, part.start, part.stop, gradient, sums), minimum=1
    )
    numbers: tuple[float, float, float]
    numbers = _join(x, h, constant, elastic, pinned, regions, gradient, sums)
    return numbers


_fill_gradient = Kernel(fill_gradient, label="the objective of implicit Euler")
_regions = Kernel(evaluate_regions)
_join = Kernel(join_regions)
_rounding_bounds = Kernel(rounding_bounds)
_rounding_coefficients = Kernel(rounding_coefficients)
_blend = Kernel(blend_dampers)
