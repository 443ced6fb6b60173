"""Any targets of any mechanism: what the loops of `restarts.py` work on."""

import math
from typing import Any, NamedTuple

import numpy as np

from ..arguments import LARGEST_COORDINATE, FloatArray
from ..articulation import (
    BALL,
    FREE,
    HINGE,
    articulated_pose,
    clamp_joint,
    joint_transform,
    normalise_start,
)
from ..backend.compiled import Kernel, Slot, bind
from ..quaternion import (
    angle_between,
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
from .chain import BEND, POSITION_ROUNDING
from .joint_updates import load_ball, move_by, store_ball
from .mechanism import (
    LEVER,
    ConfigurationData,
    Mechanism,
    gather,
    least_residual,
    merit_of,
    new_data,
    residuals,
    scatter,
    update_forward_kinematics,
    weighted_square,
)
from .restarts import (
    COST,
    INFINITY,
    MADE,
    RANK,
    SETTLED,
    STATE,
    Criteria,
    copy_row,
    limits_of,
    new_progress,
    solve_with_restarts,
)
from .result import (
    EXCESS,
    ITERATIONS,
    MERIT,
    OUTCOME,
    RESIDUAL,
    RESIDUAL_ROTATION,
    outcome_of,
)
from .task_jacobian import clear

# One iteration of a solver: step(mechanism, target, data, workspace).
step = Slot("step")
# new_workspace(mechanism): the arrays that its step writes to, in a NamedTuple.
new_workspace = Slot("new_workspace")

# A start that settles within so few iterations away from its target is stuck, such as a straight
# chain, perhaps folded since, whose target lies on its own line.
STUCK = 6
# Out of reach an error that changes by no more than this share of the tolerance has settled.
FAR_MARGIN = 1e-8
# A stuck ball is bent about this axis of its own, which lies across no plane of the axes.
PERTURBATION_AXIS = (0.48, 0.6, 0.64)


class MechanismState(NamedTuple):
    """A mechanism, where it is, and the ends of attempts on it.

    Attributes:
        mechanism: what moves.
        data: its configuration.
        workspace: of the solver, what `new_workspace` returns.
        restarts: coordinates of the mechanism for further attempts, (restart, coordinate).
        effector_frames: where they put the effectors, positions [m] and rotations, (restart,
            effector, 7).
        saved: states of its configuration, (attempt + 1, coordinate + 2).
        progress: see `restarts.py`.
    """

    mechanism: Mechanism
    data: ConfigurationData
    workspace: Any
    restarts: FloatArray
    effector_frames: FloatArray
    saved: FloatArray
    progress: FloatArray


def solve_mechanisms(
    joints, own_joints, sources, effectors, moves, adjacent, reach, width, freedoms, equations,
    restarts, restart_frames, numbers, starts, targets, local,
    positions, figures, history, coordinates,
):  # fmt: skip
    """Solve target after target; return whether all starts and targets were valid.

    Arrays come one by one, since tuples of them take longer from Python: the joints of the
    articulation, the fields of Mechanism, the restarts of MechanismState and their effectors, the
    numbers of Limits, coordinates of the articulation to start from, (start, coordinate), which the
    targets use one after the other, targets, records TARGET, (target, effector), whose rotations
    are made unit, and the fields of Result.
    """
    limits = limits_of(numbers)
    mechanism = Mechanism(
        own_joints, sources, effectors, moves, adjacent, reach, width, freedoms, equations
    )
    state = new_state(mechanism, restarts, restart_frames)
    rotations = np.empty((len(joints), 4))
    for i in range(len(targets)):
        q, target = coordinates[i], targets[i]
        chained = limits.chained and i > 0
        copy_row(coordinates[i - 1] if chained else starts[i % len(starts)], q)
        if not (normalise_start(joints, q) and normalise_target(target)):
            return False
        begin(state, q)
        least = least_residual(mechanism, target)
        criteria = mechanism_criteria(mechanism, least, limits)
        past = history[i % len(history)]
        iterations, settled = solve_with_restarts(state, target, limits, criteria, past)
        figures[i, ITERATIONS] = iterations
        scatter(mechanism, state.saved[-1], q)
        articulated_pose(joints, q, positions[i], rotations)
        for j in range(len(joints)):
            _, Q = joint_transform(joints, j, q)
            store_quaternion(local[i], j, Q)
        rate_pose(mechanism, target, limits, positions[i], rotations, least, settled, figures[i])
    return True


def new_state(mechanism, restarts, effector_frames):
    """Return a state to begin from."""
    rows = len(restarts) + 2
    return MechanismState(
        mechanism, new_data(mechanism), new_workspace(mechanism), restarts, effector_frames,
        np.empty((rows, mechanism.coordinates + 2)), new_progress(rows - 1),
    )  # fmt: skip


def normalise_target(target):
    """Make the rotations of a target unit; return whether they and all other numbers were valid."""
    valid = True
    for e in range(len(target)):
        for k in range(3):
            valid &= abs(target["position"][e, k]) <= LARGEST_COORDINATE
        Q, unit = made_unit(load_quaternion(target["rotation"], e))
        store_quaternion(target["rotation"], e, Q)
        valid &= unit
    return valid


def begin(state, q):
    """Bring a mechanism to coordinates of the articulation, within their limits."""
    gather(state.mechanism, q, state.data.q)
    clear(state.data.far_step)
    for j in range(len(state.mechanism.joints)):
        clamp_joint(state.mechanism.joints, j, state.data.q)
    update_forward_kinematics(state.mechanism, state.data)


def mechanism_criteria(mechanism, least, limits):
    """Return when an attempt ends, where no pose has a lesser residual than `least` [m].

    Targets out of reach count as reached within the tolerance of their least distances.
    """
    margin = POSITION_ROUNDING * mechanism.reach
    slack, slack_rotation = (
        min(margin, 0.5 * limits.tolerance),
        min(POSITION_ROUNDING, 0.5 * limits.tolerance_rotation),
    )
    far = least > limits.tolerance
    return Criteria(
        least + limits.tolerance - slack,
        limits.tolerance_rotation - slack_rotation,
        max(margin, FAR_MARGIN * limits.tolerance) if far else margin,
        limits.far_iterations if far else limits.max_iterations,
    )


def rate_pose(mechanism, target, limits, positions, rotations, least, settled, figures):
    """Fill the figures of a pose of all joints."""
    distance, angle, total = 0.0, 0.0, 0.0
    for e in range(len(mechanism.effectors)):
        j, apart, off = mechanism.effectors["source"][e], 0.0, 0.0
        apart = norm(subtract(load_vector(target["position"], e), load_vector(positions, j)))
        if mechanism.effectors["oriented"][e]:
            off = angle_between(
                load_quaternion(rotations, j), load_quaternion(target["rotation"], e)
            )
        distance, angle = max(distance, apart), max(angle, off)
        total += weighted_square(mechanism, target["weight"][e], apart, off)
    reached = distance <= limits.tolerance and angle <= limits.tolerance_rotation
    outcome = outcome_of(reached, least > limits.tolerance, settled)
    figures[RESIDUAL], figures[RESIDUAL_ROTATION] = distance, angle
    figures[OUTCOME], figures[MERIT] = outcome.value, math.sqrt(total)
    figures[EXCESS] = max(0.0, distance - least)


def update_mechanism(state, target):
    """Make one iteration of a solver."""
    step(state.mechanism, target, state.data, state.workspace)


def mechanism_error(state, target):
    """Return the largest distance [m] and angle [rad] to the target, their sum, and a bound [m]."""
    return residuals(state.mechanism, target, state.data)


def mechanism_merit(state, target):
    """Return the root of the sum of weighted squares of distances and levered angles [m]."""
    return merit_of(state.mechanism, target, state.data)


def perturb_mechanism(state, _target, _criteria, first):
    """Bend a mechanism that settled at once, away from its target: all joints share one angle."""
    mechanism, q, count = state.mechanism, state.data.q, len(state.mechanism.joints)
    away = first[COST] > POSITION_ROUNDING * mechanism.reach
    if not (first[STATE] == SETTLED and first[MADE] < STUCK and away):
        return False
    for j in range(count):
        if mechanism.joints["leader"][j] == j:
            perturb_joint(mechanism.joints, q, j, BEND / count)
    update_forward_kinematics(mechanism, state.data)
    return True


def perturb_joint(joints, q, j, angle):
    """Rotate a joint by an angle [rad], always alike, within its limits."""
    kind = joints["kind"][j]
    if kind == HINGE and move_by(joints, q, j, angle) == 0.0:
        move_by(joints, q, j, -angle)
    elif kind in (BALL, FREE):
        bend = rotation_about(PERTURBATION_AXIS, angle)
        store_ball(joints, q, j, normalised(multiply(load_ball(joints, q, j), bend)))
        clamp_joint(joints, j, q)


def save_mechanism(state, k):
    """Save where the mechanism is."""
    copy_row(state.data.state, state.saved[k])


def restore_mechanism(state, k):
    """Bring the mechanism back to where it was."""
    copy_row(state.saved[k], state.data.state)
    update_forward_kinematics(state.mechanism, state.data)


def draw_mechanism(state, target, n):
    """Bring the mechanism to the random configuration whose effectors are n-th nearest."""
    if n == 1:
        rank_restarts(state, target)
    take_nearest(state, state.data.q)
    clear(state.data.far_step)
    update_forward_kinematics(state.mechanism, state.data)


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
                there = load_quaternion(state.effector_frames[r], e, 3)
                angle = max(angle, rough_angle(there, load_quaternion(target["rotation"], e)))
        state.progress[1 + r, RANK] = distance + lever * angle


def rough_angle(a, b):
    """Return the angle from a to b [rad] by its quarter's sine, at most a tenth too small."""
    w = abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3])
    return 4.0 * math.sqrt(max(0.5 - 0.5 * w, 0.0))


def take_nearest(state, q):
    """Copy the nearest of the random configurations that has not yet been taken."""
    nearest = 0
    for r in range(1, len(state.restarts)):
        if state.progress[1 + r, RANK] < state.progress[1 + nearest, RANK]:
            nearest = r
    state.progress[1 + nearest, RANK] = INFINITY
    copy_row(state.restarts[nearest], q)


def on_mechanisms(name, step, new_workspace):
    """Return the kernel that solves mechanisms by the step of a named solver."""
    return Kernel(
        bind(
            solve_mechanisms, new_workspace=new_workspace,
            update=bind(update_mechanism, step=step), error=mechanism_error,
            merit=mechanism_merit, perturb=perturb_mechanism, save=save_mechanism,
            restore=restore_mechanism, draw=draw_mechanism,
        ),
        label=f"{name} for mechanisms",
    )  # fmt: skip
