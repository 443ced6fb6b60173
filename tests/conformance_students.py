"""Right solvers as students write them, on their own: plain loops, in either precision.

They share no line with the reference or the textbook of the diagnosis. Their options are those in
which honest programs differ.
"""

import numpy as np


def product(a, b):
    w, v, s, u = a[0], a[1:], b[0], b[1:]
    return np.concatenate([[w * s - v @ u], w * u + s * v + np.cross(v, u)]).astype(a.dtype)


def inverse(q):
    return q * np.array([1, -1, -1, -1], dtype=q.dtype)


def matrix(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ],
        dtype=q.dtype,
    )


def forward_kinematics(parents, offsets, local_rotations):
    x, R = np.zeros_like(offsets), np.zeros_like(local_rotations)
    for j, p in enumerate(parents):
        if p < 0:
            x[j], R[j] = offsets[j], local_rotations[j]
        else:
            x[j] = x[p] + matrix(R[p]) @ offsets[j]
            R[j] = product(R[p], local_rotations[j])
    return x, R


def half_way(a, b, dead=0.0):
    """The shortest arc through the vector half-way between two directions."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    if np.linalg.norm(np.cross(a, b)) <= dead:
        return np.array([1, 0, 0, 0], dtype=a.dtype)
    half = a + b
    half /= np.linalg.norm(half)
    return np.concatenate([[a @ half], np.cross(a, half)]).astype(a.dtype)


def axis_angle(a, b, dead=0.0, most=np.inf, share=1.0):
    """The shortest arc by an axis and the arc cosine."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    axis = np.cross(a, b)
    if np.linalg.norm(axis) <= dead:
        return np.array([1, 0, 0, 0], dtype=a.dtype)
    axis /= np.linalg.norm(axis)
    angle = min(share * np.arccos(np.clip(a @ b, -1, 1)), most)
    return np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis]).astype(a.dtype)


def arc(a, b, **options):
    """A shortest arc that knows vectors without length and directions without a plane."""
    if min(np.linalg.norm(a), np.linalg.norm(b)) < 1e-12:
        return np.array([1, 0, 0, 0], dtype=a.dtype)
    kind = options.pop("kind", half_way)
    if np.linalg.norm(a / np.linalg.norm(a) + b / np.linalg.norm(b)) < 1e-6:
        return np.array([0, 0, 0, 1], dtype=a.dtype)
    return kind(a, b, **options)


def ancestors(parents, effector):
    path = [int(effector)]
    while parents[path[0]] >= 0:
        path.insert(0, int(parents[path[0]]))
    return path


def ccd(parents, offsets, local_rotations, target, effector, tolerance, max_iterations, **options):
    kind = {"dead": 0.0, **options}
    up, tip = kind.pop("up", True), kind.pop("rotates_tip", False)
    normalises, tests_each = kind.pop("normalises", True), kind.pop("tests_each", False)
    Q, path = local_rotations.copy(), ancestors(parents, effector)
    joints = path if tip else path[:-1]
    for _ in range(max_iterations):
        x, R = forward_kinematics(parents, offsets, Q)
        if np.linalg.norm(x[effector] - target) <= tolerance:
            break
        for j in reversed(joints) if up else joints:
            x, R = forward_kinematics(parents, offsets, Q)
            if tests_each and np.linalg.norm(x[effector] - target) <= tolerance:
                break
            if j == effector:
                Q[j] = product(Q[j], np.array([0.6, 0.8, 0, 0], dtype=Q.dtype))
                continue
            d = arc(x[effector] - x[j], target - x[j], **kind)
            R_new = product(d, R[j])
            Q[j] = R_new if parents[j] < 0 else product(inverse(R[parents[j]]), R_new)
            if normalises:
                Q[j] /= np.linalg.norm(Q[j])
    return Q, forward_kinematics(parents, offsets, Q)[0]


def fabrik(
    parents, offsets, local_rotations, target, effector, tolerance, max_iterations, **options
):
    """FABRIK that lays unreachable chains straight, or just goes on; rotations from rest or not."""
    Q, path = local_rotations.copy(), ancestors(parents, effector)
    start = forward_kinematics(parents, offsets, Q)
    x = start[0][path]
    lengths = np.linalg.norm(np.diff(x, axis=0), axis=-1)
    if options.get("stretches") and np.linalg.norm(target - x[0]) > lengths.sum():
        step = (target - x[0]) / np.linalg.norm(target - x[0])
        x[1:] = x[0] + np.cumsum(lengths)[:, None] * step
        max_iterations = 0
    root = x[0].copy()
    for _ in range(max_iterations):
        if not options.get("tests_last") and np.linalg.norm(x[-1] - target) <= tolerance:
            break
        x[-1] = target
        for k in reversed(range(len(lengths))):
            x[k] = x[k + 1] + lengths[k] * towards(x[k + 1], x[k])
        x[0] = root
        for k in range(len(lengths)):
            x[k + 1] = x[k] + lengths[k] * towards(x[k], x[k + 1])
        if options.get("tests_last") and np.linalg.norm(x[-1] - target) <= tolerance:
            break
    for k, j in enumerate(path[:-1]):
        link = x[k + 1] - x[k]
        _, R = forward_kinematics(parents, offsets, Q)
        R_parent = R[parents[j]] if parents[j] >= 0 else np.array([1, 0, 0, 0], dtype=Q.dtype)
        if options.get("from_rest"):
            Q[j] = product(inverse(R_parent), arc(offsets[path[k + 1]], link, dead=0.0))
        else:
            old = matrix(R[j]) @ offsets[path[k + 1]]
            Q[j] = product(inverse(R_parent), product(arc(old, link, **_dead(options)), R[j]))
    positions = forward_kinematics(parents, offsets, Q)[0]
    positions[path] = x
    return Q, positions


def _dead(options):
    return {"dead": options.get("dead", 0.0)}


def towards(a, b):
    direction = b - a
    length = np.linalg.norm(direction)
    return direction / length if length > 0 else np.zeros_like(direction)


def in_single(function, **options):
    """The same with every number in single precision."""

    def single(**inputs):
        given = {
            name: value.astype(np.float32)
            if isinstance(value, np.ndarray) and value.dtype == np.float64
            else np.float32(value)
            if isinstance(value, float)
            else value
            for name, value in inputs.items()
            if name != "method"
        }
        return function(**given, **options)

    return single


def with_options(function, **options):
    def called(**inputs):
        inputs.pop("method", None)
        return function(**inputs, **options)

    return called
