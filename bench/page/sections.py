"""The chapters of the report and their tables, which experiments offer."""

import tomllib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from ..experiments import EXPERIMENTS
from ..experiments.pictures import arm_motion, cloth_motion
from ..measure.experiment import Experiment
from ..player.motion import Scene
from ..tables.layout import Layout
from ..tables.results import Results
from ..tables.table import Table


class Section(NamedTuple):
    """A chapter of the report."""

    name: str  # in experiments, and in addresses within the page
    short: str  # text of links
    title: str  # heading
    about: str  # introduction
    main: str = ""  # name of its unfolded table; "" if it has none
    figures: Sequence[str] = ()  # names of its unfolded figures

    @property
    def experiments(self) -> list[Experiment]:
        """Its experiments, in order."""
        return [experiment for experiment in EXPERIMENTS if experiment.chapter == self.name]

    @property
    def layouts(self) -> tuple[Layout, ...]:
        """The tables of its experiments, in order; each experiment is imported only now."""
        return tuple(layout for e in self.experiments for layout in e.content.LAYOUTS)


_CHAPTERS = tomllib.loads(Path(__file__).with_name("chapters.toml").read_text(encoding="utf-8"))
SECTIONS = tuple(Section(**chapter) for chapter in _CHAPTERS["chapter"])
# The motions of chapters.
MOTIONS: dict[str, Callable[[Results], Scene | None]] = {
    "kinematics": arm_motion,
    "cloth": cloth_motion,
}


def tables(results: Results, suites: Iterable[str] | None = None) -> list[Table]:
    """Return the tables of the chapters on any of these suites, or all, in order."""
    return [
        layout(results)
        for section in SECTIONS
        if suites is None or any(e.suite in set(suites) for e in section.experiments)
        for layout in section.layouts
    ]
