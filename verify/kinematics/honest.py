"""Sweeps of honest programs that are not the textbook's: another order, smaller rotations."""

import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from plumbob.text.sentence import Sentence, sentence, with_code

from .textbook import Choices

_TABLE = tomllib.loads(Path(__file__).with_name("faults.toml").read_text(encoding="utf-8"))


class HonestSweeps(NamedTuple):
    """Choices that may be on purpose: the answers still obey every law."""

    choices: Choices
    sentence: Sentence  # with the code of the choice


def _honest(part: str) -> Iterator[HonestSweeps]:
    """Yield the choices of a table."""
    for entry in _TABLE[part].values():
        if "choices" in entry:
            words = with_code(entry["code"], Sentence(entry["sentence"], {}))
            yield HonestSweeps(Choices(**entry["choices"]), words)


_ANEW = _TABLE["follow"]["frames start anew"]
STARTS_ANEW = with_code(_ANEW["code"], Sentence(_ANEW["sentence"], {}))
STOPS = tuple(_honest("stop"))
HONEST: Mapping[str, tuple[HonestSweeps, ...]] = {
    "ccd": (*_honest("ccd"), *STOPS),
    "fabrik": STOPS[:-1],  # the last stop is CCD's own
}
ROOT_FIRST = Choices(root_first=True)
# A sweep with a possible end in its middle: each iteration rotates one joint of a sweep.
AFTER_EACH_JOINT = HonestSweeps(
    Choices(sweep_of_a_joint=True),
    sentence("It is CCD that ends a sweep as soon as the effector is within the tolerance."),
)
