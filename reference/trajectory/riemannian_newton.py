"""Newton's method over all frames at once, on the manifold of poses that meet their targets.

A step lies in the null spaces of the frames' Jacobians and is then projected back onto the targets,
so that only the cost decides whether it is taken. Within the null spaces the Hessian is that of
the cost less sum_i m_i times that of constraint i, m the least-squares multipliers of the gradient
(Absil, Mahony & Sepulchre 2008, Riemannian Newton on a submanifold). It is shifted by a multiple of
the identity until it is positive definite and the step lowers the cost (Levenberg-Marquardt).
"""

from typing import NamedTuple

import numpy as np
import scipy.linalg

from ..arguments import FloatArray
from ..backend.compiled import Kernel
from .augmented_lagrangian import add_active_limits, limit_cost, update_multipliers
from .problem import (
    TrajectoryProblem,
    add_smoothness,
    displacements,
    errors_and_jacobians,
    integrate,
    project,
    transposed_pseudoinverse,
)
from .task_derivatives import subtract_second_derivatives

# The weight of half the squared errors, over the reach, of a frame that is not constrained.
TARGET_PENALTY = 100.0
# Converged when a step predicts a decrease below this ratio to the cost, or below this cost.
RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE = 1e-14, 1e-20
# And when no multiplier changes by more than this, over the penalty [rad].
MULTIPLIER_TOLERANCE = 1e-10
# Multipliers are updated after steps no longer than this [rad].
LONGEST_STEP_TO_UPDATE = 0.1
MAX_STEPS = 100
# How often a step is solved for, until the limits that it makes active are those assumed.
MAX_ACTIVE_SETS = 10
# Shifts of the Hessian, whose entries are about 1.
FIRST_SHIFT, LEAST_SHIFT, LEAST_RAISED_SHIFT, MAX_SHIFT = 1e-6, 1e-12, 1e-7, 1e4
# Least ratios of the actual to the predicted decrease: to take a step, and to lower the shift.
ACCEPTED, TRUSTED = 1e-4, 0.75

_add_smoothness = Kernel(add_smoothness)
_add_active_limits = Kernel(add_active_limits)
_limit_cost = Kernel(limit_cost)
_update_multipliers = Kernel(update_multipliers)
_subtract_second_derivatives = Kernel(subtract_second_derivatives)


class QuadraticModel(NamedTuple):
    """The cost about a trajectory to second order; the terms of the limits are in `cost` only."""

    problem: TrajectoryProblem
    q: FloatArray  # the trajectory, (frame, coordinate)
    z: FloatArray  # the multipliers of the limits, (frame, limit)
    cost: float  # of the trajectory, limits included
    gradient: FloatArray  # (frame, freedom)
    diagonal: FloatArray  # the Hessian's block of each frame, (frame, freedom, freedom)
    # its blocks with the frame after a displacement as rows and the one before it as columns,
    # within the null spaces, (displacement, freedom, freedom)
    coupling: FloatArray
    P: FloatArray  # projections onto the null spaces, (frame, freedom, freedom)


class CyclicBandedSystem:
    """A positive definite system of n unknowns a frame, each frame coupled to the next.

    A cycle has no narrow band in its own order. Numbered 0, 2, 4 .. along one half and .. 5, 3, 1
    back along the other, neighbours are at most two apart, and a banded Cholesky factor solves it.
    """

    def __init__(self, frames: int, unknowns: int, closed: bool) -> None:
        """Number the frames and allocate the band; `closed` couples the last to the first."""
        number = np.arange(frames)
        if closed:
            number = np.where(2 * number < frames, 2 * number, 2 * (frames - number) - 1)
        self._number = number
        furthest = 2 if closed and frames > 2 else 1
        self._band = np.empty((frames * unknowns, (furthest + 1) * unknowns))

    def fill(self, diagonal: FloatArray, coupling: FloatArray) -> None:
        """Set the blocks (frame, n, n) and the couplings of frames to the next, (.., n, n)."""
        _fill(diagonal, coupling, self._number, self._band)

    def solve(self, b: FloatArray, shift: float) -> FloatArray | None:
        """Return x of (A + shift 1) x = b, (frame, n); None if it is not positive definite."""
        band, permuted = self._band.copy(), np.empty_like(b)
        band[:, 0] += shift
        permuted[self._number] = b
        try:
            factor = scipy.linalg.cholesky_banded(
                band.T, lower=True, overwrite_ab=True, check_finite=False
            )
        except np.linalg.LinAlgError:
            return None
        x = scipy.linalg.cho_solve_banded((factor, True), permuted.ravel(), check_finite=False)
        return x.reshape(b.shape)[self._number]


def minimise(problem: TrajectoryProblem, q: FloatArray) -> tuple[FloatArray, int]:
    """Return the trajectory of least cost near q, which meets its targets, and the steps taken."""
    system = CyclicBandedSystem(len(q), problem.mechanism.freedoms, problem.closed)
    z, shift = np.zeros((len(q), len(problem.limits))), FIRST_SHIFT
    steps, converged = 0, False
    while steps < MAX_STEPS and not converged:
        steps += 1
        model = quadratic_model(problem, q, z)
        accepted = accepted_step(model, system, shift)
        if accepted is None:
            break
        q, length, predicted, shift = accepted
        change = np.inf
        if length <= LONGEST_STEP_TO_UPDATE:
            change = _update_multipliers(problem, q, z)
        converged = is_negligible(predicted, model) and change <= MULTIPLIER_TOLERANCE
    return q, steps


def is_negligible(predicted: float, model: QuadraticModel) -> bool:
    """Return whether a predicted decrease is no more than rounding."""
    return abs(predicted) <= RELATIVE_TOLERANCE * model.cost + ABSOLUTE_TOLERANCE


def cost(problem: TrajectoryProblem, q: FloatArray, z: FloatArray) -> float:
    """Return half the squared displacements, plus the terms of limits and of targets not met."""
    d, (e, _) = displacements(problem, q), errors_and_jacobians(problem, q)
    return sum_of_costs(problem, d, e) + _limit_cost(problem, q, z)


def sum_of_costs(problem: TrajectoryProblem, d: FloatArray, e: FloatArray) -> float:
    """Return half the squared displacements, plus the penalties of frames off their targets."""
    errors = e[~problem.constrained]
    return 0.5 * float((d * d).sum() + TARGET_PENALTY * (errors**2).sum())


def quadratic_model(problem: TrajectoryProblem, q: FloatArray, z: FloatArray) -> QuadraticModel:
    """Return the cost about a trajectory to second order."""
    mechanism, (frames, n) = problem.mechanism, (len(q), problem.mechanism.freedoms)
    d, (e, J) = displacements(problem, q), errors_and_jacobians(problem, q)
    gradient, diagonal = np.zeros((frames, n)), np.zeros((frames, n, n))
    coupling = np.zeros((len(d), n, n))
    _add_smoothness(mechanism.joints, d, gradient, diagonal, coupling)
    K, penalised = transposed_pseudoinverse(J), ~problem.constrained
    with_limits, _, _, _ = add_limits(problem, q, z, gradient, diagonal, np.zeros_like(gradient))
    m = np.einsum("fek,fk->fe", K, with_limits)
    P = np.eye(n) - J.swapaxes(-1, -2) @ K
    P[penalised], m[penalised] = np.eye(n), TARGET_PENALTY * e[penalised]
    gradient[penalised] -= np.einsum("fek,fe->fk", J[penalised], m[penalised])
    diagonal[penalised] += TARGET_PENALTY * J[penalised].swapaxes(-1, -2) @ J[penalised]
    _subtract_second_derivatives(problem, q, m / mechanism.reach, diagonal)
    projected = np.roll(P, -1, axis=0)[: len(d)] @ coupling @ P[: len(d)]
    total = sum_of_costs(problem, d, e) + _limit_cost(problem, q, z)
    return QuadraticModel(problem, q, z, total, gradient, diagonal, projected, P)


def accepted_step(
    model: QuadraticModel, system: CyclicBandedSystem, shift: float
) -> tuple[FloatArray, float, float, float] | None:
    """Return the first step that lowers the cost enough as the shift is raised, or None.

    Returns:
        The trajectory after it, its largest entry [rad], its predicted decrease, the next shift.
    """
    problem = model.problem
    while shift <= MAX_SHIFT:
        step, predicted = newton_step(model, system, shift)
        if step is not None:
            trial, valid = project(problem, integrate(problem, model.q, step))
            if valid[problem.constrained].all():
                decrease = model.cost - cost(problem, trial, model.z)
                negligible = is_negligible(predicted, model)
                if negligible or decrease >= ACCEPTED * abs(predicted):
                    trusted = negligible or decrease >= TRUSTED * predicted
                    after = max(shift / 16.0, LEAST_SHIFT) if trusted else shift
                    return trial, float(np.abs(step).max()), predicted, after
        shift = max(4.0 * shift, LEAST_RAISED_SHIFT)
    return None


def newton_step(
    model: QuadraticModel, system: CyclicBandedSystem, shift: float
) -> tuple[FloatArray | None, float]:
    """Return the minimiser of the shifted model, and the decrease that it predicts.

    It is solved for again until the limits active at its end are those that it was solved with.
    Returns None if the shifted Hessian is not positive definite.
    """
    step, predicted = np.zeros_like(model.gradient), 0.0
    active = np.zeros(model.z.shape, dtype=bool)
    for i in range(MAX_ACTIVE_SETS):
        gradient, diagonal, surplus, changed = add_limits(
            model.problem, model.q, model.z, model.gradient, model.diagonal, step, active
        )
        if i > 0 and not changed:
            break
        gradient, diagonal = project_derivatives(model.P, gradient, diagonal)
        system.fill(diagonal, model.coupling)
        solution = system.solve(-gradient, shift)
        if solution is None:
            return None, 0.0
        step = solution
        predicted = 0.5 * float((step * (shift * step - gradient)).sum()) - surplus
    return step, predicted


def add_limits(
    problem: TrajectoryProblem,
    q: FloatArray,
    z: FloatArray,
    gradient: FloatArray,
    diagonal: FloatArray,
    step: FloatArray,
    active: np.ndarray | None = None,
) -> tuple[FloatArray, FloatArray, float, bool]:
    """Return gradient and Hessian blocks with the limits active at the end of a step added.

    See `augmented_lagrangian.add_active_limits` for the other results.
    """
    gradient, diagonal = gradient.copy(), diagonal.copy()
    flags = np.zeros(z.shape, dtype=bool) if active is None else active
    surplus, changed = _add_active_limits(problem, q, z, step, gradient, diagonal, flags)
    return gradient, diagonal, surplus, changed


def project_derivatives(
    P: FloatArray, gradient: FloatArray, diagonal: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return both within the null spaces; across them the Hessian is the identity."""
    return np.einsum("fkl,fl->fk", P, gradient), P @ diagonal @ P + np.eye(P.shape[-1]) - P


def fill_band(diagonal, coupling, number, band):
    """Fill the lower band: row c holds column c of the matrix from the diagonal on."""
    frames, n = diagonal.shape[0], diagonal.shape[1]
    band[:] = 0.0
    for f in range(frames):
        first = number[f] * n
        for b in range(n):
            for a in range(b, n):
                band[first + b, a - b] = diagonal[f, a, b]
    for f in range(len(coupling)):
        row, successor = number[f], number[(f + 1) % frames]
        for a in range(n):
            for b in range(n):
                if successor > row:
                    band[row * n + b, (successor - row) * n + a - b] = coupling[f, a, b]
                else:
                    band[successor * n + a, (row - successor) * n + b - a] = coupling[f, a, b]


_fill = Kernel(fill_band)
