"""One position to reach by a chain of unlimited balls: what the loops of `restarts.py` work on.

The textbook forms of the solvers on a chain are four times faster than on a mechanism.
"""

from typing import NamedTuple

import numpy as np

from ..arguments import LARGEST_COORDINATE, FloatArray
from ..backend.compiled import Kernel, Slot, bind
from ..kinematics import forward_pose, normalise
from ..quaternion import (
    load_quaternion,
    load_vector,
    norm,
    store_quaternion,
    store_vector,
    subtract,
)
from .chain import (
    Chain,
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
from .restarts import MADE, Criteria, limits_of, new_progress, solve_with_restarts
from .result import (
    EXCESS,
    ITERATIONS,
    MERIT,
    OUTCOME,
    RESIDUAL,
    RESIDUAL_ROTATION,
    outcome_of,
)

# One iteration of a solver: sweep(chain, target).
sweep = Slot("sweep")


class ChainState(NamedTuple):
    """A chain and the ends of attempts on it.

    Attributes:
        chain: where it is.
        saved: positions [m] and global rotations of its joints, (attempt + 1, joint, 7).
        progress: see `restarts.py`.
    """

    chain: Chain
    saved: FloatArray
    progress: FloatArray


def solve_chains(
    parents, offsets, path, numbers, starts, targets, local, positions, figures, history
):
    """Solve target after target; return whether all starts and targets were valid.

    Arrays come one by one, since tuples of them take longer from Python: those of the skeleton, the
    joints from the root to the effector, the numbers of Limits, local rotations to start from,
    (start, joint, 4), which the targets use one after the other, global positions [m], (target, 3),
    and the fields of Result but its coordinates.
    """
    limits = limits_of(numbers)
    chain = new_chain(offsets, path)
    state = ChainState(chain, np.empty((2, len(path), 7)), new_progress(1))
    rotations = np.empty((len(parents), 4))
    for i in range(len(targets)):
        pose, target = local[i], load_vector(targets, i)
        start = local[i - 1] if limits.chained and i > 0 else starts[i % len(starts)]
        if not (normalise(start, pose) and largest(target) <= LARGEST_COORDINATE):
            return False
        pose_chain(chain, path, pose)
        d = root_distance(chain, target)
        criteria = chain_criteria(chain, d, limits)
        past = history[i % len(history)]
        iterations, settled = solve_with_restarts(state, target, limits, criteria, past)
        if iterations > 0:
            restore_chain(state, len(state.saved) - 1)
            rotate_links(chain)
            store_local(chain, path, pose)
        forward_pose(parents, offsets, pose, positions[i], rotations)
        distance = norm(subtract(load_vector(positions[i], path[-1]), target))
        figures[i, ITERATIONS] = iterations
        rate_pose(chain, d, limits, distance, settled, figures[i])
    return True


def largest(v):
    """Return the largest magnitude of a vector's components, NaN if it has one."""
    x, y, z = abs(v[0]), abs(v[1]), abs(v[2])
    return x + y + z if x + y + z != x + y + z else max(x, y, z)


def chain_criteria(chain, d, limits):
    """Return when an attempt ends whose target is at distance d from the root [m]."""
    least, margin = least_distance(chain, d), rounding(chain, d)
    slack = min(8.0 * margin, 0.5 * limits.tolerance)
    far = least > limits.tolerance
    count = limits.far_iterations if far else limits.max_iterations
    return Criteria(least + limits.tolerance - slack, limits.tolerance_rotation, margin, count)


def rate_pose(chain, d, limits, distance, settled, figures):
    """Fill the figures of a pose with the effector at a distance from its target [m]."""
    least = least_distance(chain, d)
    unreachable = least > limits.tolerance + rounding(chain, d)
    outcome = outcome_of(distance <= limits.tolerance, unreachable, settled)
    figures[RESIDUAL], figures[RESIDUAL_ROTATION], figures[MERIT] = distance, 0.0, distance
    figures[OUTCOME], figures[EXCESS] = outcome.value, max(0.0, distance - least)


def update_chain(state, target):
    """Make one iteration of a solver."""
    sweep(state.chain, target)


def chain_error(state, target):
    """Return the distance from effector to target [m] as the loops want it."""
    distance = effector_error(state.chain, target)
    return distance, 0.0, distance, distance


def chain_merit(state, target):
    """Return the distance from effector to target [m]."""
    return effector_error(state.chain, target)


def perturb_chain(state, target, criteria, first):
    """Bend a chain that starts collinear with its target, which no solver would leave."""
    chain, d = state.chain, root_distance(state.chain, target)
    if (
        first[MADE] > 0
        or effector_error(chain, target) <= criteria.distance
        or is_beyond_reach(chain, d)
    ):
        return False
    if not is_collinear(chain, target):
        return False
    bend(chain)
    return True


def save_chain(state, k):
    """Save where the chain is."""
    for j in range(len(state.chain.positions)):
        row = state.saved[k, j]
        row[0], row[1], row[2] = load_vector(state.chain.positions, j)
        row[3], row[4], row[5], row[6] = load_quaternion(state.chain.rotations, j)


def restore_chain(state, k):
    """Bring the chain back to where it was."""
    for j in range(len(state.chain.positions)):
        store_vector(state.chain.positions, j, load_vector(state.saved[k], j))
        store_quaternion(state.chain.rotations, j, load_quaternion(state.saved[k], j, 3))


def draw_chain(_state, _target, _n):
    """Leave the chain where it is: its random restarts are made on a mechanism."""


def on_chains(name, sweep):
    """Return the kernel that solves chains by the sweep of a named solver."""
    return Kernel(
        bind(
            solve_chains, update=bind(update_chain, sweep=sweep), error=chain_error,
            merit=chain_merit, perturb=perturb_chain, save=save_chain, restore=restore_chain,
            draw=draw_chain,
        ),
        label=f"{name} for chains",
    )  # fmt: skip
