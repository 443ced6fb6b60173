"""Levenberg-Marquardt: damped least squares whose damping follows the squared error.

An iteration computes the errors e of the effectors and their Jacobian J. It solves
(J J' + mu 1) z = e, of the size of e, and changes the coordinates by J' z.

- *Damping*: mu is a share of |e|² plus a bias (Sugihara 2011). Far from the target the step is
  short and safe; near the target convergence is quadratic. ROUNDING_DAMPING keeps factors above
  rounding.
- *Acceptance*: every step is taken; tasks that are approached only, such as a posture, have a
  descent whose steps have to lower the errors (`descent.py`).
- *End*: `restarts.py` repeats steps until the target is within the tolerances, the error no longer
  changes, or the iterations allowed are made. Of a target out of reach the nearest point counts. On
  mechanisms a start that stalls or hardly progresses is followed by further starts.
- *Limits*: `step_towards` stops hinges and slides at their limits and solves for the others again;
  `take_step` clamps balls (`bounded_step.py`).
- *Beyond reach*: on mechanisms `step_towards` makes Newton's steps to the nearest pose, with a
  damping of their own (`far_step.py`). A chain's target is drawn to the nearest point in reach.
- *Compiled* are the two kernels at the end, with all that they call: numba compiles the same
  functions that the interpreter can run.

`levenberg_marquardt_sweep` is the form for a chain of unlimited balls with one position, where
J J' has closed entries (`jacobian.py`).
"""

from ..quaternion import dot
from .bounded_step import linearise_task, take_step
from .far_step import step_towards
from .jacobian import linearise, rotate_joints, solve_damped
from .linear_algebra import ROUNDING_DAMPING, inner
from .solve_mechanism import kernels_of

# Damping over the squared error, for positions; and for rotations as well, the factor of Chan &
# Lawrence 1988, which needs fewer iterations there. For tasks, whose radians count as metres, a
# tenth of that meets the most on the bench's tuning robots.
DAMPING_OF_POSITIONS, DAMPING_OF_POSES, DAMPING_OF_TASKS = 0.5, 0.1, 0.01
# Over the reach squared; only to keep a division by zero away.
BIAS = 1e-24


def levenberg_marquardt_sweep(chain, target):
    """Rotate all joints by J^T (J J^T + mu 1)^-1 e, mu = 1/2 |e|^2 + bias."""
    e, A = linearise(chain, target, 0.0)
    damping = DAMPING_OF_POSITIONS * dot(e, e) + BIAS * chain.reach * chain.reach
    damping += ROUNDING_DAMPING * (A[0] + A[1] + A[2])
    rotate_joints(chain, solve_damped(A, damping, e))


def levenberg_marquardt_update(state, target):
    """Change the coordinates by J' (J J' + mu 1)^-1 e, within their limits."""
    mechanism, data, system = state.mechanism, state.data, state.workspace.system
    linearise_task(mechanism, target, data, system)
    positions = 3 * len(mechanism.effectors) == mechanism.equations
    share = DAMPING_OF_POSITIONS if positions else DAMPING_OF_POSES
    damping = share * inner(system.e, system.e) + BIAS * mechanism.reach * mechanism.reach
    step_towards(state, target, damping)
    take_step(mechanism, data, system)


ON_CHAINS, ON_MECHANISMS = kernels_of(
    "levenberg_marquardt", levenberg_marquardt_sweep, levenberg_marquardt_update
)
