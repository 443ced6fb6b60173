"""Published numbers of solvers, and the measurements as far as known.

`published.toml` holds the facts, each with its source.
"""

import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple


class PublishedRate(NamedTuple):
    """A success rate [%], and the mean time of all solves [ms]."""

    robot: str
    solver: str
    percent: float
    milliseconds: float
    source: str


class PublishedSearch(NamedTuple):
    """A search of the toolbox, its share of infeasible targets [%], and our adapter's settings."""

    title: str
    infeasible: float
    settings: dict[str, str | float]


class PublishedFrame(NamedTuple):
    """A time for a frame of a cloth [s], the work done, and our settings for the same."""

    seconds: float
    work: str
    settings: dict[str, float]


_TABLES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
TRAC_IK, TOOLBOX, FABRIK, _LIU = (SimpleNamespace(**table) for table in _TABLES.values())
TRAC_IK.rates = [PublishedRate(*rate) for rate in TRAC_IK.rates]
TOOLBOX.searches = [PublishedSearch(*search) for search in TOOLBOX.searches]
LIU_2013 = {solver: PublishedFrame(**frame) for solver, frame in _LIU.frames.items()}
LIU_2013_SIZE, LIU_2013_STIFFNESS = _LIU.size, _LIU.stiffness
LIU_2013_FRAME = 1 / _LIU.frames_per_second
