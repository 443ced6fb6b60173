"""Forward and backward reaching (Aristidou & Lasenby 2011, Algorithm 1).

A chain of unlimited balls is solved as in the paper, by positions alone (`fabrik_sweep`). On
mechanisms (`fabrik_update`) the backward pass gives each joint a backward position. The forward
pass does not move points: joints rotate and translate to bring their children nearest to the
children's backward positions, and effectors further below to their targets. A hinge rotates about
its axis, a ball within its limits, and a free joint moves as a body; all children of a branch share
a rotation. A joint with followers goes down the gradient. The remaining distances are the residual.

- *Damping*: there is none.
- *End*: `restarts.py` repeats passes until the target is within the tolerances, the error no longer
  changes, or the iterations allowed are made. Of a target out of reach the nearest point counts.
- *Limits*: `move_by` and `rotate_to` stop each joint at its own, also a joint with followers.
- *Beyond reach*: `lay_on_line` straightens a chain in a single pass. A mechanism goes on as within
  reach.
- *Compiled* are the two kernels at the end, with all that they call: numba compiles the same
  functions that the interpreter can run.
"""

from ..articulation import BALL, FREE, HINGE, SLIDE, joint_in_world, joint_transform
from ..jacobians import ZERO, axis_of, frame_of
from ..quaternion import (
    IDENTITY,
    add,
    between,
    conjugate,
    dot,
    load_quaternion,
    load_vector,
    multiply,
    norm,
    normalised,
    rotate,
    rotation_about,
    scale,
    store_quaternion,
    store_vector,
    subtract,
)
from .bounded_step import descend
from .chain import is_beyond_reach, root_distance, rounding
from .mechanism import (
    move_by,
    rotate_to,
    rotation_weight,
    translate_free,
    update_forward_kinematics,
)
from .solve_mechanism import kernels_of
from .wahba import ZERO_MATRIX, add_outer, add_rotation, best_angle, best_rotation

# The weight of the identity in fitting a free joint, beside a single arm as long as the reach. The
# fit is then unique up to rounding, and unchanged where the arms are right already.
IDENTITY_WEIGHT = 1e-6


def fabrik_sweep(chain, target):
    """Move the joints' positions: to the target and back to the root, or, beyond reach, on a line.

    Only positions move; the joints' rotations follow after the last sweep.
    """
    d = root_distance(chain, target)
    if is_beyond_reach(chain, d):
        lay_on_line(chain, target, 1.0)
    elif d <= 2.0 * chain.longest - chain.reach + rounding(chain, d):  # in the inner radius
        lay_on_line(chain, target, -1.0)
    else:
        reach_backward(chain, target)
        reach_forward(chain)


def reach_backward(chain, target):
    """Put the effector on the target and pull the joints after the effector, up to the root."""
    store_vector(chain.positions, len(chain.lengths), target)
    for k in range(len(chain.lengths) - 1, -1, -1):
        after = load_vector(chain.positions, k + 1)
        point = point_towards(after, load_vector(chain.positions, k), chain.lengths[k])
        store_vector(chain.positions, k, point)


def reach_forward(chain):
    """Put the root back and pull the joints after the root, down to the effector."""
    store_vector(chain.positions, 0, load_vector(chain.offsets, 0))
    for k in range(len(chain.lengths)):
        before = load_vector(chain.positions, k)
        point = point_towards(before, load_vector(chain.positions, k + 1), chain.lengths[k])
        store_vector(chain.positions, k + 1, point)


def lay_on_line(chain, target, sign):
    """Lay the longest link towards the target and the other links towards it (1) or back (-1).

    Beyond reach all links point at the target. If the target is nearer than the longest link
    allows, all others fold back, and the effector comes to rest on the inner radius.
    """
    root = load_vector(chain.positions, 0)
    direction = subtract(point_towards(root, target, 1.0), root)
    passed = False
    for k in range(len(chain.lengths)):
        longest = chain.lengths[k] == chain.longest and not passed
        passed |= longest
        step = scale(chain.lengths[k] if longest else sign * chain.lengths[k], direction)
        store_vector(chain.positions, k + 1, add(load_vector(chain.positions, k), step))


def point_towards(start, end, length):
    """Return the point at a distance from start towards end; along x if start and end coincide."""
    direction = subtract(end, start)
    distance = norm(direction)
    if distance == 0.0:
        return add(start, (length, 0.0, 0.0))
    return add(start, scale(length / distance, direction))


def fabrik_update(state, target):
    """Compute the backward positions, then move joint after joint towards them."""
    mechanism, data, work = state.mechanism, state.data, state.workspace
    backward_pass(mechanism, target, data, work.backward)
    joints = mechanism.joints
    for j in range(len(joints)):
        update_joint_pose(joints, data, work.backward, j)
        forward_joint(mechanism, target, data, work, j)
    update_forward_kinematics(mechanism, data)


def backward_pass(mechanism, target, data, backward):
    """Fill the joints' positions with the effectors on their targets and all lengths kept.

    A joint with several children takes the weighted mean of the positions to which they pull.
    """
    parents = mechanism.joints["parent"]
    for j in range(len(backward)):
        store_vector(backward["position"], j, ZERO)
        backward["weight"][j] = 0.0
    for e in range(len(mechanism.effectors)):
        j = mechanism.effectors["joint"][e]
        if j >= 0:
            point = backward_from_target(mechanism, target, data, e, j)
            add_backward(backward, j, target["weight"][e], point)
    for j in range(len(backward) - 1, -1, -1):
        weight = backward["weight"][j]
        if weight > 0.0:
            x = scale(1.0 / weight, load_vector(backward["position"], j))
            store_vector(backward["position"], j, x)
            if parents[j] >= 0:
                x_parent = load_vector(data.positions, parents[j])
                length = norm(subtract(load_vector(data.positions, j), x_parent))
                add_backward(backward, parents[j], weight, point_towards(x, x_parent, length))


def backward_from_target(mechanism, target, data, e, j):
    """Return the position of an effector's joint with the effector on its target [m]."""
    x = load_vector(target["position"], e)
    arm = load_vector(mechanism.effectors["position"], e)
    if mechanism.effectors["oriented"][e]:
        R = load_quaternion(mechanism.effectors["rotation"], e)
        R_joint = multiply(load_quaternion(target["rotation"], e), conjugate(R))
        return subtract(x, rotate(R_joint, arm))
    return point_towards(x, load_vector(data.positions, j), norm(arm))


def add_backward(backward, j, weight, x):
    """Add a weighted position to a joint's sum."""
    total = add(load_vector(backward["position"], j), scale(weight, x))
    store_vector(backward["position"], j, total)
    backward["weight"][j] += weight


def update_joint_pose(joints, data, backward, j):
    """Update a joint's pose in the world from its parent's and its coordinates.

    A ball with a backward position below keeps its earlier rotation in the world.
    """
    x, R = joint_in_world(joints, j, data.q, data.positions, data.rotations)
    store_vector(data.positions, j, x)
    if joints["kind"][j] != BALL or backward["weight"][j] == 0.0:
        store_quaternion(data.rotations, j, R)


def forward_joint(mechanism, target, data, work, j):
    """Move a joint, its parent in place, to bring its children nearest to backward positions."""
    joints, q, kind = mechanism.joints, data.q, mechanism.joints["kind"][j]
    R, x = load_quaternion(data.rotations, j), load_vector(data.positions, j)
    if kind == FREE and work.backward["weight"][j] > 0.0:
        forward_free(mechanism, target, data, work, j)
        return
    if joints["followed"][j]:  # the backward positions know nothing of its followers
        descend(mechanism, target, data, work, j)
        return
    leads = joints["leader"][j] == j
    if kind == SLIDE and leads:
        axis = axis_of(joints, j, R)
        distance = dot(axis, mean_displacement(mechanism, target, data, work.backward, j))
        x = add(x, scale(move_by(joints, q, j, distance), axis))
    store_vector(data.positions, j, x)
    if kind == HINGE and leads:
        axis = axis_of(joints, j, R)
        M, _, _, _ = fit_arms(mechanism, target, data, work.backward, j)
        R = multiply(rotation_about(axis, move_by(joints, q, j, best_angle(M, axis))), R)
    elif kind == BALL and work.backward["weight"][j] > 0.0:
        R_best = multiply(forward_rotation(mechanism, target, data, work, j), R)
        R = rotate_to(joints, q, j, frame_of(joints, j, data.rotations), R_best)
    store_quaternion(data.rotations, j, normalised(R))


def forward_free(mechanism, target, data, work, j):
    """Move a free joint as a body to bring the joints below nearest to their backward positions.

    The centre of the arms goes to the centre of their backward positions, and the rotation is the
    best about this centre (Horn 1987). A joint moved to its own backward position and then rotated
    would overshoot and oscillate. Where all arms are collinear, the smallest of the best rotations
    is taken.
    """
    joints, x = mechanism.joints, load_vector(data.positions, j)
    M, total, arms, ends = fit_arms(mechanism, target, data, work.backward, j)
    arm, to = scale(1.0 / total, arms), scale(1.0 / total, ends)
    M = add_outer(M, -total, to, arm)
    stay = IDENTITY_WEIGHT * total * mechanism.reach * mechanism.reach
    M = add_rotation(M, stay, IDENTITY)
    Q = best_rotation(M, work.eigen[0], work.eigen[1])
    v, frame = subtract(to, rotate(Q, arm)), frame_of(joints, j, data.rotations)
    R = rotate_to(joints, data.q, j, frame, multiply(Q, load_quaternion(data.rotations, j)))
    translate_free(joints, data.q, j, rotate(conjugate(frame), v))
    store_vector(data.positions, j, add(x, v))
    store_quaternion(data.rotations, j, normalised(R))


def forward_rotation(mechanism, target, data, work, j):
    """Return the rotation of joint j that fits adjacent points best; the shortest for one point."""
    backward, joints = work.backward, len(mechanism.joints)
    count, arm, to = 0, ZERO, ZERO
    for e in range(len(mechanism.effectors)):
        if mechanism.adjacent[j, joints + e]:
            count += 2 if mechanism.effectors["oriented"][e] else 1
            arm, to = effector_arms(mechanism, target, data, e, j)
    for c in range(j + 1, joints):
        if mechanism.adjacent[j, c] and backward["weight"][c] > 0.0:
            count += 1
            arm, to = joint_arms(mechanism, data, backward, c, j)
    if count == 1:
        return between(arm, to)
    M, _, _, _ = fit_arms(mechanism, target, data, backward, j)
    return best_rotation(M, work.eigen[0], work.eigen[1])


def fit_arms(mechanism, target, data, backward, j):
    """Return Wahba's M of the arms from joint j to adjacent joints and to all effectors below.

    Effectors further below count as well. A hinge often cannot bring its child to its backward
    position, and would otherwise never make up for the remaining distance.

    Returns:
        M; the sum of the weights; and the weighted sums of the arms and of their targets [m].
    """
    M, total, arms, ends = ZERO_MATRIX, 0.0, ZERO, ZERO
    for e in range(len(mechanism.effectors)):
        if mechanism.moves[j, e]:
            weight = target["weight"][e]
            arm, R = effector_below(mechanism, data, e, j)
            to = subtract(load_vector(target["position"], e), load_vector(data.positions, j))
            M, total = add_outer(M, weight, to, arm), total + weight
            arms, ends = add(arms, scale(weight, arm)), add(ends, scale(weight, to))
            if mechanism.effectors["oriented"][e]:
                error = multiply(load_quaternion(target["rotation"], e), conjugate(R))
                M = add_rotation(M, weight * rotation_weight(mechanism), error)
    for c in range(j + 1, len(backward)):
        if mechanism.adjacent[j, c]:
            weight = backward["weight"][c]
            arm, to = joint_arms(mechanism, data, backward, c, j)
            M, total = add_outer(M, weight, to, arm), total + weight
            arms, ends = add(arms, scale(weight, arm)), add(ends, scale(weight, to))
    return M, total, arms, ends


def mean_displacement(mechanism, target, data, backward, j):
    """Return the weighted mean of the vectors from joint j's children to their targets [m]."""
    total, mean = 0.0, ZERO
    for e in range(len(mechanism.effectors)):
        if mechanism.effectors["joint"][e] == j:
            arm, to = effector_arms(mechanism, target, data, e, j)
            mean = add(mean, scale(target["weight"][e], subtract(to, arm)))
            total += target["weight"][e]
    for c in range(j + 1, len(backward)):
        if mechanism.joints["parent"][c] == j and backward["weight"][c] > 0.0:
            arm, to = joint_arms(mechanism, data, backward, c, j)
            mean = add(mean, scale(backward["weight"][c], subtract(to, arm)))
            total += backward["weight"][c]
    return scale(1.0 / total, mean) if total > 0.0 else mean


def effector_arms(mechanism, target, data, e, j):
    """Return the vectors from joint j to an effector and to its target, in the world [m]."""
    arm, _ = effector_below(mechanism, data, e, j)
    return arm, subtract(load_vector(target["position"], e), load_vector(data.positions, j))


def effector_below(mechanism, data, e, j):
    """Return the vector from joint j to an effector [m] and its rotation, in the world."""
    effectors = mechanism.effectors
    x, R = load_vector(effectors["position"], e), load_quaternion(effectors["rotation"], e)
    return pose_below(mechanism.joints, data, j, effectors["joint"][e], x, R)


def joint_arms(mechanism, data, backward, c, j):
    """Return the vectors from joint j to a joint below and to its backward position [m]."""
    x, R = joint_transform(mechanism.joints, c, data.q)
    arm, _ = pose_below(mechanism.joints, data, j, mechanism.joints["parent"][c], x, R)
    return arm, subtract(load_vector(backward["position"], c), load_vector(data.positions, j))


def pose_below(joints, data, j, k, x, R):
    """Return the vector from joint j to a point x of the frame of k, at or below j, and R likewise.

    The coordinates from j down count, since the poses below are not updated yet.
    """
    while k != j:
        offset, Q = joint_transform(joints, k, data.q)
        x, R = add(offset, rotate(Q, x)), multiply(Q, R)
        k = joints["parent"][k]
    Q = load_quaternion(data.rotations, j)
    return rotate(Q, x), multiply(Q, R)


ON_CHAINS, ON_MECHANISMS = kernels_of("fabrik", fabrik_sweep, fabrik_update)
