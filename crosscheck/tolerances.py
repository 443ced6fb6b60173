"""The tolerances of the cross-checks, read from `tolerances.toml` with the reason for each size."""

import tomllib
from pathlib import Path
from typing import NamedTuple


class ClaimTolerance(NamedTuple):
    """The largest difference allowed between two correct results, and the reason."""

    value: float  # relative to the scale of the comparison
    reason: str


_FIELDS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
TOLERANCES = {name: ClaimTolerance(**fields) for name, fields in _FIELDS.items()}
POSITION, ROTATION, JACOBIAN = (TOLERANCES[n] for n in ("position", "rotation", "jacobian"))
