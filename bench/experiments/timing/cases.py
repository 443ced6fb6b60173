"""The cases of all subjects, one file a subject."""

import functools

from . import cloth, ik, kinematics
from .case import Case

SUBJECTS = (kinematics, ik, cloth)


@functools.cache
def cases() -> tuple[Case, ...]:
    """Return the cases of all subjects."""
    return tuple(case for subject in SUBJECTS for case in subject.cases())
