"""The motions on record as scenes for a page to play."""

from collections.abc import Sequence

import numpy as np

from ...figures.view import ARM_VIEW, CLOTH_VIEW
from ...harness.record import Record
from ...motion.motion import Moving, Scene
from ...tables.results import Results, counted, label
from . import ARM_MOTION, CLOTH_MOTION
from .values import ClothMotion

# So many motions of a kind are on the page, those of entrants first: a cloth costs it some 60 kB.
MOST_ARMS, MOST_CLOTHS = 6, 4
# How long the arm takes for the curve [s].
DRAWING = 12.0
# Of solvers that have a step solved before this many iterations nobody asks how many there were.
FEW = 50


def arm_motion(results: Results) -> Scene | None:
    """Return the arm on the custom curve, by each solver on record; None if none is."""
    records = _first(results, ARM_MOTION, MOST_ARMS)
    if not records:
        return None
    return Scene(
        "arm",
        "The lab’s arm draws the custom curve by two solvers",
        "Each frame starts from the last one’s solution; a coherent motion is as smooth as it can "
        "be. The line drawn has the colour of its error.",
        [Moving(_arm_named(r), r.values.positions, r.values.error) for r in records],
        DRAWING / len(records[0].values.positions),
        "distance to the target",
        ARM_VIEW,
        panes=2,
        curve=records[0].values.curve,
    ).checked()


def cloth_motion(results: Results) -> Scene | None:
    """Return the falling cloth by each solver on record; None if none is."""
    records = _first(results, CLOTH_MOTION, MOST_CLOTHS)
    if not records:
        return None
    return Scene(
        "cloth",
        "The lab’s cloth falls by two solvers",
        "Every particle has the colour of its distance to where converged steps of implicit Euler "
        "bring it; the numbers are root mean squares over the particles.",
        [_cloth(record) for record in records],
        records[0].details.h * records[0].details.every,
        "distance to the exact implicit motion",
        CLOTH_VIEW,
        panes=2,
        marked=records[0].values.pinned.tolist(),
    ).checked()


def _cloth(record: Record) -> Moving:
    motion: ClothMotion = record.values
    rms = np.sqrt(np.mean(motion.distance**2, axis=-1))
    return Moving(_cloth_named(record), motion.positions, rms, motion.distance)


def _first(results: Results, task: str, most: int) -> Sequence[Record]:
    """Return the records of a task that are shown: those of entrants, then in their order."""
    records = results.all("pictures", task=task)
    order = sorted(records, key=lambda r: (r.solver not in results.entrants, r.details.order))
    return order[:most]


def _arm_named(record: Record) -> str:
    return f"{label(record.solver)}, coherent" if record.details.coherent else label(record.solver)


def _cloth_named(record: Record) -> str:
    count = record.details.iterations
    many = "converged" if count > FEW else counted(count, "iteration")
    return f"{label(record.solver)}, {many}"
