"""MuJoCo's models of cloths, kept: building one takes time cubic in the number of particles."""

from typing import TypeVar

import numpy as np

from plumbob.crosscheck.engines import MujocoMassSpring
from plumbob.reference import MassSpring

Engine = TypeVar("Engine", bound=MujocoMassSpring)

# What a model is built from; stiffness and damping are set anew every time.
_BUILT_FROM = ("masses", "springs", "rest_lengths", "tension_only", "pinned", "gravity")
_kept: dict[tuple[type, int], tuple[MassSpring, MujocoMassSpring]] = {}


def kept(kind: type[Engine], system: MassSpring) -> Engine:
    """Return the engine made before for a system alike but for stiffness and damping, or a new one.

    At most one is kept for each number of particles.
    """
    key = kind, system.particle_count
    if key in _kept and _alike(_kept[key][0], system):
        engine = _kept[key][1]
        assert isinstance(engine, kind)
        return engine
    engine = kind(system)
    _kept[key] = system, engine
    return engine


def _alike(one: MassSpring, other: MassSpring) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in _BUILT_FROM)
