"""Comparisons of the poses and Jacobians of the links of robots and characters."""

import contextlib
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..engines.robot_engine import UnreadableError
from ..verdict import Comparison
from .models import comparable
from .sweep import LinkKinematics, Sweep, reference_kinematics, sweep


def positions(family: str, engine: str, cases: int) -> Iterator[Comparison]:
    """Compare the positions of all links, relative to their extent."""
    for swept, ours in _read(family, engine, cases, moving=True):
        yield Comparison(
            ours.positions, swept.theirs.positions, _at_zero(swept).positions, extent(ours)
        )


def rotations(family: str, engine: str, cases: int) -> Iterator[Comparison]:
    """Compare the rotation matrices of all links."""
    for swept, ours in _read(family, engine, cases):
        yield Comparison(ours.matrices, swept.theirs.matrices, _at_zero(swept).matrices, 1.0)


def jacobians(family: str, engine: str, cases: int) -> Iterator[Comparison]:
    """Compare the Jacobians of all links, linear velocities relative to the links' extent."""
    for swept, ours in _read(family, engine, cases):
        size: FloatArray = np.repeat([extent(ours) or 1.0, 1.0], 3)[:, None]  # of the rows, (6, 1)
        theirs = swept.theirs.jacobians / size
        yield Comparison(ours.jacobians / size, theirs, np.zeros_like(theirs), 1.0)


class Differences(NamedTuple):
    """The largest differences in one model.

    Attributes:
        positions: relative to the extent of the links.
        rotations: of matrices.
        jacobians: of linear velocities relative to the extent, of angular ones to one radian.
    """

    positions: float
    rotations: float
    jacobians: float


def differences(parts: Iterable[Sweep]) -> Differences:
    """Return the largest differences between the reference and the engine in parts of a model."""
    boxes, largest = [], []
    for part in parts:
        ours = reference_kinematics(part.robot, part.q, part.links)
        x, R, J = (np.abs(a - b) for a, b in zip(ours, part.theirs, strict=True))
        boxes += [ours.positions.min(axis=(0, 1)), ours.positions.max(axis=(0, 1))]
        largest.append([e.max(initial=0.0) for e in (x, R, J[..., :3, :], J[..., 3:, :])])
    size = np.ptp(boxes, axis=0).max() or 1.0
    position, rotation, linear, angular = np.max(largest, axis=0)
    jacobian = np.maximum(linear / size, angular)
    return Differences(float(position / size), float(rotation), float(jacobian))


def extent(links: LinkKinematics) -> float:
    """Return the largest side of the box around all links in all configurations [m]."""
    return float(np.ptp(links.positions.reshape(-1, 3), axis=0).max())


def _read(
    family: str, engine: str, cases: int, *, moving: bool = False
) -> Iterator[tuple[Sweep, LinkKinematics]]:
    """Yield the first few models, except those that the engine cannot read."""
    for model in comparable(family, engine, moving=moving)[:cases]:
        with contextlib.suppress(UnreadableError):
            swept = sweep(engine, model)
            yield swept, reference_kinematics(swept.robot, swept.q, swept.links)


def _at_zero(swept: Sweep) -> LinkKinematics:
    """Return the kinematics by the reference with all coordinates at zero."""
    zero = np.tile(swept.robot.articulation.zero(), (len(swept.q), 1))
    return reference_kinematics(swept.robot, zero, swept.links)
