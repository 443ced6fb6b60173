"""Newton, the engine, in single precision: particles and springs, by any of its solvers.

- semi-implicit: symplectic Euler.
- VBD: vertex block descent minimises the objective of implicit Euler (Chen et al. 2024). Each
  particle takes a Newton step of its own, all of a colour at once; so neighbours must differ in
  colour.
- XPBD: extended position based dynamics (Macklin, Müller, Chentanez 2016) corrects all springs at
  once and adds their corrections of a particle, without averaging.

Collisions between particles are left out, as the reference has none. A pinned particle has mass
zero. A spring's rest length would be taken from the particles' places, and is overwritten.
"""

from typing import Any

import newton
import numpy as np
import warp as wp
from newton.solvers import SolverSemiImplicit, SolverVBD, SolverXPBD

from plumbob.reference import MassSpring, State
from plumbob.reference.arguments import FloatArray, IndexArray

from .protocol import Mover

SOLVERS: dict[str, Any] = {
    "semi-implicit": SolverSemiImplicit,
    "VBD": SolverVBD,
    "XPBD": SolverXPBD,
}


def prepare(
    system: MassSpring,
    frame: float,
    solver: str = "VBD",
    substeps: int = 1,
    own: int = 0,
    **limits: int,
) -> Mover:
    """Return a solver, stepping so many times a frame, with `iterations` a step if it iterates.

    With `own`, VBD uses the colours that Newton computes, not the colours of the springs.
    """
    wp.config.log_level = wp.LOG_ERROR
    with wp.ScopedDevice("cpu"):
        particles = model(system, own_colours=bool(own))
        return _Steps(particles, SOLVERS[solver](particles, **limits), frame / substeps, substeps)


class _Steps:
    """Steps of a solver of Newton's, so many a frame."""

    def __init__(self, particles: Any, solver: Any, h: float, substeps: int) -> None:
        self._now, self._next = particles.state(), particles.state()
        self._solver, self._control = solver, particles.control()
        self._substeps, self._h = substeps, h

    def begin(self, state: State) -> None:
        for buffer in (self._now, self._next):
            buffer.particle_q.assign(state.positions.astype(np.float32))
            buffer.particle_qd.assign(state.velocities.astype(np.float32))

    def advance(self) -> None:
        for _ in range(self._substeps):
            self._now.clear_forces()
            self._solver.step(self._now, self._next, self._control, None, self._h)
            self._now, self._next = self._next, self._now

    def positions(self) -> FloatArray:
        return np.array(self._now.particle_q.numpy(), dtype=float)


def model(system: MassSpring, *, own_colours: bool = False) -> Any:
    """Return the model, coloured by its springs, or by Newton, which sees none."""
    builder = newton.ModelBuilder(gravity=wp.vec3(*system.gravity))
    nowhere = wp.vec3(0.0, 0.0, 0.0)
    for mass, free in zip(system.masses, system.free, strict=True):
        builder.add_particle(nowhere, nowhere, float(mass) if free else 0.0, radius=0.0)
    for (i, j), k, c in zip(system.springs, system.stiffnesses, system.dampings, strict=True):
        builder.add_spring(int(i), int(j), float(k), float(c), 0.0)
    if own_colours:
        builder.color()
    else:
        builder.set_coloring(colours(system.springs, system.particle_count))
    particles: Any = builder.finalize(device="cpu")
    particles.spring_rest_length.assign(system.rest_lengths.astype(np.float32))
    particles.particle_grid = None
    return particles


def colours(springs: IndexArray, particle_count: int) -> list[IndexArray]:
    """Return groups of particles, no two of a group joined by a spring.

    In order, each particle takes the first colour that its neighbours do not have.
    """
    neighbours: list[list[int]] = [[] for _ in range(particle_count)]
    for i, j in springs.tolist():
        neighbours[i].append(j)
        neighbours[j].append(i)
    colour = np.full(particle_count, -1)
    for i, adjacent in enumerate(neighbours):
        used = set(colour[adjacent])
        colour[i] = next(number for number in range(particle_count) if number not in used)
    return [np.flatnonzero(colour == number) for number in range(colour.max() + 1)]
