"""Timing by pytest-benchmark: cases in one file a subject, taken by `time_cases.py`."""

from collections.abc import Iterator

from .case import Case


def cases() -> Iterator[Case]:
    """Yield the cases of all subjects; engines are imported only now."""
    from . import cloth, ik, kinematics

    for subject in (kinematics, ik, cloth):
        yield from subject.cases()
