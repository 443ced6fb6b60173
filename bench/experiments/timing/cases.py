"""The cases of all subjects, one file a subject."""

from collections.abc import Iterator

from . import cloth, ik, kinematics
from .case import Case

SUBJECTS = (kinematics, ik, cloth)


def cases() -> Iterator[Case]:
    """Yield the cases of all subjects."""
    for subject in SUBJECTS:
        yield from subject.cases()
