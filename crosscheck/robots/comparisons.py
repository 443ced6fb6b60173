"""Comparisons of the poses and Jacobians of the links of robots and characters."""

import contextlib
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from reference.arguments import FloatArray

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
        size = jacobian_scales(ours)
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


def differences(swept: Sweep) -> Differences:
    """Return the largest differences between the reference and the engine; 0 without links."""
    ours = reference_kinematics(swept.robot, swept.q, swept.links)
    errors = [np.abs(a - b) for a, b in zip(ours, swept.theirs, strict=True)]
    errors[0] /= extent(ours) or 1.0
    errors[2] /= jacobian_scales(ours)
    return Differences(*(float(values.max(initial=0.0)) for values in errors))


def extent(links: LinkKinematics) -> float:
    """Return the largest side of the box around all links in all configurations [m]."""
    return float(np.ptp(links.positions.reshape(-1, 3), axis=0).max())


def jacobian_scales(links: LinkKinematics) -> FloatArray:
    """Return the scales of the rows of a Jacobian, (6, 1): the extent [m], and one radian."""
    return np.repeat([extent(links) or 1.0, 1.0], 3)[:, None]


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
