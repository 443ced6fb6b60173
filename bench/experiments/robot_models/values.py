"""The records of robots and characters in engines."""

from ...harness.values import Values
from . import PEERS


class FileWords(Values, frozen=True, kw_only=True):
    """Why an engine reads a file otherwise or not at all, and the mimics left free."""

    configurations: int
    cause: str = ""
    free_mimics: str = ""
    unread: str = ""


class FileValues(FileWords, frozen=True):
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


class EngineWords(Values, frozen=True, kw_only=True):
    """The engine's version."""

    configurations: int
    version: str


class EffectorDifferences(EngineWords, frozen=True):
    """The largest differences of effectors: positions [m], and entries of rotation matrices."""

    positions: float
    rotations: float


KINDS = {"": FileValues, PEERS: EffectorDifferences}
