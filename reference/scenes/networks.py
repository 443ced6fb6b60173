"""Random networks of unequal particles and springs in motion, reproducible by their seed."""

import numpy as np

from ..arguments import IndexArray, count, integer, number
from ..mass_spring import MassSpring, State


def random_network(
    seed: int,
    *,
    particles: int = 20,
    pinned: int = 1,
    damping: float = 1.0,
    tension_only: float = 0.0,
) -> tuple[MassSpring, State]:
    """Return a random connected network in motion; no two particles or springs are alike.

    Masses lie between 0.2 and 2 kg, stiffnesses between 10 and 1000 N/m, dampings between a tenth
    of `damping` and `damping` [N s/m]. Positions and velocities are normally distributed about
    zero, by 1 m and 1 m/s along each axis. Each spring is stretched or compressed by up to a third:
    none is at its rest length. Gravity has a random direction. `pinned` particles are pinned, and a
    share `tension_only` of the springs, from 0 to 1, goes slack. A number out of range is a
    ValueError.
    """
    rng = np.random.default_rng(integer("seed", seed, minimum=0))
    n = count("particles", particles, minimum=1)
    pins = rng.permutation(n)[: integer("pinned", pinned, minimum=0, below=n + 1)]
    springs = _connected(rng, n)
    s, x = len(springs), rng.standard_normal((n, 3))
    lengths = np.linalg.norm(np.subtract(*x[springs.T]), axis=-1)
    strains = rng.uniform(0.02, 0.33, s) * rng.choice([-1.0, 1.0], s)
    system = MassSpring(
        masses=rng.uniform(0.2, 2.0, n),
        springs=springs,
        rest_lengths=lengths * (1.0 + strains),
        stiffnesses=10.0 ** rng.uniform(1.0, 3.0, s),
        dampings=number("damping", damping, minimum=0) * rng.uniform(0.1, 1.0, s),
        pinned=pins,
        gravity=5.0 * rng.standard_normal(3),
        tension_only=rng.uniform(size=s) < number("tension_only", tension_only, minimum=0),
    )
    return system, State(x, rng.standard_normal((n, 3)))


def _connected(rng: np.random.Generator, n: int) -> IndexArray:
    """Return a spanning tree and about as many other springs, with shuffled ends, (spring, 2)."""
    later = np.arange(1, n)
    tree = np.stack([rng.integers(0, later), later], axis=1)
    chords = rng.integers(0, n, (n, 2))
    pairs = np.sort(np.concatenate([tree, chords[chords[:, 0] != chords[:, 1]]]), axis=1)
    return rng.permuted(np.unique(pairs, axis=0), axis=1)
