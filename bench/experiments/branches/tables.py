"""How many solutions each solver lists, misses and makes up."""

from collections.abc import Sequence

import numpy as np

from ...harness.record import Record
from ...peers.catalogue import PLUMBOB
from ...tables.captions import Captions
from ...tables.columns import words_in
from ...tables.layout import Row
from ...tables.results import Results, grouped, listed
from ...tables.table import Summary, listing, words
from . import BRANCHES, EXACT, LARGEST_COUNT, SAME, STARTS, TOLERANCE


def _rows(results: Results) -> list[Row]:
    return [*map(_row, results.all("ik", task=BRANCHES))]


def _row(record: Record) -> Row:
    row: Row = {"record": record, "robot": record.title, "solver": record.solver}
    row["remark"] = record.values.remark
    if record.has_numbers:
        values = record.values
        row["targets"] = len(values.solutions)
        row["solutions"] = int(values.solutions.sum())
        row["missing"], row["false"] = int(values.missing.sum()), int(values.wrong.sum())
        row["targets with missing ones"] = int((values.missing > 0).sum())
        row["singular targets"] = values.singular
        row["time, median"] = float(np.median(values.seconds))
    return row


def _summary(rows: Sequence[Row]) -> Summary:
    measured = [row for row in rows if "solutions" in row]
    points = (
        f"{solver}: {words(sum(row['missing'] for row in members))} missing, "
        f"{words(sum(row['false'] for row in members))} false; {listed([*map(_time, members)])}"
        for solver, members in grouped(measured, lambda row: str(row["solver"])).items()
    )
    plumbob_rows = [row for row in measured if row["solver"] == PLUMBOB]
    solutions, missing = (
        sum(row[title] for row in plumbob_rows) for title in ("solutions", "missing")
    )
    sentence = f"Plumbob lists {words(solutions)} of {words(solutions + missing)} solutions."
    return listing(sentence * bool(plumbob_rows), points)


def _time(row: Row) -> str:
    return f"{row['robot']} {words_in(row['time, median'], 'µs')}"


_CAPTIONS = Captions(
    __file__,
    starts=words(STARTS),
    exact=words(EXACT),
    tolerance=words(TOLERANCE),
    same=words(SAME),
    largest=words(LARGEST_COUNT),
)

branches = _CAPTIONS.layout("branches", _rows, _summary)

LAYOUTS = (branches,)
