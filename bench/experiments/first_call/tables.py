"""What the first call of a public function costs: compiled then, or read from disk."""

from collections.abc import Sequence

from ...harness.record import Record
from ...presentation.columns import number, text, titled
from ...presentation.layout import Layout
from ...presentation.results import label
from ...presentation.tables import Summary, words


def _summary(records: Sequence[Record]) -> Summary:
    dearest = max(records, key=lambda record: float(record.arrays["cold processor"]))
    warm = max(float(record.arrays["warm processor"]) for record in records)
    return Summary(
        f"With nothing on disk the dearest, {dearest.title} by "
        f"{label(dearest.solver)}, takes {words(float(dearest.arrays['cold processor']))} s of the "
        f"processor; once compiled, no first call takes more than {words(warm)} s."
    )


first_calls = Layout(
    "What does the first call cost, which compiles?",
    "first_calls",
    "The first call in a process",
    subjects=lambda results: results.all("first_call"),
    columns=(
        titled("function"),
        text("by", lambda record: label(record.solver)),
        number("compiled", "cold compiled"),
        number("nothing on disk, processor", "cold processor", "s"),
        number("nothing on disk, wall", "cold wall", "s"),
        number("compiled before, processor", "warm processor", "s"),
        number("compiled before, wall", "warm wall", "s"),
    ),
    shows="A kernel is compiled by the first call that needs it, and kept on disk; importing "
    "the compiler is part of the first call, importing Plumbob is not. The third column counts "
    "the kernels compiled, each with all that it calls.",
    measured="Each in two fresh processes, the first with an empty folder for what is compiled.",
    summary=_summary,
)


LAYOUTS = (first_calls,)
