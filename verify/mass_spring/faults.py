"""Faults of mass-spring solvers as changes of a problem or of a model; `faults.toml` lists them."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any

from plumbob.text.sentence import Sentence, sentence, with_code

from .model import RIGHT_MATRIX
from .options import ASPECTS, Option, option_of, options_of, read_table

# Aspects of which the forces and the matrix of an implicit step may have different versions.
IN_PARTS = ("masses", "springs", "damping")


def _in_parts(option: Option, entry: Mapping[str, Any]) -> Iterator[Option]:
    """Yield a fault of a step, then the same fault of the forces and of the matrix alone.

    In the equation for dv the damper's force stands besides its matrix, and M on one side only.
    """
    yield option
    in_dv, is_whole = {**option.fields, "dv": True}, bool(option.part or entry.get("whole"))
    if "damper_pull" in entry:
        yield option._replace(fields=in_dv)
    if is_whole or option.rare not in (False, "parts") or option.aspect not in IN_PARTS:
        return
    for part, words in _FAULTS["part"].items():
        place = with_code(words["code"], Sentence(words["sentence"], {}))
        message = sentence("{fault} {where}", fault=option.sentence, where=place)
        alone = option._replace(key=f"{option.key}, {part} only", sentence=message, part=part)
        has_dampers = option.aspect == "damping" or "set" in entry
        if option.aspect != "damping" or part != "forces":
            yield alone
        if part == "matrix":  # of local/global iterations that know the pins' part without it
            right = RIGHT_MATRIX._replace(pins_element=RIGHT_MATRIX.element)
            yield alone._replace(fields={**option.fields, "matrix": right})
        if (part == "forces" and has_dampers) or (
            part == "matrix" and option.aspect in ("masses", "damping")
        ):
            yield alone._replace(fields=in_dv)


_FAULTS = read_table("faults.toml")


def faults_of(task: str, aspects: Sequence[str]) -> tuple[Option, ...]:
    """Return the faults of these aspects that show in a task: step, forces or energy."""
    options = tuple(
        option
        for aspect in aspects
        for entry in _FAULTS.get(aspect, ())
        if task in entry.get("tasks", (task,))
        for basis in options_of(aspect, entry)
        for option in (_in_parts(basis, entry) if task == "step" else [basis])
    )
    if idle := [
        option.key
        for option in options
        if not any((option.change, option.fields, option.parts, option.energy, option.output))
    ]:
        raise ValueError(f"faults.toml: expected a change of each fault, got none of {idle}")
    return options


def relation_fault(aspect: str, values: Mapping[str, Any]) -> Option:
    """Return the fault of an aspect that a quantity is a combination of known terms, `relation`."""
    entry = next(entry for entry in _FAULTS[aspect] if "relation" in entry.get("each", {}))
    return option_of(aspect, entry, values)


FORCE_FAULTS = faults_of("forces", ("reading", "gravity", "springs", "damping", "forces"))
ENERGY_FAULTS = faults_of(
    "energy", ("reading", "kinetic", "elastic", "springs", "gravitational", "sum")
)
STEP_FAULTS, OF_ENERGY = (
    tuple(fault for fault in faults_of("step", ASPECTS) if (fault.part == "energy") is is_energy)
    for is_energy in (False, True)
)
EARLY_END, KEPT_DIRECTIONS = _FAULTS["end"]
# Of iterations that are followed.
FOLLOWED_FAULTS = (*faults_of("step", ("followed",)), *OF_ENERGY)


def pairs(options: Sequence[Option]) -> Iterator[tuple[Option, ...]]:
    """Yield two faults of different aspects, none of which may be alone only."""
    usual = [option for option in options if option.rare != "alone" and option.at is None]
    for first, second in combinations(usual, 2):
        if first.aspect != second.aspect:
            yield first, second
