"""An entrant as a solver for cloths: a frame is one request or several, one a step."""

from typing import Any

import numpy as np

from plumbob.crosscheck.verify.greeting import Greeting
from plumbob.reference import MassSpring, State
from plumbob.reference.arguments import FloatArray

from ..peers.cloth.protocol import Mover
from .contestants import Asked, asked, remark
from .entrant import Spec

__all__ = ["prepare", "remark"]

STEP, MOTION = "mass_spring_step", "mass_spring_motion"


def prepare(system: MassSpring, frame: float, spec: Spec = "", substeps: int = 1) -> Mover:
    """Return an entrant that takes so many steps a frame.

    Raises:
        ValueError: if its model cannot hold the system.
    """
    return _Steps(asked(spec), system, frame / substeps, substeps)


class _Steps:
    def __init__(self, solver: Asked, system: MassSpring, h: float, substeps: int) -> None:
        greeting = solver.contestant.greeting
        _check_model(system, greeting)
        self._solver, self._h, self._substeps = solver, h, substeps
        self._task = STEP if STEP in greeting.tasks else MOTION
        self._known = _inputs(system, greeting, self._task) | {"h": h}
        self._before = greeting.system.state == "previous_positions"

    def begin(self, state: State) -> None:
        self._x, self._v = state.positions, state.velocities

    def advance(self) -> None:
        for _ in range(self._substeps):
            self._step()
            if not np.isfinite(self._x).all():
                raise FloatingPointError

    def positions(self) -> FloatArray:
        return self._x

    def _step(self) -> None:
        inputs = {**self._known, "positions": self._x, "velocities": self._v}
        if self._before:
            inputs["previous_positions"] = self._x - self._h * self._v
        values = self._solver.answer(self._task, inputs).values
        found: dict[str, FloatArray] = {
            name: value[-1] if self._task == MOTION else value for name, value in values.items()
        }
        moved = found.get("positions")
        if moved is None:
            moved = self._x + self._h * found["velocities"]
        self._x, self._v = moved, found.get("velocities", (moved - self._x) / self._h)


def _inputs(system: MassSpring, greeting: Greeting, task: str) -> dict[str, Any]:
    known: dict[str, Any] = {
        "masses": system.masses,
        "springs": system.springs,
        "rest_lengths": system.rest_lengths,
        "stiffnesses": system.stiffnesses,
        "dampings": system.dampings,
        "pinned": system.pinned,
        "gravity": system.gravity,
    }
    if greeting.system.external_forces:
        known["external_forces"] = np.zeros((system.particle_count, 3))
    if greeting.system.tension_only:
        known["tension_only"] = system.tension_only
    return known | ({"steps": 1} if task == MOTION else {})


def _is_downward(gravity: FloatArray) -> bool:
    return not gravity[[0, 2]].any() and bool(gravity[1] <= 0.0)


def _check_model(system: MassSpring, greeting: Greeting) -> None:
    """Make sure that a solver's own model can hold a system.

    Raises:
        ValueError: if it cannot; the message says in what.
    """
    can = greeting.system
    wrong = [
        words
        for words, cannot in (
            ("it measures rest lengths itself", can.rest_lengths == "measured"),
            ("it pins nothing", not can.pinned and not system.free.all()),
            ("it goes on from its own state", can.continues),
            ("it knows one mass", can.masses == "one" and np.ptp(system.masses) > 0.0),
            ("it knows one stiffness",
             can.stiffnesses == "one" and np.ptp(system.stiffnesses) > 0.0),
            ("it knows gravity along -y only",
             can.gravity == "number" and not _is_downward(system.gravity)),
            ("it knows no springs that resist no compression",
             bool(system.tension_only.any()) and not can.tension_only),
        )
        if cannot
    ]  # fmt: skip
    if wrong:
        raise ValueError(f"not asked: {wrong[0]}, by its own greeting")
