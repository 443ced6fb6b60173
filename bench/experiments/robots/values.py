"""The records of solvers on robots."""

import msgspec
import numpy as np

from ...harness.values import Booleans1, Floats1, Floats2, Integers1, Values
from . import REACHABLE, UNREACHABLE


class RobotWords(Values, frozen=True, kw_only=True):
    """The solver's start and version, and a description of the robot.

    Targets, a pose or a position for each effector, are solved within the tolerances [m], [rad].
    Their seeds alternate, stratum after stratum.
    """

    kind: str = ""
    version: str = ""
    tolerance: float = 0.0
    tolerance_rotation: float = 0.0
    seeds: int = 1
    strata: list[str] = msgspec.field(default_factory=list)
    effectors: list[str] = msgspec.field(default_factory=list)
    joints: int = 0
    freedom: int = 0
    target: str = ""
    robot: str = ""  # of a published table
    infeasible: float | None = None  # published share of infeasible targets [%]


class RobotSolves(RobotWords, frozen=True, kw_only=True):
    """The targets of a solver, (target,); only `setup` if no target was begun.

    Attributes:
        solved: whether the evaluation finds the target solved.
        claims: 1 or 0 as the solver claims, or -1 if it makes no claims.
        seconds: how long the first targets took [s], (round, target).
        control: how long a fixed loop took before each round [s], (round,).
        position, rotation: distance of the effectors from the target [m], [rad]; NaN without an
            answer.
        beyond: by how much the answer oversteps limits [rad].
        exception: whether the solver raised, or its process was lost.
        stratum: the number of each target's stratum.
        setup: how long the solver took before the first [s].
        overhead: of the time of a solve, what the harness adds [s]; NaN if unknown.
        bound: how near any pose may come to a target out of reach [m].
        disputed: the numbers of the targets whose answers the engines place differently.
        repeats: how many targets a solver with a time limit solves each time, (repeat,).
    """

    solved: Booleans1 | None = None
    claims: Integers1 | None = None
    seconds: Floats2 | None = None
    control: Floats1 | None = None
    position: Floats1 | None = None
    rotation: Floats1 | None = None
    beyond: Floats1 | None = None
    exception: Booleans1 | None = None
    stratum: Integers1 | None = None
    setup: float
    overhead: float | None = None
    bound: Floats1 | None = None
    disputed: Integers1 | None = None
    repeats: Integers1 | None = None

    def __post_init__(self) -> None:
        """Refuse records of which some arrays are missing, or of other lengths."""
        names = ("solved", "claims", "position", "rotation", "beyond", "stratum")
        if len({np.shape(getattr(self, name)) for name in names}) > 1:
            raise ValueError("solved: expected as many entries in every array")


KINDS = {REACHABLE: RobotSolves, UNREACHABLE: RobotSolves}
