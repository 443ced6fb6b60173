"""What is measured: an experiment is a folder, a suite is one experiment or several."""

import importlib
from collections.abc import Iterator

from ..harness.block import SCALES, Block, Measured, Scale
from ..harness.experiment import Experiment

__all__ = ["EXPERIMENTS", "SCALES", "SUITES", "Block", "Measured", "Scale", "blocks"]

# In the order of the report, which is also that of measuring.
FOLDERS = (
    "check",
    "robot_models",
    "chain",
    "closed_curves",
    "arm",
    "pictures",
    "robots",
    "published",
    "cloth",
    "newton",
    "cloth_peers",
    "energy",
    "timing",
    "cloth_scale",
    "first_call",
)
EXPERIMENTS: list[Experiment] = [
    importlib.import_module(f"{__package__}.{folder}").EXPERIMENT for folder in FOLDERS
]

# What the command line calls them, and what each answers.
SUITES = {made.suite: made.about for made in EXPERIMENTS if made.about}


def blocks(suite: str, scale: Scale) -> Iterator[Block]:
    """Yield the blocks of a suite; engines are imported only now.

    Raises:
        KeyError: if there is no such suite.
    """
    if suite not in SUITES:
        raise KeyError(suite)
    for experiment in EXPERIMENTS:
        if experiment.suite == suite:
            yield from experiment.blocks(scale)
