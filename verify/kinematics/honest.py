"""Sweeps of honest programs that are not the textbook's: another order, smaller rotations."""

import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from plumbob.text.sentence import Sentence, sentence, with_code

from .switches import Switches

_TABLE = tomllib.loads(Path(__file__).with_name("faults.toml").read_text(encoding="utf-8"))


class HonestSweeps(NamedTuple):
    """A choice that may be on purpose: its answers still obey every law."""

    key: str
    switches: Switches
    sentence: Sentence  # with the code of the choice


def _honest(part: str) -> Iterator[HonestSweeps]:
    """Yield the choices of a table that concern sweeps, not the test that ends them."""
    for key, entry in _TABLE[part].items():
        if entry.get("honest") and "test" not in entry["switch"]:
            words = with_code(entry["code"], Sentence(entry["sentence"], {}))
            yield HonestSweeps(key, Switches(**entry["switch"]), words)


STOPS = tuple(_honest("stop"))
HONEST: Mapping[str, tuple[HonestSweeps, ...]] = {
    "ccd": (*_honest("ccd"), *STOPS),
    "fabrik": (*_honest("fabrik"), *STOPS[:-1]),  # the last stop is CCD's own
}
ROOT_FIRST = next(choice.switches for choice in HONEST["ccd"] if choice.key == "root to tip")
# A sweep that may end in its middle: each iteration rotates one joint of a sweep.
AFTER_EACH_JOINT = HonestSweeps(
    "tests after each joint",
    Switches(budget=3),
    sentence("It is CCD that ends a sweep as soon as the effector is within the tolerance."),
)
