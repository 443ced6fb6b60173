"""Ask anyone's solver for the motion of a scene, through the doors that `plumbob verify` has."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from plumbob.crosscheck.verify.case import Case
from plumbob.crosscheck.verify.contestant import Contestant, Failure, NoGreetingError
from plumbob.crosscheck.verify.message import shown
from plumbob.crosscheck.verify.sentence import sentence
from plumbob.crosscheck.verify.solvers import open_contestant
from plumbob.reference import Skeleton, forward_kinematics
from plumbob.reference.arguments import FloatArray

from .ours import ARM, CLOTH, Drawn, Fallen, H

TRACK, REACH = "track", "inverse_kinematics"
STEP, MOTION = "mass_spring_step", "mass_spring_motion"
# What a scene asks for: one of these tasks.
ARM_TASKS, CLOTH_TASKS = (TRACK, REACH), (STEP, MOTION)
SYSTEM = ("masses", "springs", "rest_lengths", "stiffnesses", "dampings", "pinned", "gravity")
TOLERANCE, SWEEPS = 1e-4, 100
Told = Callable[[int, int], None]


class Yours:
    """A solver behind its door; `close` ends it.

    Attributes:
        door: its address as the user gave it.
        name: what it calls itself, or else its address.
        tasks: that it offers.
    """

    def __init__(self, words: Sequence[str]) -> None:
        """Open it.

        Raises:
            ValueError: if there is no such solver, or it does not say what it offers.
        """
        self.door = " ".join(words)
        self._contestant: Contestant = open_contestant(words[0] if len(words) == 1 else words)
        try:
            self._greeting = self._contestant.greeting
        except NoGreetingError as error:
            self.close()
            why = shown(str(error.failure.sentence), 500)
            raise ValueError(f"with: expected a solver, got {self.door}: {why}") from None
        self.tasks = self._greeting.tasks
        said = self._greeting.name
        self.name = self.door if said == "solver" else said

    def close(self) -> None:
        """End it and whatever it has started."""
        self._contestant.close()

    @property
    def scene(self) -> str:
        """The scene that it is shown with if none is named."""
        task = self.offered("an arm or a cloth", ARM_TASKS + CLOTH_TASKS)
        return ARM if task in ARM_TASKS else CLOTH

    def offered(self, scene: str, wanted: Sequence[str]) -> str:
        """Return the first of some tasks that it offers.

        Raises:
            ValueError: if it offers none; the message says which it has and which are needed.
        """
        for task in wanted:
            if task in self.tasks:
                return task
        raise ValueError(
            f"with: expected a solver with a function {' or '.join(wanted)} for "
            f"{scene}, got {self.door}, which has {', '.join(self.tasks)}; plumbob verify --list "
            "says what each takes and returns"
        )

    def draws(self, found: Drawn, told: Told) -> FloatArray:
        """Return the joints' positions as it follows the curve, (frame, joint, 3)."""
        inputs = {
            "parents": found.skeleton.parents,
            "offsets": found.skeleton.offsets,
            "local_rotations": found.rest,
            "effector": len(found.skeleton.parents) - 1,
            "tolerance": TOLERANCE,
            "max_iterations": SWEEPS,
            "method": self._greeting.methods[0] if self._greeting.methods else "",
        }
        if self.offered("an arm", ARM_TASKS) == TRACK:
            values = self._answer(TRACK, {**inputs, "curve": found.curve}, "the curve")
            return _positions(found.skeleton, values)
        return self._reaches(found, inputs, told)

    def _reaches(self, found: Drawn, inputs: dict[str, Any], told: Told) -> FloatArray:
        """Return the positions of all frames, each solved from the answer to the one before."""
        frames = []
        for i, target in enumerate(found.curve):
            what = f"frame {i + 1} of {len(found.curve)}"
            values = self._answer(REACH, {**inputs, "target": target}, what)
            frames.append(_positions(found.skeleton, values))
            inputs["local_rotations"] = values.get("local_rotations", inputs["local_rotations"])
            told(i + 1, len(found.curve))
        return np.array(frames)

    def falls(self, found: Fallen, told: Told) -> FloatArray:
        """Return where particles are after each step, the start first, (frame, particle, 3)."""
        system, steps = found.system, len(found.positions) - 1
        inputs: dict[str, Any] = {name: getattr(system, name) for name in SYSTEM} | {"h": H}
        if self._greeting.system.tension_only:
            inputs["tension_only"] = system.tension_only
        if self._greeting.system.external_forces:
            inputs["external_forces"] = np.zeros_like(found.start.positions)
        if self._greeting.system.rest_lengths == "measured":
            inputs["rest_positions"] = found.start.positions
        x, v = found.start.positions, found.start.velocities
        task = self.offered("a cloth", CLOTH_TASKS)
        if task == MOTION:
            asked = {**inputs, "steps": steps} | self._state(x, v)
            values = self._answer(MOTION, asked, "the motion")
            return np.array([x, *_named(values, "positions")])
        frames = [x]
        for i in range(steps):
            values = self._answer(STEP, inputs | self._state(x, v), f"step {i + 1} of {steps}")
            moved = _named(values, "positions")
            x, v = moved, values.get("velocities", (moved - x) / H)
            if not np.isfinite(x).all():
                break
            frames.append(x)
            told(i + 1, steps)
        return np.array([*frames, *[np.full_like(x, np.nan)] * (steps + 1 - len(frames))])

    def _state(self, x: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
        state = {"positions": x, "velocities": v}
        if self._greeting.system.state == "previous_positions":
            state["previous_positions"] = x - H * v
        return state

    def _answer(self, task: str, inputs: dict[str, Any], what: str) -> dict[str, Any]:
        """Return what it answers.

        Raises:
            ValueError: if it gives no answer; the message says where and why.
        """
        found = self._contestant.answer(Case(what, task, inputs, "show", sentence("")))
        if isinstance(found, Failure):
            why = shown(str(found.sentence), 300)
            raise ValueError(
                f"with: expected an answer to {what}, got none from {self.door}: {why}"
            )
        return dict(found.values)


def _positions(skeleton: Skeleton, values: dict[str, Any]) -> FloatArray:
    """Return the positions of joints, from the rotations where they were answered."""
    if "local_rotations" not in values:
        return _named(values, "positions")
    rotations = values["local_rotations"]
    with np.errstate(all="ignore"):
        unit = rotations / np.linalg.norm(rotations, axis=-1, keepdims=True)
    valid = np.isfinite(unit).all(axis=(-2, -1))
    unit[~valid] = [1.0, 0.0, 0.0, 0.0]
    positions = np.array(forward_kinematics(skeleton, unit).positions)
    positions[~valid] = np.nan
    return positions


def _named(values: dict[str, Any], name: str) -> FloatArray:
    if name not in values:
        raise ValueError(f"with: expected {name} in the answer, got {', '.join(values)}")
    array: FloatArray = values[name]
    return array
