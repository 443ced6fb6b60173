"""The known faults of kinematics solvers, from `faults.toml`, and their combinations."""

import itertools
import tomllib
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ..explain import either
from ..sentence import Sentence, sentence
from .textbook import Switches

TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
AS_THE_TEXTBOOK = sentence("It does what the textbook does.")


class SwitchFault(NamedTuple):
    """A fault that setting a switch of the textbook's solvers reproduces."""

    part: str  # the table that it is in: "forward", "ccd", "fabrik", "stop" or "follow"
    key: str  # its short name
    switch: str  # the field of Switches
    number: int  # of the faulty setting
    sentence: Sentence  # the mistake, and its correction
    honest: bool  # whether it may be on purpose: the answers still obey every law


def _load() -> dict[str, tuple[SwitchFault, ...]]:
    """Return the faults that each method may have, the most frequent first."""
    parts = {
        part: tuple(
            SwitchFault(part, key, switch, number, Sentence(entry["sentence"], {}),
                        entry.get("honest", False))
            for key, entry in entries.items()
            for switch, number in entry.get("switch", {}).items()
        )
        for part, entries in TABLE.items()
    }  # fmt: skip
    forward, stop, follow = parts["forward"], parts["stop"], parts["follow"]
    faults = {
        "forward": forward,
        "ccd": (*parts["ccd"], *forward, *stop),
        "fabrik": (*parts["fabrik"], *forward, *stop[:-1]),  # the last is CCD's own
    }
    return faults | {f"track {method}": (*follow, *faults[method]) for method in ("ccd", "fabrik")}


FAULTS = _load()


@cache
def by_key(method: str) -> dict[str, SwitchFault]:
    """Return the faults of a method by their keys."""
    return {fault.key: fault for fault in FAULTS[method]}


def switches(faults: Sequence[SwitchFault]) -> Switches:
    """Return the switches that faults set."""
    return Switches(**{fault.switch: fault.number for fault in faults})


def combinations(method: str) -> Iterator[tuple[SwitchFault, ...]]:
    """Yield no fault, single faults, pairs and likely triples, no two of the same switch."""
    faults = FAULTS[method]
    yield ()
    yield from ((fault,) for fault in faults)
    pairs = filter(_are_independent, itertools.combinations(faults, 2))
    if method.startswith("track "):  # other faults show in single solves
        yield from (pair for pair in pairs if pair[0].part == "follow")
        return
    yield from pairs
    yield from filter(_is_likely, itertools.combinations(faults, 3))


def _are_independent(faults: Sequence[SwitchFault]) -> bool:
    return len({fault.switch for fault in faults}) == len(faults)


def _is_likely(triple: Sequence[SwitchFault]) -> bool:
    """Return whether a triple is in rotations, another step and kinematics, as in real programs."""
    rotations, step, kinematics = triple
    return (
        rotations.switch in ("applied", "rotations")
        and step.part == rotations.part
        and kinematics.part == "forward"
        and _are_independent(triple)
    )


def describe(method: str, keys: Sequence[str]) -> Sentence:
    """Return the sentences of a class of faults that no answer tells apart."""
    sentences = {key: fault.sentence for key, fault in by_key(method).items()}
    sentences[""] = AS_THE_TEXTBOOK
    return either([[sentences[name] for name in key.split(" + ")] for key in keys])
