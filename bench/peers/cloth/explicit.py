"""Plumbob's own explicit integrators, through their public interface."""

from reference import MassSpring, State, runge_kutta, symplectic_euler
from reference.arguments import FloatArray

from .protocol import Mover

INTEGRATORS = {"symplectic_euler": symplectic_euler, "runge_kutta": runge_kutta}


def prepare(
    system: MassSpring, frame: float, integrator: str = "symplectic_euler", substeps: int = 1
) -> Mover:
    """Return an explicit integrator that takes so many steps a frame."""
    return _Steps(system, frame, integrator, substeps)


class _Steps:
    def __init__(self, system: MassSpring, frame: float, integrator: str, substeps: int) -> None:
        self._system, self._substeps = system, substeps
        self._step, self._h = INTEGRATORS[integrator], frame / substeps

    def begin(self, state: State) -> None:
        self._state = state

    def advance(self) -> None:
        for _ in range(self._substeps):
            self._state = self._step(self._system, self._state, self._h)

    def positions(self) -> FloatArray:
        return self._state.positions
