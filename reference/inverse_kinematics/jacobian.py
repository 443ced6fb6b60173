"""The transposed Jacobian and damped least squares: a sweep of a chain, an update of a mechanism.

- The transposed Jacobian (Wolovich & Elliott 1984; Balestrino et al. 1984; its step: Buss 2004).
- Damped least squares with a fixed damping (Wampler 1986; Nakamura & Hanafusa 1986).

Let r_k be the arm from joint k of a chain to the effector. A rotation w_k of joint k moves the
effector by w_k x r_k: J_k w = w x r_k and J_k^T z = r_k x z. J J^T is 3 x 3 however many joints
there are: sum over k of |r_k|^2 1 - r_k r_k^T. The form for mechanisms (`bounded_step.py`) makes
the same iterations on a chain of ten balls, but a solve takes nine times as long.

- *Damping*: FIXED_DAMPING, the square of a tenth of the reach, of damped least squares alone.
- *End*: `restarts.py` repeats steps until the target is within the tolerances, the error no longer
  changes, or the iterations allowed are made. Of a target out of reach the nearest point counts.
- *Limits* (`bounded_step.py`): damped steps stop hinges and slides at their own and leave the rest
  to the other joints; transposed steps leave out what is at a limit. `take_step` clamps all joints.
- *Beyond reach*: a chain's target is drawn nearer (`drawn_near`). On mechanisms damped least
  squares makes Newton's steps with a damping of their own (`far_step.py`); the transposed Jacobian
  goes on as within reach.
- *Compiled* are the kernels at the end, with all that they call: numba compiles the same
  functions that the interpreter can run.
"""

from ..quaternion import (
    IDENTITY,
    cross,
    dot,
    exponential,
    load_quaternion,
    load_vector,
    multiply,
    norm,
    renormalised,
    scale,
    store_quaternion,
    subtract,
)
from .bounded_step import linearise_task, take_step, transposed_step
from .chain import LINE_TOLERANCE, bend, drawn_near, update_positions
from .far_step import step_towards
from .solve_mechanism import kernels_of

# How far beyond reach a chain's target may be, over the reach; a further target is drawn nearer.
# Steps towards a far target would swing about the nearest point; the nearer to reach itself, the
# slower they would be.
BEYOND_TRANSPOSED, BEYOND_DAMPED = 0.2, 0.02
# The square of the fixed damping factor, over the reach squared: a tenth of the reach.
FIXED_DAMPING = 0.01


def jacobian_transpose_sweep(chain, target):
    """Rotate all joints by a J^T e, a = <e, J J^T e> / |J J^T e|^2.

    This step brings the effector nearest if the effector moves by a J J^T e in a straight line.
    """
    e, A = linearise(chain, target, BEYOND_TRANSPOSED * chain.reach)
    move = times(A, e)
    if dot(move, move) > 0.0:
        rotate_joints(chain, scale(dot(e, move) / dot(move, move), e))


def jacobian_transpose_update(state, target):
    """Change the coordinates by a J' e with the same a, within their limits.

    Steps towards a target beyond reach may swing about the nearest point.
    """
    mechanism, data, system = state.mechanism, state.data, state.workspace.system
    linearise_task(mechanism, target, data, system)
    transposed_step(mechanism, data, system)
    take_step(mechanism, data, system)


def damped_least_squares_sweep(chain, target):
    """Rotate all joints by J^T (J J^T + (0.1 reach)^2 1)^-1 e."""
    e, A = linearise(chain, target, BEYOND_DAMPED * chain.reach)
    rotate_joints(chain, solve_damped(A, FIXED_DAMPING * chain.reach * chain.reach, e))


def damped_least_squares_update(state, target):
    """Change the coordinates by J' (J J' + (0.1 reach)^2 1)^-1 e, within their limits."""
    mechanism, data, system = state.mechanism, state.data, state.workspace.system
    linearise_task(mechanism, target, data, system)
    damping = FIXED_DAMPING * mechanism.reach * mechanism.reach
    step_towards(state, target, damping)
    take_step(mechanism, data, system)


def linearise(chain, target, beyond):
    """Return e, from the effector to the target [m], and J J^T.

    The chain is bent first where every arm lies along e: there no rotation brings the effector
    nearer at first order. A target further than `beyond` [m] out of reach is drawn to `beyond`.
    """
    target = drawn_near(chain, target, beyond)
    for _ in range(2):
        e = subtract(target, load_vector(chain.positions, len(chain.lengths)))
        A = task_matrix(chain)
        near = norm(e) <= LINE_TOLERANCE * chain.reach
        if near or norm(times(A, e)) > LINE_TOLERANCE * chain.reach * chain.reach * norm(e):
            break
        bend(chain)
    return e, A


def task_matrix(chain):
    """Return J J^T as its six entries xx, yy, zz, xy, xz, yz [m²]."""
    n = len(chain.lengths)
    effector = load_vector(chain.positions, n)
    xx, yy, zz, xy, xz, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        x, y, z = subtract(effector, load_vector(chain.positions, k))
        xx += y * y + z * z
        yy += x * x + z * z
        zz += x * x + y * y
        xy -= x * y
        xz -= x * z
        yz -= y * z
    return xx, yy, zz, xy, xz, yz


def times(A, v):
    """Return A v for a symmetric matrix given by its six entries."""
    xx, yy, zz, xy, xz, yz = A
    x, y, z = v
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


def solve_damped(A, damping, b):
    """Return z of (A + damping 1) z = b, A positive semidefinite, by the factors L D L'."""
    xx, yy, zz, xy, xz, yz = A
    d0 = xx + damping
    l10, l20 = xy / d0, xz / d0
    d1 = yy + damping - l10 * xy
    u21 = yz - l10 * xz
    l21 = u21 / d1
    d2 = zz + damping - l20 * xz - l21 * u21
    y1 = b[1] - l10 * b[0]
    y2 = b[2] - l20 * b[0] - l21 * y1
    z2 = y2 / d2
    z1 = y1 / d1 - l21 * z2
    return b[0] / d0 - l10 * z1 - l20 * z2, z1, z2


def rotate_joints(chain, z):
    """Rotate every joint k by the rotation vector r_k x z, J^T z, in the world."""
    n = len(chain.lengths)
    effector = load_vector(chain.positions, n)
    above = IDENTITY
    for k in range(n):
        Q = exponential(cross(subtract(effector, load_vector(chain.positions, k)), z))
        above = multiply(above, Q)
        R = load_quaternion(chain.rotations, k)
        store_quaternion(chain.rotations, k, renormalised(multiply(above, R)))
    update_positions(chain)


TRANSPOSE_ON_CHAINS, TRANSPOSE_ON_MECHANISMS = kernels_of(
    "jacobian_transpose", jacobian_transpose_sweep, jacobian_transpose_update
)
DAMPED_ON_CHAINS, DAMPED_ON_MECHANISMS = kernels_of(
    "damped_least_squares", damped_least_squares_sweep, damped_least_squares_update
)
