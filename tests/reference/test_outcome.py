"""Every outcome is an integer that says in a sentence what it means."""

import pytest

from plumbob.reference.outcome import Outcome


def test_the_outcomes_are_those_of_the_interface():
    names = ["CONVERGED", "UNREACHABLE", "STALLED", "ITERATION_LIMIT", "DIVERGED", "AT_ROUNDING"]
    names += ["UNREACHABLE_UNSETTLED", "SADDLE"]
    assert [outcome.name for outcome in Outcome] == names
    assert [int(outcome) for outcome in Outcome] == list(range(len(names)))


@pytest.mark.parametrize("outcome", Outcome)
def test_each_has_a_sentence_of_its_own(outcome):
    assert outcome.sentence.endswith(".")
    assert sum(outcome.sentence == other.sentence for other in Outcome) == 1


def test_solved_are_those_that_got_as_far_as_asked_for_or_as_rounding_lets():
    solved = [outcome for outcome in Outcome if outcome.solved]
    assert solved == [Outcome.CONVERGED, Outcome.AT_ROUNDING]
