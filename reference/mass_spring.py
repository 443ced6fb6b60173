"""Particles joined by damped springs: the model, its state, energies, forces and their matrices.

A spring from particle i to particle j has length l = |x_i - x_j| and direction u = (x_i - x_j) / l.
It stores k/2 (l - r)² and pulls i with -(k (l - r) + c (v_i - v_j)·u) u. The dampers of an implicit
Euler step have another law, see `damper_forces`.

A tension-only spring, such as a rope, is slack where l <= r: it stores no energy and does not pull.
Its damper acts in all states, as in MuJoCo. The stiffness jumps at l = r, where it is defined as
zero, the one-sided second derivative from the slack side, again as in MuJoCo. A tension-only spring
with r = 0 is never slack and equals a linear spring.

Where the ends of a spring coincide, its direction is undefined and u is set to (1, 0, 0), as in
MuJoCo. The order of the particles then decides in which direction each end is pushed; a slack
spring and a spring with r = 0 exert no force there.

Functions raise a ValueError with the name of an argument that has another shape, holds numbers that
are not finite, or is no system or state.
"""

import functools
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy import uint64 as at
from numpy.typing import ArrayLike

from .arguments import (
    BoolArray,
    FloatArray,
    IndexArray,
    KeepsReadOnly,
    array,
    check_shape,
    coordinates,
    flags,
    frozen,
    indices,
    instance,
    sizes,
)
from .backend.compiled import Kernel
from .backend.partition import LARGE, Regions, partition_springs
from .quaternion import add, dot, load_vector, norm, scale, store_vector, subtract
from .sparse.assembly import BlockSum

# Ends closer than this [m] count as coincident: the square of their distance would be subnormal.
COINCIDENT = 1e-150


class SystemArrays(NamedTuple):
    """The arrays of a mass-spring system for kernels."""

    masses: FloatArray
    springs: IndexArray
    rest_lengths: FloatArray
    stiffnesses: FloatArray
    dampings: FloatArray
    tension_only: BoolArray
    pinned: IndexArray
    gravity: FloatArray


@dataclass(frozen=True, eq=False, init=False, repr=False)
class MassSpring(KeepsReadOnly):
    """Particles and the springs between them; positions and velocities are in a `State`.

    Attributes:
        masses: [kg], shape (particle,).
        springs: the two particles of each spring, shape (spring, 2).
        rest_lengths: [m], shape (spring,).
        stiffnesses: [N/m], shape (spring,).
        dampings: along the springs [N s/m], shape (spring,).
        tension_only: whether each spring goes slack below its rest length, bool, shape (spring,).
        pinned: particles that keep their position in the state unless a step has `pin_positions`,
            ascending, shape (pinned,); their velocity in a state is ignored.
        free: whether each particle may move, bool, shape (particle,).
        gravity: acceleration [m/s²], shape (3,).
        damped: whether any spring has a damper.
        arrays: the arguments of the kernels, not to be written to.
    """

    masses: FloatArray
    springs: IndexArray
    rest_lengths: FloatArray
    stiffnesses: FloatArray
    dampings: FloatArray
    tension_only: BoolArray
    pinned: IndexArray
    free: BoolArray
    gravity: FloatArray
    damped: bool
    arrays: SystemArrays

    def __init__(
        self,
        masses: ArrayLike,
        springs: ArrayLike,
        rest_lengths: ArrayLike,
        stiffnesses: ArrayLike,
        dampings: ArrayLike = 0.0,
        pinned: ArrayLike = (),
        gravity: ArrayLike = (0.0, -9.81, 0.0),
        tension_only: ArrayLike = False,
    ) -> None:
        """Check and copy the system; a property of springs may be a single number.

        Raises:
            ValueError: if a shape is wrong, a number is negative, not finite, beyond 1e75 or below
                1e-75 but not 0, or an index is out of range. Also if a spring joins a particle to
                itself, or a free particle has no mass.
        """
        mass = sizes("masses", masses, "particle").copy()
        if len(mass) == 0:
            raise ValueError("masses: expected at least one particle, got none")
        ends = _springs(springs, len(mass))
        self._store(
            SystemArrays(
                mass,
                ends,
                _per_spring("rest_lengths", rest_lengths, len(ends)),
                _per_spring("stiffnesses", stiffnesses, len(ends)),
                _per_spring("dampings", dampings, len(ends)),
                flags("tension_only", tension_only, len(ends)),
                np.unique(indices("pinned", pinned, "pinned", minimum=0, below=len(mass))),
                array("gravity", gravity, 3).copy(),
            )
        )
        weightless = np.flatnonzero(self.free & (mass == 0))
        if len(weightless):
            raise ValueError(
                f"masses: expected free particles to have mass, got 0 at index {weightless[0]}"
            )

    def _store(self, arrays: SystemArrays) -> None:
        free = np.ones(len(arrays.masses), dtype=bool)
        free[arrays.pinned] = False
        fields = {name: frozen(values) for name, values in arrays._asdict().items()}
        damped = bool(arrays.dampings.any())
        self.__dict__.update(fields, free=frozen(free), damped=damped, arrays=arrays)

    def replaced(self, **arrays: Any) -> "MassSpring":
        """Return the system with some of its `SystemArrays` replaced, unchecked and not copied."""
        system = object.__new__(MassSpring)
        system._store(self.arrays._replace(**arrays))
        return system

    @functools.cached_property
    def with_separate_dampers(self) -> "MassSpring":
        """The same system with every damper of a tension-only spring as a spring of its own.

        These springs have no stiffness and follow all others. The system itself if there are none.
        """
        damped = np.flatnonzero(self.tension_only & (self.dampings > 0))
        if len(damped) == 0:
            return self
        arrays, zeros = self.arrays, np.zeros(len(damped))
        dampings = np.where(self.tension_only, 0.0, self.dampings)
        return self.replaced(
            springs=np.concatenate([arrays.springs, arrays.springs[damped]]),
            rest_lengths=np.concatenate([arrays.rest_lengths, arrays.rest_lengths[damped]]),
            stiffnesses=np.concatenate([arrays.stiffnesses, zeros]),
            dampings=np.concatenate([dampings, arrays.dampings[damped]]),
            tension_only=np.concatenate([arrays.tension_only, zeros > 0]),
        )

    @property
    def particle_count(self) -> int:
        """Number of particles, pinned or free."""
        return len(self.arrays.masses)

    @functools.cached_property
    def weights(self) -> FloatArray:
        """The weight of each particle [N], shape (particle, 3), not to be written to."""
        return self.masses[:, None] * self.gravity

    @functools.cached_property
    def spring_sums(self) -> FloatArray:
        """The sums of k r [N] and of 2 k [N/m] over the springs of each particle, (particle, 2)."""
        return _sums(*self.arrays[:4])

    @functools.cached_property
    def regions(self) -> Regions | None:
        """The partition of a large system for sums over threads; None for a small system."""
        large = len(self.arrays.springs) >= LARGE
        return partition_springs(self.arrays.springs, self.particle_count) if large else None

    @functools.cached_property
    def free_incidence(self) -> Any:
        """A with empty rows for pinned particles, sparse (particle, spring); see `Derivation`."""
        free = scipy.sparse.diags_array(self.free.astype(float)) @ incidence(self)
        free.eliminate_zeros()
        return free

    @functools.cached_property
    def free_blocks(self) -> "BlockSum":
        """The sum of 3 x 3 blocks over springs, rows and columns of pinned particles left empty."""
        return BlockSum(self.free_incidence)

    @functools.cached_property
    def free_masses(self) -> FloatArray:
        """The masses, shape (particle,), with 1 at the pins, whose rows are eliminated."""
        return frozen(np.where(self.free, self.masses, 1.0))

    def __repr__(self) -> str:
        counts = self.particle_count, len(self.springs), len(self.pinned)
        return "MassSpring({} particles, {} springs, {} pinned)".format(*counts)


@dataclass(frozen=True, eq=False, init=False, repr=False)
class State(KeepsReadOnly):
    """Positions and velocities of the particles at an instant.

    Attributes:
        positions: [m], shape (particle, 3).
        velocities: [m/s], shape (particle, 3).
    """

    positions: FloatArray
    velocities: FloatArray

    def __init__(self, positions: ArrayLike, velocities: ArrayLike) -> None:
        """Check and copy both; a ValueError if a shape is wrong, or a number not finite."""
        x = coordinates("positions", positions, "particle", 3)
        v = array("velocities", velocities, len(x), 3)
        self._store(x.copy(), v.copy())

    def _store(self, positions: FloatArray, velocities: FloatArray) -> None:
        positions.setflags(write=False)
        velocities.setflags(write=False)
        self.__dict__.update(positions=positions, velocities=velocities)

    @classmethod
    def of(cls, positions: FloatArray, velocities: FloatArray) -> "State":
        """Return a state of these arrays, neither checked nor copied, which become read-only."""
        state = object.__new__(cls)
        state._store(positions, velocities)
        return state

    def __repr__(self) -> str:
        return f"State({len(self.positions)} particles)"


class Derivation(NamedTuple):
    """Sparse matrices of Liu et al. 2013, before the Kronecker product with the 3 x 3 identity."""

    A: Any  # shape (particle, spring); column A_i is 1 at spring i's first end, -1 at the other
    S: Any  # shape (spring, spring); column S_i is 1 at spring i
    L: Any  # the sum of k_i A_i A_i', shape (particle, particle) [N/m]
    J: Any  # the sum of k_i A_i S_i', shape (particle, spring) [N/m]


def derivation(system: MassSpring) -> Derivation:
    """Return A, S, L and J of the system, pinned particles treated as free."""
    A, K = incidence(system), scipy.sparse.diags_array(system.stiffnesses, format="csc")
    S = scipy.sparse.eye_array(len(system.springs), format="csc")
    return Derivation(A=A, S=S, L=A @ K @ A.T, J=A @ K @ S.T)


def incidence(system: MassSpring) -> Any:
    """Return the incidence matrix A, sparse CSC (particle, spring)."""
    n, s = _system(system).particle_count, len(system.springs)
    signs, starts = np.tile([1.0, -1.0], s), 2 * np.arange(s + 1)
    return scipy.sparse.csc_array((signs, system.springs.ravel(), starts), shape=(n, s))


def rest_vectors(system: MassSpring, positions: ArrayLike) -> FloatArray:
    """Return d, shape (spring, 3) [m]: d_i = r_i u_i, each spring's vector at its rest length.

    The nearest vector of length r_i to the spring's own vector is d_i (Liu et al. 2013). For a
    slack tension-only spring, d_i is the spring's own vector.
    """
    length, u = _frames(system, positions)
    slack = system.tension_only & (system.rest_lengths > 0.0) & (length <= system.rest_lengths)
    return np.where(slack, length, system.rest_lengths)[:, None] * u


def lengths(system: MassSpring, positions: ArrayLike) -> FloatArray:
    """Return the length of each spring [m], shape (spring,)."""
    return _frames(system, positions)[0]


def stretches(system: MassSpring, positions: ArrayLike) -> FloatArray:
    """Return l - r of each spring [m], shape (spring,), zero for a slack tension-only spring."""
    stretch = lengths(system, positions) - system.rest_lengths
    return np.where(system.tension_only, np.maximum(stretch, 0.0), stretch)


def potential_energy(system: MassSpring, positions: ArrayLike) -> float:
    """Return the energy of springs and gravity [J]: sum of k/2 (l - r)² - sum of m g·x."""
    x = _positions(system, positions)
    return spring_energy(system, x) - float(np.sum(system.weights * x))


def spring_energy(system: MassSpring, positions: ArrayLike) -> float:
    """Return the energy of the springs [J]: the sum of k/2 (l - r)² over all springs not slack."""
    stretch = stretches(system, positions)
    return float(np.sum(0.5 * system.stiffnesses * stretch**2))


def kinetic_energy(system: MassSpring, state: State) -> float:
    """Return the sum of m/2 |v|² [J]."""
    _, v = checked_state(system, state)
    return float(np.sum(0.5 * system.masses[:, None] * v**2))


def forces(
    system: MassSpring, state: State, external_forces: ArrayLike | None = None
) -> FloatArray:
    """Return the total force on each particle [N], (particle, 3); at a pin, the load on the pin."""
    x, v = checked_state(system, state)
    return constant_forces(system, external_forces) + pulls(x, v, system.arrays)


def constant_forces(system: MassSpring, external_forces: ArrayLike | None = None) -> FloatArray:
    """Return gravity and the external forces on each particle [N], shape (particle, 3)."""
    weights = _system(system).weights
    if external_forces is None:
        return weights.copy()
    return weights + array("external_forces", external_forces, system.particle_count, 3)


def spring_forces(system: MassSpring, positions: ArrayLike) -> FloatArray:
    """Return the sum over springs of -k (l - r) u at the first end, its opposite at the second [N].

    Shape (particle, 3). Slack springs exert none.
    """
    x = _positions(system, positions)
    return pulls(x, np.zeros_like(x), system.arrays)


def damper_forces(system: MassSpring, state: State) -> FloatArray:
    """Return the dampers' forces -c ((v_i - v_j)·u) u at their first ends [N], (particle, 3).

    Dampers of slack springs act as well. A step of implicit Euler uses -(c/h) (l - l_n) u instead,
    which has an energy; l_n is the length before the step. At the end of a step the two forces
    differ by about c h/2 |w_t|² / l. Here w_t is the part of v_i - v_j at a right angle to u.
    """
    x, v = checked_state(system, state)
    return pulls(x, v, system.arrays._replace(stiffnesses=np.zeros(len(system.springs))))


def stiffness_matrix(system: MassSpring, positions: ArrayLike) -> Any:
    """Return the exact Hessian of the spring energy [N/m], sparse (3 particle, 3 particle).

    It is the sum, over springs not slack, of (A_i A_i') x (k u u' + k (1 - r/l) (I - u u')). The
    second, geometric term is zero for a spring with a rest length whose ends coincide.
    """
    stiffness = blocks(_positions(system, positions), system.arrays, True)
    return BlockSum(incidence(system)).matrix(stiffness)


def damping_matrix(system: MassSpring, positions: ArrayLike) -> Any:
    """Return C, sparse (3 particle, 3 particle) [N s/m]: the dampers' forces are -C v.

    C is the sum of (A_i A_i') x c u u', slack springs included.
    """
    x, never_slack = _positions(system, positions), np.zeros(len(system.springs), dtype=bool)
    dampers = system.arrays._replace(stiffnesses=system.arrays.dampings, tension_only=never_slack)
    return BlockSum(incidence(system)).matrix(blocks(x, dampers, False))


def checked_state(system: MassSpring, state: State) -> tuple[FloatArray, FloatArray]:
    """Return copies of a state's positions and velocities, zero at the pins; else an error."""
    check_particles(system, state)
    v = np.array(state.velocities)
    v[system.pinned] = 0.0
    return np.array(state.positions), v


def check_particles(system: MassSpring, state: State) -> None:
    """Raise a ValueError unless a state is one of the particles of a system."""
    _system(system)
    instance("state", state, State)
    if len(state.positions) != system.particle_count:
        expected, got = system.particle_count, len(state.positions)
        raise ValueError(f"state: expected {expected} particles, got {got}")


def pin_targets(system: MassSpring, pin_positions: ArrayLike) -> FloatArray:
    """Return the checked positions of the pins at the end of a step, shape (pinned, 3) [m]."""
    return coordinates("pin_positions", pin_positions, len(system.pinned), 3)


def spring_pulls(x, v, system):
    """Return the forces of springs and dampers on each particle, shape (particle, 3)."""
    total = np.zeros(x.shape)
    add_pulls(x, v, system, 0, len(system.springs), total)
    return total


def add_pulls(x, v, system, first, last, total):
    """Add the forces of springs `first` to `last` - 1 and their dampers."""
    for s in range(first, last):
        i, j = at(system.springs[s, 0]), at(system.springs[s, 1])
        length, p, inverse = spring_line(x, i, j)
        stretch = spring_stretch(length, system.rest_lengths[s], system.tension_only[s])
        tension = system.stiffnesses[s] * stretch
        if system.dampings[s] > 0.0:
            rate = dot(subtract(load_vector(v, i), load_vector(v, j)), p) * inverse
            tension += system.dampings[s] * rate
        pull = scale(tension * inverse, p)
        store_vector(total, i, subtract(load_vector(total, i), pull))
        store_vector(total, j, add(load_vector(total, j), pull))


def stiffness_blocks(x, system, geometric):
    """Return the 3 x 3 stiffness of each spring, zero if slack; see `stiffness_matrix`."""
    blocks = np.empty((len(system.springs), 3, 3))
    elastic = system.rest_lengths, system.stiffnesses, system.tension_only
    fill_blocks(x, system.springs, elastic, 1.0, geometric, blocks)
    return blocks


def fill_blocks(x, springs, elastic, factor, geometric, blocks):
    """Fill an array with the stiffness of each spring times a factor."""
    rest_lengths, stiffnesses, tension_only = elastic
    for s in range(len(springs)):
        length, u = spring_frame(x, springs[s, 0], springs[s, 1])
        k, transverse = factor * stiffnesses[s], 0.0
        if is_slack(length, rest_lengths[s], tension_only[s]):
            k = 0.0
        if geometric:
            transverse = k * transverse_share(length, rest_lengths[s])
        for a in range(3):
            for b in range(3):
                blocks[s, a, b] = (k - transverse) * (u[a] * u[b])
            blocks[s, a, a] += transverse


def transverse_share(length, rest_length):
    """Return 1 - r/l; where the ends coincide, 1 if the rest length is zero and 0 otherwise."""
    if length >= COINCIDENT:
        return 1.0 - rest_length / length
    return 1.0 if rest_length == 0.0 else 0.0


def sum_springs(masses, springs, rest_lengths, stiffnesses):
    """Return the sums of k r and of 2 k over the springs of each particle, (particle, 2)."""
    sums = np.zeros((len(masses), 2))
    for s in range(len(springs)):
        k = stiffnesses[s]
        for i in springs[s]:
            sums[i, 0] += k * rest_lengths[s]
            sums[i, 1] += 2.0 * k
    return sums


def spring_stretch(length, rest_length, tension_only):
    """Return l - r, or 0 for a slack spring."""
    stretch = length - rest_length
    return 0.0 if tension_only and stretch < 0.0 else stretch


def is_slack(length, rest_length, tension_only):
    """Return whether a spring is slack: tension-only, with a rest length, and no longer than it."""
    return tension_only and rest_length > 0.0 and length <= rest_length


def spring_line(x, i, j):
    """Return the length, the vector from particle j to i, and 1 over the norm of the vector.

    The vector is (1, 0, 0) where the particles coincide.
    """
    p = subtract(load_vector(x, i), load_vector(x, j))
    length = norm(p)
    if length < COINCIDENT:
        return length, (1.0, 0.0, 0.0), 1.0
    return length, p, 1.0 / length


def spring_frame(x, i, j):
    """Return the length and the direction from particle j to i; (1, 0, 0) where they coincide."""
    length, p, inverse = spring_line(x, i, j)
    return length, scale(inverse, p)


pulls = Kernel(spring_pulls)
blocks = Kernel(stiffness_blocks)
_sums = Kernel(sum_springs)


def _system(system: MassSpring) -> MassSpring:
    return instance("system", system, MassSpring)


def _positions(system: MassSpring, positions: ArrayLike) -> FloatArray:
    return coordinates("positions", positions, _system(system).particle_count, 3)


def _frames(system: MassSpring, positions: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the lengths and the directions of all springs; see `spring_frame`."""
    p = np.subtract(*_positions(system, positions)[system.springs.T])
    length = np.linalg.norm(p, axis=1)
    p[length < COINCIDENT] = 1.0, 0.0, 0.0
    return length, (1.0 / np.where(length < COINCIDENT, 1.0, length))[:, None] * p


def _springs(springs: ArrayLike, particle_count: int) -> IndexArray:
    if isinstance(springs, list | tuple) and len(springs) == 0:
        springs = np.empty((0, 2))
    ends = indices("springs", springs, "spring", 2, minimum=0, below=particle_count)
    loops = np.flatnonzero(ends[:, 0] == ends[:, 1])
    if len(loops):
        raise ValueError(
            f"springs: expected two different particles, got {ends[loops[0], 0]} twice "
            f"in spring {loops[0]}"
        )
    return ends


def _per_spring(name: str, value: ArrayLike, count: int) -> FloatArray:
    values = sizes(name, value, "...")
    if values.ndim > 0:
        check_shape(name, values, count)
    return np.array(np.broadcast_to(values, count))
