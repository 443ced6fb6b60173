"""A user's solver for cloths: each step of a frame is a request."""

from typing import Any

import numpy as np

from plumbob.reference import MassSpring, State
from plumbob.reference.arguments import FloatArray
from plumbob.verify.greeting import Greeting

from .connection import connection
from .protocol import Mover, OwnTime, total
from .user_solver import MOTION_TASK, STEP_TASK, Spec

_PARTS = ("masses", "springs", "rest_lengths", "stiffnesses", "dampings", "pinned", "gravity")


def system_inputs(system: MassSpring, h: float, greeting: Greeting) -> dict[str, Any]:
    """Return the part of a request that is the same in each step: the system and the step [s]."""
    inputs: dict[str, Any] = {name: getattr(system, name) for name in _PARTS} | {"h": h}
    if greeting.system.external_forces:
        inputs["external_forces"] = np.zeros((system.particle_count, 3))
    if greeting.system.tension_only:
        inputs["tension_only"] = system.tension_only
    return inputs


def state_inputs(x: FloatArray, v: FloatArray, h: float, greeting: Greeting) -> dict[str, Any]:
    """Return the part of a request that changes: positions [m] and velocities [m/s]."""
    state = {"positions": x, "velocities": v}
    if greeting.system.state == "previous_positions":
        state["previous_positions"] = x - h * v
    return state


def prepare(system: MassSpring, frame: float, spec: Spec = "", substeps: int = 1) -> Mover:
    """Return a user's solver with so many steps a frame.

    Raises:
        ValueError: if the solver's model cannot hold the system.
    """
    return _Requests(system, frame / substeps, substeps, spec)


class _Requests:
    """Steps, each a request; the first non-finite step is the last."""

    def __init__(self, system: MassSpring, h: float, substeps: int, spec: Spec) -> None:
        self._solver, self._h, self._substeps = connection(spec), h, substeps
        greeting = self._solver.greeting
        _check_model(system, greeting)
        self._task = STEP_TASK if STEP_TASK in greeting.tasks else MOTION_TASK
        self._inputs = system_inputs(system, h, greeting)
        if self._task == MOTION_TASK:
            self._inputs["steps"] = 1

    def begin(self, state: State) -> None:
        self._x, self._v = state.positions, state.velocities

    def advance(self) -> OwnTime | None:
        steps = range(self._substeps)
        return total(self._step() for _ in steps if np.isfinite(self._x).all())

    def positions(self) -> FloatArray:
        return self._x

    def _step(self) -> OwnTime:
        state = state_inputs(self._x, self._v, self._h, self._solver.greeting)
        answer, time = self._solver.answer(self._task, self._inputs | state)
        if self._task == MOTION_TASK:
            answer = {name: frames[-1] for name, frames in answer.items()}
        x = answer.get("positions")
        if x is None:
            x = self._x + self._h * answer["velocities"]
        self._x, self._v = x, answer.get("velocities", (x - self._x) / self._h)
        return time


def _check_model(system: MassSpring, greeting: Greeting) -> None:
    """Make sure that a solver's own model can hold a system.

    Raises:
        ValueError: naming the part that the model cannot hold.
    """
    can, gravity = greeting.system, system.gravity
    is_down = not gravity[[0, 2]].any() and bool(gravity[1] <= 0.0)
    one_mass, one_stiffness = can.masses == "one", can.stiffnesses == "one"
    compressible = bool(system.tension_only.any())
    reasons = {
        "it measures rest lengths itself": can.rest_lengths == "measured",
        "it pins nothing": not can.pinned and not system.free.all(),
        "it goes on from its own state": can.continues,
        "it knows one mass": one_mass and np.ptp(system.masses) > 0.0,
        "it knows one stiffness": one_stiffness and np.ptp(system.stiffnesses) > 0.0,
        "it knows gravity along -y only": can.gravity == "number" and not is_down,
        "it knows no springs that resist no compression": compressible and not can.tension_only,
    }
    for reason, applies in reasons.items():
        if applies:
            raise ValueError(f"not asked: {reason}, by its own greeting")
