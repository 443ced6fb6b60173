"""Problems of a user's own: targets of a skeleton, a robot, a cloth."""

import functools
import hashlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plumbob.reference import MassSpring, Skeleton, State, rotation
from plumbob.reference.arguments import array, coordinates, number
from plumbob.text.printable import one_line, visible

from .chains import TargetsForSkeleton
from .robots import BenchRobot

# Letters of a user's name for a problem or a solver.
_LONGEST = 60


def clean(name: str) -> str:
    """Return a name on a line with printable letters only."""
    return one_line(visible(name.encode(errors="replace").decode()), _LONGEST)


@dataclass(frozen=True, eq=False)
class OwnProblem:
    """A user's problem: targets of balls, a chain of hinges, or a cloth."""

    name: str  # as it stands in tables
    targets: TargetsForSkeleton | None = None  # of a skeleton of balls, its last joint the effector
    robot: BenchRobot | None = None  # a chain of hinges
    cloth: tuple[MassSpring, State] | None = None  # particles, springs and the initial state
    h: float = 1 / 60  # the frame of a cloth [s]

    @property
    def suite(self) -> str:
        """The suite for this problem."""
        return "cloth" if self.cloth else "ik"

    @property
    def recorded(self) -> list[str]:
        """The names of its problems in records."""
        if self.targets is not None:
            return [self.targets.name]
        kinds = ("robots", "unreachable") if self.robot else ("peers/one step", "peers/motion")
        return [f"{kind}/{self.name}" for kind in kinds]

    @functools.cached_property
    def digest(self) -> str:
        """Twelve hex digits over its contents."""
        text, arrays = self.robot.text if self.robot else repr(self.h), list[NDArray[Any]]()
        if self.targets is not None:
            arrays += [self.targets.skeleton.offsets, self.targets.starts, self.targets.targets]
        if self.cloth is not None:
            arrays += [*self.cloth[0].arrays, self.cloth[1].positions, self.cloth[1].velocities]
        content = b"".join(part.tobytes() for part in arrays)
        return hashlib.sha256(text.encode() + content).hexdigest()[:12]


def skeleton(
    name: str,
    *,
    parents: Any,
    offsets: Any,
    targets: Any,
    starts: Any = None,
    effector: int | str = -1,
) -> OwnProblem:
    """Return the problem of targets (target, 3) for a joint of balls, from local rotations."""
    tree, targets = Skeleton(parents, offsets), coordinates("targets", targets, "target", 3)
    path, rest = tree.path(effector), rotation.identity(tree.joint_count)
    starts = array("starts", rest if starts is None else starts, "...", len(rest), 4)
    starts = np.broadcast_to(starts, (len(targets), len(rest), 4))
    chain = Skeleton(np.arange(len(path)) - 1, tree.offsets[path])  # no other joint moves it
    problem = TargetsForSkeleton(f"chain/{name}", name, chain, starts[:, path], targets)
    return OwnProblem(name, targets=problem)


def cloth(  # noqa: PLR0913 -- one field an argument
    name: str,
    *,
    positions: Any,
    springs: Any,
    stiffness: Any,
    masses: Any,
    rest_lengths: Any = None,
    pinned: Any = (),
    gravity: Any = (0.0, -9.81, 0.0),
    velocities: Any = None,
    h: float = 1 / 60,
) -> OwnProblem:
    """Return the problem of a cloth; without rest lengths its springs are at rest."""
    x = coordinates("positions", positions, "particle", 3)
    mass = np.broadcast_to(np.asarray(masses, dtype=float), len(x))
    system = MassSpring(mass, springs, 0.0, stiffness, pinned=pinned, gravity=gravity)
    if rest_lengths is None:
        a, b = system.springs.T
        rest_lengths = np.linalg.norm(x[a] - x[b], axis=1)
    state = State(x, np.zeros_like(x) if velocities is None else velocities)
    system = system.replaced(rest_lengths=rest_lengths)
    return OwnProblem(name, cloth=(system, state), h=number("h", h, above=0.0))
