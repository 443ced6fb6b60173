"""Plumbob's own steps of implicit Euler, through their public interface."""

from collections.abc import Callable
from typing import Any

from plumbob.reference import ImplicitEuler, MassSpring, State
from plumbob.reference.arguments import FloatArray

from .protocol import Mover


def prepare(
    system: MassSpring,
    frame: float,
    solver: str = "newton",
    substeps: int = 1,
    tolerance: float = 0.0,
    iterations: int | None = None,
) -> Mover:
    """Return one of `STEP_SOLVERS`; without a tolerance, so many iterations in every step."""
    limits: dict[str, Any] = {"tolerance": tolerance, "max_iterations": iterations}
    integrator = ImplicitEuler(system, h=frame / substeps, solver=solver, **limits)
    return Steps(lambda state: integrator.step(state).state, substeps)


class Steps:
    """So many steps a frame of what maps a state to the next."""

    def __init__(self, step: Callable[[State], State], substeps: int) -> None:
        self._step, self._substeps = step, substeps

    def begin(self, state: State) -> None:
        """Start from a state."""
        self._state = state

    def advance(self) -> None:
        """Take the steps of one frame."""
        for _ in range(self._substeps):
            self._state = self._step(self._state)

    def positions(self) -> FloatArray:
        """Return where the particles are [m], (particle, 3)."""
        return self._state.positions
