"""Evaluate positions from any solver as the result of a step of implicit Euler.

Where springs are stiff, the residual |grad g(x)| / |grad g(y)| says little about the distance to
the minimiser. It ignores pins, which are not variables of g. Positions are therefore compared with
x*, the limit of Newton's method from y, by the error

    |x - x*| / |y - x*|,

over all particles and pins, which is 0 at x* and 1 at the inertial start y.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import SMALLEST_POSITIVE, FloatArray, array, coordinates, frozen
from ..implicit_euler import ImplicitEuler
from ..implicit_euler.certificate import Certificate
from ..mass_spring import MassSpring, State
from ..outcome import Outcome

# The smallest: only rounding stops Newton's method.
TOLERANCE = SMALLEST_POSITIVE
# Five times Newton's default: a step that needs more has no x*, and no error.
MAX_ITERATIONS = 500


@dataclass(frozen=True, eq=False)
class StepJudgement:
    """Errors and proven bounds of positions x as the result of a step.

    Attributes:
        error: |x - x*| / |y - x*|; 0 if both distances are 0, infinite if only |y - x*| is, or if
            Newton's method found no x*.
        distance: |x - x*| over all coordinates [m].
        displacement: |y - x*| over all coordinates [m].
        pin_displacement: the largest distance of a pinned particle from its position at the end of
            the step [m].
        velocity_error: the largest difference of a velocity from (x - x_n) / h [m/s]; None without
            velocities.
        residual: |grad g(x)| / max(|grad g(y)|, floor), over the free particles.
        certificate: the certificate of x with the pins at their positions at the end of the step.
        reference_certificate: the certificate of the end of Newton's method.
        same_minimiser: whether the minimiser near x is proven to be the minimiser near x* (True) or
            another minimiser (False); None without a proof of either.
        minimiser: x*, shape (particle, 3) [m]; without x*, the end of Newton's method.
        iterations: number of iterations of Newton's method.
        outcome: the outcome of Newton's method; without `solved` there is no x*.
    """

    error: float
    distance: float
    displacement: float
    pin_displacement: float
    velocity_error: float | None
    residual: float
    certificate: Certificate
    reference_certificate: Certificate
    same_minimiser: bool | None
    minimiser: FloatArray
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
        if not self.outcome.solved:
            return f"Newton's method found no minimiser to compare with ({self.outcome.name})."
        doubt = "" if self.reference_certificate.covered else ", not proven to be a minimiser"
        return (
            f"The positions are {self.distance:.2g} m from x*, what Newton's method comes to from y"
            f"{doubt}: {self.error:.2g} times as far as y."
        )

    def _proof(self) -> str:
        if not self.certificate.covered:
            return self.certificate.coverage.sentence
        minimiser = {
            True: "the minimiser near x* lies",
            False: "another minimiser, as right as that one, lies",
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
    integrator = ImplicitEuler(system, h=h, tolerance=TOLERANCE, max_iterations=MAX_ITERATIONS)
    loads = external_forces, pin_positions
    objective = integrator.objective(state, *loads)
    x = coordinates("positions", positions, system.particle_count, 3)
    solution = integrator.step(state, *loads)
    best, with_pins = solution.state.positions, np.where(system.free[:, None], x, objective.y)
    certificate, reference = (
        integrator.certify(state, points, *loads) for points in (with_pins, best)
    )
    between = float(np.linalg.norm(with_pins - best))
    distance = displacement = error = math.inf
    if solution.outcome.solved:
        distance = float(np.linalg.norm(x - best))
        displacement = float(np.linalg.norm(objective.y - best))
        if displacement > 0.0 or distance == 0.0:
            error = distance / displacement if distance > 0.0 else 0.0
    velocity_error = None
    if velocities is not None:
        v = array("velocities", velocities, len(x), 3)
        velocity_error = _largest(v - (x - objective.x_n) / objective.h)
    return StepJudgement(
        error=error,
        distance=distance,
        displacement=displacement,
        pin_displacement=_largest((x - objective.y)[system.pinned]),
        velocity_error=velocity_error,
        residual=integrator.certify(state, x, *loads).residual,
        certificate=certificate,
        reference_certificate=reference,
        same_minimiser=certificate.shares_minimiser_within(reference, between),
        minimiser=frozen(best),
        iterations=solution.iterations,
        outcome=solution.outcome,
    )


def _largest(vectors: FloatArray) -> float:
    return float(np.linalg.norm(vectors, axis=1).max(initial=0.0))
