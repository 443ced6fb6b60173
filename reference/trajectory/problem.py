"""The problem of a smooth trajectory: its displacements, its constraints, its retraction.

The displacement d from frame f to frame g is the velocity that leads from one to the other in unit
time, lengths over the reach. 1/2 |d|^2 has the gradient -d in frame f and d in frame g. For a ball,
with d = log(Q_f* Q_g), the second derivatives are S in either frame and -(S - 1/2 [d]x) between
them: S = c 1 + (1 - c) d d'/|d|^2, c = |d|/2 cot |d|/2, is the symmetric part of the inverse of the
right Jacobian of the exponential map (Sola et al. 2018).

The poses that meet their targets form a manifold. A step along it is integrated joint by joint and
then projected back onto it by Gauss-Newton steps of least norm; the two together are the retraction
of Absil, Mahony & Sepulchre 2008 (section 4.1).
"""

import math
from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray, IndexArray, RecordArray
from ..articulation import BALL, FREE, HINGE, SLIDE
from ..backend.compiled import Kernel
from ..inverse_kinematics.mechanism import Mechanism
from ..jacobians import joint_difference, move_joint
from .augmented_lagrangian import joint_limits
from .task_derivatives import fill_errors_and_jacobians

# A target is met when its errors, over the reach, are below this.
CONSTRAINT_TOLERANCE = 1e-12
MAX_PROJECTIONS = 12
# The longest step of a projection [rad]; longer ones come from singular poses and lead anywhere.
LONGEST_PROJECTION = 1.0
# Added to J J' over the reach squared, so that it can be inverted where J lacks rank.
RIDGE = 1e-14
# A pose is near singular if a singular value of its J is below this ratio to that of a pose nearby,
# every freedom of which has moved by up to PROBE [rad]; values below the last are always zero.
SINGULAR_RATIO, PROBE, ALWAYS_ZERO = 1e-3, 0.3, 1e-9

# Below this angle [rad] the leading term of (1 - c)/|d|^2 is exact to rounding.
SMALL_ANGLE = 1e-4


class TrajectoryProblem(NamedTuple):
    """The constraints and units of a trajectory."""

    mechanism: Mechanism  # the joints
    units: FloatArray  # the displacement that counts as 1: 1 rad, or the reach [m], (freedom,)
    # the joint and the bound of every finite limit, see `joint_limits`, (limit, 2)
    limits: IndexArray
    targets: RecordArray  # of each frame, records TARGET, (frame, effector)
    # which frames have to meet their targets; a penalty draws the others, (frame,)
    constrained: np.ndarray
    closed: bool  # whether the first frame follows the last

    def at(self, frames: IndexArray) -> "TrajectoryProblem":
        """Return the problem of some of the frames."""
        return self._replace(targets=self.targets[frames], constrained=self.constrained[frames])


def new_problem(
    mechanism: Mechanism, targets: RecordArray, constrained: np.ndarray, closed: bool
) -> TrajectoryProblem:
    """Return the problem of a mechanism with the limits of its joints."""
    units, limits = np.ones(mechanism.freedoms), joint_limits(mechanism.joints)
    for index, joint in enumerate(mechanism.joints):
        if joint["leader"] == index and joint["kind"] in (SLIDE, FREE):
            first, count = joint["freedom"], 1 if joint["kind"] == SLIDE else 3
            units[first : first + count] = mechanism.reach
    return TrajectoryProblem(mechanism, units, limits, targets, constrained, closed)


def displacements(problem: TrajectoryProblem, q: FloatArray) -> FloatArray:
    """Return the displacements between neighbouring frames, (displacement, freedom)."""
    d = np.empty((len(q) - (not problem.closed), problem.mechanism.freedoms))
    _displacements(problem, q, d)
    return d


def integrate(problem: TrajectoryProblem, q: FloatArray, step: FloatArray) -> FloatArray:
    """Return the frames displaced by a step, (frame, freedom)."""
    q = q.copy()
    _integrate(problem, step, q)
    return q


def errors_and_jacobians(
    problem: TrajectoryProblem, q: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return e, target less effector over the reach, (frame, equation), and J = -de/dq."""
    mechanism = problem.mechanism
    e = np.empty((len(q), mechanism.equations))
    J = np.empty((*e.shape, mechanism.freedoms))
    _errors_and_jacobians(problem, q, e, J)
    return e / mechanism.reach, J / mechanism.reach


def transposed_pseudoinverse(J: FloatArray) -> FloatArray:
    """Return (J J')^-1 J of each frame, (frame, equation, freedom)."""
    A = J @ J.swapaxes(-1, -2) + RIDGE * np.eye(J.shape[-2])
    return np.asarray(np.linalg.solve(A, J), dtype=np.float64)


def project(problem: TrajectoryProblem, q: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Return the constrained frames brought onto their targets, and which frames meet theirs."""
    for _ in range(MAX_PROJECTIONS):
        e, J = errors_and_jacobians(problem, q)
        missed_target = np.abs(e).max(axis=-1) > CONSTRAINT_TOLERANCE
        if not (missed_target & problem.constrained).any():
            break
        step = np.einsum("fe,fek->fk", e, transposed_pseudoinverse(J))
        step[~problem.constrained] = 0.0
        step[np.abs(step).max(axis=-1) > LONGEST_PROJECTION] = 0.0
        q = integrate(problem, q, step)
    return q, ~missed_target


def near_singular(problem: TrajectoryProblem, q: FloatArray) -> np.ndarray:
    """Return which frames cannot move their effectors in a direction in which poses nearby can.

    From such a pose, a straight arm say, the targets can only be kept to first order.
    """
    frames, n = len(q), problem.mechanism.freedoms
    nearby = integrate(problem, q, PROBE * np.cos(np.arange(frames * n)).reshape(frames, n))
    values, nearby_values = (
        np.linalg.svd(errors_and_jacobians(problem, poses)[1], compute_uv=False)
        for poses in (q, nearby)
    )
    usual = nearby_values.max(axis=0)
    return ((values < SINGULAR_RATIO * usual) & (usual > ALWAYS_ZERO)).any(axis=-1)


def fill_displacements(problem, q, d):
    """Fill the displacements d, (displacement, freedom), between frames q, (frame, coordinate).

    With as many as frames the last one leads to the first frame; a continuous hinge then takes the
    smaller angle.
    """
    joints, units = problem.mechanism.joints, problem.units
    for f in range(len(d)):
        g = (f + 1) % len(q)
        for j in range(len(joints)):
            joint_difference(joints, j, q[g], q[f], d[f])
            unlimited = joints["lower"][j] == -math.inf and joints["upper"][j] == math.inf
            leads = joints["leader"][j] == j and not joints["followed"][j]
            if g < f and joints["kind"][j] == HINGE and unlimited and leads:
                k = joints["freedom"][j]
                d[f, k] -= 2.0 * math.pi * round(d[f, k] / (2.0 * math.pi))
        for k in range(len(units)):
            d[f, k] /= units[k]


def integrate_frames(problem, step, q):
    """Displace all frames by a step, (frame, freedom)."""
    joints, units = problem.mechanism.joints, problem.units
    v = np.empty(len(units))
    for f in range(len(q)):
        for k in range(len(v)):
            v[k] = units[k] * step[f, k]
        for j in range(len(joints)):
            move_joint(joints, j, v, q[f])


def add_smoothness(joints, d, gradient, diagonal, coupling):
    """Add the derivatives of half the squared displacements, see `QuadraticModel`."""
    for f in range(len(d)):
        g = (f + 1) % len(gradient)
        for k in range(d.shape[1]):
            gradient[f, k] -= d[f, k]
            gradient[g, k] += d[f, k]
            diagonal[f, k, k] += 1.0
            diagonal[g, k, k] += 1.0
            coupling[f, k, k] -= 1.0
        for j in range(len(joints)):
            if joints["kind"][j] in (BALL, FREE):
                k = joints["freedom"][j] + (3 if joints["kind"][j] == FREE else 0)
                add_curvature(d[f], k, diagonal[f], diagonal[g], coupling[f])


def add_curvature(d, k, before, after, coupling):
    """Add the second derivatives of the rotation vector from freedom k on, less +-1."""
    v = d[k], d[k + 1], d[k + 2]
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    if square < SMALL_ANGLE * SMALL_ANGLE:
        factor = 1.0 / 12.0
    else:
        half = 0.5 * math.sqrt(square)
        factor = (1.0 - half * math.cos(half) / math.sin(half)) / square
    for a in range(3):
        for b in range(3):
            S = factor * (v[a] * v[b] - (square if a == b else 0.0))
            before[k + a, k + b] += S
            after[k + a, k + b] += S
            coupling[k + a, k + b] -= S
        # 1/2 [d]x
        coupling[k + (a + 1) % 3, k + a] += 0.5 * v[(a + 2) % 3]
        coupling[k + a, k + (a + 1) % 3] -= 0.5 * v[(a + 2) % 3]


_displacements = Kernel(fill_displacements)
_integrate = Kernel(integrate_frames)
_errors_and_jacobians = Kernel(fill_errors_and_jacobians)
