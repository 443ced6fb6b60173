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
    "robot_models": "published robot and character files, read by Plumbob and both engines",
    "ik": "ten ball joints, robots and a character, by every installed solver",
    "ik_proofs": "answers for robots that are proven: exact solutions, impossible targets",
    "tracking": "closed curves: frames from rest, from the last solution, and all together",
    "arm": "the lab's arm on every curve and at targets out of reach",
    "pictures": "the poses and cloths that the report draws",
    "cloth": "the lab's cloth at three stiffnesses; a falling cloth by every solver",
    "newton": "one step of a heavy cloth by every solver, with proven error bounds",
    "energy": "the energy of a cloth over 10,000 steps of each integrator",
    "timing": "times of forward kinematics, solves and steps, with both engines",
    "cloth_scale": "time and memory of factorisations and solves of large cloths",
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
        ("chain", "ik", "chains", WITH_TIMES),
        ("closed_curves", "tracking", "chains", WITHOUT_TIMES),
        ("arm", "arm", "chains", WITHOUT_TIMES),
        ("pictures", "pictures", "chains", WITHOUT_TIMES),
        ("robots", "ik", "kinematics", WITH_TIMES),
        ("branches", "ik", "kinematics", WITH_TIMES),
        ("published", "ik", "kinematics", WITH_TIMES),
        ("ik_proofs", "ik_proofs", "kinematics", WITH_TIMES),
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
