"""Plumbob's own steps of implicit Euler, through their public interface."""

from reference import ImplicitEuler, MassSpring, State
from reference.arguments import FloatArray

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
    return _Steps(
        ImplicitEuler(
            system,
            h=frame / substeps,
            solver=solver,
            tolerance=tolerance,
            max_iterations=iterations,
        ),
        substeps,
    )


class _Steps:
    def __init__(self, integrator: ImplicitEuler, substeps: int) -> None:
        self._integrator, self._substeps = integrator, substeps

    def begin(self, state: State) -> None:
        self._state = state

    def advance(self) -> None:
        for _ in range(self._substeps):
            self._state = self._integrator.step(self._state).state

    def positions(self) -> FloatArray:
        return self._state.positions
