"""What is measured: an experiment is a folder, a suite is one experiment or several."""

from collections.abc import Iterator

from ..harness.block import SCALES, Block, Measured, Scale
from . import (
    arm,
    chain,
    check,
    closed_curves,
    cloth,
    cloth_peers,
    cloth_scale,
    energy,
    first_call,
    newton,
    pictures,
    published,
    robot_models,
    robots,
    timing,
)

__all__ = ["EXPERIMENTS", "SCALES", "SUITES", "Block", "Measured", "Scale", "blocks"]

# In the order in which they are measured.
EXPERIMENTS = [
    check.EXPERIMENT,
    robot_models.EXPERIMENT,
    arm.EXPERIMENT,
    closed_curves.EXPERIMENT,
    chain.EXPERIMENT,
    robots.EXPERIMENT,
    published.EXPERIMENT,
    cloth.EXPERIMENT,
    cloth_peers.EXPERIMENT,
    energy.EXPERIMENT,
    newton.EXPERIMENT,
    cloth_scale.EXPERIMENT,
    timing.EXPERIMENT,
    first_call.EXPERIMENT,
    pictures.EXPERIMENT,
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
