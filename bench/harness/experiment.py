"""An experiment: a folder that holds a problem, its measurement, its tables and its figures."""

import importlib
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from .block import Block, Scale


class Experiment(NamedTuple):
    """What one folder of `bench/experiments` measures, without importing what measures it.

    Attributes:
        package: the folder, by its full name as a package.
        suite: what the command line calls it; experiments may share a suite.
        chapter: the section of the report that shows it.
        times: whether times are among its numbers, or a budget of time ends its work; such blocks
            share no machine with others while they are measured.
    """

    package: str
    suite: str
    chapter: str
    times: bool = True

    def blocks(self, scale: Scale) -> Iterator[Block]:
        """Yield what there is to be measured; engines are imported only now."""
        for block in importlib.import_module(f"{self.package}.measurement").blocks(scale):
            yield replace(block, times=self.times)
