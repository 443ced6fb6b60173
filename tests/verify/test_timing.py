"""Times that are compared are of the same kind: of warm calls, the solver's and the reference's."""

import pytest

from plumbob.text.sentence import sentence
from plumbob.verify import timing
from plumbob.verify.exchange import Answer, Failure, FailureKind

UNTIMED = sentence("Not timed.")


def test_the_call_of_the_reference_that_compiles_is_not_its_time(monkeypatch):
    now, calls = [0.0], []
    monkeypatch.setattr(timing.time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(timing.time, "sleep", lambda seconds: calls.append("pause"))

    def reference():
        now[0] += 1.5 if "call" in calls else 100.0
        calls.append("call")
        return "answer"

    assert timing.time_call(reference) == ("answer", 1.5)
    assert calls == timing.CALLS * ["pause", "call"]  # as a solver waits for each request


@pytest.mark.parametrize(
    ("first", "again", "lesser"),
    [(2.0, 1.0, 1.0), (1.0, 2.0, 1.0), (0.0, 1.0, 1.0), (0.0, 0.0, 0.0)],
)
def test_a_case_that_is_asked_twice_takes_the_lesser_time_that_the_clock_sees(first, again, lesser):
    answer = timing.with_lesser_time(Answer({"x": 1}, first), Answer({"x": 2}, again))
    assert (answer.seconds, answer.values) == (lesser, {"x": 1})


@pytest.mark.parametrize(
    "again", [Answer({}, 0.5, (), UNTIMED), Failure(FailureKind.HUNG, sentence("It hangs."))]
)
def test_a_time_that_is_not_the_solvers_own_is_not_taken(again):
    first = Answer({}, 1.0)
    answer = timing.with_lesser_time(first, again)
    assert answer is first or (answer.seconds, answer.untimed) == (0.5, UNTIMED)
    assert timing.with_lesser_time(again, first) is again
