"""Wrong programs in forms of their own: matrices, recursion, arrays and plain loops."""

import numpy as np


def matrix(q):
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def quaternion(R):
    """Return (w, x, y, z) as the eigenvector of the largest eigenvalue of Bar-Itzhack's matrix."""
    (a, b, c), (d, e, f), (g, h, i) = R
    K = np.array([
        [a + e + i, h - f, c - g, d - b],
        [h - f, a - e - i, b + d, c + g],
        [c - g, b + d, e - a - i, f + h],
        [d - b, c + g, f + h, i - a - e],
    ])  # fmt: skip
    return np.linalg.eigh(K)[1][:, -1]


def rodrigues(a, b):
    """Return the rotation matrix from direction a to b."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    axis, cosine = np.cross(a, b), a @ b
    sine = np.linalg.norm(axis)
    if sine < 1e-12:
        return np.eye(3)
    x, y, z = axis / sine
    X = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + sine * X + (1 - cosine) * X @ X


def leaves_not_rotated(parents, offsets, local_rotations):
    """Forward kinematics by recursion, with matrices: a leaf keeps its parent's rotation."""
    positions, rotations = np.zeros((len(parents), 3)), np.zeros((len(parents), 4))

    def visit(joint, x, R):
        positions[joint] = x + R @ offsets[joint]
        children = np.flatnonzero(parents == joint)
        if len(children):
            R = R @ matrix(local_rotations[joint])
        rotations[joint] = quaternion(R)
        for child in children:
            visit(child, positions[joint], R)

    visit(0, np.zeros(3), np.eye(3))
    return {"positions": positions, "rotations": rotations}


def _ccd(parents, offsets, local_rotations, target, effector, tolerance, sweeps, carries):
    Rs, xs = [], []
    for j, p in enumerate(parents):
        R, x = (Rs[p], xs[p]) if p >= 0 else (np.eye(3), np.zeros(3))
        xs.append(x + R @ offsets[j])
        Rs.append(R @ matrix(local_rotations[j]))
    xs, Rs = np.array(xs), np.array(Rs)
    chain = [effector]
    while parents[chain[-1]] >= 0:
        chain.append(parents[chain[-1]])
    for _ in range(sweeps):
        if np.linalg.norm(xs[effector] - target) <= tolerance:
            break
        for joint in chain[1:]:
            D = rodrigues(xs[effector] - xs[joint], target - xs[joint])
            for k in range(len(parents)):
                above = k
                while above >= 0 and above != joint:
                    above = parents[above]
                if above == joint:
                    xs[k] = xs[joint] + D @ (xs[k] - xs[joint])
                    if carries or k == joint:
                        Rs[k] = D @ Rs[k]
    local = [Rs[p].T @ R if p >= 0 else R for p, R in zip(parents, Rs, strict=True)]
    return {"local_rotations": np.array([quaternion(R) for R in local]), "positions": xs}


def joints_below_not_rotated(
    parents, offsets, local_rotations, target, effector, tolerance, max_iterations
):
    """CCD on global matrices: joints below are moved along and keep their global rotation."""
    arguments = parents, offsets, local_rotations, target, effector, tolerance
    return _ccd(*arguments, max_iterations, carries=False)


def ten_sweeps(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    """CCD on global matrices: always ten sweeps."""
    return _ccd(parents, offsets, local_rotations, target, effector, tolerance, 10, carries=True)


def gravity_constant(
    masses, springs, rest_lengths, stiffnesses, dampings, pinned, gravity, positions, velocities, h
):
    """Symplectic Euler in plain loops: gravity is -9.8 along y."""
    x, v = positions.tolist(), velocities.tolist()
    n = len(x)
    f = [[0.0, -9.8 * masses[i], 0.0] for i in range(n)]
    for s in range(len(springs)):
        i, j = int(springs[s][0]), int(springs[s][1])
        d = [x[i][a] - x[j][a] for a in range(3)]
        length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) ** 0.5
        rate = 0.0
        for a in range(3):
            rate += (v[i][a] - v[j][a]) * d[a] / length
        pull = stiffnesses[s] * (length - rest_lengths[s]) + dampings[s] * rate
        for a in range(3):
            f[i][a] -= pull * d[a] / length
            f[j][a] += pull * d[a] / length
    for i in range(n):
        for a in range(3):
            v[i][a] = 0.0 if i in pinned else v[i][a] + h * f[i][a] / masses[i]
            x[i][a] += h * v[i][a]
    return {"positions": np.array(x), "velocities": np.array(v)}


def velocities_without_h(
    masses, springs, rest_lengths, stiffnesses, dampings, pinned, gravity, positions, velocities, h
):
    """One linearised implicit step with dense arrays: the velocities are not divided by h."""
    n = len(masses)
    f, K = masses[:, None] * gravity, np.zeros((3 * n, 3 * n))
    for (i, j), r, k, c in zip(springs, rest_lengths, stiffnesses, dampings, strict=True):
        d = positions[i] - positions[j]
        length = np.linalg.norm(d)
        u = d / length
        pull = (k * (length - r)) * u
        f[i] -= pull
        f[j] += pull
        block = k * (np.outer(u, u) + (1 - r / length) * (np.eye(3) - np.outer(u, u)))
        block += c / h * np.outer(u, u)
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            K[3 * a : 3 * a + 3, 3 * b : 3 * b + 3] += sign * block
    M = np.diag(np.repeat(masses, 3))
    free = np.repeat(~np.isin(np.arange(n), pinned), 3)
    A, b = M / h**2 + K, (f + masses[:, None] * velocities / h).ravel()
    dx = np.zeros(3 * n)
    dx[free] = np.linalg.solve(A[np.ix_(free, free)], b[free])
    dx = dx.reshape(n, 3)
    return {"positions": positions + dx, "velocities": dx}


def quartic_energy(
    masses, springs, rest_lengths, stiffnesses, dampings, gravity, positions, velocities
):
    """Forces as arrays, of the energy k (l² - r²)² / (8 r²) in place of k (l - r)² / 2."""
    d = positions[springs[:, 0]] - positions[springs[:, 1]]
    squares = (d * d).sum(axis=1)
    u = d / np.sqrt(squares)[:, None]
    rates = ((velocities[springs[:, 0]] - velocities[springs[:, 1]]) * u).sum(axis=1)
    strain = stiffnesses * (squares - rest_lengths**2) / (2 * rest_lengths**2)
    pulls = strain[:, None] * d + (dampings * rates)[:, None] * u
    forces = masses[:, None] * gravity
    np.add.at(forces, springs[:, 0], -pulls)
    np.add.at(forces, springs[:, 1], pulls)
    return {"forces": forces}


# The program, its task and method.
PROGRAMS = {
    leaves_not_rotated: ("forward_kinematics", ""),
    joints_below_not_rotated: ("inverse_kinematics", "ccd"),
    ten_sweeps: ("inverse_kinematics", "ccd"),
    gravity_constant: ("mass_spring_step", ""),
    velocities_without_h: ("mass_spring_step", ""),
    quartic_energy: ("mass_spring_forces", ""),
}
