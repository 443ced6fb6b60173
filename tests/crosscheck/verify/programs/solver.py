"""A right solver of the lab in plain Python with planted faults: python3 solver.py --fault NAME.

The step is one linearised step of implicit Euler from x_n, (M + h^2 K) (x' - x_n) = h M v + h^2 f,
with K the exact Hessian of the springs and the dampers' forces explicit; pins are eliminated.
"""

import json
import math
import os
import sys
from itertools import pairwise

FAULT = sys.argv[2] if sys.argv[1:2] == ["--fault"] else ""
NO_ROTATION = [1.0, 0.0, 0.0, 0.0]


def planted(name):
    return name == FAULT


def add(a, b):
    return [p + q for p, q in zip(a, b, strict=True)]


def sub(a, b):
    return [p - q for p, q in zip(a, b, strict=True)]


def times(s, a):
    return [s * p for p in a]


def dot(a, b):
    return math.fsum(p * q for p, q in zip(a, b, strict=True))


def norm(a):
    return math.sqrt(dot(a, a))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def product(p, q):
    (a, *u), (b, *v) = p, q
    return [a * b - dot(u, v), *add(add(times(a, v), times(b, u)), cross(u, v))]


def conjugate(q):
    return [q[0], -q[1], -q[2], -q[3]]


def unit(a):
    return times(1.0 / norm(a), a)


def rotate(q, v):
    return product(product(q, [0.0, *v]), conjugate(q))[1:]


def perpendicular(a):
    axis = [0.0, 0.0, 0.0]
    axis[min(range(3), key=lambda i: abs(a[i]))] = 1.0
    return unit(cross(a, axis))


def between(a, b):
    """The smallest rotation from the direction of a to that of b."""
    if norm(a) == 0.0 or norm(b) == 0.0:
        return NO_ROTATION
    a, b = unit(a), unit(b)
    half = add(a, b)
    if norm(half) < 1e-14:
        return [0.0, *perpendicular(a)]
    half = b if planted("ccd_angle_not_halved") else unit(half)
    return unit([dot(a, half), *cross(a, half)])


def as_read(q):
    return [q[3], q[0], q[1], q[2]] if planted("fk_w_last") else q


def kinematics(parents, offsets, local_rotations):
    positions, rotations = [], []
    for parent, offset, q in zip(parents, offsets, map(as_read, local_rotations), strict=True):
        if parent < 0:
            positions.append(offset)
            rotations.append(q)
            continue
        above = rotations[parent]
        rotations.append(product(q, above) if planted("fk_child_first") else product(above, q))
        by = rotations[-1] if planted("fk_own_rotation") else above
        positions.append(add(positions[parent], rotate(by, offset)))
    return positions, rotations


class Arm:
    def __init__(self, parents, offsets, local_rotations):
        self.parents, self.offsets = parents, offsets
        self.local = [list(q) for q in local_rotations]
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

    def reach(self, effector):
        return sum(norm(self.offsets[joint]) for joint in self.chain(effector)[:-1])

    def bend(self, effector, target):
        """Leave a line with the target, on which every rotation is none or by half a circle."""
        joints = self.chain(effector)
        root, reach = self.x[joints[-1]], self.reach(effector)
        to = sub(target, root)
        line = to if norm(to) > 0.0 else sub(self.x[effector], root)
        if norm(line) == 0.0 or norm(to) >= reach:
            return
        if max(norm(cross(unit(line), sub(self.x[j], root))) for j in joints) > 1e-12 * reach:
            return
        axis = times(math.sin(0.1), perpendicular(line))
        for joint in joints[:0:-1]:
            self.apply(joint, [math.cos(0.1), *axis])


def ccd_joint(arm, joint, effector, target, tip):
    d = between(sub(tip, arm.x[joint]), sub(target, arm.x[joint]))
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
    if most > 1:
        arm.bend(effector, target)
    joints = arm.chain(effector)[1:]
    if planted("ccd_root_to_tip"):
        joints.reverse()
    for iterations in range(most + 1):
        left = norm(sub(arm.x[effector], target))
        arrived = (left**2 if planted("ccd_tolerance") else left) <= tolerance
        if arrived or iterations == most:
            return left, iterations, arrived
        tip = arm.x[effector]
        for joint in joints:
            ccd_joint(
                arm, joint, effector, target, tip if planted("ccd_stale") else arm.x[effector]
            )
    return None


def toward(start, end, length):
    apart = sub(end, start)
    size = norm(apart)
    return add(start, times(length / size, apart) if size > 0.0 else [0.0, 0.0, length])


def fabrik_sweep(p, lengths, target, root):
    p[-1] = target
    for i in range(len(p) - 2, -1, -1):
        p[i] = toward(p[i + 1], p[i], lengths[i + 1])
    if not planted("fabrik_root"):
        p[0] = root
    for i in range(1, len(p)):
        p[i] = toward(p[i - 1], p[i], lengths[i])


def fabrik(arm, target, effector, tolerance, most):
    if most > 1:
        arm.bend(effector, target)
    joints = arm.chain(effector)[::-1]
    p = [arm.x[joint] for joint in joints]
    lengths, root, iterations = [norm(arm.offsets[joint]) for joint in joints], p[0], 0
    while norm(sub(p[-1], target)) > tolerance and iterations < most and len(p) > 1:
        fabrik_sweep(p, lengths, target, root)
        iterations += 1
    for i, (joint, child) in enumerate(pairwise(joints)):
        wanted = sub(p[i + 1], p[i])
        if planted("fabrik_global_rotations"):
            arm.local[joint] = between(arm.offsets[child], wanted)
        else:
            arm.apply(joint, between(sub(arm.x[child], arm.x[joint]), wanted))
    for joint, position in zip(joints, p, strict=True):
        arm.x[joint] = position
    left = norm(sub(p[-1], target))
    return left, iterations, left <= tolerance


def solve(arm, method, target, effector, tolerance, max_iterations):
    solver = fabrik if method == "fabrik" else ccd
    return solver(arm, target, effector, tolerance, max_iterations)


def forward_kinematics(parents, offsets, local_rotations):
    positions, rotations = kinematics(parents, offsets, local_rotations)
    return {"positions": positions, "rotations": rotations}


def inverse_kinematics(parents, offsets, local_rotations, target, method="", **limits):
    arm = Arm(parents, offsets, local_rotations)
    left, iterations, arrived = solve(arm, method, target, **limits)
    return {
        "local_rotations": arm.local,
        "positions": arm.x,
        "residual": left,
        "iterations": iterations,
        "converged": arrived,
    }


def track(parents, offsets, local_rotations, curve, method="", **limits):
    arm, frames, positions = Arm(parents, offsets, local_rotations), [], []
    for target in curve:
        solve(arm, method, target, **limits)
        frames.append(list(arm.local))
        positions.append(list(arm.x))
        arm.forward()
    return {"local_rotations": frames, "positions": positions}


def resample(curve, closed, count=None, spacing=None, **_):
    points = [*curve, curve[0]] if closed and not planted("resample_left_open") else curve
    s = [0.0]
    for a, b in pairwise(points):
        s.append(s[-1] + norm(sub(a, b)))
    if count is None:
        count = math.ceil(s[-1] / spacing - 1e-12) + (not closed)
    pieces, out, j = max(1, count if closed else count - 1), [], 0
    for i in range(count):
        at = s[-1] * i / pieces
        while j + 2 < len(s) and s[j + 1] < at:
            j += 1
        piece = s[j + 1] - s[j] if len(s) > 1 else 0.0
        part = min(1.0, (at - s[j]) / piece) if piece > 0.0 else 0.0
        if planted("resample_nearest"):
            part = round(part)
        out.append(add(times(1.0 - part, points[j]), times(part, points[min(j + 1, len(s) - 1)])))
    return {"points": out}


class System:
    def __init__(self, masses, springs, rest_lengths, stiffnesses, dampings, gravity, **state):
        self.masses, self.gravity = masses, gravity
        self.springs = list(zip(springs, rest_lengths, stiffnesses, dampings, strict=True))
        self.pinned = state.get("pinned", [])
        self.x, self.v = state["positions"], state["velocities"]

    def spring_forces(self, damping=1.0, one_sided=False):
        f = [[0.0, 0.0, 0.0] for _ in self.masses]
        for (i, j), rest, k, c in self.springs:
            apart = sub(self.x[i], self.x[j])
            length = norm(apart)
            if length == 0.0:
                continue
            u = times(1.0 / length, apart)
            rate = dot(sub(self.v[i], self.v[j]), u)
            pull = times(k * (length - rest) + damping * c * rate, u)
            f[i] = sub(f[i], pull)
            if not one_sided:
                f[j] = add(f[j], pull)
        return f

    def blocks(self):
        """The 3 x 3 stiffness of each spring with its particles."""
        geometric = 0.0 if planted("step_geometric_dropped") else 1.0
        if planted("step_geometric_sign"):
            geometric = -1.0
        for (i, j), rest, k, _ in self.springs:
            apart = sub(self.x[i], self.x[j])
            length = norm(apart)
            u = times(1.0 / length, apart) if length > 0.0 else apart
            across = geometric * k * (1.0 - rest / length) if length > 0.0 else 0.0
            along = 1.0 if planted("step_matrix_without_k") else k
            yield (
                i,
                j,
                [
                    [along * u[a] * u[b] + across * ((a == b) - u[a] * u[b]) for b in range(3)]
                    for a in range(3)
                ],
            )


def mass_spring_forces(**inputs):
    system = System(**inputs)
    damping = 2.0 if planted("forces_damping_twice") else 1.0
    f = system.spring_forces(damping, planted("forces_one_end"))
    weight = [times(m, system.gravity) for m in system.masses]
    return {"forces": [add(a, b) for a, b in zip(f, weight, strict=True)]}


def energy(**inputs):
    system = System(**inputs)
    each = list(zip(system.masses, system.x, system.v, strict=True))
    kinetic = sum((1.0 if planted("energy_kinetic") else 0.5) * m * dot(v, v) for m, _, v in each)
    gravitational = -sum(m * dot(system.gravity, x) for m, x, _ in each)
    elastic = sum(
        0.5 * k * (norm(sub(system.x[i], system.x[j])) - rest) ** 2
        for (i, j), rest, k, _ in system.springs
    )
    return {
        "total": kinetic + elastic + gravitational,
        "kinetic": kinetic,
        "potential": elastic + gravitational,
        "elastic": elastic,
        "gravitational": gravitational,
    }


def matrix(system, h, rows):
    """The rows of M + h^2 K for free particles, as dicts."""
    size = 3 * len(rows)
    A = [{} for _ in range(size)]
    sign = -1.0 if planted("step_matrix_sign") else 1.0
    off = -2.0 if planted("step_off_diagonals_doubled") else -1.0

    def put(i, j, block, factor):
        if i in rows and j in rows:
            for a in range(3):
                for b in range(3):
                    row, column = A[3 * rows[i] + a], 3 * rows[j] + b
                    row[column] = row.get(column, 0.0) + sign * h * h * factor * block[a][b]

    for i, r in rows.items():
        for a in range(3):
            A[3 * r + a][3 * r + a] = system.masses[i]
    for i, j, block in system.blocks():
        put(i, i, block, 1.0)
        put(j, j, block, 1.0)
        put(i, j, block, off)
        put(j, i, block, off)
    return A


def eliminate(A, b):
    """Solve A x = b by Gauss's elimination of a symmetric pattern; A and b are overwritten."""
    for p, pivot in enumerate(A):
        for i in sorted(pivot):
            if i > p and p in A[i]:
                row, factor = A[i], A[i].pop(p) / pivot[p]
                for column, value in pivot.items():
                    if column > p:
                        row[column] = row.get(column, 0.0) - factor * value
                b[i] -= factor * b[p]
    for p in range(len(A) - 1, -1, -1):
        b[p] -= math.fsum(value * b[c] for c, value in A[p].items() if c > p)
        b[p] /= A[p][p]
    return b


def right_side(system, h):
    """h M v + h^2 f for each particle."""
    damping = -1.0 if planted("step_damping_sign") else 1.0
    if planted("step_damping_absent"):
        damping = 0.0
    out = []
    for m, v, f in zip(system.masses, system.v, system.spring_forces(damping), strict=True):
        weight = times(1.0 if planted("step_gravity_mass") else m, system.gravity)
        if planted("step_gravity_doubled"):
            weight = times(2.0, weight)
        out.append(add(times(h * m, v), times(h * h, add(f, weight))))
    return out


def one_step(system, h):
    system.v = [[0.0] * 3 if i in system.pinned else v for i, v in enumerate(system.v)]
    held = () if planted("step_pins_overwritten") or planted("step_pins_springs") else system.pinned
    rows = {i: r for r, i in enumerate(i for i in range(len(system.x)) if i not in held)}
    A, sides = matrix(system, h, rows), right_side(system, h)
    if planted("step_pins_springs"):
        for pin in system.pinned:
            for a in range(3):
                A[3 * pin + a][3 * pin + a] += h * h * 5e5
    solved = eliminate(A, [value for i in rows for value in sides[i]])
    x = list(system.x)
    for i, r in rows.items():
        x[i] = add(x[i], solved[3 * r : 3 * r + 3])
    if planted("step_pins_overwritten"):
        x = [
            old if i in system.pinned else new
            for i, (old, new) in enumerate(zip(system.x, x, strict=True))
        ]
    velocities = [times(1.0 / h, sub(new, old)) for new, old in zip(x, system.x, strict=True)]
    if planted("step_velocity_explicit"):
        f = right_side(system, h)
        velocities = [times(1.0 / (h * m), one) for m, one in zip(system.masses, f, strict=True)]
        velocities = [[0.0] * 3 if i in system.pinned else v for i, v in enumerate(velocities)]
    system.x, system.v = x, velocities


def mass_spring_step(h, **inputs):
    system = System(**inputs)
    one_step(system, h)
    return {"positions": system.x, "velocities": system.v}


def mass_spring_motion(h, steps, **inputs):
    system, positions, velocities = System(**inputs), [], []
    if planted("motion_frame_early"):
        positions, velocities, steps = [system.x], [system.v], steps - 1
    for _ in range(steps):
        one_step(system, h)
        positions.append(system.x)
        velocities.append(system.v)
    return {"positions": positions, "velocities": velocities}


TASKS = {
    task.__name__: task
    for task in (
        forward_kinematics,
        inverse_kinematics,
        track,
        resample,
        mass_spring_forces,
        energy,
        mass_spring_step,
        mass_spring_motion,
    )
}
GREETING = {
    "protocol": 1,
    "name": "lab in Python",
    "language": "Python",
    "tasks": list(TASKS),
    "methods": ["ccd", "fabrik"],
    "step": {
        "method": "linearised",
        "start": "x_n",
        "iterations": 1,
        "substeps": 1,
        "damper": "explicit",
        "pins": "eliminated",
        "velocity": "displacement",
    },
}


def plain(value):
    """None for what JSON has no number for."""
    if isinstance(value, list):
        return [plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def answer(task, **inputs):
    if task == "greeting":
        return GREETING
    try:
        return {name: plain(value) for name, value in TASKS[task](**inputs).items()}
    except (ArithmeticError, LookupError, TypeError) as error:
        return {"error": str(error)}


if __name__ == "__main__":
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    for line in sys.stdin:
        request = json.loads(line)
        reply = {"id": request.pop("id"), **answer(**request)}
        print(json.dumps(reply), file=answers, flush=True)
