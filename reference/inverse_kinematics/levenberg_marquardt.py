"""Levenberg-Marquardt with a damping in proportion to the squared error (Sugihara 2011).

"Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method": the step minimises
1/2 |e - J q|^2 + 1/2 mu |q|^2 with mu = 1/2 |e|^2 plus a bias. Far from the target, or where it
cannot be reached, the step is short and safe; near it the damping vanishes with the square of the
error, and convergence is quadratic even where the Jacobian loses rank. Where rotations are asked
for mu is a tenth of |e|^2, the factor of Chan & Lawrence 1988, which needs fewer iterations there.
Towards a target proven out of reach a mechanism has the mu of `box_step.far_damping`.
"""

from ..quaternion import dot
from .box_step import damped_step, far_damping, linearise_task, squared, take_step
from .jacobian import LEAST_DAMPING, linearise, rotate_joints, solve_damped

# Of the squared error: for positions, and for positions and rotations.
DAMPING, DAMPING_OF_POSES = 0.5, 0.1
# Over the reach squared; it only keeps a division by zero away.
BIAS = 1e-24


def levenberg_marquardt_sweep(chain, target):
    """Rotate all joints by J^T (J J^T + mu 1)^-1 e, mu = 1/2 |e|^2 + bias."""
    e, A = linearise(chain, target, 0.0)
    damping = DAMPING * dot(e, e) + BIAS * chain.reach * chain.reach
    damping += LEAST_DAMPING * (A[0] + A[1] + A[2])
    rotate_joints(chain, solve_damped(A, damping, e))


def levenberg_marquardt_update(state, target):
    """Change the coordinates by J' (J J' + mu 1)^-1 e, within their limits."""
    mechanism, data, system = state.mechanism, state.data, state.workspace.system
    linearise_task(mechanism, target, data, system)
    positions = 3 * len(mechanism.effectors) == mechanism.equations
    share = DAMPING if positions else DAMPING_OF_POSES
    damping = share * squared(system.e) + BIAS * mechanism.reach * mechanism.reach
    damped_step(mechanism, data, system, far_damping(mechanism, target, data, system, damping))
    take_step(mechanism, data, system)
