"""Tasks of arms: the share met by each solver, and its time."""

from collections.abc import Iterator, Sequence

import numpy as np

from ...harness import metrics
from ...peers.catalogue import PLUMBOB_LM
from ...peers.peer import RESTARTS
from ...tables.captions import Captions
from ...tables.layout import Row
from ...tables.results import Results, grouped, listed
from ...tables.table import Summary, listing, words
from . import ROBOT_TASK, TOLERANCE


def _rows(results: Results) -> Iterator[Row]:
    records = results.all("robot_tasks", task=ROBOT_TASK)
    groups = grouped(records, lambda r: (r.title.rpartition(", ")[2], r.values.kind, r.solver))
    for (task, kind, solver), members in groups.items():
        row: Row = {"records": members, "task": task, "attempts": kind, "solver": solver}
        row["remark"] = members[0].values.remark
        values = [record.values for record in members if record.has_numbers]
        if values:
            solved = np.concatenate([v.solved for v in values])
            row["solved"] = metrics.share(solved)
            row["time, median"] = float(np.median(np.concatenate([v.seconds for v in values])))
            distance = np.concatenate([v.distance for v in values])[solved]
            row["distance, median"] = float(np.median(distance)) if len(distance) else None
        yield row


def _summary(rows: Sequence[Row]) -> Summary:
    points = []
    for (task, attempts), members in grouped(rows, lambda r: (r["task"], r["attempts"])).items():
        shares = [f"{r['solver']} {words(r['solved'])}" for r in members if "solved" in r]
        points.append(f"{task}, {attempts}: {listed(shares)}")
    return listing("The share of the targets whose tasks each solver meets.", points)


_CAPTIONS = Captions(
    __file__,
    tolerance=words(TOLERANCE),
    restarts=words(PLUMBOB_LM.first(RESTARTS).settings["restarts"]),
)

robot_tasks = _CAPTIONS.layout(
    "robot_tasks", lambda results: list(_rows(results)), _summary, compared=2
)

LAYOUTS = (robot_tasks,)
