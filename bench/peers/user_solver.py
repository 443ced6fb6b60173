"""A solver entered by a user: its name, its address, its tasks."""

from dataclasses import dataclass

# What `open_connection` takes: a Python file or object, or a command.
Spec = str | tuple[str, ...]

CHAIN_TASK, ROBOT_TASK = "inverse_kinematics", "robot_inverse_kinematics"
STEP_TASK, MOTION_TASK = "mass_spring_step", "mass_spring_motion"
# The tasks of each suite for a user's solver.
SUITE_TASKS = {"ik": (CHAIN_TASK, ROBOT_TASK), "cloth": (STEP_TASK, MOTION_TASK)}


@dataclass(frozen=True)
class UserSolver:
    """A solver, opened once to describe itself."""

    name: str  # its own, or the user's name for it
    address: str  # its address as the user gave it
    spec: Spec  # the argument that opens it
    version: str = ""  # its own; "" if it states none
    commit: str = ""  # of its sources, and whether they were changed since; "" outside of git
    digest: str = ""  # twelve hex digits over its sources
    tasks: tuple[str, ...] = ()  # that it offers
    methods: tuple[str, ...] = ("",)  # of inverse kinematics
    step: str | None = None  # the method of its time step, None if it declares none

    @property
    def titles(self) -> dict[str, str]:
        """The names of its rows, by its methods of inverse kinematics."""
        several = len(self.methods) > 1
        return {
            method: f"{self.name}, {method}" if method and several else self.name
            for method in self.methods
        }

    def offers(self, suite: str) -> list[str]:
        """Return its tasks in a suite."""
        return [task for task in SUITE_TASKS.get(suite, ()) if task in self.tasks]
