"""The errors of tasks and their derivatives by the velocity, as kernels.

A point p of a frame, with rotation R, has velocity v and angular velocity w; a point b of the
reference frame, with rotation B, has v_b and w_b. Rotations are quaternions, Q* is the inverse of
Q. The derivative has a row for each freedom, the rate of the residual by its unit.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..arguments import BoolArray, FloatArray, RecordArray
from ..articulation import BALL, FREE, FREEDOMS, Articulation
from ..backend.compiled import Kernel
from ..jacobians import ZERO, accumulate, fill_jacobian, joint_difference, motion, unit_vector
from ..quaternion import (
    IDENTITY,
    add,
    conjugate,
    cross,
    dot,
    load_quaternion,
    load_vector,
    logarithm,
    multiply,
    norm,
    rotate,
    scale,
    subtract,
)
from .linear_algebra import clear, store

# The kinds of tasks. Those of users are evaluated in Python.
FRAME, LOOK_AT, CENTRE_OF_MASS, POSTURE, COUPLING, OWN = range(6)
# Below this angle [rad] the series of the right Jacobian's last factor is exact to rounding.
SMALL_ANGLE = 1e-4
# The joints of tasks, in records by index; the last three may be None, in records -1.
JOINTS = "frame", "joint", "relative_to", "target_frame", "leader"
# What a frame without a target has in its place.
NEUTRAL = {"position": ZERO, "rotation": IDENTITY}
# A record of a task, for kernels. Fields have the names of the attributes in `tasks.py`.
TASK = np.dtype(
    [
        ("kind", np.int64),
        ("row", np.int64),  # where its residual begins
        ("size", np.int64),  # of its residual
        ("has_position", np.bool_),  # whether the position of a frame matters
        ("has_rotation", np.bool_),  # whether the rotation of a frame matters
        ("exact", np.bool_),
        *((name, np.int64) for name in JOINTS),
        *((name, np.float64) for name in ("weight", "zero", "leader_zero")),
        *((name, np.float64, 3) for name in ("position", "target", "point", "origin", "axis")),
        ("rotation", np.float64, 4),
    ],
    align=True,
)


class TaskArrays(NamedTuple):
    """The tasks of a model, for kernels; a task without numbers of a name has zeros."""

    records: RecordArray  # TASK, (task,)
    exact: BoolArray  # whether an entry of the residuals is of an exact task, (row,)
    factors: FloatArray  # of the residuals, (row,)
    masses: FloatArray  # (task, joint)
    centres: FloatArray  # (task, joint, 3)
    coordinates: FloatArray  # of postures, (task, coordinate)
    coefficients: FloatArray  # of couplings, (task, term)
    # spare arrays: Jacobians of p and of b, (freedom, 6); the mass at or below each joint and its
    # first moment about the origin of the world [kg m], (joint, 4)
    jacobian: FloatArray
    reference_jacobian: FloatArray
    below: FloatArray


class Residuals(NamedTuple):
    """The residuals of all tasks, times the roots of their weights."""

    q: FloatArray  # (coordinate,)
    r: FloatArray  # (row,)
    J: FloatArray  # the derivative of r, transposed, (freedom, row)
    errors: FloatArray  # the largest entry of each task's residual, without its weight, (task,)


def task_arrays(
    model: Articulation, tasks: Sequence[Any], kinds: list[int], factors: list[FloatArray]
) -> TaskArrays:
    """Return the arrays of tasks, given their kinds and the factors of their residuals."""
    count, n, freedoms, rows = len(tasks), model.joint_count, model.freedom_count, 0
    terms = max(len(getattr(task, "coefficients", ())) for task in tasks)
    total = sum(map(len, factors))
    arrays = TaskArrays(
        np.zeros(count, TASK), np.zeros(total, dtype=bool), np.zeros(total), np.zeros((count, n)),
        np.zeros((count, n, 3)), np.zeros((count, model.coordinate_count)),
        np.zeros((count, terms)), np.zeros((freedoms, 6)), np.zeros((freedoms, 6)),
        np.zeros((n, 4)),
    )  # fmt: skip
    for t, task in enumerate(tasks):
        record, size = arrays.records[t], len(factors[t])
        record["kind"], record["row"], record["size"] = kinds[t], rows, size
        record["weight"], record["exact"] = task.weight, task.exact
        arrays.exact[rows : rows + size] = task.exact
        arrays.factors[rows : rows + size] = factors[t]
        rows += size
        for name, attribute in vars(task).items() if kinds[t] != OWN else ():
            if name in JOINTS:
                is_world = attribute is None and name in JOINTS[2:]
                record[name] = -1 if is_world else model.index(attribute, name)
            elif name in NEUTRAL:
                record[f"has_{name}"] = attribute is not None
                record[name] = NEUTRAL[name] if attribute is None else attribute
            elif name == "coordinates":
                arrays.coordinates[t] = model.checked(name, attribute)
            elif name in ("masses", "centres", "coefficients"):
                getattr(arrays, name)[t, : len(attribute)] = attribute
            elif name in record.dtype.names:
                record[name] = attribute
    return arrays


def evaluate_tasks(state, evaluation):
    """Fill the evaluation of all tasks but those of users, at `state.data`."""
    records = state.tasks.records
    for k in range(len(evaluation.J)):
        clear(evaluation.J[k])
    for i in range(len(evaluation.q)):
        evaluation.q[i] = state.data.q[i]
    for t in range(len(records)):
        kind = records["kind"][t]
        if kind == FRAME:
            evaluate_frame(state, t, evaluation)
        elif kind == LOOK_AT:
            evaluate_look_at(state, t, evaluation)
        elif kind == CENTRE_OF_MASS:
            evaluate_centre_of_mass(state, t, evaluation)
        elif kind == POSTURE:
            evaluate_posture(state, t, evaluation)
        elif kind == COUPLING:
            evaluate_coupling(state, t, evaluation)
        if kind != OWN:
            weigh(state.tasks, t, evaluation)


def weigh(tasks, t, evaluation):
    """Multiply the rows of a task by their factors and the root of its weight; note its error."""
    row, size, r = tasks.records["row"][t], tasks.records["size"][t], evaluation.r
    root, largest = math.sqrt(tasks.records["weight"][t]), 0.0
    for i in range(row, row + size):
        r[i] *= tasks.factors[i]
        largest = max(largest, abs(r[i])) if r[i] == r[i] else math.inf
        r[i] *= root
        for k in range(len(evaluation.J)):
            evaluation.J[k, i] *= tasks.factors[i] * root
    evaluation.errors[t] = largest


def evaluate_frame(state, t, evaluation):
    """Fill Q* B* (p - b) - Q* x and log(Q* B* R); the target x, Q is in the reference frame.

    The rates are Q* B* (v - v_b - w_b x (p - b)) and J^-1(log) R* (w - w_b), J the right Jacobian.
    """
    records, row = state.tasks.records, state.tasks.records["row"][t]
    frame, base = state.tasks.jacobian, state.tasks.reference_jacobian
    p, R = place_point(state, records["frame"][t], load_vector(records["point"], t), frame)
    b, B = place_point(state, records["relative_to"][t], ZERO, base)
    inverse, offset = conjugate(load_quaternion(records["rotation"], t)), subtract(p, b)
    into = multiply(inverse, conjugate(B))
    if records["has_position"][t]:
        x = rotate(inverse, load_vector(records["position"], t))
        store(evaluation.r, row, subtract(rotate(into, offset), x))
        for k in range(len(frame)):
            v_base = add(load_vector(base, k), cross(load_vector(base, k, 3), offset))
            rate = rotate(into, subtract(load_vector(frame, k), v_base))
            store(evaluation.J[k], row, rate)
        row += 3
    if records["has_rotation"][t]:
        error = logarithm(multiply(into, R))
        store(evaluation.r, row, error)
        for k in range(len(frame)):
            w = rotate(conjugate(R), subtract(load_vector(frame, k, 3), load_vector(base, k, 3)))
            store(evaluation.J[k], row, inverse_right_jacobian(error, w))


def evaluate_look_at(state, t, evaluation):
    """Fill the axis a less the direction u = (b - p)/d to the target b.

    The rate is w x a - (1 - u u')(v_b - v)/d. A target at the eye has no direction: u = 0, d = 1.
    """
    records, row = state.tasks.records, state.tasks.records["row"][t]
    eye, base = state.tasks.jacobian, state.tasks.reference_jacobian
    p, R = place_point(state, records["frame"][t], load_vector(records["origin"], t), eye)
    target = load_vector(records["target"], t)
    b, _ = place_point(state, records["target_frame"][t], target, base)
    axis, offset = rotate(R, load_vector(records["axis"], t)), subtract(b, p)
    distance = norm(offset)
    if distance == 0.0:
        distance = 1.0
    direction = scale(1.0 / distance, offset)
    store(evaluation.r, row, subtract(axis, direction))
    for k in range(len(eye)):
        v = subtract(load_vector(base, k), load_vector(eye, k))
        across = scale(1.0 / distance, subtract(v, scale(dot(direction, v), direction)))
        store(evaluation.J[k], row, subtract(cross(load_vector(eye, k, 3), axis), across))


def evaluate_centre_of_mass(state, t, evaluation):
    """Fill the centre of mass less its target.

    A freedom moves the mass m at or below its joint, whose first moment about the joint is s: the
    rate is (w x s + m v) over the whole mass.
    """
    joints, tasks, row = state.mechanism.joints, state.tasks, state.tasks.records["row"][t]
    x, R, below = state.data.positions, state.data.rotations, state.tasks.below
    mass, moment = fill_masses(state, t)
    centre = scale(1.0 / mass, moment)
    store(evaluation.r, row, subtract(centre, load_vector(tasks.records["position"], t)))
    for j in range(len(joints)):
        m, s = below[j, 0], load_vector(below, j, 1)
        s = subtract(s, scale(m, load_vector(x, j)))
        for i in range(FREEDOMS[joints["kind"][j]]):
            w, v = motion(joints, j, i, R, 1.0)
            rate = scale(1.0 / mass, add(cross(w, s), scale(m, v)))
            accumulate(evaluation.J[joints["freedom"][j] + i], row, rate)


def fill_masses(state, t):
    """Fill the mass at or below each joint, and its first moment; return the sums over roots."""
    parents, masses, below = state.mechanism.joints["parent"], state.tasks.masses, state.tasks.below
    positions, rotations = state.data.positions, state.data.rotations
    mass, moment = 0.0, ZERO
    for j in range(len(parents)):
        arm = rotate(load_quaternion(rotations, j), load_vector(state.tasks.centres[t], j))
        below[j, 0] = masses[t, j]
        store(below[j], 1, scale(masses[t, j], add(load_vector(positions, j), arm)))
    for j in range(len(parents) - 1, -1, -1):
        if parents[j] >= 0:
            below[parents[j], 0] += below[j, 0]
            accumulate(below[parents[j]], 1, load_vector(below, j, 1))
        else:
            mass, moment = mass + below[j, 0], add(moment, load_vector(below, j, 1))
    return mass, moment


def evaluate_posture(state, t, evaluation):
    """Fill the velocity from the posture to the configuration, of rotations the rotation vector.

    The rate is the velocity, of rotations J^-1(rotation vector) times the angular velocity.
    """
    joints, row, J = state.mechanism.joints, state.tasks.records["row"][t], evaluation.J
    r = evaluation.r[row:]
    for k in range(len(J)):
        J[k, row + k] = 1.0
    for j in range(len(joints)):
        joint_difference(joints, j, state.data.q, state.tasks.coordinates[t], r)
        if joints["kind"][j] in (BALL, FREE):
            first = joints["freedom"][j] + FREEDOMS[joints["kind"][j]] - 3
            error = (r[first], r[first + 1], r[first + 2])
            for i in range(3):
                rate = inverse_right_jacobian(error, unit_vector(i, 1.0))
                store(J[first + i], row + first, rate)


def evaluate_coupling(state, t, evaluation):
    """Fill q - q0 - p(leader - leader0), p the polynomial by Horner's rule."""
    joints, tasks, q = state.mechanism.joints, state.tasks, state.data.q
    records, row, displacement = tasks.records, tasks.records["row"][t], 0.0
    joint, leader = records["joint"][t], records["leader"][t]
    if leader >= 0:
        displacement = coordinate_of(joints, leader, q) - records["leader_zero"][t]
    polynomial, slope = 0.0, 0.0
    for k in range(tasks.coefficients.shape[1] - 1, -1, -1):
        slope = slope * displacement + polynomial
        polynomial = polynomial * displacement + tasks.coefficients[t, k]
    evaluation.r[row] = coordinate_of(joints, joint, q) - records["zero"][t] - polynomial
    evaluation.J[joints["freedom"][joint], row] += joints["multiplier"][joint]
    if leader >= 0:
        evaluation.J[joints["freedom"][leader], row] -= slope * joints["multiplier"][leader]


def coordinate_of(joints, j, q):
    """Return the coordinate of a hinge or slide, a mimic joint's too [rad or m]."""
    return joints["multiplier"][j] * q[joints["coordinate"][j]] + joints["shift"][j]


def place_point(state, frame, point, J):
    """Fill the Jacobian of a point of a frame; return its position [m] and the frame's rotation."""
    for k in range(len(J)):
        clear(J[k])
    if frame < 0:
        return point, IDENTITY
    data, R = state.data, load_quaternion(state.data.rotations, frame)
    arm = rotate(R, point)
    fill_jacobian(state.mechanism.joints, frame, data.positions, data.rotations, J.T)
    for k in range(len(J)):
        accumulate(J[k], 0, cross(load_vector(J, k, 3), arm))
    return add(load_vector(data.positions, frame), arm), R


def inverse_right_jacobian(v, w):
    """Return J^-1(v) w, the derivative of log(exp(v) exp(t w)) by t at 0: Sola et al. 2018."""
    angle = norm(v)
    factor = 1.0 / 12.0 + angle * angle / 720.0
    if angle > SMALL_ANGLE:
        factor = (1.0 - 0.5 * angle / math.tan(0.5 * angle)) / (angle * angle)
    across = cross(v, w)
    return add(add(w, scale(0.5, across)), scale(factor, cross(v, across)))


evaluation_kernel = Kernel(evaluate_tasks, label="tasks")
