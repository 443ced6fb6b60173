"""Proofs for the poses of robots, by robot and kind of target."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ...harness.record import Record
from ...tables.captions import Captions
from ...tables.layout import Row
from ...tables.results import counted
from ...tables.table import Summary, words
from . import CAUSES, COVERED, IMPOSSIBLE
from .values import PoseProofs

CAPTIONS = Captions(__file__)


def _row(record: Record) -> Row:
    proofs: PoseProofs = record.values
    is_covered, is_impossible = (proofs.coverage == value for value in (COVERED, IMPOSSIBLE))
    causes = Counter(CAUSES[value] for value in proofs.coverage.tolist() if value in CAUSES)
    return {
        "record": record,
        "robot": record.title,
        "robots": record.values.group,
        "targets": record.values.targets,
        "converged": float(proofs.converged.mean()),
        "reached": float(proofs.reached.mean()),
        "exact solution": float(is_covered.mean()),
        "impossible": float(is_impossible.mean()),
        "open": sum(causes.values()) / len(proofs.coverage),
        "refuted": int(proofs.refuted.sum()),
        "distance, median": _median(proofs.distance[is_covered]),
        "least distance, median": _median(proofs.least_distance[is_impossible]),
        "proof, median": _median(proofs.seconds[is_covered]),
        "impossible, median": _median(proofs.seconds[is_impossible]),
        "shells": proofs.setup,
        "causes": ", ".join(f"{name} {count}" for name, count in causes.most_common()),
    }


def _median(numbers: np.ndarray) -> float | None:
    return float(np.median(numbers)) if len(numbers) else None


def _summary(rows: Sequence[Row]) -> Summary:
    proofs = [row["record"].values for row in rows]
    total, refuted = sum(len(p.coverage) for p in proofs), sum(int(p.refuted.sum()) for p in proofs)
    covered, impossible = (
        sum(int((p.coverage == value).sum()) for p in proofs) for value in (COVERED, IMPOSSIBLE)
    )
    return Summary(
        f"Of {counted(total, 'target')} {words(covered)} are proven to have an exact solution near "
        f"the answer and {words(impossible)} to have none, {words(total - covered - impossible)} "
        f"are open; {words(refuted)} proofs are refuted."
    )


pose_proofs = CAPTIONS.layout(
    "pose_proofs", lambda results: map(_row, results.all("ik_proofs")), _summary
)

LAYOUTS = (pose_proofs,)
