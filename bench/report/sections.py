"""The chapters of the report, in order: each is made of what some experiments offer."""

import importlib
import importlib.util
from collections.abc import Callable, Iterable
from typing import NamedTuple

from ..experiments import EXPERIMENTS
from ..experiments.pictures.figures import arm_motion, cloth_motion
from ..harness.experiment import Experiment
from ..motion.motion import Scene
from ..tables.layout import Layout
from ..tables.results import Results
from ..tables.table import Table


class Section(NamedTuple):
    """A chapter of the report.

    Attributes:
        name: what experiments and addresses within the page call it.
        short: what links to it say.
        title: its heading.
        about: what it is about.
        main: the name of its main table, shown unfolded; "" if it has none.
        figure: the name of the figure beside it.
    """

    name: str
    short: str
    title: str
    about: str
    main: str = ""
    figure: str = ""

    @property
    def experiments(self) -> list[Experiment]:
        """The experiments that it shows, in order."""
        return [experiment for experiment in EXPERIMENTS if experiment.chapter == self.name]

    @property
    def layouts(self) -> tuple[Layout, ...]:
        """The questions of all its experiments."""
        return tuple(layout for made in self.experiments for layout in offered(made))

    @property
    def suites(self) -> set[str]:
        """The suites that it is made from."""
        return {experiment.suite for experiment in self.experiments}


SECTIONS = (
    Section(
        "right",
        "Right?",
        "Is it right?",
        "Nothing below counts unless the reference itself is right. Each claim computes one "
        "quantity twice: by Plumbob, and by a physics engine that shares no code with it, or by a "
        "closed form or an invariant where the table says so.",
    ),
    Section(
        "kinematics",
        "Kinematics",
        "Inverse kinematics",
        "Real arms and a character with two hands to place: the same targets, starts and "
        "evaluation for every solver. The lab’s arm of five joints draws curves, and a chain of "
        "ten ball joints reaches for targets near, far, at the edge of its reach and beyond it.",
        "robots_overall",
        "budget_one_start",
    ),
    Section(
        "cloth",
        "Cloth",
        "Cloth by implicit Euler",
        "A cloth falls from rest and swings from two corners, as it is and stiffer. A step "
        "minimises the objective g of Liu et al. (2013).",
        "cloth_peers_step",
        "work_precision_step",
    ),
    Section(
        "speed",
        "Speed",
        "Speed",
        "The same work by the compiled and the plain source, and by both engines, in one run, on "
        "one core unless all are named.",
        "timing_kinematics",
        "timing_kinematics",
    ),
)


# What moves in a chapter.
MOTIONS: dict[str, Callable[[Results], Scene | None]] = {
    "kinematics": arm_motion,
    "cloth": cloth_motion,
}


def offered(experiment: Experiment) -> tuple[Layout, ...]:
    """Return the tables of an experiment, imported only now; none where another shows it."""
    name = f"{experiment.package}.tables"
    layouts: tuple[Layout, ...] = ()
    if importlib.util.find_spec(name) is not None:
        layouts = importlib.import_module(name).LAYOUTS
    return layouts


def tables(results: Results, suites: Iterable[str] | None = None) -> list[Table]:
    """Return the tables made from any of these suites, or all, in the order of the report."""
    return [
        layout(results)
        for section in SECTIONS
        if suites is None or set(suites) & section.suites
        for layout in section.layouts
    ]
