"""The faults that robots' programs may have: requests read otherwise, and wrong kinematics."""

from collections.abc import Iterator, Mapping
from typing import Any

from plumbob.text.sentence import Sentence, with_code

from .faults import TABLE
from .robot_readings import RobotFault


def _load(entries: Mapping[str, Any]) -> Iterator[tuple[str, RobotFault]]:
    """Yield the faults of a table by their keys: of an entry, or of each of its rules."""
    for key, entry in entries.items():
        fields = {k: entry[k] for k in ("change", "scale", "relative", "order") if k in entry}
        fault = RobotFault(with_code(entry["code"], Sentence(entry["sentence"], {})), **fields)
        rules = entry.get("rules", {})
        for number, changed in enumerate(rules if isinstance(rules, list) else [rules], start=1):
            yield key if number == 1 else f"{key} {number}", fault._replace(rules=changed)


# Faults that show in coordinates, and those that show in Jacobians and steps only.
FAULTS = dict(_load(TABLE["robots"]))
JACOBIAN_FAULTS = dict(_load(TABLE["robot_jacobian"]))
