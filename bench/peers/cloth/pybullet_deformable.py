"""PyBullet: a deformable body as masses and springs, by symplectic Euler in double precision.

Its springs are the edges of a mesh of triangles, so only square cloths are possible. PyBullet adds
springs of 0.1 N/m between neighbours' neighbours; their stiffness is set to zero. Rest lengths are
taken anew from where the particles are at the first step, which is taken with the cloth flat.
Velocities cannot be written, but stay when positions are written: a step of chosen forces gives the
particles their first velocities.
"""

import functools
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from plumbob.reference import ImplicitEuler, MassSpring, State
from plumbob.reference.arguments import FloatArray, IndexArray

from ..peer import EXPLICIT, Peer, Run
from ..protocol import Mover

PEER = Peer(
    "PyBullet deformable",
    __name__,
    "pybullet",
    "Zlib",
    "semi-implicit Euler",
    "square cloths of equal undamped springs",
    (Run(EXPLICIT, title="PyBullet deformable, Euler"),),
    engine="PyBullet",
)

# The length [s] of the step to set velocities, and its gravity in units of the fastest velocity.
# Then the length [s] and number of the steps of implicit Euler to find its start.
_PUSH, _PULL, _RELAX, _RELAXATIONS, _ITERATIONS = 0.1, 4.0, 1e3, 3, 50
# Larger cloths take PyBullet minutes to load.
MAXIMUM_PARTICLES = 2500
# A step so short [s] moves nothing.
_INSTANT = 1e-12
# Rest lengths equal the flat cloth's up to rounding.
_ROUNDING = 1e-9


def prepare(system: MassSpring, frame: float, substeps: int = 1) -> Mover:
    """Return PyBullet, stepping so many times a frame; `mesh` says which cloths are possible."""
    return _Steps(system, frame / substeps, substeps)


class _Steps:
    def __init__(self, system: MassSpring, h: float, substeps: int) -> None:
        flat, triangles = mesh(system)
        text = wavefront(flat, triangles), flat.tobytes()
        pins, whole = tuple(system.pinned.tolist()), float(system.masses.sum())
        self._load = functools.partial(_body, *text, pins, whole, float(system.stiffnesses[0]))
        self._body = self._load()
        self._system, self._flat, self._h, self._substeps = system, flat, h, substeps

    def begin(self, state: State) -> None:
        # The velocities [m/s], by a step of the flat cloth, in which no spring pulls.
        self._body.write(self._flat)
        self._body.set(0.0 * self._system.gravity, _PUSH)
        self._body.step()
        before = (self._body.positions() - self._flat) / _PUSH
        if not np.isfinite(before).all():  # it blew up, and does not forget
            _body.cache_clear()
            self._body, before = self._load(), np.zeros_like(before)
        self._give(self._system.free[:, None] * state.velocities - before)
        self._body.write(state.positions)
        self._body.set(self._system.gravity, self._h)

    def advance(self) -> None:
        for _ in range(self._substeps):
            self._body.step()

    def positions(self) -> FloatArray:
        return self._body.positions()

    def _give(self, velocities: FloatArray) -> None:
        """Add to the velocities, which particles keep when put elsewhere."""
        fastest = float(np.abs(velocities).max())
        if fastest:
            gravity = np.array([0.0, -_PULL * fastest / _PUSH, 0.0])
            pulled = self._system.replaced(gravity=gravity)
            self._body.write(_pushed(pulled, velocities, self._flat))
            self._body.set(gravity, _PUSH)
            self._body.step()


class _Body:
    """A cloth in a world of its own, with the rest lengths of the flat cloth."""

    def __init__(
        self, text: str, flat: FloatArray, pins: tuple[int, ...], mass: float, stiffness: float
    ) -> None:
        import pybullet

        self._engine: Any = pybullet
        self._client: Any = pybullet.connect(pybullet.DIRECT)
        pybullet.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD, physicsClientId=self._client)
        springs = {"useMassSpring": 1, "springElasticStiffness": stiffness}
        springs |= {"springDampingStiffness": 0.0, "springBendingStiffness": 0.0}
        client = {"physicsClientId": self._client}
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "cloth.obj"
            file.write_text(text, encoding="utf-8")
            self._number = pybullet.loadSoftBody(str(file), mass=mass, **springs, **client)
        for particle in pins:
            pybullet.createSoftBodyAnchor(self._number, particle, -1, -1, **client)
        self.write(flat)  # the file was read in single precision
        self.set(np.zeros(3), _INSTANT)
        self.step()

    def __del__(self) -> None:
        self._engine.disconnect(self._client)

    def positions(self) -> FloatArray:
        flags = {"flags": self._engine.MESH_DATA_SIMULATION_MESH, "physicsClientId": self._client}
        return np.array(self._engine.getMeshData(self._number, -1, **flags)[1])

    def write(self, positions: FloatArray) -> None:
        """Put the particles elsewhere with the same velocities."""
        self._engine.resetMeshData(self._number, positions.tolist(), physicsClientId=self._client)

    def set(self, gravity: FloatArray, h: float) -> None:
        self._engine.setGravity(*gravity.tolist(), physicsClientId=self._client)
        self._engine.setTimeStep(h, physicsClientId=self._client)

    def step(self) -> None:
        self._engine.stepSimulation(self._client)


@functools.lru_cache(maxsize=1)
def _body(text: str, flat: bytes, pins: tuple[int, ...], mass: float, stiffness: float) -> _Body:
    """Return a body, kept for the next solver: loading takes time quadratic in its size."""
    return _Body(text, np.frombuffer(flat).reshape(-1, 3), pins, mass, stiffness)


def _pushed(system: MassSpring, velocities: FloatArray, start: FloatArray) -> FloatArray:
    """Return positions at which forces give particles at rest these velocities in a step.

    There the system is in equilibrium under as much force in the other direction.
    """
    force = -system.masses[:, None] * velocities / _PUSH
    euler = ImplicitEuler(system, h=_RELAX, tolerance=0.0, max_iterations=_ITERATIONS)
    rest = np.zeros_like(start)
    for _ in range(_RELAXATIONS):
        start = euler.step(State(start, rest), external_forces=force).state.positions
    return start


def mesh(system: MassSpring) -> tuple[FloatArray, IndexArray]:
    """Return the flat cloth (particle, 3) and triangles (triangle, 3) with its springs for edges.

    Raises:
        ValueError: if the system is no square cloth of equal masses and undamped springs, or large.
    """
    if system.particle_count > MAXIMUM_PARTICLES:
        raise ValueError(
            f"system: expected {MAXIMUM_PARTICLES:,} particles or fewer, which PyBullet loads in "
            f"seconds, got {system.particle_count:,}"
        )
    size = round(system.particle_count**0.5)
    i, j = np.divmod(np.arange(size**2), size)
    triangles = _triangles(size)
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, ::2]]))
    springs, edges = np.unique(np.sort(system.springs), axis=0), np.unique(edges, axis=0)
    alike = [len(np.unique(part)) == 1 for part in (system.masses, system.stiffnesses)]
    if not (all(alike) and np.array_equal(springs, edges)) or system.damped:
        raise ValueError("system: expected a square cloth, equal masses, equal undamped springs")
    if system.tension_only.any():
        raise ValueError("system: expected springs that also push")
    flat = np.stack([i, 0.0 * i, j], axis=1) * system.rest_lengths.min()
    lengths = np.linalg.norm(np.diff(flat[system.springs], axis=1)[:, 0], axis=-1)
    if np.abs(lengths - system.rest_lengths).max() > _ROUNDING:
        raise ValueError("system: expected rest lengths of a flat cloth")
    return flat, triangles


def _triangles(size: int) -> IndexArray:
    """Return the corners of triangles, whose edges become springs, (triangle, 3).

    There are two triangles for each square of particles, triangles over two edges in a row, and one
    for the last diagonal. PyBullet never finishes loading a mesh with flat or loose triangles.
    """
    at = np.arange(size**2).reshape(size, size)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    groups = [(a, b, c), (a, c, d), (a[:1, :1], b[:1, :1], d[:1, :1])]
    for grid in (at, at.T):
        neighbours = np.concatenate([grid[1:-1, 1:], grid[1:-1, -2:-1]], axis=1)
        groups.append((grid[:-2], neighbours, grid[2:]))
    return np.concatenate(
        [np.stack([corner.ravel() for corner in group], axis=1) for group in groups]
    )


def wavefront(vertices: FloatArray, triangles: IndexArray) -> str:
    """Return a mesh as the text of an OBJ file."""
    lines = ["v {!r} {!r} {!r}".format(*vertex) for vertex in vertices.tolist()]
    lines += ["f {} {} {}".format(*triangle) for triangle in (triangles + 1).tolist()]
    return "\n".join([*lines, ""])
