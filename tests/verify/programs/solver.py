"""A right solver of the lab in numpy with planted faults: python3 solver.py --fault NAME.

The step is one linearised step of implicit Euler from x_n, (M + h^2 K) (x' - x_n) = h M v + h^2 f,
with K the exact Hessian of the springs and the dampers' forces explicit; pins are eliminated.
"""

import json
import math
import os
import sys
from itertools import pairwise

import numpy as np
from numpy.linalg import norm

FAULT = sys.argv[2] if sys.argv[1:2] == ["--fault"] else ""
NO_ROTATION = np.array([1.0, 0.0, 0.0, 0.0])


def planted(name):
    return name == FAULT


def product(p, q):
    a, b, u, v = p[0], q[0], p[1:], q[1:]
    return np.array([a * b - u @ v, *(a * v + b * u + np.cross(u, v))])


def conjugate(q):
    return q * [1.0, -1.0, -1.0, -1.0]


def unit(a):
    return a / norm(a)


def rotate(q, v):
    return product(product(q, np.array([0.0, *v])), conjugate(q))[1:]


def perpendicular(a):
    return unit(np.cross(a, np.eye(3)[np.argmin(np.abs(a))]))


def between(a, b):
    """The smallest rotation from the direction of a to that of b."""
    if not a.any() or not b.any():
        return NO_ROTATION
    a, b = unit(a), unit(b)
    half = a + b
    if norm(half) < 1e-14:
        return np.array([0.0, *perpendicular(a)])
    half = b if planted("ccd_angle_not_halved") else unit(half)
    return unit(np.array([a @ half, *np.cross(a, half)]))


def kinematics(parents, offsets, local_rotations):
    positions, rotations = np.array(offsets), np.array(local_rotations)
    for j, parent in enumerate(parents):
        q = np.roll(rotations[j], 1) if planted("fk_w_last") else rotations[j]
        if parent >= 0:
            above = rotations[parent]
            q = product(q, above) if planted("fk_child_first") else product(above, q)
            by = q if planted("fk_own_rotation") else above
            positions[j] = positions[parent] + rotate(by, offsets[j])
        rotations[j] = q
    return positions, rotations


class Arm:
    def __init__(self, parents, offsets, local_rotations):
        self.parents, self.offsets = parents, offsets
        self.local = np.array(local_rotations)
        self.forward()

    def forward(self):
        self.x, self.r = kinematics(self.parents, self.offsets, self.local)

    def above(self, joint):
        return NO_ROTATION if self.parents[joint] < 0 else self.r[self.parents[joint]]

    def apply(self, joint, world):
        """Rotate a joint and all below it about global axes."""
        parent = self.above(joint)
        turned = product(product(conjugate(parent), world), parent)
        self.local[joint] = unit(product(turned, self.local[joint]))
        self.forward()

    def chain(self, effector):
        """Joints from the effector up to the root."""
        joints = [effector]
        while self.parents[joints[-1]] >= 0:
            joints.append(self.parents[joints[-1]])
        return joints

    def bend(self, effector, target):
        """Leave a line with the target, on which every rotation is none or by half a circle."""
        joints = self.chain(effector)
        root, reach = self.x[joints[-1]], norm(self.offsets[joints[:-1]], axis=1).sum()
        to = target - root
        line = to if to.any() else self.x[effector] - root
        if not line.any() or norm(to) >= reach:
            return
        if norm(np.cross(unit(line), self.x[joints] - root), axis=1).max() > 1e-12 * reach:
            return
        bent = np.array([math.cos(0.1), *(math.sin(0.1) * perpendicular(line))])
        for joint in joints[:0:-1]:
            self.apply(joint, bent)


def ccd_joint(arm, joint, target, tip):
    d = between(tip - arm.x[joint], target - arm.x[joint])
    above, q = arm.above(joint), arm.local[joint]
    if planted("ccd_world_left"):
        arm.local[joint] = unit(product(d, q))
    elif planted("ccd_world_right"):
        arm.local[joint] = unit(product(q, d))
    elif planted("ccd_conjugated"):
        arm.local[joint] = unit(product(product(product(above, d), conjugate(above)), q))
    else:
        arm.apply(joint, d)
    arm.forward()


def ccd(arm, target, effector, tolerance, most):
    joints = arm.chain(effector)[1:]
    if planted("ccd_root_to_tip"):
        joints.reverse()
    for iterations in range(most + 1):
        left = norm(arm.x[effector] - target)
        arrived = (left**2 if planted("ccd_tolerance") else left) <= tolerance
        if arrived or iterations == most:
            return left, iterations, arrived
        tip = arm.x[effector].copy()
        for joint in joints:
            ccd_joint(arm, joint, target, tip if planted("ccd_stale") else arm.x[effector])
    return None


def toward(start, end, length):
    apart = end - start
    return start + (length * unit(apart) if apart.any() else np.array([0.0, 0.0, length]))


def fabrik_sweep(p, lengths, target, root):
    p[-1] = target
    for i in range(len(p) - 2, -1, -1):
        p[i] = toward(p[i + 1], p[i], lengths[i + 1])
    if not planted("fabrik_root"):
        p[0] = root
    for i in range(1, len(p)):
        p[i] = toward(p[i - 1], p[i], lengths[i])


def fabrik(arm, target, effector, tolerance, most):
    joints = arm.chain(effector)[::-1]
    p, lengths, iterations = arm.x[joints], norm(arm.offsets[joints], axis=1), 0
    root = p[0].copy()
    while norm(p[-1] - target) > tolerance and iterations < most and len(p) > 1:
        fabrik_sweep(p, lengths, target, root)
        iterations += 1
    for i, (joint, child) in enumerate(pairwise(joints)):
        wanted = p[i + 1] - p[i]
        if planted("fabrik_global_rotations"):
            arm.local[joint] = between(arm.offsets[child], wanted)
        else:
            arm.apply(joint, between(arm.x[child] - arm.x[joint], wanted))
    arm.x[joints] = p
    left = norm(p[-1] - target)
    return left, iterations, left <= tolerance


def solve(arm, method, target, effector, tolerance, max_iterations):
    if max_iterations > 1:
        arm.bend(effector, target)
    solver = fabrik if method == "fabrik" else ccd
    return solver(arm, target, effector, tolerance, max_iterations)


def forward_kinematics(parents, offsets, local_rotations):
    positions, rotations = kinematics(parents, offsets, local_rotations)
    return {"positions": positions, "rotations": rotations}


def inverse_kinematics(parents, offsets, local_rotations, target, method="", **limits):
    arm = Arm(parents, offsets, local_rotations)
    left, iterations, arrived = solve(arm, method, target, **limits)
    told = {"residual": float(left), "iterations": iterations, "converged": bool(arrived)}
    return {"local_rotations": arm.local, "positions": arm.x} | told


def track(parents, offsets, local_rotations, curve, method="", **limits):
    arm, frames, positions = Arm(parents, offsets, local_rotations), [], []
    for target in curve:
        solve(arm, method, target, **limits)
        frames.append(arm.local.copy())
        positions.append(arm.x)
        arm.forward()
    return {"local_rotations": np.array(frames), "positions": np.array(positions)}


def resample(curve, closed, count=None, spacing=None, **_):
    is_closed = closed and not planted("resample_left_open")
    points = np.vstack([curve, curve[:1]]) if is_closed else curve
    s = np.append(0.0, np.cumsum(norm(np.diff(points, axis=0), axis=1)))
    if count is None:
        count = math.ceil(s[-1] / spacing - 1e-12) + (not closed)
    at = s[-1] * np.arange(count) / max(1, count if closed else count - 1)
    if planted("resample_nearest"):
        return {"points": points[np.abs(at[:, None] - s).argmin(axis=1)]}
    return {"points": np.stack([np.interp(at, s, axis) for axis in points.T], axis=1)}


class System:
    def __init__(self, masses, springs, gravity, positions, velocities, pinned=(), **springs_are):
        self.masses, self.gravity, self.x, self.v = masses, gravity, positions, velocities
        self.i, self.j = springs.astype(int).reshape(-1, 2).T
        self.rest, self.k, self.c = (
            springs_are[name] for name in ("rest_lengths", "stiffnesses", "dampings")
        )
        self.pinned = np.array(pinned, dtype=int)

    def directions(self):
        """Lengths and unit vectors of the springs; zero where the ends coincide."""
        apart = self.x[self.i] - self.x[self.j]
        length = norm(apart, axis=1)
        return length, apart / np.where(length > 0.0, length, 1.0)[:, None]

    def spring_forces(self, damping=1.0, one_sided=False):
        length, u = self.directions()
        rate = np.vecdot(self.v[self.i] - self.v[self.j], u)
        pull = (self.k * (length - self.rest) + damping * self.c * rate)[:, None] * u
        f = np.zeros_like(self.x)
        np.subtract.at(f, self.i, pull)
        if not one_sided:
            np.add.at(f, self.j, pull)
        return f

    def blocks(self):
        """The 3 x 3 stiffness of each spring."""
        length, u = self.directions()
        geometric = {"step_geometric_dropped": 0.0, "step_geometric_sign": -1.0}.get(FAULT, 1.0)
        long = length > 0.0
        across = geometric * self.k * (1.0 - self.rest / np.where(long, length, 1.0)) * long
        along = np.ones_like(self.k) if planted("step_matrix_without_k") else self.k
        lines = u[:, :, None] * u[:, None, :]
        return along[:, None, None] * lines + across[:, None, None] * (np.eye(3) - lines)


def mass_spring_forces(**inputs):
    system = System(**inputs)
    damping = 2.0 if planted("forces_damping_twice") else 1.0
    f = system.spring_forces(damping, planted("forces_one_end"))
    return {"forces": f + system.masses[:, None] * system.gravity}


def energy(**inputs):
    system = System(**inputs)
    share = 1.0 if planted("energy_kinetic") else 0.5
    kinetic = float(share * system.masses @ np.vecdot(system.v, system.v))
    gravitational = float(-system.masses @ system.x @ system.gravity)
    elastic = float(0.5 * system.k @ (system.directions()[0] - system.rest) ** 2)
    potential = elastic + gravitational
    parts = {"kinetic": kinetic, "elastic": elastic, "gravitational": gravitational}
    return {"total": kinetic + potential, "potential": potential} | parts


def matrix(system, h):
    """M + h^2 K of all particles."""
    A = np.zeros((len(system.x), 3, len(system.x), 3))
    change = (-h * h if planted("step_matrix_sign") else h * h) * system.blocks()
    off = -2.0 if planted("step_off_diagonals_doubled") else -1.0
    for i, j, block in zip(system.i, system.j, change, strict=True):
        A[i, :, i] += block
        A[j, :, j] += block
        A[i, :, j] += off * block
        A[j, :, i] += off * block
    size = 3 * len(system.x)
    return A.reshape(size, size) + np.diag(np.repeat(system.masses, 3))


def right_side(system, h):
    """h M v + h^2 f for each particle."""
    damping = {"step_damping_sign": -1.0, "step_damping_absent": 0.0}.get(FAULT, 1.0)
    masses = system.masses[:, None]
    weight = (1.0 if planted("step_gravity_mass") else masses) * system.gravity
    if planted("step_gravity_doubled"):
        weight = 2.0 * weight
    return h * masses * system.v + h * h * (system.spring_forces(damping) + weight)


def one_step(system, h):
    pins = system.pinned
    system.v = system.v.copy()
    system.v[pins] = 0.0
    free = np.ones((len(system.x), 3), dtype=bool)
    free[pins] = planted("step_pins_overwritten") or planted("step_pins_springs")
    A, b, rows = matrix(system, h), right_side(system, h), free.ravel()
    if planted("step_pins_springs"):
        held = (3 * pins[:, None] + np.arange(3)).ravel()
        A[held, held] += h * h * 5e5
    x = system.x.copy()
    x[free] += np.linalg.solve(A[np.ix_(rows, rows)], b[free])
    if planted("step_pins_overwritten"):
        x[pins] = system.x[pins]
    velocities = (x - system.x) / h
    if planted("step_velocity_explicit"):
        velocities = right_side(system, h) / (h * system.masses[:, None])
        velocities[pins] = 0.0
    system.x, system.v = x, velocities


def mass_spring_step(h, **inputs):
    system = System(**inputs)
    one_step(system, h)
    return {"positions": system.x, "velocities": system.v}


def mass_spring_motion(h, steps, **inputs):
    system = System(**inputs)
    states = [(system.x, system.v)]
    for _ in range(steps):
        one_step(system, h)
        states.append((system.x, system.v))
    positions, velocities = map(np.array, zip(*states, strict=True))
    frames = slice(0, steps) if planted("motion_frame_early") else slice(1, None)
    return {"positions": positions[frames], "velocities": velocities[frames]}


KINEMATICS = (forward_kinematics, inverse_kinematics, track, resample)
MASS_SPRING = (mass_spring_forces, energy, mass_spring_step, mass_spring_motion)
TASKS = {task.__name__: task for task in KINEMATICS + MASS_SPRING}
GREETING = {"protocol": 1, "name": "lab in Python", "language": "Python", "tasks": list(TASKS)}
STEP = {"method": "linearised", "start": "x_n", "iterations": 1, "substeps": 1}
STEP |= {"damper": "explicit", "pins": "eliminated", "velocity": "displacement"}
GREETING |= {"methods": ["ccd", "fabrik"], "step": STEP}
INDICES = ("parents", "pinned", "springs")


def read(name, given):
    """An array of a list; indices stay integers."""
    if not isinstance(given, list):
        return given
    return np.array(given, dtype=int if name in INDICES else float)


def plain(given):
    """None for what JSON has no number for."""
    if isinstance(given, np.ndarray | list):
        return [plain(one) for one in np.asarray(given).tolist()] if len(given) else []
    return None if isinstance(given, float) and not math.isfinite(given) else given


def answer(task, **inputs):
    if task == "greeting":
        return GREETING
    try:
        outputs = TASKS[task](**{name: read(name, given) for name, given in inputs.items()})
        return {name: plain(given) for name, given in outputs.items()}
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        return {"error": str(error)}


if __name__ == "__main__":
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    for line in sys.stdin:
        request = json.loads(line)
        reply = {"id": request.pop("id"), **answer(**request)}
        print(json.dumps(reply), file=answers, flush=True)
