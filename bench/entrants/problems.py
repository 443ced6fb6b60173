"""Problems of a user's own."""

from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class OwnProblem:
    """A problem that a user entered.

    Attributes:
        name: as it stands in tables.
        suite: which asks it, "ik" or "cloth".
    """

    name: str
    suite: str
