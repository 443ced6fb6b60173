"""Step by conjugate gradients."""

import numpy as np

PLUMBOB = {
    "system": {"external_forces": True, "tension_only": True},
    "step": {"method": "linearised", "start": "x_n", "damper": "end_velocity"},
}
DAMPER = "end_velocity"


def linearised(springs, rest_lengths, stiffnesses, dampings, x, v, tension_only):
    """Return forces [N], directions, and the stiffnesses along and across the springs."""
    f = np.zeros_like(x)
    directions, along, across = [], [], []
    for s in range(len(springs)):
        i, j = springs[s]
        d = x[j] - x[i]
        length = np.linalg.norm(d)
        u = d / length
        stretch = length - rest_lengths[s]
        k = stiffnesses[s]
        if tension_only is not None and tension_only[s] and stretch < 0.0:
            k = 0.0
        pull = k * stretch * u
        if DAMPER != "none":
            pull += dampings[s] * (u @ (v[j] - v[i])) * u
        f[i] += pull
        f[j] -= pull
        directions.append(u)
        along.append(k)
        across.append(k * (1.0 - rest_lengths[s] / length))
    return f, directions, along, across


def product(springs, directions, along, across, z):
    """Return the stiffness matrix, or that of the dampers, times a vector of each particle."""
    result = np.zeros_like(z)
    for s in range(len(springs)):
        i, j = springs[s]
        u = directions[s]
        dz = z[j] - z[i]
        dz_along = (u @ dz) * u
        df = along[s] * dz_along + across[s] * (dz - dz_along)
        result[i] -= df
        result[j] += df
    return result


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings, pinned, gravity,
                     positions, velocities, h, external_forces=None, tension_only=None):
    x, v = positions, velocities
    f, directions, along, across = linearised(
        springs, rest_lengths, stiffnesses, dampings, x, v, tension_only
    )
    for i in range(len(masses)):
        f[i] += masses[i] * gravity
    if external_forces is not None:
        f = f + external_forces
    stiff = h**2 * np.array(along)
    if DAMPER != "explicit" and DAMPER != "none":
        stiff = stiff + h * dampings
    sideways = h**2 * np.array(across)
    b = h * (f - h * product(springs, directions, along, across, v))
    b[pinned] = 0.0
    dv = np.zeros_like(b)
    r = b.copy()
    p = r.copy()
    rho = np.sum(r * r)
    smallest = 1e-28 * rho
    for _ in range(6 * b.size):
        if rho <= smallest:
            break
        q = product(springs, directions, stiff, sideways, p)
        for i in range(len(masses)):
            q[i] += masses[i] * p[i]
        q[pinned] = 0.0
        alpha = rho / np.sum(p * q)
        dv = dv + alpha * p
        r = r - alpha * q
        new_rho = np.sum(r * r)
        beta = new_rho / rho
        p = r + beta * p
        rho = new_rho
    v = v + dv
    v[pinned] = 0.0
    x = x + h * v
    return {"positions": x, "velocities": v}
