"""Forces, energy and the implicit Euler step in 50 digits, directly from their definitions.

Nothing here knows how the reference computes them: a damper is a spring beside its spring, and no
rest length is blended. Arrays hold mpmath numbers, (particle, 3) and (3 particle, 3 particle).
"""

from typing import NamedTuple

import mpmath
import numpy as np

DIGITS = 50
# The largest entry of the gradient that counts as zero, in units of the largest mass times 1 m.
ZERO = mpmath.mpf(10) ** (8 - DIGITS)
mpmath.mp.dps = DIGITS


class Spring(NamedTuple):
    """What stores k/2 (l - r)² between particles i and j, nothing if slack."""

    i: int
    j: int
    k: mpmath.mpf
    r: mpmath.mpf
    rope: bool


def wide(values):
    """The same numbers with more digits."""
    return np.vectorize(mpmath.mpf, otypes=[object])(np.asarray(values, dtype=float))


def norm(vectors):
    return mpmath.sqrt(np.sum(vectors * vectors))


def springs_of(system):
    """The springs of a system."""
    parts = system.springs, system.stiffnesses, system.rest_lengths, system.tension_only
    return [
        Spring(int(i), int(j), mpmath.mpf(k), mpmath.mpf(r), bool(rope))
        for (i, j), k, r, rope in zip(*parts, strict=True)
    ]


def stretch(x, spring):
    """The vector from end to end, its length, and l - r, 0 if slack."""
    p = x[spring.i] - x[spring.j]
    length = norm(p)
    slack = spring.rope and spring.r > 0 and length <= spring.r
    return p, length, mpmath.mpf(0) if slack else length - spring.r


def spring_energy(springs, x):
    return sum((s.k * stretch(x, s)[2] ** 2 / 2 for s in springs), mpmath.mpf(0))


def spring_forces(springs, x):
    total = wide(np.zeros(x.shape))
    for s in springs:
        p, length, stretched = stretch(x, s)
        if stretched != 0:
            pull = s.k * stretched / length * p
            total[s.i] -= pull
            total[s.j] += pull
    return total


def stiffness(springs, x, *, geometric=True):
    n = len(x)
    blocks = wide(np.zeros((n, 3, n, 3)))
    eye = wide(np.eye(3))
    for s in springs:
        p, length, stretched = stretch(x, s)
        if stretched == 0 and s.rope and s.r > 0:
            continue
        along = np.outer(p, p) / length**2 if length > 0 else 0 * eye
        across = stretched / length if length > 0 else mpmath.mpf(1)
        block = s.k * (along + (across if geometric else 0) * (eye - along))
        for a, b, sign in ((s.i, s.i, 1), (s.j, s.j, 1), (s.i, s.j, -1), (s.j, s.i, -1)):
            blocks[a, :, b] += sign * block
    return blocks.reshape(3 * n, 3 * n)


class Step:
    """g of one step, 1/2 (x - y)' M (x - y) + h² E(x)."""

    def __init__(self, system, state, h, external_forces=0.0, pin_positions=None):
        self.free, self.h = system.free, mpmath.mpf(h)
        self.m = wide(system.masses)[:, None]
        self.x_n, v = wide(state.positions), wide(state.velocities)
        v[~self.free] = mpmath.mpf(0)
        self.y = self.x_n + self.h * v
        if pin_positions is not None:
            self.y[~self.free] = wide(pin_positions)
        given = np.broadcast_to(np.asarray(external_forces, dtype=float), self.x_n.shape)
        self.external = self.m * wide(system.gravity) + wide(given)
        beside = [
            Spring(s.i, s.j, mpmath.mpf(c) / self.h, norm(self.x_n[s.i] - self.x_n[s.j]), False)
            for s, c in zip(springs_of(system), system.dampings, strict=True)
            if c > 0
        ]
        self.springs = springs_of(system) + beside

    def value(self, x):
        away = x - self.y
        energy = spring_energy(self.springs, x) - np.sum(self.external * x)
        return np.sum(self.m * away * away) / 2 + self.h**2 * energy

    def gradient(self, x):
        forces = self.external + spring_forces(self.springs, x)
        gradient = self.m * (x - self.y) - self.h**2 * forces
        gradient[~self.free] = mpmath.mpf(0)
        return gradient

    def hessian(self, x, *, geometric=True):
        """Over the free particles only."""
        free = np.flatnonzero(np.repeat(self.free, 3))
        H = self.h**2 * stiffness(self.springs, x, geometric=geometric)
        H[np.diag_indices(len(H))] += np.repeat(self.m[:, 0], 3)
        return H[np.ix_(free, free)]

    def newton_step(self, x, gradient, hessian):
        """x less the solution of `hessian` with `gradient`; None if that is not definite."""
        p = solve(hessian, gradient[self.free].ravel())
        if p is None:
            return None
        end = x.copy()
        end[self.free] -= p.reshape(-1, 3)
        return end

    def minimiser(self, start, most=60):
        """Where Newton's method comes to from a start; None if not to a minimum."""
        x = np.where(self.free[:, None], wide(start), self.y)
        for _ in range(most):
            gradient = self.gradient(x)
            done = norm(gradient) <= ZERO * max(self.m[:, 0])
            x_next = self.newton_step(x, gradient, self.hessian(x))
            if x_next is None or done:
                return None if x_next is None else x
            x = x_next
        return None

    def gauss_newton(self):
        """One step with the springs linearised at x_n, pins at rest."""
        gradient = self.gradient(self.x_n)
        return self.newton_step(self.x_n, gradient, self.hessian(self.x_n, geometric=False))


def solve(A, b):
    """The solution of A x = b, A symmetric, by elimination; None if a pivot is not positive."""
    A, x = A.copy(), b.copy()
    n = len(x)
    for j in range(n):
        if not A[j, j] > 0:
            return None
        shares = A[j + 1 :, j] / A[j, j]
        A[j + 1 :, j:] -= np.outer(shares, A[j, j:])
        x[j + 1 :] -= shares * x[j]
    for j in reversed(range(n)):
        x[j] = (x[j] - np.sum(A[j, j + 1 :] * x[j + 1 :])) / A[j, j]
    return x
