"""Solvers for cloths as the bench calls them, one file each; an engine is imported there alone.

Each takes part with a ladder of settings: iterations where it iterates, steps a frame where it is
explicit. A rung of the ladder is a point in a work-precision diagram.
"""

import importlib.metadata
from collections.abc import Mapping
from typing import Any, NamedTuple

from reference import STEP_SOLVERS

from ...experiments.cloth_peers.problem import explicit_substeps

ITERATED, LINEARISED, EXPLICIT = "iterations", "one linear solve", "explicit"


class Rung(NamedTuple):
    """A solver with settings, and how they are written."""

    label: str
    settings: Mapping[str, Any]


class ClothPeer(NamedTuple):
    """A solver for cloths.

    Attributes:
        title: how it is written.
        engine: whose it is.
        module: its adapter.
        package: what must be installed.
        kind: what distinguishes its rungs.
        settings: with which its adapter is always prepared.
        ladder: iterations in one step, where it iterates.
        motion: iterations a frame when it moves on frame after frame.
    """

    title: str
    engine: str
    module: str
    package: str
    kind: str
    settings: Mapping[str, Any] = {}
    ladder: tuple[int, ...] = ()
    motion: tuple[int, ...] = ()

    @property
    def version(self) -> str:
        """The version that is installed, "" if none is."""
        try:
            return importlib.metadata.version(self.package)
        except importlib.metadata.PackageNotFoundError:
            return ""

    def step_rungs(self, frequency: float) -> list[Rung]:
        """Return the rungs for one step of one frame, cheap ones first."""
        return self._rungs(frequency, self.ladder, (1,))

    def motion_rungs(self, frequency: float) -> list[Rung]:
        """Return the rungs for a motion; steps of part of a frame are nearer to the truth."""
        return self._rungs(frequency, self.motion, PARTS)

    def _rungs(
        self, frequency: float, iterations: tuple[int, ...], parts: tuple[int, ...]
    ) -> list[Rung]:
        if self.kind == EXPLICIT:
            counts = [explicit_substeps(frequency, margin) for margin in MARGINS]
            return [self._rung(_counted(n, "step"), substeps=n) for n in counts]
        if self.kind == LINEARISED:
            return [self._rung(_counted(n, "step"), substeps=n) for n in parts]
        rungs = [self._rung(_counted(n, "iteration"), iterations=n) for n in iterations]
        if self.settings.get("solver") in EXACT and len(parts) > 1:
            enough = f"{ENOUGH:g}".replace("e-0", "e-")
            rungs += [
                self._rung(f"{_counted(n, 'step')} to {enough}", tolerance=ENOUGH, substeps=n)
                for n in parts
            ]
        return rungs

    def _rung(self, label: str, **settings: float) -> Rung:
        return Rung(label, {**self.settings, **settings})


# Explicit steps, for those at symplectic Euler's limit of stability.
MARGINS = (1.1, 2.0, 4.0)
# Steps a frame of implicit ones.
PARTS = (1, 4, 16)
# Solvers of ours that go on until a step is solved.
EXACT = ("newton", "newton_cg")
ENOUGH = 1e-6
MANY = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
FEW = (1, 2, 3, 4, 5, 6, 8, 10, 15, 20, 40)
SOME = (1, 10, 100)


def _counted(count: int, name: str) -> str:
    return f"{count:,} {name}{'' if count == 1 else 's'}"


def _ours(solver: str) -> ClothPeer:
    title = f"Plumbob {TITLES.get(solver, solver.replace('_', ' '))}"
    module, package = "bench.peers.cloth.step_solvers", "plumbob"
    settings: dict[str, Any] = {"solver": solver}
    if solver == "gauss_newton":
        settings |= {"iterations": 1}
        return ClothPeer(title, "Plumbob", module, package, LINEARISED, settings)
    ladder, motion = (FEW, (1, 3)) if solver in EXACT else (MANY, SOME)
    return ClothPeer(title, "Plumbob", module, package, ITERATED, settings, ladder, motion)


TITLES = {
    "local_global": "local/global", "lbfgs": "L-BFGS", "newton": "Newton",
    "newton_cg": "Newton-CG", "gauss_newton": "Gauss-Newton", "chebyshev": "Chebyshev",
}  # fmt: skip
_TENDONS, _FLEX = "bench.peers.cloth.mujoco_tendons", "bench.peers.cloth.mujoco_flex"
_NEWTON = "bench.peers.cloth.newton_{}"
CLOTH_PEERS = (
    *(_ours(solver) for solver in STEP_SOLVERS),
    *(
        ClothPeer(
            f"Plumbob {title}", "Plumbob", "bench.peers.cloth.explicit", "plumbob", EXPLICIT,
            {"integrator": name},
        )
        for name, title in (
            ("symplectic_euler", "symplectic Euler"), ("runge_kutta", "Runge-Kutta"),
        )
    ),
    *(
        ClothPeer(
            f"MuJoCo {name}", "MuJoCo", _TENDONS, "mujoco", EXPLICIT, {"integrator": name}
        )
        for name in ("Euler", "implicitfast")
    ),
    ClothPeer("MuJoCo flex, Euler", "MuJoCo", _FLEX, "mujoco", EXPLICIT),
    ClothPeer(
        "MuJoCo discrete", "MuJoCo", _TENDONS, "mujoco", LINEARISED, {"integrator": "discrete"}
    ),
    ClothPeer(
        "MuJoCo discrete, to the end", "MuJoCo", _TENDONS, "mujoco", LINEARISED,
        {"integrator": "discrete", "iterations": 5000, "tolerance": 1e-15},
    ),
    ClothPeer(
        "Newton engine, semi-implicit", "Newton", _NEWTON.format("semi_implicit"), "newton",
        EXPLICIT,
    ),
    ClothPeer(
        "Newton engine, VBD", "Newton", _NEWTON.format("vbd"), "newton", ITERATED, {},
        MANY, SOME,
    ),
    ClothPeer(
        "Newton engine, VBD, its own colours", "Newton", _NEWTON.format("vbd"), "newton", ITERATED,
        {"own": 1}, SOME, SOME,
    ),
    ClothPeer(
        "Newton engine, XPBD", "Newton", _NEWTON.format("xpbd"), "newton", ITERATED, {},
        SOME, SOME,
    ),
    ClothPeer(
        "Newton engine, XPBD, substeps", "Newton", _NEWTON.format("xpbd"), "newton", EXPLICIT,
        {"iterations": 1},
    ),
)  # fmt: skip
