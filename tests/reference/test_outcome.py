"""Every outcome is an integer that says in a sentence what it means."""

import pytest

from reference.outcome import Outcome


def test_the_outcomes_are_those_of_the_interface():
    names = ["CONVERGED", "UNREACHABLE", "STALLED", "ITERATION_LIMIT", "DIVERGED"]
    names.append("UNREACHABLE_UNSETTLED")
    assert [outcome.name for outcome in Outcome] == names


@pytest.mark.parametrize("outcome", Outcome)
def test_each_has_a_sentence_of_its_own(outcome):
    assert outcome.sentence.endswith(".")
    assert sum(outcome.sentence == other.sentence for other in Outcome) == 1
