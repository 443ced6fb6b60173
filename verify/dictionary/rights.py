"""The keys of right programs, in each of the choices that a solver may leave undeclared."""

from collections.abc import Mapping
from functools import cache

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..fault_programs import IN_DICTIONARY, source_of
from ..greeting import Step
from ..one_line.mutants import Program
from ..one_line.right_programs import answer_of, in_choices
from .requests import STEP, keys, requests


@cache
@np.errstate(all="ignore")
def right_keys(task: str, method: str) -> Mapping[str, list[FloatArray]]:
    """Return the keys (request, output) of each right program of a dictionary, by its name.

    The first row of a program is that of the choices in its text. Other tasks than steps have one
    right answer to each request: their keys are zero. So are those of solves, which no row tells.
    """
    cases, names = requests(task, method), IN_DICTIONARY[method or task]
    base = Program(source_of(names[0]))
    right = [answer_of(base, method, case) for case in cases]
    if task != STEP:
        zeros = np.array(
            [keys(values, values, case) for values, case in zip(right, cases, strict=True)]
        )
        return {name: [zeros] for name in names}
    rows = dict[str, list[FloatArray]]()
    for name in names:
        programs = [Program(source_of(name)), *in_choices(name, Step())]
        rows[name] = [
            np.array(
                [
                    keys(answer_of(program, method, case), values, case)
                    for values, case in zip(right, cases, strict=True)
                ]
            )
            for program in programs
        ]
    return rows
