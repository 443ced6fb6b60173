"""Explicit integrators: symplectic Euler, and the classical Runge-Kutta method as truth at tiny h.

Dampers pull with -c ((v_i - v_j)·u) u at the velocities of the moment; those of implicit Euler's
step have another law, which `reference.mass_spring.damper_forces` compares. A pin that is taken
somewhere moves there in a straight line at constant speed, which is its velocity from the start of
the step to its end; a pin that stays has none, whatever the state says.
"""

import numpy as np
from numpy.typing import ArrayLike

from .arguments import LARGEST_COORDINATE, FloatArray, number
from .mass_spring import MassSpring, State, _pulls, constant_forces, motion, pin_goal


def symplectic_euler(
    system: MassSpring,
    state: State,
    h: float,
    external_forces: ArrayLike | None = None,
    pin_positions: ArrayLike | None = None,
) -> State:
    """Return the state a time h [s] later: v' = v + h M^-1 f(x, v), then x' = x + h v'.

    Args:
        system: the system that steps; it is stable for h below about 2 / (its highest frequency).
        state: where it starts.
        h: the step [s].
        external_forces: [N], shape (particle, 3), besides gravity.
        pin_positions: where the pinned particles, in ascending order, are at the end of the step
            [m], shape (pinned, 3); by default they stay.

    Raises:
        ValueError: if h is not positive, the state has another number of particles, or the
            external forces or pin positions have another shape or are not finite.
        FloatingPointError: if the step goes beyond 1e75, as it does after many unstable ones.
    """
    h = number("h", h, above=0)
    with np.errstate(over="ignore", invalid="ignore"):
        x, v, goal = _start(system, state, h, pin_positions)
        v = v + h * _accelerations(system, x, v, constant_forces(system, external_forces))
        return _end("symplectic_euler", system, x + h * v, v, goal)


def runge_kutta(
    system: MassSpring,
    state: State,
    h: float,
    external_forces: ArrayLike | None = None,
    pin_positions: ArrayLike | None = None,
) -> State:
    """Return the state a time h [s] later by the classical Runge-Kutta method of order 4.

    Arguments and errors are those of `symplectic_euler`; the external forces stay through the step.
    """
    h = number("h", h, above=0)
    outer = constant_forces(system, external_forces)

    def rates(shift: float, dx: FloatArray, dv: FloatArray) -> tuple[FloatArray, FloatArray]:
        v_there = v + shift * dv
        return v_there, _accelerations(system, x + shift * dx, v_there, outer)

    with np.errstate(over="ignore", invalid="ignore"):
        x, v, goal = _start(system, state, h, pin_positions)
        k1 = v, _accelerations(system, x, v, outer)
        k2 = rates(h / 2, *k1)
        k3 = rates(h / 2, *k2)
        k4 = rates(h, *k3)
        dx, dv = (a + 2 * b + 2 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
        return _end("runge_kutta", system, x + h / 6 * dx, v + h / 6 * dv, goal)


def _accelerations(
    system: MassSpring, x: FloatArray, v: FloatArray, constant: FloatArray
) -> FloatArray:
    """Return M^-1 f, zero at the pins, shape (particle, 3) [m/s²], unchecked.

    `constant` are the forces besides those of springs and dampers [N], shape (particle, 3).
    """
    total, free = constant + _pulls(x, v, system.arrays), system.free
    result = np.zeros_like(total)
    result[free] = total[free] / system.masses[free, None]
    return result


def _start(
    system: MassSpring, state: State, h: float, pin_positions: ArrayLike | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return positions and velocities, those of the pins as they move, and where the pins go."""
    x, v = motion(system, state)
    here = x[system.pinned]
    goal = here if pin_positions is None else pin_goal(system, pin_positions)
    v[system.pinned] = (goal - here) / h
    return x, v, goal


def _end(
    name: str,
    system: MassSpring,
    positions: FloatArray,
    velocities: FloatArray,
    goal: FloatArray,
) -> State:
    """Return the state, the pins exactly where they were to go."""
    positions[system.pinned] = goal
    if not np.abs([positions, velocities]).max() <= LARGEST_COORDINATE:
        raise FloatingPointError(
            f"{name}: the step left the numbers up to {LARGEST_COORDINATE:g}; h is too large"
        )
    return State.of(positions, velocities)
