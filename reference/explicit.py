"""Explicit integrators: symplectic Euler, and the classical Runge-Kutta method as truth at tiny h.

Dampers pull with -c ((v_i - v_j)·u) u at the velocities of the moment.
"""

import numpy as np
from numpy.typing import ArrayLike

from .arguments import FloatArray, number
from .mass_spring import MassSpring, State, forces, motion


def symplectic_euler(
    system: MassSpring, state: State, h: float, external_forces: ArrayLike | None = None
) -> State:
    """Return the state a time h [s] later: v' = v + h M^-1 f(x, v), then x' = x + h v'.

    Args:
        system: the system that steps; it is stable for h below about 2 / (its highest frequency).
        state: where it starts.
        h: the step [s].
        external_forces: [N], shape (particle, 3), besides gravity.

    Raises:
        ValueError: if h is not positive, the state has another number of particles, or the
            external forces have another shape or are not finite.
        FloatingPointError: if the step overflows, as it does after many unstable ones.
    """
    h = number("h", h, above=0)
    x, v = motion(system, state)
    with np.errstate(over="ignore", invalid="ignore"):
        v = v + h * accelerations(system, state, external_forces)
        return _finite_state("symplectic_euler", x + h * v, v)


def runge_kutta(
    system: MassSpring, state: State, h: float, external_forces: ArrayLike | None = None
) -> State:
    """Return the state a time h [s] later by the classical Runge-Kutta method of order 4.

    Arguments and errors are those of `symplectic_euler`; the external forces stay through the step.
    """
    h = number("h", h, above=0)
    x, v = motion(system, state)

    def rates(shift: float, dx: FloatArray, dv: FloatArray) -> tuple[FloatArray, FloatArray]:
        moved = State.of(x + shift * dx, v + shift * dv)
        return moved.velocities, accelerations(system, moved, external_forces)

    with np.errstate(over="ignore", invalid="ignore"):
        k1 = v, accelerations(system, state, external_forces)
        k2 = rates(h / 2, *k1)
        k3 = rates(h / 2, *k2)
        k4 = rates(h, *k3)
        dx, dv = (a + 2 * b + 2 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
        return _finite_state("runge_kutta", x + h / 6 * dx, v + h / 6 * dv)


def accelerations(
    system: MassSpring, state: State, external_forces: ArrayLike | None = None
) -> FloatArray:
    """Return M^-1 f, zero at the pins, shape (particle, 3) [m/s²].

    Raises:
        ValueError: if the state has another number of particles, or the external forces have
            another shape or are not finite.
    """
    total, free = forces(system, state, external_forces), system.free
    result = np.zeros_like(total)
    result[free] = total[free] / system.masses[free, None]
    return result


def _finite_state(name: str, positions: FloatArray, velocities: FloatArray) -> State:
    if not (np.isfinite(positions).all() and np.isfinite(velocities).all()):
        raise FloatingPointError(f"{name}: the step left the finite numbers; h is too large")
    return State.of(positions, velocities)
