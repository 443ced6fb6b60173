"""Any targets of any mechanism, for the loops of `restarts.py`."""

import math
from typing import NamedTuple

import numpy as np

from ..arguments import LARGEST_COORDINATE, FloatArray, RecordArray
from ..articulation import (
    BALL,
    FIXED,
    FREE,
    HINGE,
    SLIDE,
    WIDTHS,
    articulated_pose,
    clamp_joint,
    joint_transform,
    normalise_start,
)
from ..backend.compiled import Kernel, bind
from ..quaternion import (
    load_quaternion,
    load_vector,
    made_unit,
    multiply,
    norm,
    normalised,
    rotation_about,
    store_quaternion,
    subtract,
)
from .anderson import DEPTH, Mixing, forget, mixing_on, mixing_size
from .bounded_step import TaskSystem, new_system
from .ccd import anderson_ccd_update, ccd_update
from .chain import BEND, POSITION_ROUNDING
from .fabrik import BACKWARD, fabrik_update
from .jacobian import (
    damped_least_squares_update,
    jacobian_transpose_update,
    levenberg_marquardt_phase,
    levenberg_marquardt_update,
    only_phase,
)
from .linear_algebra import clear
from .mechanism import (
    LEVER,
    ConfigurationData,
    Mechanism,
    data_on,
    errors,
    gather,
    least_residual,
    load_ball,
    merit_of,
    move_by,
    residuals,
    scatter,
    store_ball,
    store_effector,
    update_forward_kinematics,
)
from .restarts import (
    COST,
    COUNT,
    INFINITY,
    LIMIT,
    OUTCOME,
    SPARE_ROWS,
    STALLED,
    STATE,
    Criteria,
    Operations,
    copy_row,
    fill_figures,
    limits_of,
    outcome_of,
    solve_with_restarts,
)

# A start is stuck if it stalls within so few iterations away from its target. An example is a
# straight chain, perhaps folded since, with its target on its own line.
STUCK = 6
# Out of reach an error has stalled if it changes by no more than this share of the tolerance. Where
# an iteration gains a ten-thousandth of what is left, a ten-thousandth of the tolerance remains.
FAR_MARGIN = 1e-8
# A stuck ball is bent about this axis of its own, which lies across no plane of the axes.
PERTURBATION_AXIS = (0.48, 0.6, 0.64)


class Workspace(NamedTuple):
    """Arrays for the solvers to write to."""

    system: TaskSystem  # of the Jacobian methods, and of CCD for joints that others follow
    backward: RecordArray  # of FABRIK, records BACKWARD, (joint,)
    eigen: FloatArray  # of CCD and FABRIK, Davenport's matrix and its eigenvectors, (2, 4, 4)


class MechanismState(NamedTuple):
    """A mechanism, its configuration, and its restarts."""

    mechanism: Mechanism  # what moves
    data: ConfigurationData  # its configuration
    row: FloatArray  # what an attempt continues from: `data.state` and `mixing`
    mixing: Mixing  # the last sweeps, of an accelerated solver
    workspace: Workspace  # of the solver
    restarts: FloatArray  # coordinates of the mechanism for further attempts, (restart, coordinate)
    # the effectors of these restarts, positions [m] and rotations, (restart, effector, 7)
    effector_frames: FloatArray
    ranks: FloatArray  # how far the restarts not yet taken are from the target [m], (restart,)


def solve_mechanisms(
    model, numbers, starts, targets, local, positions, figures, history, coordinates
):
    """Solve target after target; return whether all starts and targets were valid.

    The model is a plain tuple, since named tuples take longer from Python: the joints of the
    articulation, the fields of Mechanism, and the restarts of MechanismState with their effectors.
    Then come the numbers of Limits, and coordinates of the articulation to start from, (start,
    coordinate), used by the targets in turn. The targets are records TARGET, (target, effector),
    made unit here. The last are the fields of Result.
    """
    joints, mechanism_fields, restarts, restart_frames = model
    limits, mechanism = limits_of(numbers), Mechanism(*mechanism_fields)
    n = len(mechanism.columns)
    row = np.zeros(n + 5 + mixing_size(n, depth))
    data, mixing = data_on(mechanism, row[: n + 5]), mixing_on(row[n + 5 :], n, depth)
    if depth > 0:
        scale_lengths(mechanism, mixing.scale)
    state = MechanismState(
        mechanism, data, row, mixing, new_workspace(mechanism), restarts, restart_frames,
        np.empty(len(restarts)),
    )  # fmt: skip
    saved = np.empty((len(restarts) + 1 + SPARE_ROWS, len(row)))
    progress, rotations = np.empty((len(saved), LIMIT + 1)), np.empty((len(joints), 4))
    for i in range(len(targets)):
        q, target = coordinates[i], targets[i]
        chained = limits.chained and i > 0
        copy_row(coordinates[i - 1] if chained else starts[i % len(starts)], q)
        if not (normalise_start(joints, q) and normalise_target(target)):
            return False
        for j in range(len(joints)):  # also joints that move no effector
            clamp_joint(joints, j, q)
        gather(mechanism, q, data.q)
        clear(data.far_step)
        forget(mixing)
        update_forward_kinematics(mechanism, data)
        bound = least_residual(mechanism, target)
        criteria, past = mechanism_criteria(mechanism, bound, limits), history[i % len(history)]
        iterations, stalled = solve_with_restarts(
            operations, state, saved, progress, target, limits, criteria, past
        )
        scatter(mechanism, saved[-1], q)
        articulated_pose(joints, q, positions[i], rotations)
        for j in range(len(joints)):
            _, Q = joint_transform(joints, j, q)
            store_quaternion(local[i], j, Q)
        place_effectors(mechanism, data, positions[i], rotations)
        distance, angle, _, _ = residuals(state, target)
        merit = merit_of(state, target)
        fill_figures(figures[i], distance, angle, iterations, merit, bound)
        reached = distance <= limits.tolerance and angle <= limits.tolerance_rotation
        figures[i, OUTCOME] = outcome_of(reached, bound > limits.tolerance, stalled).value
    return True


def new_workspace(mechanism):
    """Return a workspace, not filled."""
    system = new_system(mechanism.equations, mechanism.freedoms)
    return Workspace(system, np.empty(len(mechanism.joints), BACKWARD), np.empty((2, 4, 4)))


def scale_lengths(mechanism, scale):
    """Divide coordinates in metres by the reach, to compare sweeps."""
    joints = mechanism.joints
    for j in range(len(joints)):
        at, kind = joints["coordinate"][j], joints["kind"][j]
        for k in range(3 if kind == FREE else 1 if kind == SLIDE else 0):
            scale[at + k] = 1.0 / mechanism.reach


def normalise_target(target):
    """Make the rotations of a target unit; return whether all its numbers were valid."""
    valid = True
    for e in range(len(target)):
        for k in range(3):
            valid &= abs(target["position"][e, k]) <= LARGEST_COORDINATE
        Q, unit = made_unit(load_quaternion(target["rotation"], e))
        store_quaternion(target["rotation"], e, Q)
        valid &= unit
    return valid


def mechanism_criteria(mechanism, bound, limits):
    """Return the end criteria of attempts, where no pose has a residual below `bound` [m].

    Targets out of reach count as reached within the tolerance of their least distances.
    """
    margin = POSITION_ROUNDING * mechanism.reach
    slack = min(margin, 0.5 * limits.tolerance)
    slack_rotation = min(POSITION_ROUNDING, 0.5 * limits.tolerance_rotation)
    unreachable = bound > limits.tolerance
    return Criteria(
        bound + limits.tolerance - slack,
        limits.tolerance_rotation - slack_rotation,
        max(margin, FAR_MARGIN * limits.tolerance) if unreachable else margin,
        limits.far_iterations if unreachable else limits.max_iterations,
        limits.phases > 1 and not unreachable and len(mechanism.effectors) > 1,
    )


def place_effectors(mechanism, data, positions, rotations):
    """Put the effectors where a pose of all joints of the articulation puts them."""
    for e in range(len(mechanism.effectors)):
        j = mechanism.effectors["source"][e]
        x, R = load_vector(positions, j), load_quaternion(rotations, j)
        store_effector(mechanism, data, e, x, R)


def perturb_mechanism(state, _target, _criteria, first):
    """Bend a mechanism stuck away from its target: all joints share an angle."""
    mechanism, q, angle = state.mechanism, state.data.q, BEND / max(len(state.mechanism.joints), 1)
    joints, missed_target = mechanism.joints, first[COST] > POSITION_ROUNDING * mechanism.reach
    if not (first[STATE] == STALLED and first[COUNT] < STUCK and missed_target):
        return False
    for j in range(len(joints)):
        kind = joints["kind"][j] if joints["leader"][j] == j else FIXED
        if kind == HINGE and move_by(joints, q, j, angle) == 0.0:
            move_by(joints, q, j, -angle)
        elif kind in (BALL, FREE):
            bend = rotation_about(PERTURBATION_AXIS, angle)
            store_ball(joints, q, j, normalised(multiply(load_ball(joints, q, j), bend)))
            clamp_joint(joints, j, q)
    forget(state.mixing)
    update_forward_kinematics(mechanism, state.data)
    return True


def place_mechanism(state):
    """Bring the mechanism to its coordinates."""
    update_forward_kinematics(state.mechanism, state.data)


def draw_mechanism(state, target, criteria, n):
    """Bring the mechanism to the random configuration with the n-th nearest effectors.

    With several limbs, only limbs whose effectors fail go to a random configuration, the n-th; the
    joints that limbs share do so every other time.
    """
    if criteria.redraws_limbs:
        redraw_limbs(state, target, criteria, n)
    else:
        if n == 1:
            rank_restarts(state, target)
        take_nearest(state, state.data.q)
    clear(state.data.far_step)
    forget(state.mixing)
    update_forward_kinematics(state.mechanism, state.data)


def redraw_limbs(state, target, criteria, n):
    """Copy from restart n the coordinates of joints that move effectors away from their targets."""
    mechanism, q, restart = state.mechanism, state.data.q, state.restarts[n - 1]
    joints = mechanism.joints
    for j in range(len(joints)):
        if joints["leader"][j] != j:
            continue
        misses, holds = False, False
        for e in range(len(mechanism.effectors)):
            if moves_effector(mechanism, j, e):
                distance, angle = errors(mechanism, target, state.data, e)
                misses_here = distance > criteria.distance or angle > criteria.angle
                misses, holds = misses or misses_here, holds or not misses_here
        if misses and not (holds and n % 2 == 0):
            at = joints["coordinate"][j]
            for k in range(at, at + WIDTHS[joints["kind"][j]]):
                q[k] = restart[k]


def moves_effector(mechanism, j, e):
    """Return whether a joint or one of its followers moves an effector."""
    moves = False
    for i in range(len(mechanism.joints)):
        moves |= mechanism.joints["leader"][i] == j and mechanism.moves[i, e]
    return moves


def rank_restarts(state, target):
    """Fill how far the effectors are from the target [m] in each random configuration."""
    lever = LEVER * state.mechanism.reach
    for r in range(len(state.restarts)):
        distance, angle = 0.0, 0.0
        for e in range(len(target)):
            offset = subtract(
                load_vector(target["position"], e), load_vector(state.effector_frames[r], e)
            )
            distance = max(distance, norm(offset))
            if state.mechanism.effectors["oriented"][e]:
                R = load_quaternion(state.effector_frames[r], e, 3)
                angle = max(angle, rough_angle(R, load_quaternion(target["rotation"], e)))
        state.ranks[r] = distance + lever * angle


def rough_angle(a, b):
    """Return the angle from a to b [rad] by its quarter's sine, at most a tenth too small."""
    w = abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3])
    return 4.0 * math.sqrt(max(0.5 - 0.5 * w, 0.0))


def take_nearest(state, q):
    """Copy the nearest random configuration not yet taken."""
    nearest = 0
    for r in range(1, len(state.restarts)):
        if state.ranks[r] < state.ranks[nearest]:
            nearest = r
    state.ranks[nearest] = INFINITY
    copy_row(state.restarts[nearest], q)


depth = 0  # of the sweeps that a solver remembers
operations = Operations(
    ccd_update, residuals, merit_of, perturb_mechanism, place_mechanism, draw_mechanism, only_phase
)
# The update of each solver, and what begins its phases.
UPDATES = {
    "ccd": (ccd_update, only_phase),
    "fabrik": (fabrik_update, only_phase),
    "levenberg_marquardt": (levenberg_marquardt_update, levenberg_marquardt_phase),
    "damped_least_squares": (damped_least_squares_update, only_phase),
    "jacobian_transpose": (jacobian_transpose_update, only_phase),
    "anderson_ccd": (anderson_ccd_update, only_phase),
}
# The kernel that solves mechanisms by the update of each solver.
ON_MECHANISMS = {
    name: Kernel(
        bind(
            solve_mechanisms,
            operations=operations._replace(update=update, begin=begin),
            depth=DEPTH * (update is anderson_ccd_update),
        ),
        label=f"{name} for mechanisms",
    )
    for name, (update, begin) in UPDATES.items()
}
