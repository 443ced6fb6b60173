"""A solver whose answers depend on the requests before is told so, and no other one is."""

import numpy as np
import pytest
from kinematics_solvers import FORWARD, textbook

from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Greeting
from plumbob.verify.judgement import Verdict
from plumbob.verify.take import kept_state
from plumbob.verify.verify import verify

RIGHT = textbook(FORWARD)


class Program(FunctionConnection):
    """Functions whose memory ends with their process."""

    def __init__(self, function):
        self.memory = {}
        super().__init__(
            {FORWARD: lambda **inputs: function(self.memory, **inputs)}, Greeting(1, (FORWARD,))
        )

    def close(self):
        self.memory.clear()


def cached_by_count(memory, parents, offsets, local_rotations):
    kept = memory.setdefault(len(parents), offsets)
    return RIGHT(parents=parents, offsets=kept, local_rotations=local_rotations)


def never_cleared(memory, parents, offsets, local_rotations):
    memory["shift"] = memory.get("shift", 0.0) + 0.1
    answer = RIGHT(parents=parents, offsets=offsets, local_rotations=local_rotations)
    return {**answer, "positions": answer["positions"] + memory["shift"]}


def without_state(memory, **inputs):
    answer = RIGHT(**inputs)
    return {**answer, "positions": answer["positions"] + np.arange(3.0)}


def test_what_is_kept_by_the_number_of_joints_is_named():
    report = verify(Program(cached_by_count)).tasks[0]
    assert report.verdict is Verdict.WRONG
    assert report.diagnosis.explanations[0].faults == (kept_state.NAME,)
    assert report.diagnosis.explanations[0].share > 0.5


@pytest.mark.parametrize("function", [never_cleared, without_state])
def test_noise_and_stateless_mistakes_are_not_taken_for_it(function):
    report = verify(Program(function)).tasks[0]
    assert report.verdict is Verdict.WRONG
    assert all(found.faults != (kept_state.NAME,) for found in report.diagnosis.explanations)
