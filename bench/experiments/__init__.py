"""The experiments, a file each; `harness/experiments.toml` lists the files."""

from ..harness.block import SCALES, Block, Measured, Scale
from ..harness.experiment import EXPERIMENTS, SUITES, blocks

__all__ = ["EXPERIMENTS", "SCALES", "SUITES", "Block", "Measured", "Scale", "blocks"]
