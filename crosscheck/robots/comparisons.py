"""Robots and characters: where links are, how they are turned and how they move, case by case."""

import contextlib
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from reference.arguments import FloatArray

from ..engines.robot_engine import UnreadableError
from ..verdict import Comparison
from .models import comparable
from .sweep import Motion, Sweep, ours, sweep


def positions(family: str, engine: str, cases: int) -> Iterator[Comparison]:
    """Compare the positions of all links, over the room that they take up."""
    for swept, mine in _read(family, engine, cases, moving=True):
        yield Comparison(
            mine.positions, swept.theirs.positions, _at_zero(swept).positions, room(mine)
        )


def rotations(family: str, engine: str, cases: int) -> Iterator[Comparison]:
    """Compare the rotation matrices of all links."""
    for swept, mine in _read(family, engine, cases):
        yield Comparison(mine.matrices, swept.theirs.matrices, _at_zero(swept).matrices, 1.0)


def jacobians(family: str, engine: str, cases: int) -> Iterator[Comparison]:
    """Compare the Jacobians of all links, linear velocities over the room that they take up."""
    for swept, mine in _read(family, engine, cases):
        size = sizes(mine)
        theirs = swept.theirs.jacobians / size
        yield Comparison(mine.jacobians / size, theirs, np.zeros_like(theirs), 1.0)


class Differences(NamedTuple):
    """The largest differences in one model.

    Attributes:
        positions: over the room that the links take up.
        rotations: of matrices.
        jacobians: of linear velocities over the room, of angular ones over one radian.
    """

    positions: float
    rotations: float
    jacobians: float


def differences(swept: Sweep) -> Differences:
    """Return by how much the reference and the engine differ; 0 where there is nothing to move."""
    mine, theirs = ours(swept.robot, swept.q, swept.links), swept.theirs
    apart = [np.abs(a - b) for a, b in zip(mine, theirs, strict=True)]
    apart[0] /= room(mine) or 1.0
    apart[2] /= sizes(mine)
    return Differences(*(float(values.max(initial=0.0)) for values in apart))


def room(motion: Motion) -> float:
    """Return the largest side of the box around all links in all configurations [m]."""
    return float(np.ptp(motion.positions.reshape(-1, 3), axis=0).max())


def sizes(motion: Motion) -> FloatArray:
    """Return what rows of a Jacobian are measured against, (6, 1): the room, and one radian."""
    return np.repeat([room(motion) or 1.0, 1.0], 3)[:, None]


def _read(
    family: str, engine: str, cases: int, *, moving: bool = False
) -> Iterator[tuple[Sweep, Motion]]:
    """Yield the first so many models, without those that the engine turns out not to read."""
    for model in comparable(family, engine, moving=moving)[:cases]:
        with contextlib.suppress(UnreadableError):
            swept = sweep(engine, model)
            yield swept, ours(swept.robot, swept.q, swept.links)


def _at_zero(swept: Sweep) -> Motion:
    """Return the same with all coordinates at zero."""
    zero = np.tile(swept.robot.articulation.zero(), (len(swept.q), 1))
    return ours(swept.robot, zero, swept.links)
