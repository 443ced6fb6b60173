"""Programs written apart from the reference: what is planted in them shows in their answers."""

import numpy as np
import planted_programs
import pytest
from planted_programs import FAULTS, IN

REQUESTS = planted_programs.requests()


def same(a, b):
    return a.shape == b.shape and np.allclose(a, b, rtol=0.0, atol=1e-9, equal_nan=True)


def unlike(one, other):
    """The tasks whose answers differ by more than rounding."""
    found = set()
    for request, a, b in zip(REQUESTS[1:], one[1:], other[1:], strict=True):
        a, b = planted_programs.values(a), planted_programs.values(b)
        if not all(same(a[name], b[name]) for name in a.keys() - {"iterations"}):
            found.add(request["task"])
    return found


PLANTED = [(language, fault) for language in IN for fault in IN[language]]
# The compiled program starts at once; of those that an interpreter runs, every sixth is quick.
CHOSEN = [
    pytest.param(*pair, marks=[] if pair[0] == "cpp" or n % 6 == 0 else [pytest.mark.slow])
    for n, pair in enumerate(PLANTED)
]


@pytest.mark.parametrize(("language", "fault"), CHOSEN)
def test_a_planted_fault_changes_its_tasks_answers(language, fault, program, right_answers):
    answers, _ = planted_programs.ask([*program(language), "--fault", fault], REQUESTS)
    assert FAULTS[fault]["task"] in unlike(right_answers(language), answers)


def test_each_program_has_twenty_faults_and_other_names_change_nothing(program, right_answers):
    assert all(len(faults) >= 20 for faults in IN.values())
    assert set().union(*IN.values()) == set(FAULTS)
    answers, _ = planted_programs.ask([*program("cpp"), "--fault", "none"], REQUESTS)
    assert not unlike(right_answers("cpp"), answers)
