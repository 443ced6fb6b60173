"""A single position to reach by a chain of unlimited balls, for the loops of `restarts.py`.

The textbook forms of the solvers on a chain are four times faster than on a mechanism.
"""

import numpy as np

from ..arguments import LARGEST_COORDINATE
from ..backend.compiled import Kernel, bind
from ..kinematics import forward_pose, normalise
from ..quaternion import load_vector, norm, subtract
from .anderson import DEPTH, forget
from .ccd import anderson_ccd_sweep, ccd_sweep
from .chain import (
    bend,
    effector_error,
    is_beyond_reach,
    is_collinear,
    least_distance,
    new_chain,
    pose_chain,
    root_distance,
    rotate_links,
    rounding,
    store_local,
)
from .fabrik import fabrik_sweep
from .jacobian import (
    damped_least_squares_sweep,
    jacobian_transpose_sweep,
    levenberg_marquardt_sweep,
)
from .restarts import (
    COUNT,
    LIMIT,
    OUTCOME,
    SPARE_ROWS,
    Criteria,
    Operations,
    copy_row,
    fill_figures,
    limits_of,
    outcome_of,
    solve_with_restarts,
)


def solve_chains(
    parents, offsets, path, numbers, starts, targets, local, positions, figures, history
):
    """Solve target after target; return whether all starts and targets were valid.

    Arrays come separately, since tuples take longer from Python. The first are the skeleton's, the
    joints from the root to the effector, and the numbers of Limits. Then come the local rotations
    to start from, (start, joint, 4), used by the targets in turn, and the global positions [m],
    (target, 3). The last are the fields of Result except its coordinates.
    """
    limits = limits_of(numbers)
    chain = new_chain(offsets, path, depth)
    count = 1 + SPARE_ROWS
    saved, progress = np.empty((count, len(chain.row))), np.empty((count, LIMIT + 1))
    rotations = np.empty((len(parents), 4))
    for i in range(len(targets)):
        pose, target = local[i], load_vector(targets, i)
        start = local[i - 1] if limits.chained and i > 0 else starts[i % len(starts)]
        if not (normalise(start, pose) and is_within(target, LARGEST_COORDINATE)):
            return False
        pose_chain(chain, path, pose)
        forget(chain.mixing)
        d = root_distance(chain, target)
        criteria, past = chain_criteria(chain, d, limits), history[i % len(history)]
        iterations, stalled = solve_with_restarts(
            operations, chain, saved, progress, target, limits, criteria, past
        )
        if iterations > 0:
            copy_row(saved[-1], chain.row)
            rotate_links(chain)
            store_local(chain, path, pose)
        forward_pose(parents, offsets, pose, positions[i], rotations)
        distance = norm(subtract(load_vector(positions[i], path[-1]), target))
        bound = least_distance(chain, d)
        fill_figures(figures[i], distance, 0.0, iterations, distance, bound)
        unreachable = bound > limits.tolerance + rounding(chain, d)
        outcome = outcome_of(distance <= limits.tolerance, unreachable, stalled)
        figures[i, OUTCOME] = outcome.value
    return True


def is_within(v, bound):
    """Return whether no component of a vector is beyond a bound, or NaN."""
    return abs(v[0]) <= bound and abs(v[1]) <= bound and abs(v[2]) <= bound


def chain_criteria(chain, d, limits):
    """Return the end criteria of attempts at a target at distance d from the root [m]."""
    bound, margin = least_distance(chain, d), rounding(chain, d)
    slack = min(8.0 * margin, 0.5 * limits.tolerance)
    count = limits.far_iterations if bound > limits.tolerance else limits.max_iterations
    distance = bound + limits.tolerance - slack
    return Criteria(distance, limits.tolerance_rotation, margin, count, False)


def chain_error(chain, target):
    """Return the distance from effector to target [m] in the form of `Operations.error`."""
    distance = effector_error(chain, target)
    return distance, 0.0, distance, distance


def perturb_chain(chain, target, criteria, first):
    """Bend a chain that starts collinear with its target: no solver would leave the line."""
    if first[COUNT] > 0 or effector_error(chain, target) <= criteria.distance:
        return False
    if is_beyond_reach(chain, root_distance(chain, target)) or not is_collinear(chain, target):
        return False
    bend(chain)
    return True


def place_chain(_chain):
    """Leave a chain unchanged: its row holds its positions and rotations themselves."""


def draw_chain(_chain, _target, _criteria, _n):
    """Leave a chain unchanged: its random restarts are made on a mechanism."""


def begin_sweeps(_chain, n):
    """Return whether phase n is the only one."""
    return n == 0


depth = 0  # of the sweeps that a solver remembers
operations = Operations(
    ccd_sweep, chain_error, effector_error, perturb_chain, place_chain, draw_chain, begin_sweeps
)
SWEEPS = {
    "ccd": ccd_sweep,
    "fabrik": fabrik_sweep,
    "levenberg_marquardt": levenberg_marquardt_sweep,
    "damped_least_squares": damped_least_squares_sweep,
    "jacobian_transpose": jacobian_transpose_sweep,
    "anderson_ccd": anderson_ccd_sweep,
}
# The kernel that solves chains by the sweep of each solver.
ON_CHAINS = {
    name: Kernel(
        bind(
            solve_chains,
            operations=operations._replace(update=sweep),
            depth=DEPTH * (sweep is anderson_ccd_sweep),
        ),
        label=f"{name} for chains",
    )
    for name, sweep in SWEEPS.items()
}
