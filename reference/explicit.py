"""Explicit integrators: symplectic Euler, and the classical Runge-Kutta method of order 4.

Dampers pull with -c ((v_i - v_j)·u) u at the current velocities, unlike in a step of implicit
Euler. `mass_spring.damper_forces` compares the two laws. A pin moves in a straight line at constant
velocity to its position at the end of the steps. Its velocity in the state is ignored.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from .arguments import LARGEST_COORDINATE, FloatArray, integer, number
from .backend.compiled import Kernel
from .backend.simd.vectors import (
    LANES,
    all_within,
    gather_vectors,
    larger,
    load_entries,
    scatter_vectors,
    square_root,
)
from .mass_spring import (
    COINCIDENT,
    MassSpring,
    State,
    add_pulls,
    check_particles,
    constant_forces,
    pin_targets,
)
from .quaternion import add, dot, load_vector, scale, store_vector, subtract

# With more steps the start of an implicit step would take as long as the step.
MOST_STEPS = 1000
# Steps times particles and springs in a call of a kernel, about 0.1 s, which no signal interrupts.
WORK = 10**7
# Two numbers for each stage of a Runge-Kutta step: the distance to the next stage along the rates
# of this stage, in steps, and the weight of these rates.
STAGES = ((0.5, 1.0 / 6.0), (0.5, 1.0 / 3.0), (1.0, 1.0 / 3.0), (0.0, 1.0 / 6.0))


def symplectic_euler(
    system: MassSpring,
    state: State,
    h: float,
    external_forces: ArrayLike | None = None,
    pin_positions: ArrayLike | None = None,
    *,
    steps: int = 1,
) -> State:
    """Return the state after steps of length h [s]: v' = v + h M^-1 f(x, v), then x' = x + h v'.

    Arguments and errors are as for `ImplicitEuler.step`; external forces stay through all steps,
    and pins reach `pin_positions` at their end. Many steps in one call save the time of the calls.
    The method is stable for h below about 2 over the highest angular frequency.

    Raises:
        FloatingPointError: if a coordinate or velocity exceeds 1e75, as after many unstable steps.
    """
    return _advanced("symplectic_euler", system, state, h, external_forces, pin_positions, steps)


def runge_kutta(
    system: MassSpring,
    state: State,
    h: float,
    external_forces: ArrayLike | None = None,
    pin_positions: ArrayLike | None = None,
    *,
    steps: int = 1,
) -> State:
    """Return the state after steps of length h [s] by the classical Runge-Kutta method of order 4.

    Arguments and errors are as for `symplectic_euler`.
    """
    return _advanced("runge_kutta", system, state, h, external_forces, pin_positions, steps)


def explicit_positions(
    system: MassSpring,
    state: State,
    h: float,
    external_forces: ArrayLike | None,
    pin_positions: ArrayLike | None,
) -> FloatArray | None:
    """Return the positions a time h [s] later, near the end of the step of implicit Euler.

    They come from stable steps of symplectic Euler; None if these are more than MOST_STEPS, or
    overflow.
    """
    steps = stable_steps(system, h)
    if steps > MOST_STEPS:
        return None
    arguments = h / steps, external_forces, pin_positions
    try:
        return symplectic_euler(system, state, *arguments, steps=int(steps)).positions
    except FloatingPointError:
        return None


def stable_steps(system: MassSpring, h: float) -> float:
    """Return how many steps of symplectic Euler through h [s] are stable.

    A step of length s is stable for a frequency w and a damping rate d if (w s)² + 2 d s <= 4.
    Without rest lengths, w² and d are at most the Gershgorin bounds of M^-1 times the graph
    Laplacians of k and of c. The result is the least n for s = h / n.
    """
    ends, free = system.springs.ravel(), system.free
    rates = []
    for values in (system.stiffnesses, system.dampings):
        sums = np.bincount(ends, np.repeat(values, 2), system.particle_count)
        rates.append(float((2.0 * sums[free] / system.masses[free]).max(initial=0.0)))
    square, damping = rates[0] * h * h, rates[1] * h
    return max(1.0, math.ceil((damping + math.sqrt(damping**2 + 4.0 * square)) / 4.0))


def _advanced(
    integrator: str,
    system: MassSpring,
    state: State,
    h: float,
    external_forces: ArrayLike | None,
    pin_positions: ArrayLike | None,
    steps: int,
) -> State:
    """Check the arguments; return the state after all steps, pins exactly at their targets."""
    h, steps = number("h", h, above=0), integer("steps", steps, minimum=1)
    check_particles(system, state)
    constant = system.weights
    if external_forces is not None:
        constant = constant_forces(system, external_forces)
    kernel, arrays = _INTEGRATORS[integrator]
    # NumPy's memory is in large pages, which kernels do not ask for.
    rows = np.empty((arrays, system.particle_count, 4))
    rows[:, :, 3] = 0.0
    x, v = rows[:2, :, :3]
    x[:], v[:] = state.positions, state.velocities
    v[system.pinned] = 0.0
    if pin_positions is not None:
        targets = pin_targets(system, pin_positions)
        with np.errstate(over="ignore"):
            v[system.pinned] = (targets - x[system.pinned]) / (steps * h)
    at_once = 1 if steps == 1 else 1 + WORK // (len(x) + len(system.springs))
    while steps > 0:
        count = steps if steps < at_once else at_once
        steps -= count
        if not kernel(rows, h, count, constant, system.arrays):
            left = f"the steps left the numbers up to {LARGEST_COORDINATE:g}; h is too large"
            raise FloatingPointError(f"{integrator}: {left}")
    if pin_positions is not None:
        x[system.pinned] = targets
    return State.of(x.copy(), v.copy())


def symplectic_euler_steps(rows, h, steps, constant, system):
    """Make steps of symplectic Euler, pins at their velocities; return `are_bounded`.

    `rows` are positions, velocities and forces, (3, particle, 4). The fourth number of a row is
    zero and fills a register.
    """
    x, v, total = rows[0], rows[1], rows[2]
    mobility, springs = mobilities(system), springs_in_lanes(system)
    for _ in range(steps):
        overwrite(total, constant)
        add_pulls_in_lanes(x, v, system, springs, total)
        for i in range(len(x)):
            v_i = add(load_vector(v, i), scale(h * mobility[i], load_vector(total, i)))
            store_vector(v, i, v_i)
            store_vector(x, i, add(load_vector(x, i), scale(h, v_i)))
    return are_bounded(x, v)


def runge_kutta_steps(rows, h, steps, constant, system):
    """Make steps of the Runge-Kutta method, as `symplectic_euler_steps` does.

    `rows` are positions, velocities, forces, positions and velocities of a stage, and positions and
    velocities at the start of a step, (7, particle, 4).
    """
    x, v, total, stage_x, stage_v = rows[0], rows[1], rows[2], rows[3], rows[4]
    x_n, v_n = rows[5], rows[6]
    mobility, springs = mobilities(system), springs_in_lanes(system)
    for _ in range(steps):
        for vectors in (stage_x, x_n):
            overwrite(vectors, x)
        for vectors in (stage_v, v_n):
            overwrite(vectors, v)
        for shift, weight in STAGES:
            overwrite(total, constant)
            add_pulls_in_lanes(stage_x, stage_v, system, springs, total)
            for i in range(len(x)):
                dx, dv = load_vector(stage_v, i), scale(mobility[i], load_vector(total, i))
                store_vector(x, i, add(load_vector(x, i), scale(weight * h, dx)))
                store_vector(v, i, add(load_vector(v, i), scale(weight * h, dv)))
                store_vector(stage_x, i, add(load_vector(x_n, i), scale(shift * h, dx)))
                store_vector(stage_v, i, add(load_vector(v_n, i), scale(shift * h, dv)))
    return are_bounded(x, v)


def add_pulls_in_lanes(x, v, system, springs, total):
    """Do the same as `add_pulls` for rows, eight springs at once, in half of the time."""
    (floors, slack, damped), count = springs, len(system.springs) // LANES * LANES
    ends = system.springs
    for s in range(0, count, LANES):
        p = subtract(gather_vectors(x, ends, s, 0), gather_vectors(x, ends, s, 1))
        length = square_root(dot(p, p))
        inverse = 1.0 / length
        if not all_within(inverse, 1.0 / COINCIDENT):
            add_pulls(x, v, system, s, s + LANES, total)
            continue
        stretch = length - load_entries(system.rest_lengths, s)
        if slack:
            stretch = larger(stretch, load_entries(floors, s))
        tension = load_entries(system.stiffnesses, s) * stretch
        if damped:
            w = subtract(gather_vectors(v, ends, s, 0), gather_vectors(v, ends, s, 1))
            tension = tension + load_entries(system.dampings, s) * (dot(w, p) * inverse)
        pull = scale(tension * inverse, p)
        scatter_vectors(total, ends, s, 0, scale(-1.0, pull))
        scatter_vectors(total, ends, s, 1, pull)
    add_pulls(x, v, system, count, len(ends), total)


def springs_in_lanes(system):
    """Return the least stretch of each spring [m], and whether any spring may be slack, is damped.

    The least stretch is 0 for a tension-only spring, otherwise minus infinity.
    """
    slack, floors = system.tension_only.any(), np.empty(0)
    if slack:
        floors = np.where(system.tension_only, 0.0, -np.inf)
    return floors, slack, system.dampings.any()


def overwrite(target, source):
    """Copy the vectors of the source, (particle, 3) or rows of four, into the target."""
    for i in range(len(target)):
        store_vector(target, i, load_vector(source, i))


def are_bounded(x, v):
    """Return whether no coordinate and no velocity exceeds LARGEST_COORDINATE or is NaN."""
    for i in range(len(x)):
        for c in range(3):
            if not (abs(x[i, c]) <= LARGEST_COORDINATE and abs(v[i, c]) <= LARGEST_COORDINATE):
                return False
    return True


def mobilities(system):
    """Return 1 / mass, zero at the pins, shape (particle,)."""
    mobility = np.reciprocal(system.masses)
    for p in system.pinned:
        mobility[p] = 0.0
    return mobility


# The kernels, and the numbers of arrays of rows.
_INTEGRATORS = {
    "symplectic_euler": (Kernel(symplectic_euler_steps), 3),
    "runge_kutta": (Kernel(runge_kutta_steps), 7),
}
