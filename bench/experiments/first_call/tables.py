"""What the first call of a public function costs: compiled then, or read from disk."""

from collections.abc import Sequence

from ...harness.record import Record
from ...presentation.results import Results, label
from ...presentation.tables import Answer, Column, Table, words


def first_calls(results: Results) -> Table:
    """Return the times of first calls."""
    records = results.all("first_call")
    return Table(
        "first_calls",
        "The first call in a process",
        (
            Column("function", words=True),
            Column("by", words=True),
            Column("compiled"),
            Column("nothing on disk, processor", "s"),
            Column("nothing on disk, wall", "s"),
            Column("compiled before, processor", "s"),
            Column("compiled before, wall", "s"),
        ),
        tuple(
            (
                _function(record.problem),
                label(record.solver),
                int(record.arrays["cold compiled"]),
                *(float(record.arrays[name]) for name in TIMES),
            )
            for record in records
        ),
        shows="A kernel is compiled by the first call that needs it, and kept on disk; importing "
        "the compiler is part of the first call, importing Plumbob is not. The third column counts "
        "the kernels compiled, each with all that it calls.",
        measured="Each in two fresh processes, the first with an empty folder for what is "
        "compiled.",
        answer=_answer(records),
    )


TIMES = ("cold processor", "cold wall", "warm processor", "warm wall")


def _function(problem: str) -> str:
    """Return the name of a function as it is called, and what it works on."""
    name, _, on = problem.partition("/")
    return f"{name}, {on}" if on else name


def _answer(records: Sequence[Record]) -> Answer:
    if not records:
        return Answer()
    dearest = max(records, key=lambda record: float(record.arrays["cold processor"]))
    warm = max(float(record.arrays["warm processor"]) for record in records)
    return Answer(
        f"With nothing on disk the dearest, {_function(dearest.problem)} by "
        f"{label(dearest.solver)}, takes {words(float(dearest.arrays['cold processor']))} s of the "
        f"processor; once compiled, no first call takes more than {words(warm)} s."
    )
