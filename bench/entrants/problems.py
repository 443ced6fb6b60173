"""Problems of a user's own: targets of a skeleton, a robot, a cloth."""

from dataclasses import dataclass

from plumbob.reference import MassSpring, State

from ..experiments.chain.problem import TargetsForSkeleton
from ..experiments.robots.problem import Robot


@dataclass(frozen=True, eq=False)
class OwnProblem:
    """A problem that a user entered.

    Attributes:
        name: as it stands in tables.
        digest: twelve hex digits over what it is made of.
        suite: which asks it, "ik" or "cloth".
        targets: of a skeleton of balls, its last joint the effector.
        robot: a chain of hinges.
        cloth: particles, springs and the state it is let go from.
        h: the frame of a cloth [s].
    """

    name: str
    digest: str
    suite: str
    targets: TargetsForSkeleton | None = None
    robot: Robot | None = None
    cloth: tuple[MassSpring, State] | None = None
    h: float = 1 / 60

    @property
    def recorded(self) -> list[str]:
        """The names of its problems in records."""
        if self.robot is not None:
            return [f"robots/{self.name}", f"unreachable/{self.name}"]
        if self.cloth is not None:
            return [f"peers/one step/{self.name}", f"peers/motion/{self.name}"]
        return [f"chain/{self.name}"]
