"""The entrant that works in this process's child: one at a time, opened when it is first asked."""

from collections.abc import Mapping
from typing import Any

from plumbob.crosscheck.verify.case import Case
from plumbob.crosscheck.verify.contestant import Answer, Contestant, Failure
from plumbob.crosscheck.verify.message import NO_SECONDS
from plumbob.crosscheck.verify.sentence import sentence
from plumbob.crosscheck.verify.solvers import Limits, open_contestant

from ..harness.progress import TROUBLE, announce
from ..harness.stopwatch import behind_door
from ..harness.worker import NoAnswerError
from .entrant import Spec

# The bench itself loses patience with a silent worker sooner: see `bench/harness/isolation.py`.
LIMITS = Limits(first=900.0, request=900.0, line=1 << 26)
_ABOUT = sentence("")


class Asked:
    """A solver behind its door.

    Attributes:
        contestant: the solver.
        remark: how its times are taken, where that is not by its own clock.
    """

    def __init__(self, spec: Spec) -> None:
        self.contestant: Contestant = open_contestant(spec, LIMITS)
        self.remark, self._has_trouble = "", False

    def answer(self, task: str, inputs: Mapping[str, Any]) -> Answer:
        """Return what it answers.

        Raises:
            NoAnswerError: if there is none.
        """
        case = Case("of the bench", task, inputs, "bench", _ABOUT)
        found = behind_door(lambda: self._answered(case), lambda answer: answer.seconds, _doubt)
        if doubt := _doubt(found):
            self._announce(doubt)
        elif found.untimed or not found.seconds:
            self.remark = 'timed by the round trip of a request, for want of valid "seconds"'
        return found

    def _answered(self, case: Case) -> Answer:
        found = self.contestant.answer(case)
        if isinstance(found, Failure):
            why = str(found.sentence)
            self._announce(why)
            raise NoAnswerError(why)
        return found

    def _announce(self, why: str) -> None:
        """Announce what is wrong with its answers or times, the first time that something is."""
        if not self._has_trouble:
            announce(self.contestant.greeting.name, TROUBLE, why)
        self._has_trouble = True


def _doubt(answer: Answer) -> str:
    """Return why the time that an answer claims is not taken, "" if it is, or claims none."""
    return "" if answer.untimed in (None, NO_SECONDS) else str(answer.untimed)


_open: dict[Spec, Asked] = {}


def asked(spec: Spec) -> Asked:
    """Return a solver, the same as before if it is asked again; any other is ended."""
    if spec not in _open:
        for other in list(_open):
            _open.pop(other).contestant.close()
        _open[spec] = Asked(spec)
    return _open[spec]


def remark() -> str:
    """Return what is to be said of the times of the solver that works."""
    return next(iter(_open.values())).remark if _open else ""
