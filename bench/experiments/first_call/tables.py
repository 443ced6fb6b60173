"""What the first call of a public function costs: compiled then, or read from disk."""

from collections.abc import Sequence
from dataclasses import replace

from ...harness.record import Record
from ...harness.results import label
from ...tables.columns import number, text, titled
from ...tables.layout import Layout
from ...tables.table import Column, Summary, words


def _summary(records: Sequence[Record]) -> Summary:
    dearest = max(records, key=lambda record: float(record.arrays["cold processor"]))
    warm = max(float(record.arrays["warm processor"]) for record in records)
    return Summary(
        f"With nothing on disk the dearest, {dearest.title} by "
        f"{label(dearest.solver)}, takes {words(float(dearest.arrays['cold processor']))} s of the "
        f"processor; once compiled, no first call takes more than {words(warm)} s."
    )


def _taken(title: str, name: str) -> list[Column]:
    """Return the columns of a call's time of the processor, and by the clock on the wall."""
    pair = (number(f"{title}, {clock}", f"{name} {clock}", "s") for clock in ("processor", "wall"))
    return [replace(column, group=title, folded=i > 0) for i, column in enumerate(pair)]


first_calls = Layout(
    "What does the first call cost, which compiles?",
    "first_calls",
    "The first call in a process",
    subjects=lambda results: results.all("first_call"),
    columns=(
        titled("function"),
        text("by", lambda record: label(record.solver)),
        number("compiled", "cold compiled"),
        *_taken("nothing on disk", "cold"),
        *_taken("compiled before", "warm"),
    ),
    shows="A kernel is compiled by the first call that needs it, and kept on disk; importing "
    "the compiler is part of the first call, importing Plumbob is not. The third column counts "
    "the kernels compiled, each with all that it calls.",
    measured="Each in two fresh processes, the first with an empty folder for what is compiled.",
    summary=_summary,
)


LAYOUTS = (first_calls,)
