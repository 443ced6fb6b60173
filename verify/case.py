"""A request on which a solver is judged."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from plumbob.text.sentence import Sentence

# The answer that a case needs. "must" is a right answer, "may" an answer or a failure, since
# textbooks divide by zero there; "implementation-defined" is any answer by the laws, or a failure.
Requirement = Literal["must", "may", "implementation-defined"]


@dataclass(frozen=True, eq=False)
class Case:
    """A request with a name.

    The inputs are float64 and integer arrays, numbers and texts, by the names of the task's inputs.
    Inputs beyond the declarations of the greeting are left out.
    """

    name: str  # unique among the cases of a task, the same in every run: "chain of 7 2"
    task: str  # a key of TASKS
    inputs: Mapping[str, Any]
    family: str  # its kind: "one joint", "beyond reach", "h changed"
    about: Sentence  # its purpose, for the reader of a failure
    follows: str = ""  # the case that must be asked just before it, if any
    facts: Mapping[str, Any] = field(default_factory=dict)  # for its laws, besides the inputs
    requirement: Requirement = "must"

    @property
    def size(self) -> int:
        """The number of numbers in the request."""
        return sum(int(np.size(value)) for value in self.inputs.values())
