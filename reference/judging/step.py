"""Evaluate positions from any solver as the result of a step of implicit Euler.

Where springs are stiff, the residual |grad g(x)| / |grad g(y)| says little about the distance to
the minimiser. It ignores pins, which are not variables of g. Positions are therefore compared with
x*, the nearest known minimiser (see `minima`), by the error

    |x - x*| / |y - x*|,

over all particles and pins, which is 0 at x* and 1 at the inertial start y.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import FloatArray, array, coordinates, frozen
from ..implicit_euler.certificate import Certificate, certify
from ..mass_spring import MassSpring, State
from ..outcome import Outcome
from .minima import Minima


@dataclass(frozen=True, eq=False)
class StepJudgement:
    """Errors and proven bounds of positions x as the result of a step.

    Attributes:
        error: |x - x*| / |y - x*|; 0 if both distances are 0, infinite if only |y - x*| is, or if
            Newton's method found no x*.
        excess: (g(x) - g*) / (g(y) - g*), over the free particles, with g* the lowest of the known
            minima; infinite if only g(y) - g* is 0, or no minimum is known.
        distance: |x - x*| over all coordinates [m].
        displacement: |y - x*| over all coordinates [m].
        pin_displacement: the largest distance of a pinned particle from its position at the end of
            the step [m].
        velocity_error: the largest difference of a velocity from (x - x_n) / h [m/s]; None without
            velocities.
        residual: |grad g(x)| / max(|grad g(y)|, floor), over the free particles.
        certificate: the certificate of x with the pins at their positions at the end of the step.
        reference_certificate: the certificate of x*.
        same_minimiser: whether the minimiser near x is proven to be that of Newton's method from y
            (True) or another minimiser (False); None without a proof of either.
        minimiser: x*, shape (particle, 3) [m]: the limit of Newton's method from y, or, if proven
            and nearer to x, its limit from x.
        is_from_y: whether x* is the limit of Newton's method from y.
        iterations: number of iterations of Newton's method from y.
        outcome: the outcome of Newton's method from y; unless `solved`, only a proven limit from x
            is x*.
    """

    error: float
    excess: float
    distance: float
    displacement: float
    pin_displacement: float
    velocity_error: float | None
    residual: float
    certificate: Certificate
    reference_certificate: Certificate
    same_minimiser: bool | None
    minimiser: FloatArray
    is_from_y: bool
    iterations: int
    outcome: Outcome

    @property
    def summary(self) -> str:
        """The findings in a few sentences, worst first."""
        sentences = [self._distance(), self._proof()]
        if self.pin_displacement:
            pin = f"A pin is {self.pin_displacement:.2g} m from where the step takes it."
            sentences.insert(0, pin)
        if self.velocity_error is not None:
            error = f"{self.velocity_error:.2g} m/s"
            sentences.append(f"Velocities differ from (x - x_n) / h by up to {error}.")
        return " ".join(sentences)

    def _distance(self) -> str:
        if self.distance == math.inf:
            return f"Newton's method found no minimiser to compare with ({self.outcome.name})."
        doubt = "" if self.reference_certificate.covered else ", not proven to be a minimiser"
        start = "y" if self.is_from_y else "x"
        return (
            f"The positions are {self.distance:.2g} m from x*, what Newton's method comes to from "
            f"{start}{doubt}: {self.error:.2g} times as far as y."
        )

    def _proof(self) -> str:
        if not self.certificate.covered:
            return self.certificate.coverage.sentence
        minimiser = {
            True: "the minimiser near x* lies",
            False: "another minimiser than from y, as right as that one, lies",
            None: "a minimiser lies",
        }[self.same_minimiser]
        pins = " of them with the pins in place" if self.pin_displacement else ""
        return f"Proven: {minimiser} within {self.certificate.distance:.2g} m{pins}."


def judge_step(
    system: MassSpring,
    state: State,
    h: float,
    positions: ArrayLike,
    velocities: ArrayLike | None = None,
    external_forces: ArrayLike | None = None,
    pin_positions: ArrayLike | None = None,
) -> StepJudgement:
    """Return the errors of positions as the result of a step, with certificates.

    `positions` and `velocities` are the result to be judged, both of shape (particle, 3) [m, m/s];
    without velocities only the positions are judged. The other arguments and the errors are as for
    `ImplicitEuler.step`.
    """
    minima = Minima(system, state, h, external_forces, pin_positions)
    objective, newton, solution = minima.objective, minima.newton, minima.solution
    x = coordinates("positions", positions, system.particle_count, 3)
    nearest, with_pins = minima.nearest(x), np.where(system.free[:, None], x, objective.y)
    certificate = certify(objective, with_pins)
    distance = displacement = error = math.inf
    if solution.outcome.solved or nearest is not newton:
        distance, displacement = map(nearest.distance, (x, objective.y))
        if displacement > 0.0 or distance == 0.0:
            error = distance / displacement if distance > 0.0 else 0.0
    velocity_error = None
    if velocities is not None:
        v = array("velocities", velocities, len(x), 3)
        velocity_error = _largest(v - (x - objective.x_n) / objective.h)
    return StepJudgement(
        error=error,
        excess=minima.excess(with_pins, minima.lowest),
        distance=distance,
        displacement=displacement,
        pin_displacement=_largest((x - objective.y)[system.pinned]),
        velocity_error=velocity_error,
        residual=objective.residual(objective.iterate_at(x)),
        certificate=certificate,
        reference_certificate=nearest.certificate,
        same_minimiser=certificate.shares_minimiser_within(
            newton.certificate, newton.distance(with_pins)
        ),
        minimiser=frozen(nearest.positions),
        is_from_y=nearest is newton,
        iterations=solution.iterations,
        outcome=solution.outcome,
    )


def _largest(vectors: FloatArray) -> float:
    return float(np.linalg.norm(vectors, axis=1).max(initial=0.0))
