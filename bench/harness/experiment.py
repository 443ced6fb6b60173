"""Experiments and suites: an experiment is a folder, a suite is a group of experiments.

A folder of `bench/experiments` holds a measurement, its tables and its figures.
"""

import importlib
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from .block import Block, Scale

# The suites of the command line, and the subject of each.
SUITES = {
    "check": "the reference against Pinocchio and MuJoCo, claim by claim",
    "self_test": "planted faults and honest solvers, judged by plumbob verify",
    "robot_models": "robots and characters from files of others, beside both engines",
    "ik": "a chain of ten ball joints, robots and a character, beside every solver installed",
    "tracking": "closed curves: frames from rest, from the last solution, and coherently",
    "arm": "the lab's arm on every curve, and reaching for what is too far",
    "pictures": "the poses and cloths that the report draws",
    "cloth": "the lab's cloth at three stiffnesses: convergence; one cloth for every solver",
    "newton": "one step of a heavy cloth by every solver: how far from a minimiser, proven",
    "energy": "what integrators do to the energy of a cloth over 10,000 steps",
    "timing": "forward kinematics, solves and steps beside both engines",
    "cloth_scale": "cloths of a thousand particles and more: factors, solves, memory",
}


class Experiment(NamedTuple):
    """A folder of `bench/experiments`, without importing it."""

    package: str  # the folder, by its full name as a package
    suite: str  # its name on the command line; experiments may share a suite
    chapter: str  # the section of the report that shows it
    # whether times are among its numbers, or a budget of time ends its work; timed blocks share no
    # machine with others while they are measured
    times: bool = True

    def blocks(self, scale: Scale) -> Iterator[Block]:
        """Yield its blocks; engines are imported only now."""
        for block in importlib.import_module(f"{self.package}.measurement").blocks(scale):
            yield replace(block, times=self.times)


# Whether times are among the numbers of an experiment.
WITH_TIMES, WITHOUT_TIMES = True, False

_BENCH = __package__.rpartition(".")[0]
# Folder, suite, and chapter of the report, in whose order they are measured and shown.
EXPERIMENTS = [
    Experiment(f"{_BENCH}.experiments.{folder}", suite, chapter, times)
    for folder, suite, chapter, times in (
        ("check", "check", "right", WITHOUT_TIMES),
        ("self_test", "self_test", "right", WITHOUT_TIMES),
        ("robot_models", "robot_models", "right", WITHOUT_TIMES),
        ("chain", "ik", "kinematics", WITH_TIMES),
        ("closed_curves", "tracking", "kinematics", WITHOUT_TIMES),
        ("arm", "arm", "kinematics", WITHOUT_TIMES),
        ("pictures", "pictures", "kinematics", WITHOUT_TIMES),
        ("robots", "ik", "kinematics", WITH_TIMES),
        ("published", "ik", "kinematics", WITH_TIMES),
        ("cloth", "cloth", "cloth", WITHOUT_TIMES),
        ("newton", "newton", "cloth", WITHOUT_TIMES),
        ("cloth_peers", "cloth", "cloth", WITH_TIMES),
        ("energy", "energy", "cloth", WITHOUT_TIMES),
        ("timing", "timing", "speed", WITH_TIMES),
        ("cloth_scale", "cloth_scale", "speed", WITH_TIMES),
    )
]


def blocks(suite: str, scale: Scale) -> Iterator[Block]:
    """Yield the blocks of a suite; engines are imported only now.

    Raises:
        KeyError: if there is no suite of this name.
    """
    if suite not in SUITES:
        raise KeyError(suite)
    for experiment in EXPERIMENTS:
        if experiment.suite == suite:
            yield from experiment.blocks(scale)
