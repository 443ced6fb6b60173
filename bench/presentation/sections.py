"""The chapters of the report, in order: each is made of what some experiments offer."""

import importlib
from collections.abc import Callable, Iterable
from typing import NamedTuple

from ..experiments import EXPERIMENTS
from ..experiments.pictures.readings import arm_motion, cloth_motion
from ..harness.experiment import Experiment
from .layout import Layout
from .motion import Scene
from .results import Results
from .tables import Table


class Section(NamedTuple):
    """A chapter of the report."""

    name: str
    title: str
    about: str

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
        "Is it right?",
        "Nothing below counts unless the reference itself is right. Each claim computes one "
        "quantity twice, by Plumbob and by a physics engine that shares no code with it.",
    ),
    Section(
        "kinematics",
        "Task 1: inverse kinematics",
        "The lab’s arm of five joints draws curves with its effector, by cyclic coordinate descent "
        "(CCD) and by FABRIK; a chain of ten ball joints reaches for targets near, far, at the "
        "edge of its reach and beyond it, also by Levenberg-Marquardt on the engines’ kinematics "
        "(LM).",
    ),
    Section(
        "robots",
        "Robots and a character",
        "Every solver that is installed, on real arms and on a character with two hands to place: "
        "the same targets, starts and evaluation for all. Solvers that make one attempt and those "
        "that start again answer different questions and stand in different tables.",
    ),
    Section(
        "cloth",
        "Task 2: the cloth by implicit Euler",
        "The lab’s cloth of 11 × 11 particles falls from rest and swings from two corners, as it "
        "is and stiffer. A step minimises the objective g of Liu et al. (2013).",
    ),
    Section(
        "speed",
        "How fast?",
        "The same work by the compiled and the plain source, and by both engines, in one run on "
        "one core.",
    ),
)


# What moves in a chapter.
MOTIONS: dict[str, Callable[[Results], Scene | None]] = {
    "kinematics": arm_motion,
    "cloth": cloth_motion,
}


def offered(experiment: Experiment) -> tuple[Layout, ...]:
    """Return the tables of an experiment; its tables and figures are imported only now."""
    layouts: tuple[Layout, ...] = importlib.import_module(f"{experiment.package}.tables").LAYOUTS
    return layouts


def tables(results: Results, suites: Iterable[str] | None = None) -> list[Table]:
    """Return the tables made from any of these suites, or all, in the order of the report."""
    return [
        layout(results)
        for section in SECTIONS
        if suites is None or set(suites) & section.suites
        for layout in section.layouts
    ]
