"""The transposed Jacobian (Wolovich & Elliott 1984; Balestrino et al. 1984).

Steps towards a target beyond reach die down on unlimited chains only, where they lead to the
nearest point within reach; elsewhere they may swing about it.
"""

from ..quaternion import dot, scale
from .box_step import linearise_task, take_step, transposed_step
from .jacobian import linearise, rotate_joints, times

# A target on an unlimited chain is drawn to within so much of its reach, over the reach. From
# further off steps would swing; at reach itself they would take the longer the nearer they are.
BEYOND = 0.2


def jacobian_transpose_sweep(chain, target):
    """Rotate all joints by a J^T e, a = <e, J J^T e> / |J J^T e|^2.

    The step length is the one that brings the effector nearest if it moved by a J J^T e in a
    straight line (Buss 2004).
    """
    e, A = linearise(chain, target, BEYOND * chain.reach)
    move = times(A, e)
    if dot(move, move) > 0.0:
        rotate_joints(chain, scale(dot(e, move) / dot(move, move), e))


def jacobian_transpose_update(state, target):
    """Change the coordinates by a J' e with the same a, within their limits."""
    mechanism, data, system = state.mechanism, state.data, state.workspace.system
    linearise_task(mechanism, target, data, system)
    transposed_step(mechanism, data, system)
    take_step(mechanism, data, system)
