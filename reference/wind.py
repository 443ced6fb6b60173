"""Wind on a cloth: drag and lift on its triangles as external forces.

After Keckeisen, Kimmerle, Thomaszewski and Wacker 2004, "Modelling Effects of Wind Fields in Cloth
Animations". On a triangle of area A and unit normal n, where w is the velocity of the air relative
to the mean velocity of the corners and e = w / |w|, act

    drag = density/2 C_drag |w|² A |n·e| e,
    lift = density/2 C_lift |w|² A (n·e) (n - (n·e) e).

|n·e| A is the area projected along the wind. Drag is parallel to the wind and lift perpendicular to
it; both are the same for n and -n. The air is not affected by the cloth, and triangles do not
shelter each other.
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

    The force on a triangle is shared equally among its corners. Pass the result to a step as
    `external_forces`: it is evaluated at the start of the step and so explicit, which is stable
    only for steps that are short compared with the time in which drag stops a particle.

    Args:
        state: positions and velocities, also of pins.
        triangles: indices of particles, shape (triangle, 3), in either orientation.
        wind: velocity of the air [m/s], shape (3,), or (particle, 3) if it differs.
        density: of the air [kg/m³].
        drag: the coefficient of drag, about 1 for a flat plate.
        lift: the coefficient of lift.

    Raises:
        ValueError: if an argument has a wrong shape, is negative or out of range.
        FloatingPointError: if a force overflows.
    """
    instance("state", state, State)
    n = len(state.positions)
    air = array("wind", wind, "...", 3)
    if air.shape != (3,):
        air = array("wind", wind, n, 3)
    corners = indices("triangles", triangles, "triangle", 3, minimum=0, below=n)
    half = number("density", density, minimum=0) / 2
    coefficients = number("drag", drag, minimum=0) * half, number("lift", lift, minimum=0) * half
    with np.errstate(over="ignore", invalid="ignore"):
        forces = _forces(np.array(state.positions), air - state.velocities, corners, *coefficients)
    if not np.isfinite(forces).all():
        raise FloatingPointError("wind_forces: a force left the finite numbers")
    return forces


def triangle_forces(x, w, triangles, drag, lift):
    """Return the force on each particle; w is the air's velocity relative to it, (particle, 3)."""
    total = np.zeros(x.shape)
    for t in range(len(triangles)):
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        first = load_vector(x, i)
        normal = cross(subtract(load_vector(x, j), first), subtract(load_vector(x, k), first))
        relative = scale(
            1.0 / 3.0, add(add(load_vector(w, i), load_vector(w, j)), load_vector(w, k))
        )
        share = scale(1.0 / 3.0, plate_force(normal, relative, drag, lift))
        for corner in (i, j, k):
            store_vector(total, corner, add(load_vector(total, corner), share))
    return total


def plate_force(normal, w, drag, lift):
    """Return drag plus lift on a triangle, its area half the length of its normal.

    The coefficients contain the factor density/2.
    """
    twice_area, speed = norm(normal), norm(w)
    if twice_area == 0.0 or speed == 0.0:
        return 0.0, 0.0, 0.0
    n, e = scale(1.0 / twice_area, normal), scale(1.0 / speed, w)
    cosine = dot(n, e)
    pressure = 0.5 * twice_area * speed * speed
    perpendicular = subtract(n, scale(cosine, e))
    return add(
        scale(drag * pressure * abs(cosine), e), scale(lift * pressure * cosine, perpendicular)
    )


_forces = Kernel(triangle_forces)
