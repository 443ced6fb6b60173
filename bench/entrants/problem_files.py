"""Problems of a user's own from files: Python, URDF, MJCF, BVH, OBJ, or a folder of these."""

from collections.abc import Sequence

from .problems import OwnProblem


def read(
    words: Sequence[str], suites: Sequence[str], effector: str | None, pins: str | None
) -> tuple[list[OwnProblem], list[str]]:
    """Return the problems in files, and the names of all problems that are meant."""
    return [], list(words)
