"""The settings that a solver for cloths is tried with, from cheap to dear.

A rung is a solver with settings: iterations where it iterates, steps a frame where it is explicit.
Each is a point in a work-precision diagram.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from ...peers.registry import EXPLICIT, LINEARISED, UNDECLARED, ClothPeer
from ...problems.falling_cloth import explicit_substeps

# Explicit steps, for those at symplectic Euler's limit of stability.
MARGINS = (1.1, 2.0, 4.0)
# Steps a frame of implicit ones.
PARTS = (1, 4, 16)
# To this residual go the steps of solvers that go on until a step is solved.
ENOUGH, ENOUGH_LABEL = 1e-6, "1e-6"


class Rung(NamedTuple):
    """A solver with settings, and how they are written."""

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
        rungs += [
            _rung(peer, f"{_counted(n, 'step')} to {ENOUGH_LABEL}", tolerance=ENOUGH, substeps=n)
            for n in parts
        ]
    return rungs


def _rung(peer: ClothPeer, label: str, **settings: float) -> Rung:
    return Rung(label, {**peer.settings, **peer.spec, **settings})


def _counted(count: int, name: str) -> str:
    return f"{count:,} {name}{'' if count == 1 else 's'}"
