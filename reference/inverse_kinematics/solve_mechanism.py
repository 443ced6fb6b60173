"""Any targets of any mechanism, for the loops of `restarts.py`."""

import math
from typing import Any, NamedTuple

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
from ..backend.compiled import Kernel
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
from .anderson import Mixing, forget, mixing_on, mixing_size
from .bounded_step import FULL_CIRCLE, TaskSystem, new_system
from .chain import BEND, POSITION_ROUNDING, on_chains, solve_chains
from .far_step import FAR_STEP
from .mechanism import (
    BACKWARD,
    LEVER,
    TARGET,
    TARGET_WIDTH,
    ConfigurationData,
    Mechanism,
    errors,
    gather,
    least_residual,
    load_ball,
    merit_of,
    move_by,
    new_data,
    problem_on,
    residuals,
    scatter,
    store_ball,
    store_effector,
    update_forward_kinematics,
)
from .restarts import (
    BEST,
    INFINITY,
    STALLED,
    Criteria,
    Operations,
    copy_row,
    limits_of,
    new_search,
    solve_with_restarts,
)
from .result import OUTCOME, fill_figures, outcome_of, result_on

# A start is stuck if it stalls within so few iterations away from its target. An example is a
# straight chain, perhaps folded since, with its target on its own line.
STUCK = 6
# Out of reach an error has stalled if it changes by no more than this share of the tolerance. Where
# an iteration gains a ten-thousandth of what is left, a ten-thousandth of the tolerance remains.
FAR_MARGIN = 1e-8
# A stuck ball is bent about this axis of its own, and turned at further starts; no two components
# are equal, so that balls in a row do not turn in a plane of their axes.
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
    row: FloatArray  # its coordinates, `data.q`
    far_step: RecordArray  # the last step towards a target out of reach, FAR_STEP, (1,)
    mixing: Mixing  # the last sweeps, of an accelerated solver
    workspace: Workspace  # of the solver
    restarts: FloatArray  # coordinates of the mechanism for further attempts, (restart, coordinate)
    # the effectors of these restarts, positions [m] and rotations, (restart, effector, 7)
    effector_frames: FloatArray
    ranks: FloatArray  # how far the restarts not yet taken are from the target [m], (restart,)
    shares: FloatArray  # of the ranges of joints at further starts, (phase - 1, joint)


def new_state(mechanism, depth, restarts, effector_frames, shares):
    """Return the state of a mechanism whose solver remembers `depth` sweeps, not filled."""
    data, n = new_data(mechanism), len(mechanism.columns)
    mixing = mixing_on(np.empty(mixing_size(n, depth)), n, depth)
    if depth > 0:
        scale_lengths(mechanism, mixing.scale)
    return MechanismState(
        mechanism, data, data.q, np.zeros(1, FAR_STEP), mixing, new_workspace(mechanism), restarts,
        effector_frames, np.empty(len(restarts)), shares,
    )  # fmt: skip


def solve_mechanisms(operations, depth, problem, numbers, starts, targets, results, first, last):
    """Solve the targets from `first` to `last`, as `solve_chains` does, on a MechanismState.

    The problem is that of `packed_problem`. Starts are coordinates of the articulation. Targets are
    records TARGET, made unit here, as numbers: target after target, effector after effector.
    """
    joints, width, mechanism, restarts, effector_frames, shares = problem_on(problem)
    limits, numbers_of_target = limits_of(numbers), TARGET_WIDTH * len(mechanism.effectors)
    start_rows, target_rows = (
        starts.reshape(max(len(starts) // max(width, 1), 1), width),
        targets.reshape(-1, numbers_of_target),
    )
    result = result_on(results, len(target_rows), len(joints), width)
    state = new_state(mechanism, depth, restarts, effector_frames, shares)
    search = new_search(1 + len(restarts) + limits.phases, len(state.row))
    rotations = np.empty((len(joints), 4))
    for i in range(first, last):
        q, target = result.coordinates[i], target_rows[i].view(TARGET)
        is_chained = limits.chained and i > 0
        copy_row(result.coordinates[i - 1] if is_chained else start_rows[i % len(start_rows)], q)
        if not (normalise_start(joints, q) and normalise_target(target)):
            return False
        begin_solve(joints, state, q)
        bound = least_residual(mechanism, target)
        criteria = mechanism_criteria(mechanism, bound, limits)
        iterations, stalled = solve_with_restarts(
            operations, state, search, target, criteria, result.history[i]
        )
        scatter(mechanism, search.rows[BEST], q)
        show_pose(joints, state, q, result.positions[i], rotations, result.local[i])
        distance, angle, _, _ = residuals(state, target)
        figures, merit = result.figures[i], merit_of(state, target)
        fill_figures(figures, distance, angle, iterations, merit, bound)
        reached = distance <= limits.tolerance and angle <= limits.tolerance_rotation
        figures[OUTCOME] = outcome_of(reached, bound > limits.tolerance, stalled).value
    return True


def begin_solve(joints, state, q):
    """Bring the coordinates of an articulation within the limits, and its mechanism to them."""
    for j in range(len(joints)):  # also joints that move no effector
        clamp_joint(joints, j, q)
    gather(state.mechanism, q, state.data.q)
    place_mechanism(state)


def show_pose(joints, state, q, positions, rotations, local):
    """Fill the pose of an articulation at q, and put the effectors where this pose has them."""
    articulated_pose(joints, q, positions, rotations)
    for j in range(len(joints)):
        _, Q = joint_transform(joints, j, q)
        store_quaternion(local, j, Q)
    effectors = state.mechanism.effectors
    for e in range(len(effectors)):
        j = effectors["source"][e]
        x, R = load_vector(positions, j), load_quaternion(rotations, j)
        store_effector(state.mechanism, state.data, e, x, R)


def new_workspace(mechanism):
    """Return a workspace, not filled."""
    system = new_system(mechanism.equations, mechanism.freedoms)
    return Workspace(system, np.empty(len(mechanism.joints), BACKWARD), np.empty((2, 4, 4)))


def scale_lengths(mechanism, scale):
    """Fill the factors of coordinates to compare sweeps: of metres one over the reach."""
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
    phases = 1 if unreachable else limits.phases
    return Criteria(
        bound + limits.tolerance - slack,
        limits.tolerance_rotation - slack_rotation,
        max(margin, FAR_MARGIN * limits.tolerance) if unreachable else margin,
        limits.far_iterations if unreachable else limits.max_iterations,
        limits.restarts,
        phases,
        limits.restarts if phases == 1 else 0,
        not unreachable and limits.restarts + phases > 1,
        phases > 1 and len(mechanism.effectors) > 1,
    )


def perturb_mechanism(state, _target, _criteria, first):
    """Bend a mechanism stuck away from its target: all joints share an angle."""
    mechanism, q, angle = state.mechanism, state.data.q, BEND / max(len(state.mechanism.joints), 1)
    joints, missed_target = mechanism.joints, first["merit"] > POSITION_ROUNDING * mechanism.reach
    if not (first["ending"] == STALLED and first["iterations"] < STUCK and missed_target):
        return False
    for j in range(len(joints)):
        kind = joints["kind"][j] if joints["leader"][j] == j else FIXED
        if kind == HINGE and move_by(joints, q, j, angle) == 0.0:
            move_by(joints, q, j, -angle)
        elif kind in (BALL, FREE):
            bend = rotation_about(PERTURBATION_AXIS, angle)
            store_ball(joints, q, j, normalised(multiply(load_ball(joints, q, j), bend)))
            clamp_joint(joints, j, q)
    place_mechanism(state)
    return True


def place_mechanism(state):
    """Bring the mechanism to its coordinates, and forget all iterations."""
    state.far_step["square"][0] = 0.0
    forget(state.mixing)
    update_forward_kinematics(state.mechanism, state.data)


def draw_mechanism(state, target, criteria, n):
    """Write the random configuration with the n-th nearest effectors to the row.

    With several limbs, only limbs whose effectors fail go to a random configuration, the n-th; the
    joints that limbs share do so every other time.
    """
    if criteria.redraws_limbs:
        redraw_limbs(state, target, criteria, n)
    else:
        if n == 1:
            rank_restarts(state, target)
        take_nearest(state, state.data.q)


def redraw_limbs(state, target, criteria, n):
    """Copy from restart n the coordinates of joints whose effectors miss their targets."""
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


def shift_mechanism(state, n):
    """Change the row from the start to further start n, within the limits.

    Each hinge or slide with two limits goes to a share of its range, the same for every start. A
    hinge without two limits, a ball and a free joint turn by this share of a circle; slides without
    stay. The first further start is the middle.
    """
    joints, q = state.mechanism.joints, state.data.q
    for j in range(len(joints)):
        kind = joints["kind"][j] if joints["leader"][j] == j else FIXED
        at, lower, upper = joints["coordinate"][j], joints["lower"][j], joints["upper"][j]
        share = state.shares[n - 1, j]
        if kind in (HINGE, SLIDE) and math.isfinite(upper - lower):
            q[at] = lower + share * (upper - lower)
        elif kind == HINGE:
            q[at] = min(max(q[at] + share * FULL_CIRCLE, lower), upper)
        elif kind in (BALL, FREE):
            turn = rotation_about(PERTURBATION_AXIS, share * FULL_CIRCLE)
            store_ball(joints, q, j, normalised(multiply(load_ball(joints, q, j), turn)))
            clamp_joint(joints, j, q)


def on_mechanisms(update: Any) -> Operations:
    """Return the operations of a solver with such an update."""
    return Operations(
        update, residuals, merit_of, perturb_mechanism, place_mechanism, draw_mechanism,
        shift_mechanism,
    )  # fmt: skip


def kernels_of(name: str, sweep: Any, update: Any, depth: int = 0) -> tuple[Kernel, Kernel]:
    """Return a solver's kernels for chains and mechanisms; the solver remembers `depth` sweeps."""
    chains, mechanisms = (on_chains(sweep), depth), (on_mechanisms(update), depth)
    return (
        Kernel(solve_chains, constants=chains, label=f"{name}, chains"),
        Kernel(solve_mechanisms, constants=mechanisms, label=f"{name}, mechanisms"),
    )
