"""The records of robots and characters in engines."""

import msgspec

from ...harness.values import Details, Kind, Values
from . import PEERS


class FileValues(Values, frozen=True):
    """The size of a file in an engine, and its largest differences from the reference.

    Positions are relative to the extent of the links, rotations are between entries of matrices,
    Jacobians relative to the extent and 1 radian.
    """

    links: int
    joints: int
    freedoms: int
    positions: float
    rotations: float
    jacobians: float


class FileDetails(Details, frozen=True):
    """Why an engine reads a file otherwise or not at all, and the mimics left free."""

    configurations: int
    cause: str = ""
    free_mimics: str = msgspec.field(default="", name="free mimics")
    unread: str = ""


class EffectorDifferences(Values, frozen=True):
    """The largest differences of effectors: positions [m], and entries of rotation matrices."""

    positions: float
    rotations: float


class EngineDetails(Details, frozen=True):
    """The engine's version, and why the robot is not taken."""

    configurations: int
    version: str
    remark: str = ""


KINDS = {"": Kind(FileValues, FileDetails), PEERS: Kind(EffectorDifferences, EngineDetails)}
