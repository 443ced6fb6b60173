"""What is measured: each experiment is a folder; `harness.experiment` lists them."""

from ..harness.block import SCALES, Block, Measured, Scale
from ..harness.experiment import EXPERIMENTS, SUITES, blocks

__all__ = ["EXPERIMENTS", "SCALES", "SUITES", "Block", "Measured", "Scale", "blocks"]
