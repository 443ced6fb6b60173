"""A request that a solver is judged by."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .sentence import Sentence


@dataclass(frozen=True, eq=False)
class Case:
    """A request with a name.

    The inputs are float64 and integer arrays, numbers and texts, by the names of the task's inputs,
    without those that the greeting does not ask for.
    """

    name: str  # unique among the cases of a task, the same in every run: "chain of 7 2"
    task: str  # a key of TASKS
    inputs: Mapping[str, Any]
    family: str  # what it is a case of: "one joint", "beyond reach", "h changed"
    about: Sentence  # what it tries, for the reader of a failure
    follows: str = ""  # the case that must be asked just before it, if any
    facts: Mapping[str, Any] = field(default_factory=dict)  # what its laws need besides the inputs

    @property
    def size(self) -> int:
        """How many numbers the request holds."""
        return sum(int(np.size(value)) for value in self.inputs.values())
