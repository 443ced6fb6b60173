"""The experiments, a file each; `measure/experiments.toml` lists the files."""

from ..measure.block import SCALES, Block, Measured, Scale
from ..measure.experiment import EXPERIMENTS, SUITES, blocks

__all__ = ["EXPERIMENTS", "SCALES", "SUITES", "Block", "Measured", "Scale", "blocks"]
