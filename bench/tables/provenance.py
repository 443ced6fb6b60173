"""What a table's numbers rest on: how many samples, and the machine and versions of the records."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..harness.record import Record
from ..peers import registry
from .results import settings

# What is installed for an engine, by how the registry calls the engine.
_PACKAGES = {
    registry.PINOCCHIO: "pin",
    registry.MUJOCO: "mujoco",
    registry.NEWTON: "newton",
    "CHOLMOD": "cholespy",
}


def provenance(records: Sequence[Record]) -> str:
    """Return sentences on samples, tolerance, machine, versions and date; "" of no records."""
    tolerance = settings(records, "tolerance")
    parts = [
        _samples(records),
        tolerance and f"tolerance {tolerance}",
        _each(_machine(record.stamp.get("machine", {})) for record in records),
        _each(_sources(record.stamp) for record in records),
        _each(map(_version, _newest(records))),
        _days(records),
    ]
    return "; ".join(filter(None, parts))


def _newest(records: Sequence[Record]) -> list[Record]:
    """Return one record of each solver, the newest."""
    return list({record.solver: record for record in sorted(records, key=_moment)}.values())


def _moment(record: Record) -> str:
    return record.when


def _each(texts: Iterable[str]) -> str:
    return ", ".join(filter(None, dict.fromkeys(texts)))


def _samples(records: Sequence[Record]) -> str:
    """Return how many targets or rounds are behind a record: "n = 20 to 200"."""
    sizes = {r.arrays[name].size for r in records for name in ("solved", "seconds", "residual")
             if name in r.arrays}  # fmt: skip
    counts = sorted(size for size in sizes if size > 1)
    if not counts:
        return ""
    return f"n = {counts[0]:,}" + (f" to {counts[-1]:,}" if counts[1:] else "")


def _machine(machine: Mapping[str, Any]) -> str:
    cores = machine.get("cores")
    return f"{machine.get('processor', '')}{f' ({cores} cores)' if cores else ''}"


def _sources(stamp: Mapping[str, Any]) -> str:
    versions = stamp.get("versions", {})
    named = [f"{title} {versions[name]}" for title, name in (("Plumbob", "plumbob"),
             ("Python", "python")) if versions.get(name)]  # fmt: skip
    return ", ".join(named)


def _version(record: Record) -> str:
    """Return the version of what a record's solver comes from, "" if it is ours or unknown."""
    engine = registry.find(record.solver).engine
    package = _PACKAGES.get(engine, engine) or record.solver
    version = record.settings.get("version") or record.stamp.get("versions", {}).get(package)
    return f"{package} {version}" if version and package.lower() != "plumbob" else ""


def _days(records: Sequence[Record]) -> str:
    days = sorted({record.when[:10] for record in records if record.when})
    return " to ".join(dict.fromkeys([*days[:1], *days[-1:]]))
