"""Forward and backward reaching (Aristidou & Lasenby 2011, Algorithm 1).

On mechanisms the way forward turns joints instead of moving points, each to bring its children
nearest to where they were wished backward: a hinge about its axis, a ball within its limits, one
rotation for all children of a branch, a free joint as one body. What cannot be had remains as the
residual.
"""

from ..articulation import BALL, FREE, HINGE, KIND, LEADER, PARENT, SLIDE, joint_transform
from ..quaternion import (
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
    scale,
    store_quaternion,
    store_vector,
    subtract,
    turn_about,
)
from .chain import in_hole, out_of_reach, root_distance
from .joint_updates import move_by, shift_free, turn_ball
from .mechanism import (
    ARM,
    HANGS,
    ORIENTED,
    POSITION,
    ROTATION,
    TURN,
    WEIGHT,
    axis_of,
    frame_of,
    moves,
    place,
    sees,
    sees_tip,
    turn_weight,
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
    store_vector(chain.positions, len(chain.lengths), target)
    for k in range(len(chain.lengths) - 1, -1, -1):
        after = load_vector(chain.positions, k + 1)
        pulled = place_towards(after, load_vector(chain.positions, k), chain.lengths[k])
        store_vector(chain.positions, k, pulled)


def reach_forward(chain):
    """Put the root back and pull the joints after it, down to the effector."""
    store_vector(chain.positions, 0, load_vector(chain.offsets, 0))
    for k in range(len(chain.lengths)):
        before = load_vector(chain.positions, k)
        pulled = place_towards(before, load_vector(chain.positions, k + 1), chain.lengths[k])
        store_vector(chain.positions, k + 1, pulled)


def lay_on_line(chain, target, others):
    """Lay the longest link towards the target and the others towards it (1) or back (-1).

    Beyond reach all point at the target; inside the hole that the longest link leaves all others
    fold back, and the effector comes to rest on the rim.
    """
    root = load_vector(chain.positions, 0)
    towards = subtract(place_towards(root, target, 1.0), root)
    found = False
    for k in range(len(chain.lengths)):
        longest = chain.lengths[k] == chain.longest and not found
        found |= longest
        step = scale(chain.lengths[k] if longest else others * chain.lengths[k], towards)
        store_vector(chain.positions, k + 1, add(load_vector(chain.positions, k), step))


def place_towards(start, end, length):
    """Return the point at a distance from start in the direction of end, of x if they coincide."""
    way = subtract(end, start)
    distance = norm(way)
    if distance == 0.0:
        return add(start, (length, 0.0, 0.0))
    return add(start, scale(length / distance, way))


def fabrik_update(mechanism, goal, posture, room):
    """Reach backward for where each joint should be, then forward, turning joints towards that."""
    wish(mechanism, goal, posture, room)
    joints = mechanism.joints
    for j in range(len(joints.integers)):
        put_frame(joints, posture, room, j)
        move_towards_wishes(mechanism, goal, posture, room, j)
    place(mechanism, posture)


def wish(mechanism, goal, posture, room):
    """Fill where each joint would be if the effectors were on their targets, the lengths kept.

    A joint with several children takes the weighted mean of what each would pull it to.
    """
    wishes = room.wishes
    for j in range(len(wishes)):
        store_quaternion(wishes, j, (0.0, 0.0, 0.0, 0.0))
    for e in range(len(mechanism.effectors)):
        j = mechanism.effectors[e, HANGS]
        if j >= 0:
            add_wish(room, j, goal[e, WEIGHT], wish_of_effector(mechanism, goal, posture, e, j))
    for j in range(len(wishes) - 1, -1, -1):
        if wishes[j, WISHED] > 0.0:
            store_vector(wishes, j, scale(1.0 / wishes[j, WISHED], load_vector(wishes, j)))
        parent = mechanism.joints.integers[j, PARENT]
        if parent >= 0 and wishes[j, WISHED] > 0.0:
            x, x_parent = load_vector(posture.positions, j), load_vector(posture.positions, parent)
            length = norm(subtract(x, x_parent))
            pulled = place_towards(load_vector(wishes, j), x_parent, length)
            add_wish(room, parent, wishes[j, WISHED], pulled)


def wish_of_effector(mechanism, goal, posture, e, j):
    """Return where the joint that an effector hangs on would be with the effector on its target."""
    target, arm = load_vector(goal, e, POSITION), load_vector(mechanism.tips, e, ARM)
    if mechanism.effectors[e, ORIENTED]:
        return subtract(target, rotate(wished_rotation(mechanism, goal, e), arm))
    return place_towards(target, load_vector(posture.positions, j), norm(arm))


def wished_rotation(mechanism, goal, e):
    """Return the rotation that the joint needs for its effector to have the target's."""
    frame = conjugate(load_quaternion(mechanism.tips, e, TURN))
    return multiply(load_quaternion(goal, e, ROTATION), frame)


def add_wish(room, j, weight, position):
    """Add a weighted position to what is wished for a joint."""
    store_vector(room.wishes, j, add(load_vector(room.wishes, j), scale(weight, position)))
    room.wishes[j, WISHED] += weight


def put_frame(joints, posture, room, j):
    """Put a joint where its parent now has it, moved by its coordinates; a ball keeps its turn."""
    x, R = joint_transform(joints, j, posture.q)
    parent = joints.integers[j, PARENT]
    if parent >= 0:
        R_parent = load_quaternion(posture.rotations, parent)
        x = add(load_vector(posture.positions, parent), rotate(R_parent, x))
        R = multiply(R_parent, R)
    store_vector(posture.positions, j, x)
    if joints.integers[j, KIND] != BALL or room.wishes[j, WISHED] == 0.0:
        store_quaternion(posture.rotations, j, R)


def move_towards_wishes(mechanism, goal, posture, room, j):
    """Move one joint, its parent in place, to bring its children nearest to their wishes."""
    joints, q, kind = mechanism.joints, posture.q, mechanism.joints.integers[j, KIND]
    R, x = load_quaternion(posture.rotations, j), load_vector(posture.positions, j)
    if kind == FREE and room.wishes[j, WISHED] > 0.0:
        fit_free(mechanism, goal, posture, room, j)
        return
    if kind == SLIDE and joints.integers[j, LEADER] == j:
        axis = axis_of(joints, j, R)
        way = dot(axis, mean_wish(mechanism, goal, posture, room, j))
        x = add(x, scale(move_by(joints, q, j, way), axis))
    store_vector(posture.positions, j, x)
    if kind == HINGE and joints.integers[j, LEADER] == j:
        axis = axis_of(joints, j, R)
        angle = best_angle(arms_to_wishes(mechanism, goal, posture, room, j), axis)
        R = multiply(turn_about(axis, move_by(joints, q, j, angle)), R)
    elif kind == BALL and room.wishes[j, WISHED] > 0.0:
        turn = turn_to_wishes(mechanism, goal, posture, room, j)
        R = turn_ball(joints, q, j, frame_of(joints, j, posture), multiply(turn, R))
    store_quaternion(posture.rotations, j, normalised(R))


def fit_free(mechanism, goal, posture, room, j):
    """Move a free joint as one body to bring what is below nearest to its wishes (Horn 1987).

    The centre of the arms goes to the centre of their wishes, the rotation is the best about it: a
    joint that first went to its own wish and then turned about that would overshoot and oscillate.
    """
    joints, x = mechanism.joints, load_vector(posture.positions, j)
    total, arm, way = mean_arm_and_wish(mechanism, goal, posture, room, j)
    M = arms_to_wishes(mechanism, goal, posture, room, j)
    M = add_outer(M, -total, way, arm)
    turn = best_rotation(M, room.eigen[0], room.eigen[1])
    shift, frame = subtract(way, rotate(turn, arm)), frame_of(joints, j, posture)
    R = multiply(turn, load_quaternion(posture.rotations, j))
    R = turn_ball(joints, posture.q, j, frame, R)
    shift_free(joints, posture.q, j, rotate(conjugate(frame), shift))
    store_vector(posture.positions, j, add(x, shift))
    store_quaternion(posture.rotations, j, normalised(R))


def mean_arm_and_wish(mechanism, goal, posture, room, j):
    """Return the weight of what `arms_to_wishes` counts, and the mean of arms and of wishes."""
    total, arms, ways = 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for e in range(len(mechanism.effectors)):
        if moves(mechanism, j, e):
            arm, way = arm_and_wish(mechanism, goal, posture, e, j)
            arms, ways = (
                add(arms, scale(goal[e, WEIGHT], arm)),
                add(ways, scale(goal[e, WEIGHT], way)),
            )
            total += goal[e, WEIGHT]
    for c in range(j + 1, len(room.wishes)):
        if sees(mechanism, j, c):
            arm, way = joint_and_wish(mechanism, posture, room, c, j)
            weight = room.wishes[c, WISHED]
            arms, ways = add(arms, scale(weight, arm)), add(ways, scale(weight, way))
            total += weight
    return total, scale(1.0 / total, arms), scale(1.0 / total, ways)


def turn_to_wishes(mechanism, goal, posture, room, j):
    """Return the turn of joint j that brings what it sees nearest, the shortest if it is one."""
    found, arm, way = 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for e in range(len(mechanism.effectors)):
        if sees_tip(mechanism, j, e):
            found += 2 if mechanism.effectors[e, ORIENTED] else 1
            arm, way = arm_and_wish(mechanism, goal, posture, e, j)
    for c in range(j + 1, len(room.wishes)):
        if sees(mechanism, j, c) and room.wishes[c, WISHED] > 0.0:
            found += 1
            arm, way = joint_and_wish(mechanism, posture, room, c, j)
    if found == 1:
        return between(arm, way)
    M = arms_to_wishes(mechanism, goal, posture, room, j)
    return best_rotation(M, room.eigen[0], room.eigen[1])


def arms_to_wishes(mechanism, goal, posture, room, j):
    """Return Wahba's M of the arms from joint j to what it sees below, and of the wishes.

    All effectors below count as well: a hinge often cannot meet its child's wish, and would else
    never make up for what that leaves.
    """
    M = NOTHING
    for e in range(len(mechanism.effectors)):
        if moves(mechanism, j, e):
            arm, way = arm_and_wish(mechanism, goal, posture, e, j)
            M = add_outer(M, goal[e, WEIGHT], way, arm)
            if mechanism.effectors[e, ORIENTED]:
                R = rotation_below(mechanism, posture, j, e)
                wanted = multiply(load_quaternion(goal, e, ROTATION), conjugate(R))
                M = add_turn(M, goal[e, WEIGHT] * turn_weight(mechanism), wanted)
    for c in range(j + 1, len(room.wishes)):
        if sees(mechanism, j, c):
            arm, way = joint_and_wish(mechanism, posture, room, c, j)
            M = add_outer(M, room.wishes[c, WISHED], way, arm)
    return M


def mean_wish(mechanism, goal, posture, room, j):
    """Return the weighted mean of the ways from joint j's children to their wishes."""
    total, mean = 0.0, (0.0, 0.0, 0.0)
    for e in range(len(mechanism.effectors)):
        if mechanism.effectors[e, HANGS] == j:
            arm, way = arm_and_wish(mechanism, goal, posture, e, j)
            mean = add(mean, scale(goal[e, WEIGHT], subtract(way, arm)))
            total += goal[e, WEIGHT]
    for c in range(j + 1, len(room.wishes)):
        if mechanism.joints.integers[c, PARENT] == j and room.wishes[c, WISHED] > 0.0:
            arm, way = joint_and_wish(mechanism, posture, room, c, j)
            mean = add(mean, scale(room.wishes[c, WISHED], subtract(way, arm)))
            total += room.wishes[c, WISHED]
    return scale(1.0 / total, mean) if total > 0.0 else mean


def arm_and_wish(mechanism, goal, posture, e, j):
    """Return where an effector is and should be, seen from joint j, in the world's axes [m]."""
    x = load_vector(mechanism.tips, e, ARM)
    arm = seen_from(mechanism.joints, posture, j, mechanism.effectors[e, HANGS], x)
    return arm, subtract(load_vector(goal, e, POSITION), load_vector(posture.positions, j))


def joint_and_wish(mechanism, posture, room, c, j):
    """Return where a joint below is and should be, seen from joint j, in the world's axes [m]."""
    x, _ = joint_transform(mechanism.joints, c, posture.q)
    arm = seen_from(mechanism.joints, posture, j, mechanism.joints.integers[c, PARENT], x)
    return arm, subtract(load_vector(room.wishes, c), load_vector(posture.positions, j))


def seen_from(joints, posture, j, k, x):
    """Return a point of the frame of joint k, below j or j itself, seen from j, in world axes."""
    while k != j:
        way, R = joint_transform(joints, k, posture.q)
        x = add(way, rotate(R, x))
        k = joints.integers[k, PARENT]
    return rotate(load_quaternion(posture.rotations, j), x)


def rotation_below(mechanism, posture, j, e):
    """Return the rotation of an effector as the coordinates from joint j down have it."""
    R, k = load_quaternion(mechanism.tips, e, TURN), mechanism.effectors[e, HANGS]
    while k != j:
        _, R_joint = joint_transform(mechanism.joints, k, posture.q)
        R, k = multiply(R_joint, R), mechanism.joints.integers[k, PARENT]
    return multiply(load_quaternion(posture.rotations, j), R)
