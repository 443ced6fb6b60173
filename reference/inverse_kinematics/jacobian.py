"""What the Jacobian methods share: J J^T of a chain of ball joints, and a step along J^T z.

With r_k the arm from joint k to the effector, a rotation w_k of joint k moves the effector by
w_k x r_k: J_k w = w x r_k and J_k^T z = r_k x z. For three coordinates J J^T is 3 x 3 however many
joints there are: sum over k of |r_k|^2 1 - r_k r_k^T. The general form (`task_jacobian.py`) makes
the same iterations on a chain of ten balls, but a solve takes nine times as long.
"""

from ..quaternion import (
    IDENTITY,
    cross,
    exponential,
    load_quaternion,
    load_vector,
    multiply,
    norm,
    renormalised,
    store_quaternion,
    subtract,
)
from .chain import LINE_TOLERANCE, bend, drawn_near, update_positions

# Where J J^T is singular, a damping of so much of its trace keeps its factors above rounding.
LEAST_DAMPING = 1e-14


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


def linearise(chain, target, beyond):
    """Return e, from the effector to the target [m], and J J^T, the chain bent first if need be.

    Where every arm lies along e no rotation brings the effector nearer at first order. A target
    further than so much beyond reach [m] is drawn that near, which leaves the nearest pose what it
    is: else steps swing about it, or are damped ever more the further off the target is.
    """
    wanted = drawn_near(chain, target, beyond)
    for _ in range(2):
        e = subtract(wanted, load_vector(chain.positions, len(chain.lengths)))
        A = task_matrix(chain)
        near = norm(e) <= LINE_TOLERANCE * chain.reach
        if near or norm(times(A, e)) > LINE_TOLERANCE * chain.reach * chain.reach * norm(e):
            break
        bend(chain)
    return e, A


def times(A, v):
    """Return A v for a symmetric matrix given by its six entries."""
    xx, yy, zz, xy, xz, yz = A
    x, y, z = v
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


def solve_damped(A, damping, b):
    """Return z of (A + damping 1) z = b, A positive semidefinite, by Cholesky's factors."""
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
