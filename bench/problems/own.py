"""Problems of a user's own: targets of a skeleton, a robot, a cloth."""

from dataclasses import dataclass

from plumbob.reference import MassSpring, State
from plumbob.text.printable import shown, visible

from .chains import TargetsForSkeleton
from .robots import BenchRobot

# Letters of a user's name for a problem or a solver.
_LONGEST = 60


def clean(name: str) -> str:
    """Return a name on a line with printable letters only."""
    return shown(visible(name.encode(errors="replace").decode()), _LONGEST)


@dataclass(frozen=True, eq=False)
class OwnProblem:
    """A problem that a user entered: targets of balls, a chain of hinges, or a cloth."""

    name: str  # as it stands in tables
    digest: str  # twelve hex digits over its contents
    suite: str  # "ik" or "cloth"
    targets: TargetsForSkeleton | None = None  # of a skeleton of balls, its last joint the effector
    robot: BenchRobot | None = None  # a chain of hinges
    cloth: tuple[MassSpring, State] | None = None  # particles, springs and the initial state
    h: float = 1 / 60  # the frame of a cloth [s]

    @property
    def recorded(self) -> list[str]:
        """The names of its problems in records."""
        if self.targets is not None:
            return [self.targets.name]
        kinds = ("robots", "unreachable") if self.robot else ("peers/one step", "peers/motion")
        return [f"{kind}/{self.name}" for kind in kinds]
