"""g, whose minimum is the implicit Euler step, with its gradient, Hessian and rounding error.

Implicit Euler asks for M (x - y) = h² f(x), where y = x_n + h v_n. With f = -grad E that is
grad g(x) = 0 for (Liu et al. 2013)

    g(x) = 1/2 (x - y)' M (x - y) + h² E(x),    E(x) = sum of k/2 (l(x) - r)² - f_ext' x,

where f_ext is gravity and what else is given. A damper adds c/(2h) (l(x) - l_n)² to E, so that
a damped spring acts through the step as a spring of stiffness k + c/h and of rest length
(k r + c l_n/h) / (k + c/h). A tension-only spring stores nothing where it is slack, but its damper
acts all the same: the damper becomes a spring of its own, of stiffness c/h and rest length l_n.
So a step's damper pulls with -(c/h) (l - l_n) u, a law with an energy, and not with the rate at the
end of the step, -c ((v_i - v_j)·u) u, as `mass_spring.damper_forces` and explicit integrators do;
the two differ in proportion to h, by how far the spring rotates within the step.
Pinned particles are no variables: y has them at the end of their path, at x_n if they stay, and
their rows of the gradient are zero.
"""

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arguments import FloatArray, boolean, choice, coordinates, instance, number
from ..backend.compiled import Kernel
from ..backend.threads import in_slices
from ..mass_spring import (
    MassSpring,
    State,
    _spring_blocks,
    constant_forces,
    derivation,
    motion,
    pin_goal,
    rest_vectors,
)
from .terms import (
    EPS,
    SUM_ROUNDING,
    blend_dampers,
    evaluate_objective,
    evaluate_regions,
    join_regions,
    measure_rounding,
    most_rounding,
)

STARTS = ("y", "x_n")


class Iterate:
    """One point on the way to the minimum of g.

    Attributes:
        positions: x, shape (particle, 3) [m].
        gradient: grad g(x), shape (particle, 3) [kg m], zero at the pins.
        value: g(x) [kg m²].
        gradient_norm: |grad g(x)|.
        most: no less than the floor, and quicker to know.
    """

    def __init__(
        self,
        positions: FloatArray,
        gradient: FloatArray,
        value: float,
        gradient_norm: float,
        most: float,
        measure: Callable[[FloatArray], tuple[float, float]],
    ) -> None:
        """Keep them, and how to measure what rounding can do."""
        self.positions = positions
        self.gradient = gradient
        self.value = value
        self.gradient_norm = gradient_norm
        self.most = most
        self._measure = measure

    @functools.cached_property
    def _rounding(self) -> tuple[float, float]:
        return self._measure(self.positions)

    @property
    def floor(self) -> float:
        """What rounding alone can leave of |grad g(x)|."""
        return self._rounding[0]

    @property
    def value_floor(self) -> float:
        """How far rounding alone can move g(x)."""
        return self._rounding[1]

    @property
    def finite(self) -> bool:
        """Whether neither g nor its gradient, nor what is needed for the floor, overflows."""
        terms = self.most / SUM_ROUNDING
        return math.isfinite(self.value + self.gradient_norm + terms * terms)

    @property
    def at_floor(self) -> bool:
        """Whether rounding alone may have left this gradient."""
        return self.within(1.0)

    @property
    def at_rest(self) -> bool:
        """Whether the floats nearest to a minimiser may have this gradient: an EPS of its terms."""
        return self.within(EPS / SUM_ROUNDING)

    def within(self, share: float) -> bool:
        """Return whether the gradient is within a share of the floor."""
        return self.gradient_norm <= share * self.most and self.gradient_norm <= share * self.floor

    def is_above(self, other: "Iterate") -> bool:
        """Return whether g is greater than at the other, or no number, beyond rounding."""
        return not (self.value <= other.value or self.value <= other.value + self.value_floor)


class Objective:
    """g of one step, in SI units.

    Attributes:
        system: the system that steps.
        h: the step [s].
        x_n: the positions before the step, shape (particle, 3).
        y: where the particles would go by themselves, and the pins do, shape (particle, 3).
        external: gravity and other given forces [N], shape (particle, 3); never to be written to.
        effective: the system with its dampers made into springs, as above; those that belong to
            tension-only springs come after all others.
        inertial: the iterate at y, by which residuals are measured.
    """

    def __init__(
        self,
        system: MassSpring,
        state: State,
        h: float,
        external_forces: ArrayLike | None = None,
        pin_positions: ArrayLike | None = None,
        start: str = "y",
    ) -> None:
        """Set up the step of length h from a state; solvers begin at `start`, "y" or "x_n".

        Raises:
            ValueError: if h is not positive, the state has another number of particles, or the
                external forces [N], shape (particle, 3), or the pins' positions at the end of the
                step [m], shape (pinned, 3), have another shape or are not finite.
        """
        self.system = system
        self.h = h = number("h", h, above=0)
        self.x_n, v_n = motion(system, state)
        self.y = np.multiply(v_n, h, out=v_n)
        self.y += self.x_n
        if pin_positions is not None:
            self.y[system.pinned] = pin_goal(system, pin_positions)
        self.external = system.weights
        if external_forces is not None:
            self.external = constant_forces(system, external_forces)
        self.effective, self._constant = _effective(system, self.x_n, h)
        arrays = self.effective.arrays
        self._arguments = (
            self.y, self.external, h, self._constant, arrays.masses, arrays.springs,
            arrays.rest_lengths, arrays.stiffnesses, arrays.tension_only, arrays.pinned,
        )  # fmt: skip
        self._most = _most_rounding(
            self.y, self.external, h, arrays.masses, self.effective.spring_sums, system.free
        )
        self._start = choice("start", start, STARTS)
        self.inertial = self._evaluate(self.y)

    @functools.cached_property
    def start(self) -> Iterate:
        """The iterate at which solvers begin: y, or x_n with the pins at their places in y."""
        if self._start == "y":
            return self.inertial
        return self._evaluate(np.where(self.system.free[:, None], self.x_n, self.y))

    def evaluate(self, positions: ArrayLike) -> Iterate:
        """Return g and its gradient at positions of shape (particle, 3) [m].

        Raises:
            ValueError: if the positions have a wrong shape or are not finite.
        """
        return self._evaluate(self._positions(positions))

    def _evaluate(self, positions: FloatArray) -> Iterate:
        """Return what `evaluate` does; the solvers' own, whose positions it keeps and trusts."""
        regions = self.system.dampers_apart.regions
        if regions is None:
            gradient, value, norm, reach = _evaluate(positions, *self._arguments)
        else:
            gradient, value, norm, reach = _side_by_side(positions, *self._arguments, regions)
        still, moving = self._most
        return Iterate(positions, gradient, value, norm, still + moving * reach, self._measure)

    def _measure(self, positions: FloatArray) -> tuple[float, float]:
        """Return what rounding can leave of the gradient's norm, and move of g."""
        y, external, h, _, *springs = self._arguments
        return _rounding(positions, y, external, h, *springs)

    def residual(self, iterate: Iterate) -> float:
        """Return |grad g(x)| / max(|grad g(y)|, floor).

        Raises:
            ValueError: if it is no iterate, such as the positions of one.
        """
        if instance("iterate", iterate, Iterate).gradient_norm == 0.0:
            return 0.0
        scale = self.inertial.gradient_norm
        if scale < iterate.most:
            scale = max(scale, iterate.floor)
        return float(iterate.gradient_norm / scale)

    def value(self, positions: ArrayLike) -> float:
        """Return g(x) [kg m²]; the pins contribute what does not change.

        Raises:
            ValueError: if the positions have a wrong shape or are not finite.
        """
        return self.evaluate(positions).value

    def gradient(self, positions: ArrayLike) -> FloatArray:
        """Return grad g(x) = M (x - y) - h² f(x) [kg m], shape (particle, 3), zero at the pins.

        Raises:
            ValueError: if the positions have a wrong shape or are not finite.
        """
        return self.evaluate(positions).gradient

    def hessian(self, positions: ArrayLike, *, geometric: bool = True) -> Any:
        """Return M + h² K [kg], sparse (3 particle, 3 particle); an identity at the pins.

        K is the stiffness matrix at x, exact, or without its geometric terms (Gauss-Newton).

        Raises:
            ValueError: if the positions have a wrong shape or are not finite.
        """
        geometric = boolean("geometric", geometric)
        return self._hessian(self._positions(positions), geometric=geometric)

    def _hessian(self, x: FloatArray, *, geometric: bool = True) -> Any:
        """Return what `hessian` does, of the solvers' own positions."""
        blocks = _spring_blocks(self.effective, x, geometric=geometric)
        springs = self.system.dampers_apart.free_blocks
        hessian = springs.matrix(self.h * self.h * blocks)
        hessian.data[springs.diagonal] += np.repeat(self.system.free_masses, 3)
        return hessian

    def pull_of_pins(self, positions: ArrayLike, *, geometric: bool = True) -> FloatArray:
        """Return h² K times the way of the pins from x_n to y, shape (particle, 3) [kg m].

        It is what their way adds to the gradient at the free particles when the springs are
        linearised at x; zero at the pins. K is as for `hessian`.

        Raises:
            ValueError: if the positions have a wrong shape or are not finite.
        """
        geometric = boolean("geometric", geometric)
        return self._pull_of_pins(self._positions(positions), geometric=geometric)

    def _pull_of_pins(self, x: FloatArray, *, geometric: bool) -> FloatArray:
        """Return what `pull_of_pins` does, of the solvers' own positions."""
        way = np.where(self.system.free[:, None], 0.0, self.y - self.x_n)
        if not way.any():
            return way
        i, j = self.effective.springs.T
        blocks = _spring_blocks(self.effective, x, geometric=geometric)
        pulls = np.einsum("sab,sb->sa", self.h * self.h * blocks, way[i] - way[j])
        return self.system.dampers_apart.free_incidence @ pulls

    def quadratic_form(self, positions: ArrayLike, d: ArrayLike) -> float:
        """Return what g becomes when each spring's vector at rest length is held at d, (spring, 3).

        1/2 x' (M + h² L) x - h² x' J d - x' (M y + h² f_ext) + constant (Liu et al. 2013), with
        L and J of the effective springs. With the d of `rest_vectors(x)` it is g(x), with any other
        d of the effective rest lengths, or shorter in a tension-only spring, it is more.

        Raises:
            ValueError: if the positions or d have a wrong shape or are not finite.
        """
        x, y, hh = self._positions(positions), self.y, self.h * self.h
        d = coordinates("d", d, len(self.effective.springs), 3)
        M = scipy.sparse.diags_array(self.system.masses)
        _, _, L, J = derivation(self.effective)
        stored = 0.5 * np.sum(self.effective.stiffnesses[:, None] * d**2) + self._constant
        constant = 0.5 * np.sum(y * (M @ y)) + hh * stored
        linear = hh * (J @ d) + M @ y + hh * self.external
        return float(0.5 * np.sum(x * ((M + hh * L) @ x)) - np.sum(x * linear) + constant)

    def rest_vectors(self, positions: ArrayLike) -> FloatArray:
        """Return the optimal d at x, of the effective springs, shape (spring, 3) [m].

        Raises:
            ValueError: if the positions have a wrong shape or are not finite.
        """
        return rest_vectors(self.effective, positions)

    def _positions(self, positions: ArrayLike) -> FloatArray:
        return coordinates("positions", positions, self.system.particle_count, 3)


def global_matrix(system: MassSpring, h: float) -> Any:
    """Return M + h² L of the effective springs [kg], sparse (particle, particle).

    It is the Hessian of g with d held, the same for x, y and z and for all steps of length h. The
    pins are eliminated: their rows and columns are those of the identity.
    """
    weights = h * h * effective_stiffnesses(system, h)
    return system.free_blocks.scalar_matrix(weights, system.free_masses)


def effective_stiffnesses(system: MassSpring, h: float) -> FloatArray:
    """Return k + c/h, shape (spring,) [N/m]."""
    return system.stiffnesses + system.dampings / h


def _effective(system: MassSpring, x_n: FloatArray, h: float) -> tuple[MassSpring, float]:
    """Return the system with dampers made into springs, and the energy that this leaves out."""
    if not system.damped:
        return system, 0.0
    apart = system.dampers_apart
    stiffnesses = effective_stiffnesses(apart, h)
    rest_lengths, constant = _blend(x_n, h, stiffnesses, apart.arrays)
    springs = {"rest_lengths": rest_lengths, "stiffnesses": stiffnesses}
    return apart.replaced(**springs, dampings=np.zeros(len(stiffnesses))), constant


def _side_by_side(
    x, y, external, h, constant, masses, springs, rest_lengths, stiffnesses, tension_only, pinned,
    regions,
):  # fmt: skip
    """Return what `evaluate_objective` does, summed region by region on all cores."""
    gradient, sums = np.empty(x.shape), np.empty((len(regions.particles) - 1, 2))
    elastic = rest_lengths, stiffnesses, tension_only
    in_slices(
        _regions,
        len(sums),
        lambda part: (
            x, y, external, h, masses, *elastic, regions, part.start, part.stop, gradient, sums,
        ),
        least=1,
    )  # fmt: skip
    joined = _join(x, h, constant, *elastic, pinned, regions, gradient, sums)
    return gradient, *joined


_evaluate = Kernel(evaluate_objective, label="the objective of implicit Euler")
_regions = Kernel(evaluate_regions)
_join = Kernel(join_regions)
_rounding = Kernel(measure_rounding)
_most_rounding = Kernel(most_rounding)
_blend = Kernel(blend_dampers)
