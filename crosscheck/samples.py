"""Random systems to check claims, seeded: case i is the same in every run."""

from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import arguments, rotation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import MassSpring, State
from plumbob.reference.skeleton import Skeleton, checked_skeleton

# Round numbers: longer than any limb of a robot, and cloths of up to 22 particles a side.
MAXIMUM_JOINTS = 50
MINIMUM_PARTICLES, MAXIMUM_PARTICLES = 5, 500
# Number of cases after which the sizes repeat.
SIZES = 10
# h omega of a smooth problem, with omega its highest rate.
RESOLVED = 0.04
# Quantities common to all springs of a uniform network.
ALIKE = ("stiffnesses", "dampings")


def generator(quantity: str, case: int) -> np.random.Generator:
    """Return the random numbers of a quantity of a case, independent of all others."""
    whole = arguments.integer("case", case, minimum=0)
    return np.random.default_rng([20130, *quantity.encode(), whole])


def skeleton(case: int) -> Skeleton:
    """Return a chain (even cases) or a tree (odd cases) of 2 to 50 joints, 50 in cases 0 and 1.

    The names are shuffled: their order differs from ours and from an engine's. Small skeletons are
    more frequent because Pinocchio's memory grows with the cube of the joints.
    """
    rng = generator("skeleton", case)
    joints = MAXIMUM_JOINTS if case < 2 else int(2 * (MAXIMUM_JOINTS / 2) ** rng.uniform())
    parents = np.arange(joints) - 1
    if case % 2:
        parents[1:] = [rng.integers(max(0, j - 6), j) for j in range(1, joints)]
    offsets = rng.standard_normal((joints, 3)) * rng.uniform(0.05, 1.0, (joints, 1))
    return Skeleton(parents, offsets, [f"joint{i}" for i in rng.permutation(joints)])


def local_rotations(case: int, skeleton: Skeleton, *batch: int) -> FloatArray:
    """Return uniformly random local rotations, shape (*batch, joint, 4)."""
    joints = checked_skeleton(skeleton).joint_count
    return rotation.random(generator("pose", case), *batch, joints)


def reach(case: int) -> tuple[Skeleton, FloatArray, int, FloatArray]:
    """Return an IK problem: a skeleton, its start, the effector and its target.

    The effector is any joint but the root; some targets are beyond reach.
    """
    rng = generator("target", case)
    tree = skeleton(case)
    effector = int(rng.integers(1, tree.joint_count))
    direction = rotation.rotate(rotation.random(rng), [1.0, 0.0, 0.0])
    distance = rng.uniform(0.05, 1.3) * tree.reach(effector)
    target = tree.offsets[0] + distance * direction
    return tree, local_rotations(case, tree), effector, target


class StepProblem(NamedTuple):
    """A mass-spring system, its state, external forces [N] and the time step [s]."""

    system: MassSpring
    state: State
    external_forces: FloatArray
    h: float


def network(case: int, *, damped: bool = True) -> StepProblem:
    """Return a random network of 5 to 500 unequal particles, of which one or two are pinned.

    Every spring is stretched or compressed by up to a third; none is at its rest length, where
    MuJoCo's integrator "discrete" omits its stiffness. In every fifth case the ends of a spring
    coincide, and in odd cases half of the springs are tension-only.
    """
    n, tension_only = particles(case), 0.5 * (case % 2)
    problem = _random_problem(
        "motion", case, n, coincident=case % 5 == 1, tension_only=tension_only
    )
    if arguments.boolean("damped", damped):
        return problem
    undamped = problem.system.replaced(dampings=np.zeros_like(problem.system.dampings))
    return problem._replace(system=undamped)


def uniform(case: int) -> StepProblem:
    """Return a random network with one pin and the same stiffness and damping for all springs."""
    problem = _random_problem("alike", case, particles(case), pins=1)
    system = problem.system
    first = {k: np.full_like(v, v[0]) for k, v in system.arrays._asdict().items() if k in ALIKE}
    return problem._replace(system=system.replaced(**first))


def smooth(case: int) -> StepProblem:
    """Return a problem of 5 to 23 particles, none coincident, with a step that resolves it.

    h omega is at most `RESOLVED`, where omega bounds the frequencies and decay rates.
    """
    return _resolved("smooth", case)


def unpinned(case: int) -> StepProblem:
    """Return a smooth problem of 5 to 23 particles, none of them pinned."""
    return _resolved("unpinned", case, pins=0)


def drifting(case: int) -> StepProblem:
    """Return a smooth problem without pins, gravity or external forces, and so without torque."""
    problem = _resolved("drifting", case, pins=0, gravity=0.0)
    return problem._replace(external_forces=np.zeros_like(problem.external_forces))


def _resolved(quantity: str, case: int, **options: Any) -> StepProblem:
    """Return a problem of 5 or 23 particles with a step that resolves it."""
    count = particles(arguments.integer("case", case, minimum=0) % 2)
    problem = _random_problem(quantity, case, count, **options)
    return problem._replace(h=RESOLVED / highest_rate(problem.system))


def oscillator(case: int) -> tuple[MassSpring, State, float]:
    """Return an oscillator at a random phase and a step h [s], with h omega from 0.01 to 1.

    It is a particle on a spring without a rest length, pinned at the origin.
    """
    rng = generator("oscillator", case)
    mass, stiffness = rng.uniform(0.2, 2.0), 10.0 ** rng.uniform(1.0, 3.0)
    system = MassSpring([1.0, mass], [[0, 1]], 0.0, stiffness, pinned=[0], gravity=(0, 0, 0))
    x, v = np.zeros((2, 2, 3))
    x[1], v[1] = rng.standard_normal((2, 3))
    h = 10.0 ** rng.uniform(-2.0, 0.0) / np.sqrt(stiffness / mass)
    return system, State(x, v), float(h)


def line(case: int) -> StepProblem:
    """Return a chain that stays on the x axis, its first particle pinned, with h = 1/60 s.

    Spring i joins particle i to i + 1, and none is compressed so far that its ends swap.
    """
    rng = generator("line", case)
    n = 5 + 15 * case
    lengths = rng.uniform(0.5, 1.5, n - 1)
    ends = np.arange(n - 1)
    parts = _springs(rng, np.stack([ends, ends + 1], axis=1), lengths)
    system = MassSpring(
        masses=rng.uniform(0.2, 2.0, n), **parts, pinned=[0], gravity=(rng.uniform(-1, 1), 0, 0)
    )
    x, v, f = np.zeros((3, n, 3))
    x[1:, 0], v[1:, 0], f[1:, 0] = np.cumsum(lengths), *rng.standard_normal((2, n - 1))
    return StepProblem(system, State(x, v), f, 1 / 60)


def particles(case: int) -> int:
    """Return the number of particles of a case, spread evenly on a logarithmic scale."""
    share = arguments.integer("case", case, minimum=0) * 3 % SIZES / (SIZES - 1)
    return round(MINIMUM_PARTICLES * (MAXIMUM_PARTICLES / MINIMUM_PARTICLES) ** share)


def highest_rate(system: MassSpring) -> float:
    """Return a bound on the frequencies and decay rates of a system [1/s], by Gershgorin."""
    arguments.instance("system", system, MassSpring)

    def largest(per_spring: FloatArray) -> float:
        total = np.zeros(system.particle_count)
        np.add.at(total, system.springs, per_spring[:, None])
        return float((2.0 * total / system.masses).max())

    return max(np.sqrt(largest(system.stiffnesses)), largest(system.dampings))


def _random_problem(
    quantity: str,
    case: int,
    n: int,
    *,
    coincident: bool = False,
    tension_only: float = 0.0,
    pins: int | None = None,
    gravity: float = 5.0,
) -> StepProblem:
    rng = generator(quantity, case)
    springs = _network(rng, n)
    x = rng.standard_normal((n, 3))
    if coincident:
        x[springs[0, 0]] = x[springs[0, 1]]
    lengths = np.linalg.norm(x[springs[:, 0]] - x[springs[:, 1]], axis=-1)
    parts = _springs(rng, springs, lengths)
    masses = rng.uniform(0.2, 2.0, n)
    pinned = rng.choice(n, size=1 + case % 2 if pins is None else pins, replace=False)
    weight = rng.standard_normal(3) * gravity
    h = float(rng.choice([1 / 240, 1 / 60, 1 / 30]))
    state, external = State(x, rng.standard_normal((n, 3))), rng.standard_normal((n, 3))
    parts["tension_only"] = rng.uniform(size=len(springs)) < tension_only
    system = MassSpring(masses, **parts, pinned=pinned, gravity=weight)
    return StepProblem(system, state, external, h)


def _springs(rng: np.random.Generator, springs: np.ndarray, lengths: FloatArray) -> dict[str, Any]:
    """Return the arguments of strained springs of these lengths [m]."""
    s = len(springs)
    strain = rng.uniform(0.02, 0.33, s) * rng.choice([-1.0, 1.0], s)
    return {
        "springs": springs,
        "rest_lengths": np.where(lengths > 0.0, lengths * (1.0 + strain), 0.5),
        "stiffnesses": 10.0 ** rng.uniform(1.0, 3.0, s),
        "dampings": rng.uniform(0.1, 5.0, s),
    }


def _network(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return a spanning tree and as many other springs, with shuffled ends, (spring, 2)."""
    tree = [(int(rng.integers(i)), i) for i in range(1, n)]
    chords = [tuple(map(int, rng.choice(n, 2, replace=False))) for _ in range(n)]
    pairs = sorted({(min(pair), max(pair)) for pair in tree + chords})
    return rng.permuted(np.array(pairs), axis=1)
