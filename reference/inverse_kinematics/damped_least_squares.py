"""Damped least squares with one fixed damping (Wampler 1986; Nakamura & Hanafusa 1986).

Towards a target beyond reach such steps would swing: a chain draws it near, a mechanism has the
damping of `box_step.far_damping`.
"""

from .box_step import damped_step, far_damping, linearise_task, take_step
from .jacobian import linearise, rotate_joints, solve_damped

# The square of the damping factor, over the reach squared: a tenth of the reach.
DAMPING = 0.01
# A target on an unlimited chain is drawn to within so much of its reach, over the reach. From
# further off steps would swing; at reach itself they would take the longer the nearer they are.
BEYOND = 0.02


def damped_least_squares_sweep(chain, target):
    """Rotate all joints by J^T (J J^T + (0.1 reach)^2 1)^-1 e."""
    e, A = linearise(chain, target, BEYOND * chain.reach)
    rotate_joints(chain, solve_damped(A, DAMPING * chain.reach * chain.reach, e))


def damped_least_squares_update(state, target):
    """Change the coordinates by J' (J J' + (0.1 reach)^2 1)^-1 e, within their limits."""
    mechanism, data, system = state.mechanism, state.data, state.workspace.system
    linearise_task(mechanism, target, data, system)
    damping = DAMPING * mechanism.reach * mechanism.reach
    damped_step(mechanism, data, system, far_damping(mechanism, target, data, system, damping))
    take_step(mechanism, data, system)
