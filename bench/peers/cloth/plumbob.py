"""Plumbob's own steps, implicit Euler's and explicit, through their public interface."""

from collections.abc import Callable
from functools import partial
from typing import Any

from plumbob.reference import ImplicitEuler, MassSpring, State, runge_kutta, symplectic_euler
from plumbob.reference.arguments import FloatArray

from ..peer import EXPLICIT, Peer, Run
from ..protocol import Mover

PEER = Peer(
    "Plumbob",
    __name__,
    "plumbob",
    "MIT",
    "implicit Euler by each of its solvers, explicit integrators",
    "particles and springs with dampers",
    # The runs of `STEP_SOLVERS` stand in `catalogue`, for other experiments have them too.
    (
        Run(EXPLICIT, {"solver": "symplectic_euler"}, title="Plumbob symplectic Euler"),
        Run(EXPLICIT, {"solver": "runge_kutta"}, title="Plumbob Runge-Kutta"),
    ),
    engine="Plumbob",
)

INTEGRATORS = {"symplectic_euler": symplectic_euler, "runge_kutta": runge_kutta}


def prepare(
    system: MassSpring,
    frame: float,
    solver: str = "newton",
    substeps: int = 1,
    tolerance: float = 0.0,
    iterations: int | None = None,
) -> Mover:
    """Return an explicit integrator, or a solver of `STEP_SOLVERS`.

    Without a tolerance, the latter makes so many iterations in every step.
    """
    h = frame / substeps
    if solver in INTEGRATORS:
        return _Steps(partial(INTEGRATORS[solver], system, h=h, steps=substeps), 1)
    limits: dict[str, Any] = {"tolerance": tolerance, "max_iterations": iterations}
    integrator = ImplicitEuler(system, h=h, solver=solver, **limits)
    return _Steps(lambda state: integrator.step(state).state, substeps)


class _Steps:
    """A frame as so many applications of a map from a state to a later one."""

    def __init__(self, step: Callable[[State], State], substeps: int) -> None:
        self._step, self._substeps = step, substeps

    def begin(self, state: State) -> None:
        self._state = state

    def advance(self) -> None:
        for _ in range(self._substeps):
            self._state = self._step(self._state)

    def positions(self) -> FloatArray:
        return self._state.positions
