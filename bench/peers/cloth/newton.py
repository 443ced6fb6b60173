"""Newton, the engine, in single precision: particles and springs, by any of its solvers.

- semi-implicit: symplectic Euler.
- VBD: vertex block descent minimises the objective of implicit Euler (Chen et al. 2024). Each
  particle takes a Newton step of its own, all particles of a colour at once, so neighbours must
  differ in colour.
- XPBD: extended position based dynamics (Macklin, Müller, Chentanez 2016) corrects all springs at
  once and adds their corrections of a particle, without averaging.

The launches of a frame are captured once and replayed, as Newton's examples do: separate launches
from Python take up to twenty times as long. Collisions between particles are left out, as the
reference has none. A pinned particle has mass zero. A spring's rest length would be taken from the
particles' places, and is overwritten. `docs/peers/newton.md` gives the reasons for all settings.
"""

from typing import Any

import numpy as np

from plumbob.reference import MassSpring, State
from plumbob.reference.arguments import FloatArray

from ..peer import EXPLICIT, ITERATED, Peer, Run
from ..protocol import Mover

PEER = Peer(
    "Newton engine",
    __name__,
    "newton",
    "Apache-2.0",
    "vertex block descent, position-based dynamics, semi-implicit Euler",
    "particles and springs, in single precision",
    # All numbers were chosen on a tuning cloth (docs/peers/newton.md), but for steps of ten
    # iterations, ten a frame, which are those of its example of a hanging cloth.
    (
        Run(EXPLICIT, {"solver": "semi-implicit"}, title="Newton engine, semi-implicit"),
        Run(
            ITERATED,
            {"solver": "VBD"},
            title="Newton engine, VBD",
            ladder=(1, 3, 10, 30, 100, 300, 1000),
            motion=((10, 10), (20, 5), (40, 2), (40, 5)),
        ),
        # Corrections are added, not averaged: only short steps of one iteration stay stable.
        Run(
            EXPLICIT,
            {"solver": "XPBD", "iterations": 1},
            title="Newton engine, XPBD",
            motion=((10, 10),),
        ),
    ),
    engine="Newton engine",
)

SOLVERS = {"semi-implicit": "SolverSemiImplicit", "VBD": "SolverVBD", "XPBD": "SolverXPBD"}


def prepare(
    system: MassSpring, frame: float, solver: str = "VBD", substeps: int = 1, **limits: int
) -> Mover:
    """Return a solver, stepping so many times a frame, with `iterations` a step if iterative."""
    import newton.solvers
    import warp as wp

    wp.config.log_level = wp.LOG_ERROR
    with wp.ScopedDevice("cpu"):
        particles = model(system)
        kind = getattr(newton.solvers, SOLVERS[solver])
        return _Frames(particles, kind(particles, **limits), frame / substeps, substeps)


class _Frames:
    """Frames of so many steps of a solver of Newton's, captured as a graph."""

    def __init__(self, particles: Any, solver: Any, h: float, substeps: int) -> None:
        import warp as wp

        self._launch = wp.capture_launch
        self._state = now = particles.state()
        following, control = particles.state(), particles.control()
        with wp.ScopedCapture() as capture:
            for _ in range(substeps):
                now.clear_forces()
                solver.step(now, following, control, None, h)
                now, following = following, now
            if now is not self._state:  # after an odd number of steps
                wp.copy(self._state.particle_q, now.particle_q)
                wp.copy(self._state.particle_qd, now.particle_qd)
        self._graph, self._used = capture.graph, (solver, now, following, control)

    def begin(self, state: State) -> None:
        self._state.particle_q.assign(state.positions.astype(np.float32))
        self._state.particle_qd.assign(state.velocities.astype(np.float32))

    def advance(self) -> None:
        self._launch(self._graph)

    def positions(self) -> FloatArray:
        return np.array(self._state.particle_q.numpy(), dtype=float)


def model(system: MassSpring) -> Any:
    """Return the model, coloured by Newton's own algorithm along the springs.

    `ModelBuilder.color` sees triangles and bending edges only: all particles of a model of springs
    would have the same colour.
    """
    import newton
    import warp as wp

    builder = newton.ModelBuilder(gravity=wp.vec3(*system.gravity))
    nowhere = wp.vec3(0.0, 0.0, 0.0)
    for mass, free in zip(system.masses, system.free, strict=True):
        builder.add_particle(nowhere, nowhere, float(mass) if free else 0.0, radius=0.0)
    for (i, j), k, c in zip(system.springs, system.stiffnesses, system.dampings, strict=True):
        builder.add_spring(int(i), int(j), float(k), float(c), 0.0)
    springs = wp.array(system.springs.astype(np.int32), dtype=int)
    builder.set_coloring(newton.utils.color_graph(system.particle_count, springs))
    particles: Any = builder.finalize()
    particles.spring_rest_length.assign(system.rest_lengths.astype(np.float32))
    particles.particle_grid = None
    return particles
