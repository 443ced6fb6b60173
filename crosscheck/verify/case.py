"""A request that a solver is judged by."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .sentence import Sentence


@dataclass(frozen=True, eq=False)
class Case:
    """A request with a name.

    Attributes:
        name: unique among the cases of a task, the same in every run: "chain of 6 joints, pose 2".
        task: a key of TASKS.
        inputs: by the names of the task's inputs, as float64 and integer arrays, numbers and texts;
            without those that the greeting does not ask for.
        family: what it is a case of: "one joint", "beyond reach", "h changed".
        about: what it tries, for the reader of a failure.
        follows: the name of the case that must be asked just before it (a repeated request, a
            changed h), or "".
        facts: what its laws need besides the inputs.
    """

    name: str
    task: str
    inputs: Mapping[str, Any]
    family: str
    about: Sentence
    follows: str = ""
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def size(self) -> int:
        """How many numbers the request holds."""
        return sum(int(np.size(value)) for value in self.inputs.values())
