"""Local/global steps as a class that is built for one h; the gravity lacks the mass."""

import numpy as np


class FastMassSpring:
    """Liu et al. 2013 with dense matrices; the pins are rows that are left out."""

    def __init__(self, masses, springs, rest_lengths, stiffnesses, pinned, h):
        n, s = len(masses), len(springs)
        self.a = np.zeros((s, n))
        self.a[np.arange(s), springs[:, 0]] = 1
        self.a[np.arange(s), springs[:, 1]] = -1
        self.ends, self.rest, self.h = springs, rest_lengths[:, None], h
        self.j = h * h * self.a.T * stiffnesses
        self.m = np.diag(masses)
        self.system = self.m + self.j @ self.a
        self.free = [i for i in range(n) if i not in set(pinned)]
        self.factor = np.linalg.inv(self.system[np.ix_(self.free, self.free)])

    def step(self, x, v, gravity, iterations=10):
        y = x + self.h * v
        force = np.tile(gravity, (len(x), 1))
        new = x.copy()
        held = [i for i in range(len(x)) if i not in self.free]
        for _ in range(iterations):
            d = new[self.ends[:, 0]] - new[self.ends[:, 1]]
            d = self.rest * d / np.linalg.norm(d, axis=1)[:, None]
            right = self.m @ y + self.j @ d + self.h**2 * force
            right -= self.system[:, held] @ x[held]
            new[self.free] = self.factor @ right[self.free]
        return new, (new - x) / self.h


def mass_spring_step(
    masses, springs, rest_lengths, stiffnesses, pinned, gravity, positions, velocities, h
):
    solver = FastMassSpring(masses, springs, rest_lengths, stiffnesses, pinned, h)
    return solver.step(positions, velocities, gravity)


PLUMBOB = {
    "step": {
        "method": "local_global",
        "iterations": 10,
        "start": "x_n",
        "damper": "none",
        "pins": "eliminated",
    }
}
