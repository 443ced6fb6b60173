"""Right time steps of mass-springs in twelve forms, honest choices all; FORM says which."""

import os

import numpy as np

FORM = os.environ.get("FORM", "symplectic")
FLOAT = np.float32 if "single" in FORM else np.float64
METHOD = FORM.split()[0]
PLUMBOB = {"precision": "single"} if "single" in FORM else {}


class Cloth:
    """A system in arrays, as a course's program keeps it."""

    def __init__(self, masses, springs, rest_lengths, stiffnesses, dampings, pinned, gravity):
        self.m, self.rest = masses.astype(FLOAT), rest_lengths.astype(FLOAT)
        self.k, self.c, self.g = stiffnesses.astype(FLOAT), dampings.astype(FLOAT), gravity
        self.i, self.j = springs.reshape(-1, 2).T
        self.free = np.setdiff1d(np.arange(len(masses)), pinned)
        if "heavy" in FORM:
            self.m[pinned] *= 1e9
            self.free = np.arange(len(masses))

    def springs(self, x):
        d = x[self.i] - x[self.j]
        length = np.linalg.norm(d, axis=1)
        return d / np.where(length > 0, length, 1)[:, None], length

    def forces(self, x, v):
        u, length = self.springs(x)
        pull = self.k * (length - self.rest)
        if "undamped" not in FORM:
            pull = pull + self.c * np.einsum("sk,sk->s", v[self.i] - v[self.j], u)
        f = self.m[:, None] * self.g.astype(FLOAT)
        np.add.at(f, self.i, -pull[:, None] * u)
        np.add.at(f, self.j, pull[:, None] * u)
        return f.astype(FLOAT)

    def matrix(self, x, h):
        """Return M + h² K at x, and h D with implicit dampers."""
        n, (u, length) = len(self.m), self.springs(x)
        a = np.diag(np.repeat(self.m, 3))
        for s in range(len(u)):
            uu = np.outer(u[s], u[s])
            across = 1 - self.rest[s] / length[s] if length[s] > 0 else 0
            block = h * h * self.k[s] * (uu + across * (np.eye(3) - uu))
            if "implicit" in FORM:
                block = block + h * self.c[s] * uu
            p, q = slice(3 * self.i[s], 3 * self.i[s] + 3), slice(3 * self.j[s], 3 * self.j[s] + 3)
            a[p, p] += block
            a[q, q] += block
            a[p, q] -= block
            a[q, p] -= block
        assert a.shape == (3 * n, 3 * n)
        return a


def linearised(cloth, x, v, h):
    """Solve (M + h D + h² K) dv = h (f + h ∂f/∂x v); dampers in f, implicit or explicit."""
    stiff = cloth.matrix(x, h)
    mass = np.repeat(cloth.m, 3)
    hk = (stiff - np.diag(mass)) / h
    if "implicit" in FORM:
        undamped = Cloth.__new__(Cloth)
        undamped.__dict__ = {**cloth.__dict__, "c": np.zeros_like(cloth.c)}
        hk = (undamped.matrix(x, h) - np.diag(mass)) / h
    right = h * (cloth.forces(x, v).ravel() - hk @ v.ravel())
    rows = (3 * cloth.free[:, None] + np.arange(3)).ravel()
    change = np.zeros(3 * len(x))
    if "overwritten" in FORM:
        change = np.linalg.solve(stiff, right)
    else:
        change[rows] = np.linalg.solve(stiff[np.ix_(rows, rows)], right[rows])
    return v + change.reshape(-1, 3)


def local_global(cloth, x, v, h, iterations):
    """Alternate spring directions and a linear solve, from x_n; no dampers."""
    n = len(x)
    laplacian, y = np.zeros((n, n)), x + h * v + h * h * cloth.g
    for s, (i, j) in enumerate(zip(cloth.i, cloth.j, strict=True)):
        laplacian[[i, j], [i, j]] += cloth.k[s]
        laplacian[[i, j], [j, i]] -= cloth.k[s]
    a, free = np.diag(cloth.m) + h * h * laplacian, cloth.free
    pins = np.setdiff1d(np.arange(n), free)
    new = x.copy()
    for _ in range(iterations):
        u, _ = cloth.springs(new)
        b = cloth.m[:, None] * y
        np.add.at(b, cloth.i, h * h * (cloth.k * cloth.rest)[:, None] * u)
        np.add.at(b, cloth.j, -h * h * (cloth.k * cloth.rest)[:, None] * u)
        right = b[free] - a[np.ix_(free, pins)] @ x[pins]
        new[free] = np.linalg.solve(a[np.ix_(free, free)], right)
    return new


def mass_spring_step(
    masses, springs, rest_lengths, stiffnesses, dampings, pinned, gravity, positions, velocities, h
):
    cloth = Cloth(masses, springs, rest_lengths, stiffnesses, dampings, pinned, gravity)
    x, v = positions.astype(FLOAT), velocities.astype(FLOAT)
    free, substeps = cloth.free, 4 if "substeps" in FORM else 1
    h = FLOAT(h / substeps)
    for _ in range(substeps):
        if METHOD == "local_global":
            new = local_global(cloth, x, v, h, 50 if "fifty" in FORM else 5)
            v, x = (new - x) / h, new
        elif METHOD == "linearised":
            v = linearised(cloth, x, v, h)
            v[pinned] = 0
            x = x + h * v
        else:
            a = cloth.forces(x, v) / cloth.m[:, None]
            old = v.copy()
            if METHOD == "positions_first":
                x[free] += h * v[free]
                a = cloth.forces(x, v) / cloth.m[:, None]
            v[free] += h * a[free]
            if METHOD == "symplectic":
                x[free] += h * v[free]
            elif METHOD == "explicit":
                x[free] += h * old[free]
    return {"positions": x, "velocities": v}
