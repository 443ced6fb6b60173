"""The settings of a solver for cloths, from cheap to expensive.

A rung is a solver with settings: the number of iterations if it iterates, steps a frame if it is
explicit. Each is a point in a work-precision diagram.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from ...peers.registry import EXPLICIT, LINEARISED, UNDECLARED, ClothPeer
from ...problems.falling_cloth import explicit_substeps

# Explicit steps a frame, relative to symplectic Euler's limit of stability.
MARGINS = (1.1, 2.0, 4.0)
# Implicit steps a frame.
PARTS = (1, 4, 16)
# Residual of solvers that converge, in motions.
RESIDUAL, RESIDUAL_LABEL = 1e-6, "1e-6"


class Rung(NamedTuple):
    """A solver with settings, and their label."""

    label: str
    settings: Mapping[str, Any]


def step_rungs(peer: ClothPeer, frequency: float) -> list[Rung]:
    """Return the rungs for one step of one frame, cheap ones first."""
    return _rungs(peer, frequency, peer.ladder, (1,))


def motion_rungs(peer: ClothPeer, frequency: float) -> list[Rung]:
    """Return the rungs for a motion; steps of part of a frame are nearer to the truth."""
    return _rungs(peer, frequency, peer.motion, PARTS)


def _rungs(
    peer: ClothPeer, frequency: float, iterations: tuple[int, ...], parts: tuple[int, ...]
) -> list[Rung]:
    stable = [explicit_substeps(frequency, margin) for margin in MARGINS]
    substeps = {EXPLICIT: stable, LINEARISED: parts, UNDECLARED: sorted({*parts, *stable})}
    if peer.kind in substeps:
        return [_rung(peer, _counted(n, "step"), substeps=n) for n in substeps[peer.kind]]
    rungs = [_rung(peer, _counted(n, "iteration"), iterations=n) for n in iterations]
    if peer.converges and len(parts) > 1:
        for n in parts:
            label = f"{_counted(n, 'step')} to {RESIDUAL_LABEL}"
            rungs.append(_rung(peer, label, tolerance=RESIDUAL, substeps=n))
    return rungs


def _rung(peer: ClothPeer, label: str, **settings: float) -> Rung:
    return Rung(label, {**peer.settings, **peer.spec, **settings})


def _counted(count: int, name: str) -> str:
    return f"{count:,} {name}{'' if count == 1 else 's'}"
