"""The tasks of solvers, with the names and shapes of their inputs and outputs.

The names are the keyword arguments of `reference`. The words in a shape stand for counts, equal
throughout a request: joint, frame, particle, spring, pin. The solver chooses counts without an
input, like the number of points of a resampled curve.
"""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

Kind = Literal["number", "integer", "boolean", "text"]
FILE = Path(__file__).with_name("tasks.toml")
# The foundations of each task, the last step of the computation first.
BUILDS_ON = {
    "inverse_kinematics": ("forward_kinematics",),
    "track": ("inverse_kinematics", "forward_kinematics"),
    "mass_spring_step": ("mass_spring_forces",),
    "mass_spring_motion": ("mass_spring_step", "mass_spring_forces"),
    "robot_velocity": ("robot_jacobian",),
    "robot_inverse_kinematics": ("robot_jacobian",),
    "robot_track": ("robot_inverse_kinematics", "robot_jacobian"),
}


class Field(NamedTuple):
    """An array, a number or a text of a request or an answer."""

    name: str
    shape: tuple[str | int, ...] = ()  # counts, as numbers or words; () for a single value
    kind: Kind = "number"
    optional: bool = False  # whether a request may lack it
    about: str = ""  # its meaning and its unit


class Task(NamedTuple):
    """The fields of the requests and the answers of a task."""

    name: str  # as in a request and as the name of a Python function
    about: str
    inputs: tuple[Field, ...]  # in the order in which `reference` names them
    outputs: tuple[Field, ...]  # an answer has at least one of them

    def counts(self, inputs: Mapping[str, Any]) -> dict[str, int]:
        """Return the counts in a request by the words of the shapes."""
        counts: dict[str | int, int] = {}
        for field in self.inputs:
            if inputs.get(field.name) is not None:
                counts |= zip(field.shape, np.shape(inputs[field.name]), strict=True)
        if "steps" in inputs:
            counts["frame"] = inputs["steps"]
        return {word: count for word, count in counts.items() if isinstance(word, str)}


def _load() -> dict[str, Task]:
    """Return the tasks in `tasks.toml` by name."""
    catalogue = tomllib.loads(FILE.read_text(encoding="utf-8"))

    def fields(entries: Sequence[Any]) -> Iterator[Field]:
        for entry in entries:
            if isinstance(entry, str):
                yield from fields(catalogue["groups"][entry])
            else:
                yield Field(**{**entry, "shape": tuple(entry.get("shape", ()))})

    return {
        task["name"]: Task(
            task["name"], task["about"], tuple(fields(task["inputs"])),
            tuple(fields(task["outputs"])),
        )
        for task in catalogue["tasks"]
    }  # fmt: skip


TASKS = _load()
