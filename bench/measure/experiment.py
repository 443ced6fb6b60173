"""Experiments and suites: an experiment is a file, a suite is a group of experiments.

A file of `bench/experiments` holds a measurement, its tables and its figures.
"""

import functools
import importlib
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from .block import Block, Scale

if TYPE_CHECKING:
    from .values import Values


class Experiment(NamedTuple):
    """A file of `bench/experiments`, not imported."""

    module: str  # the file, by its full name as a module
    suite: str  # its name on the command line; experiments may share a suite
    chapter: str  # the section of the report that shows it
    # whether times are among its numbers, or a budget of time ends its work; timed blocks share no
    # machine with others while they are measured
    times: bool = True
    subject: str = ""  # of its suite, at the first experiment of the suite

    @property
    def content(self) -> Any:
        """The module, imported only now."""
        return importlib.import_module(self.module)

    def blocks(self, scale: Scale) -> Iterator[Block]:
        """Yield its blocks; engines are imported only now."""
        for block in self.content.blocks(scale):
            yield replace(block, times=self.times)


_CATALOGUE = tomllib.loads(Path(__file__).with_name("experiments.toml").read_text(encoding="utf-8"))
_FOLDER = f"{__package__.rpartition('.')[0]}.experiments"
# The experiments in order, and the suites of the command line with their subjects.
EXPERIMENTS = [
    Experiment(f"{_FOLDER}.{name}", **{"suite": name, **line}) for name, line in _CATALOGUE.items()
]
SUITES = {e.suite: e.subject for e in EXPERIMENTS if e.subject}


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


@functools.cache
def kind_of(suite: str, task: str) -> "type[Values] | None":
    """Return the type of the records of a task ("" if unnamed); None of other suites.

    No engine is imported.

    Raises:
        ValueError: if the suite has no task of this name.
    """
    kinds: dict[str, type[Values]] = {}
    for experiment in EXPERIMENTS:
        if experiment.suite == suite:
            kinds |= experiment.content.KINDS
    if kinds and task not in kinds:
        raise ValueError(f"task: expected one of {', '.join(map(repr, kinds))}, got {task[:40]!r}")
    return kinds.get(task)
