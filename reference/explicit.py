"""Explicit integrators: symplectic Euler, and the classical Runge-Kutta method of order 4.

Dampers pull with -c ((v_i - v_j)·u) u at the current velocities, unlike in a step of implicit
Euler. `mass_spring.damper_forces` compares the two laws. A pin moves in a straight line at constant
velocity to its position at the end of the step. Its velocity in the state is ignored.
"""

import numpy as np
from numpy.typing import ArrayLike

from .arguments import LARGEST_COORDINATE, FloatArray, number
from .mass_spring import MassSpring, State, checked_state, constant_forces, pin_targets, pulls


def symplectic_euler(
    system: MassSpring,
    state: State,
    h: float,
    external_forces: ArrayLike | None = None,
    pin_positions: ArrayLike | None = None,
) -> State:
    """Return the state a time h [s] later: v' = v + h M^-1 f(x, v), then x' = x + h v'.

    Arguments and errors are as for `ImplicitEuler.step`. The method is stable for h below about 2
    over the highest angular frequency.

    Raises:
        FloatingPointError: if a coordinate or velocity exceeds 1e75, as after many unstable steps.
    """
    h = number("h", h, above=0)
    with np.errstate(over="ignore", invalid="ignore"):
        x, v, targets = _start(system, state, h, pin_positions)
        v = v + h * _accelerations(system, x, v, constant_forces(system, external_forces))
        return _end("symplectic_euler", system, x + h * v, v, targets)


def runge_kutta(
    system: MassSpring,
    state: State,
    h: float,
    external_forces: ArrayLike | None = None,
    pin_positions: ArrayLike | None = None,
) -> State:
    """Return the state a time h [s] later by the classical Runge-Kutta method of order 4.

    Arguments and errors are as for `symplectic_euler`; the external forces stay through the step.
    """
    h = number("h", h, above=0)
    constant = constant_forces(system, external_forces)

    def rates(shift: float, dx: FloatArray, dv: FloatArray) -> tuple[FloatArray, FloatArray]:
        v_shifted = v + shift * dv
        return v_shifted, _accelerations(system, x + shift * dx, v_shifted, constant)

    with np.errstate(over="ignore", invalid="ignore"):
        x, v, targets = _start(system, state, h, pin_positions)
        k1 = v, _accelerations(system, x, v, constant)
        k2 = rates(h / 2, *k1)
        k3 = rates(h / 2, *k2)
        k4 = rates(h, *k3)
        dx, dv = (a + 2 * b + 2 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
        return _end("runge_kutta", system, x + h / 6 * dx, v + h / 6 * dv, targets)


def _accelerations(
    system: MassSpring, x: FloatArray, v: FloatArray, constant: FloatArray
) -> FloatArray:
    """Return M^-1 f [m/s²], zero at the pins, f the forces, constant and of springs."""
    total, free = constant + pulls(x, v, system.arrays), system.free
    result = np.zeros_like(total)
    result[free] = total[free] / system.masses[free, None]
    return result


def _start(
    system: MassSpring, state: State, h: float, pin_positions: ArrayLike | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return positions, velocities and the positions of the pins at the end of the step."""
    x, v = checked_state(system, state)
    pins = x[system.pinned]
    targets = pins if pin_positions is None else pin_targets(system, pin_positions)
    v[system.pinned] = (targets - pins) / h
    return x, v, targets


def _end(name: str, system: MassSpring, x: FloatArray, v: FloatArray, targets: FloatArray) -> State:
    """Return the checked state with the pins exactly at their targets."""
    x[system.pinned] = targets
    if not np.abs([x, v]).max() <= LARGEST_COORDINATE:
        raise FloatingPointError(
            f"{name}: the step left the numbers up to {LARGEST_COORDINATE:g}; h is too large"
        )
    return State.of(x, v)
