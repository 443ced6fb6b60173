"""Wind on a cloth: drag and lift on its triangles as external forces.

After Keckeisen, Kimmerle, Thomaszewski and Wacker 2004, "Modelling Effects of Wind Fields in Cloth
Animations". A triangle of area A and unit normal n, past which the air moves with w, relative to
the mean of its corners, feels with e = w / |w|

    drag = density/2 C_drag |w|² A |n·e| e,
    lift = density/2 C_lift |w|² A (n·e) (n - (n·e) e).

|n·e| A is the area that faces the wind. Drag goes with the wind and lift at a right angle to it,
like the sine and cosine of the angle of attack together; both are the same for n and -n. The air
is not moved in return, and one triangle does not shelter another.
"""

import numpy as np
from numpy.typing import ArrayLike

from .arguments import FloatArray, array, indices, instance, number
from .backend.compiled import Kernel
from .mass_spring import State
from .quaternion import add, cross, dot, load_vector, norm, scale, store_vector, subtract


def wind_forces(
    state: State,
    triangles: ArrayLike,
    wind: ArrayLike,
    *,
    density: float = 1.2,
    drag: float = 1.0,
    lift: float = 0.0,
) -> FloatArray:
    """Return the force of the wind on each particle [N], shape (particle, 3).

    Each triangle gives a third of its force to each of its corners. A step takes the result as
    `external_forces`: the wind of the moment at which the step starts, which is explicit, so that
    the step has to be short against the time in which the wind stops a particle.

    Args:
        state: positions and velocities, those of pins as they stand there.
        triangles: indices of particles, shape (triangle, 3); how they turn does not matter.
        wind: velocity of the air [m/s], shape (3,), or (particle, 3) if it differs.
        density: of the air [kg/m³].
        drag: the coefficient of drag, about 1 for a flat plate.
        lift: the coefficient of lift.

    Raises:
        ValueError: if an argument has a wrong shape, is negative or not finite, or an index is out
            of range.
        FloatingPointError: if a force overflows.
    """
    instance("state", state, State)
    n = len(state.positions)
    air = array("wind", wind, "...", 3)
    if air.shape != (3,):
        air = array("wind", wind, n, 3)
    corners = indices("triangles", triangles, "triangle", 3, least=0, below=n)
    half = number("density", density, least=0) / 2
    coefficients = number("drag", drag, least=0) * half, number("lift", lift, least=0) * half
    with np.errstate(over="ignore", invalid="ignore"):
        forces = _forces(np.array(state.positions), air - state.velocities, corners, *coefficients)
    if not np.isfinite(forces).all():
        raise FloatingPointError("wind_forces: a force left the finite numbers")
    return forces


def triangle_forces(x, w, triangles, drag, lift):
    """Return the force on each particle; w is the wind past it, shape (particle, 3)."""
    total = np.zeros(x.shape)
    for t in range(len(triangles)):
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        first = load_vector(x, i)
        normal = cross(subtract(load_vector(x, j), first), subtract(load_vector(x, k), first))
        past = scale(1.0 / 3.0, add(add(load_vector(w, i), load_vector(w, j)), load_vector(w, k)))
        share = scale(1.0 / 3.0, plate_force(normal, past, drag, lift))
        for corner in (i, j, k):
            store_vector(total, corner, add(load_vector(total, corner), share))
    return total


def plate_force(normal, w, drag, lift):
    """Return drag and lift; the normal is as long as twice the area, density/2 is in the rest."""
    twice_area, speed = norm(normal), norm(w)
    if twice_area == 0.0 or speed == 0.0:
        return 0.0, 0.0, 0.0
    n, e = scale(1.0 / twice_area, normal), scale(1.0 / speed, w)
    facing = dot(n, e)
    pressure = 0.5 * twice_area * speed * speed
    upwards = subtract(n, scale(facing, e))
    return add(
        scale(drag * pressure * abs(facing), e),
        scale(lift * pressure * facing, upwards),
    )


_forces = Kernel(triangle_forces)
