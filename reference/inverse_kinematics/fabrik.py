"""Forward and backward reaching (Aristidou & Lasenby 2011, Algorithm 1).

On mechanisms the way forward turns joints instead of moving points, each to bring its children
nearest to where they were wished backward: a hinge about its axis, a ball within its limits, one
rotation for all children of a branch, a free joint as one body. What cannot be had remains as the
residual.
"""

from ..articulation import BALL, FREE, HINGE, SLIDE, joint_transform
from ..motion_subspace import axis_of, frame_of
from ..quaternion import (
    add,
    between,
    conjugate,
    dot,
    multiply,
    norm,
    normalised,
    put_quaternion,
    put_vector,
    quaternion_at,
    rotate,
    scale,
    subtract,
    turn_about,
    vector_at,
)
from .chain import in_hole, out_of_reach, root_distance
from .joint_updates import move_by, shift_free, turn_ball
from .mechanism import (
    rotation_weight,
    update_forward_kinematics,
)
from .wahba import NOTHING, add_outer, add_turn, best_angle, best_rotation

# The column of wishes, (joint, 4), that holds the weight of a joint's wish; a position before it.
WISHED = 3


def fabrik_sweep(chain, target):
    """Move the joints' positions: to the target and back to the root, or, beyond reach, on a line.

    Only positions move; the links are turned after the last sweep.
    """
    d = root_distance(chain, target)
    if out_of_reach(chain, d):
        lay_on_line(chain, target, 1.0)
    elif in_hole(chain, d):
        lay_on_line(chain, target, -1.0)
    else:
        reach_backward(chain, target)
        reach_forward(chain)


def reach_backward(chain, target):
    """Put the effector on the target and pull the joints after it, up to the root."""
    put_vector(chain.positions, len(chain.lengths), target)
    for k in range(len(chain.lengths) - 1, -1, -1):
        after = vector_at(chain.positions, k + 1)
        pulled = place_towards(after, vector_at(chain.positions, k), chain.lengths[k])
        put_vector(chain.positions, k, pulled)


def reach_forward(chain):
    """Put the root back and pull the joints after it, down to the effector."""
    put_vector(chain.positions, 0, vector_at(chain.offsets, 0))
    for k in range(len(chain.lengths)):
        before = vector_at(chain.positions, k)
        pulled = place_towards(before, vector_at(chain.positions, k + 1), chain.lengths[k])
        put_vector(chain.positions, k + 1, pulled)


def lay_on_line(chain, target, others):
    """Lay the longest link towards the target and the others towards it (1) or back (-1).

    Beyond reach all point at the target; inside the hole that the longest link leaves all others
    fold back, and the effector comes to rest on the rim.
    """
    root = vector_at(chain.positions, 0)
    towards = subtract(place_towards(root, target, 1.0), root)
    found = False
    for k in range(len(chain.lengths)):
        longest = chain.lengths[k] == chain.longest and not found
        found |= longest
        step = scale(chain.lengths[k] if longest else others * chain.lengths[k], towards)
        put_vector(chain.positions, k + 1, add(vector_at(chain.positions, k), step))


def place_towards(start, end, length):
    """Return the point at a distance from start in the direction of end, of x if they coincide."""
    way = subtract(end, start)
    distance = norm(way)
    if distance == 0.0:
        return add(start, (length, 0.0, 0.0))
    return add(start, scale(length / distance, way))


def fabrik_update(mechanism, goal, data, room):
    """Reach backward for where each joint should be, then forward, turning joints towards that."""
    wish(mechanism, goal, data, room)
    joints = mechanism.joints
    for j in range(len(joints)):
        put_frame(joints, data, room, j)
        move_towards_wishes(mechanism, goal, data, room, j)
    update_forward_kinematics(mechanism, data)


def wish(mechanism, goal, data, room):
    """Fill where each joint would be if the effectors were on their targets, the lengths kept.

    A joint with several children takes the weighted mean of what each would pull it to.
    """
    wishes = room.wishes
    for j in range(len(wishes)):
        put_quaternion(wishes, j, (0.0, 0.0, 0.0, 0.0))
    for e in range(len(mechanism.effectors)):
        j = mechanism.effectors["joint"][e]
        if j >= 0:
            add_wish(room, j, goal["weight"][e], wish_of_effector(mechanism, goal, data, e, j))
    for j in range(len(wishes) - 1, -1, -1):
        if wishes[j, WISHED] > 0.0:
            put_vector(wishes, j, scale(1.0 / wishes[j, WISHED], vector_at(wishes, j)))
        parent = mechanism.joints["parent"][j]
        if parent >= 0 and wishes[j, WISHED] > 0.0:
            x, x_parent = vector_at(data.positions, j), vector_at(data.positions, parent)
            length = norm(subtract(x, x_parent))
            pulled = place_towards(vector_at(wishes, j), x_parent, length)
            add_wish(room, parent, wishes[j, WISHED], pulled)


def wish_of_effector(mechanism, goal, data, e, j):
    """Return where the joint that an effector hangs on would be with the effector on its target."""
    target, arm = vector_at(goal["position"], e), vector_at(mechanism.effectors["position"], e)
    if mechanism.effectors["oriented"][e]:
        return subtract(target, rotate(wished_rotation(mechanism, goal, e), arm))
    return place_towards(target, vector_at(data.positions, j), norm(arm))


def wished_rotation(mechanism, goal, e):
    """Return the rotation that the joint needs for its effector to have the target's."""
    frame = conjugate(quaternion_at(mechanism.effectors["rotation"], e))
    return multiply(quaternion_at(goal["rotation"], e), frame)


def add_wish(room, j, weight, position):
    """Add a weighted position to what is wished for a joint."""
    put_vector(room.wishes, j, add(vector_at(room.wishes, j), scale(weight, position)))
    room.wishes[j, WISHED] += weight


def put_frame(joints, data, room, j):
    """Put a joint where its parent now has it, moved by its coordinates; a ball keeps its turn."""
    x, R = joint_transform(joints, j, data.q)
    parent = joints["parent"][j]
    if parent >= 0:
        R_parent = quaternion_at(data.rotations, parent)
        x = add(vector_at(data.positions, parent), rotate(R_parent, x))
        R = multiply(R_parent, R)
    put_vector(data.positions, j, x)
    if joints["kind"][j] != BALL or room.wishes[j, WISHED] == 0.0:
        put_quaternion(data.rotations, j, R)


def move_towards_wishes(mechanism, goal, data, room, j):
    """Move one joint, its parent in place, to bring its children nearest to their wishes."""
    joints, q, kind = mechanism.joints, data.q, mechanism.joints["kind"][j]
    R, x = quaternion_at(data.rotations, j), vector_at(data.positions, j)
    if kind == FREE and room.wishes[j, WISHED] > 0.0:
        fit_free(mechanism, goal, data, room, j)
        return
    if kind == SLIDE and joints["leader"][j] == j:
        axis = axis_of(joints, j, R)
        way = dot(axis, mean_wish(mechanism, goal, data, room, j))
        x = add(x, scale(move_by(joints, q, j, way), axis))
    put_vector(data.positions, j, x)
    if kind == HINGE and joints["leader"][j] == j:
        axis = axis_of(joints, j, R)
        angle = best_angle(arms_to_wishes(mechanism, goal, data, room, j), axis)
        R = multiply(turn_about(axis, move_by(joints, q, j, angle)), R)
    elif kind == BALL and room.wishes[j, WISHED] > 0.0:
        turn = turn_to_wishes(mechanism, goal, data, room, j)
        R = turn_ball(joints, q, j, frame_of(joints, j, data.rotations), multiply(turn, R))
    put_quaternion(data.rotations, j, normalised(R))


def fit_free(mechanism, goal, data, room, j):
    """Move a free joint as one body to bring what is below nearest to its wishes (Horn 1987).

    The centre of the arms goes to the centre of their wishes, the rotation is the best about it: a
    joint that first went to its own wish and then turned about that would overshoot and oscillate.
    """
    joints, x = mechanism.joints, vector_at(data.positions, j)
    total, arm, way = mean_arm_and_wish(mechanism, goal, data, room, j)
    M = arms_to_wishes(mechanism, goal, data, room, j)
    M = add_outer(M, -total, way, arm)
    turn = best_rotation(M, room.eigen[0], room.eigen[1])
    shift, frame = subtract(way, rotate(turn, arm)), frame_of(joints, j, data.rotations)
    R = multiply(turn, quaternion_at(data.rotations, j))
    R = turn_ball(joints, data.q, j, frame, R)
    shift_free(joints, data.q, j, rotate(conjugate(frame), shift))
    put_vector(data.positions, j, add(x, shift))
    put_quaternion(data.rotations, j, normalised(R))


def mean_arm_and_wish(mechanism, goal, data, room, j):
    """Return the weight of what `arms_to_wishes` counts, and the mean of arms and of wishes."""
    total, arms, ways = 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for e in range(len(mechanism.effectors)):
        if mechanism.moves[j, e]:
            arm, way = arm_and_wish(mechanism, goal, data, e, j)
            arms, ways = (
                add(arms, scale(goal["weight"][e], arm)),
                add(ways, scale(goal["weight"][e], way)),
            )
            total += goal["weight"][e]
    for c in range(j + 1, len(room.wishes)):
        if mechanism.adjacent[j, c]:
            arm, way = joint_and_wish(mechanism, data, room, c, j)
            weight = room.wishes[c, WISHED]
            arms, ways = add(arms, scale(weight, arm)), add(ways, scale(weight, way))
            total += weight
    return total, scale(1.0 / total, arms), scale(1.0 / total, ways)


def turn_to_wishes(mechanism, goal, data, room, j):
    """Return the turn of joint j that brings what it sees nearest, the shortest if it is one."""
    found, arm, way = 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for e in range(len(mechanism.effectors)):
        if mechanism.adjacent[j, len(mechanism.joints) + e]:
            found += 2 if mechanism.effectors["oriented"][e] else 1
            arm, way = arm_and_wish(mechanism, goal, data, e, j)
    for c in range(j + 1, len(room.wishes)):
        if mechanism.adjacent[j, c] and room.wishes[c, WISHED] > 0.0:
            found += 1
            arm, way = joint_and_wish(mechanism, data, room, c, j)
    if found == 1:
        return between(arm, way)
    M = arms_to_wishes(mechanism, goal, data, room, j)
    return best_rotation(M, room.eigen[0], room.eigen[1])


def arms_to_wishes(mechanism, goal, data, room, j):
    """Return Wahba's M of the arms from joint j to what it sees below, and of the wishes.

    All effectors below count as well: a hinge often cannot meet its child's wish, and would else
    never make up for what that leaves.
    """
    M = NOTHING
    for e in range(len(mechanism.effectors)):
        if mechanism.moves[j, e]:
            arm, way = arm_and_wish(mechanism, goal, data, e, j)
            M = add_outer(M, goal["weight"][e], way, arm)
            if mechanism.effectors["oriented"][e]:
                R = rotation_below(mechanism, data, j, e)
                wanted = multiply(quaternion_at(goal["rotation"], e), conjugate(R))
                M = add_turn(M, goal["weight"][e] * rotation_weight(mechanism), wanted)
    for c in range(j + 1, len(room.wishes)):
        if mechanism.adjacent[j, c]:
            arm, way = joint_and_wish(mechanism, data, room, c, j)
            M = add_outer(M, room.wishes[c, WISHED], way, arm)
    return M


def mean_wish(mechanism, goal, data, room, j):
    """Return the weighted mean of the ways from joint j's children to their wishes."""
    total, mean = 0.0, (0.0, 0.0, 0.0)
    for e in range(len(mechanism.effectors)):
        if mechanism.effectors["joint"][e] == j:
            arm, way = arm_and_wish(mechanism, goal, data, e, j)
            mean = add(mean, scale(goal["weight"][e], subtract(way, arm)))
            total += goal["weight"][e]
    for c in range(j + 1, len(room.wishes)):
        if mechanism.joints["parent"][c] == j and room.wishes[c, WISHED] > 0.0:
            arm, way = joint_and_wish(mechanism, data, room, c, j)
            mean = add(mean, scale(room.wishes[c, WISHED], subtract(way, arm)))
            total += room.wishes[c, WISHED]
    return scale(1.0 / total, mean) if total > 0.0 else mean


def arm_and_wish(mechanism, goal, data, e, j):
    """Return where an effector is and should be, seen from joint j, in the world's axes [m]."""
    x = vector_at(mechanism.effectors["position"], e)
    arm = seen_from(mechanism.joints, data, j, mechanism.effectors["joint"][e], x)
    return arm, subtract(vector_at(goal["position"], e), vector_at(data.positions, j))


def joint_and_wish(mechanism, data, room, c, j):
    """Return where a joint below is and should be, seen from joint j, in the world's axes [m]."""
    x, _ = joint_transform(mechanism.joints, c, data.q)
    arm = seen_from(mechanism.joints, data, j, mechanism.joints["parent"][c], x)
    return arm, subtract(vector_at(room.wishes, c), vector_at(data.positions, j))


def seen_from(joints, data, j, k, x):
    """Return a point of the frame of joint k, below j or j itself, seen from j, in world axes."""
    while k != j:
        way, R = joint_transform(joints, k, data.q)
        x = add(way, rotate(R, x))
        k = joints["parent"][k]
    return rotate(quaternion_at(data.rotations, j), x)


def rotation_below(mechanism, data, j, e):
    """Return the rotation of an effector as the coordinates from joint j down have it."""
    R, k = quaternion_at(mechanism.effectors["rotation"], e), mechanism.effectors["joint"][e]
    while k != j:
        _, R_joint = joint_transform(mechanism.joints, k, data.q)
        R, k = multiply(R_joint, R), mechanism.joints["parent"][k]
    return multiply(quaternion_at(data.rotations, j), R)
