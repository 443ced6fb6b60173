"""A solver that a user entered: what it is called, where it comes from, what it offers."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

# What `open_contestant` takes: a Python file or object, or a command.
Spec = str | tuple[str, ...]

# The tasks that each suite asks of an entrant.
SUITE_TASKS = {
    "ik": ("inverse_kinematics", "robot_inverse_kinematics"),
    "cloth": ("mass_spring_step", "mass_spring_motion"),
}


class Method(NamedTuple):
    """A method of an entrant: what it is asked for by, and how its rows are called."""

    name: str
    solver: str


@dataclass(frozen=True)
class Entrant:
    """A solver that was opened once and said what it is.

    Attributes:
        name: of its own, or as the user calls it.
        door: its address as the user gave it.
        spec: what opens it.
        version: of its own; "" if it says none.
        commit: of its sources, and whether they were changed since; "" outside of git.
        digest: twelve hex digits over its sources.
        tasks: that it offers.
        methods: of inverse kinematics.
        step: the method of its time step, None if it declares none.
    """

    name: str
    door: str
    spec: Spec
    version: str = ""
    commit: str = ""
    digest: str = ""
    tasks: tuple[str, ...] = ()
    methods: tuple[str, ...] = ("",)
    step: str | None = None

    def called(self) -> Iterator[Method]:
        """Yield its methods of inverse kinematics, each with the name of its rows."""
        for method in self.methods:
            several = method and len(self.methods) > 1
            yield Method(method, f"{self.name}, {method}" if several else self.name)

    @property
    def facts(self) -> dict[str, Any]:
        """What every record of it says of it."""
        return {"entrant": True, "door": self.door, "digest": self.digest}

    @property
    def conditions(self) -> dict[str, Any]:
        """What it was measured under that makes it no other measurement."""
        return {"solver_commit": self.commit}

    def offers(self, suite: str) -> list[str]:
        """Return which of its tasks a suite asks for."""
        return [task for task in SUITE_TASKS.get(suite, ()) if task in self.tasks]
