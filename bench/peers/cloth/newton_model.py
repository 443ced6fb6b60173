"""Particles and springs as a model of Newton, the engine, in single precision.

Collisions between particles are left out, as the reference has none. A pinned particle has mass
zero. A spring's rest length would be taken from the particles' places, and is overwritten.
"""

from collections.abc import Callable
from typing import Any

import newton
import numpy as np
import warp as wp

from plumbob.reference import MassSpring, State
from plumbob.reference.arguments import FloatArray, IndexArray

Solver = Callable[[Any], Any]


class NewtonSteps:
    """Steps of one of Newton's solvers, so many a frame.

    Attributes:
        model: the newton.Model.
    """

    def __init__(
        self, system: MassSpring, frame: float, substeps: int, solver: Solver, *,
        own_colours: bool = False,
    ) -> None:  # fmt: skip
        """Build the model; `solver` makes the solver for it.

        With `own_colours` the particles are coloured by Newton, which sees no springs.
        """
        wp.config.log_level = wp.LOG_ERROR
        with wp.ScopedDevice("cpu"):
            self.model = model(system, own_colours=own_colours)
            self._now, self._next = self.model.state(), self.model.state()
            self._solver, self._control = solver(self.model), self.model.control()
        self._substeps, self._h = substeps, frame / substeps

    def begin(self, state: State) -> None:
        """Put the particles into a state."""
        for mine in (self._now, self._next):
            mine.particle_q.assign(state.positions.astype(np.float32))
            mine.particle_qd.assign(state.velocities.astype(np.float32))

    def advance(self) -> None:
        """Take the steps of one frame."""
        for _ in range(self._substeps):
            self._now.clear_forces()
            self._solver.step(self._now, self._next, self._control, None, self._h)
            self._now, self._next = self._next, self._now

    def positions(self) -> FloatArray:
        """Return where the particles are [m], (particle, 3)."""
        return np.array(self._now.particle_q.numpy(), dtype=float)


def model(system: MassSpring, *, own_colours: bool = False) -> Any:
    """Return the model, coloured by its springs, or by Newton if `own_colours`."""
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
    made: Any = builder.finalize(device="cpu")
    made.spring_rest_length.assign(system.rest_lengths.astype(np.float32))
    made.particle_grid = None
    return made


def colours(springs: IndexArray, particle_count: int) -> list[IndexArray]:
    """Return groups of particles, no two of one group joined by a spring.

    One after the other, each particle takes the first colour that none of its neighbours has.
    """
    neighbours: list[list[int]] = [[] for _ in range(particle_count)]
    for i, j in springs.tolist():
        neighbours[i].append(j)
        neighbours[j].append(i)
    colour = np.full(particle_count, -1)
    for i, near in enumerate(neighbours):
        taken = set(colour[near])
        colour[i] = next(c for c in range(particle_count) if c not in taken)
    return [np.flatnonzero(colour == c) for c in range(colour.max() + 1)]
