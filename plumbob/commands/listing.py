"""What there is to be chosen from: the suites, or the problems and solvers of one."""

import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import zip_longest
from typing import Any

from plumbob.bench.experiments import SUITES, blocks
from plumbob.bench.harness.block import Block, Choice
from plumbob.bench.harness.measure import not_asked, not_installed
from plumbob.bench.peers import registry
from plumbob.bench.tables.results import counted

from ..terminal import width

NOT_INSTALLED = "not installed"
# What a block does that measures nothing.
_EMPTY: tuple[Callable[..., Any], ...] = (not_installed, not_asked)
# So many names of problems or solvers at most stand in the list of all suites, in so many lines.
_FEW, _LINES = 6, 2
_PACKAGES = {registry.PLUMBOB: "plumbob", registry.PINOCCHIO: "pin", registry.MUJOCO: "mujoco"}


def listed(suites: Sequence[str], choice: Choice) -> Iterator[str]:
    """Yield lines that name what there is: of one suite everything, of several a summary."""
    for suite in suites:
        there = list(filter(choice.takes, blocks(suite, choice.scale)))
        yield f"{suite}: {SUITES[suite]}"
        if len(suites) == 1:
            yield from ("", "problems", *_aligned(_problems(there).items()))
            yield from ("", "solvers", *_aligned(_solvers(there)))
        else:
            yield from _in_short("problem", _problems(there))
            yield from _in_short("solver", [name for name, *_ in _solvers(there)])
    if len(suites) > 1:
        yield "All problems and solvers of one: plumbob bench SUITE --list"


def _problems(there: Iterable[Block]) -> dict[str, str]:
    """Return the titles of problems by their names, "" for a title that says the same."""
    found = {
        block.problem: str(block.facts.get("title", ""))
        for block in there
        if not _does(block, _EMPTY)
    }
    return {name: _if_other(name, title) for name, title in found.items()}


def _if_other(name: str, title: str) -> str:
    """Return a title, "" if the name ends in the same words."""
    return "" if _plain(name).endswith(_plain(title)) else title


def _plain(name: str) -> str:
    return re.sub(r"[\W_]+", " ", name).casefold().strip()


def _solvers(there: Iterable[Block]) -> list[tuple[str, str, str]]:
    """Return name, label if it is another, and version of each solver, those missing last."""
    found = {block.solver: block for block in there}
    missing = {name for name, block in found.items() if _does(block, (not_installed,))}
    names = [*(name for name in found if name not in missing), *sorted(missing)]
    return [
        (
            name,
            _if_other(name, registry.find(name).label),
            NOT_INSTALLED if name in missing else _version(found[name]),
        )
        for name in names
    ]


def _does(block: Block, what: Sequence[Callable[..., Any]]) -> bool:
    return isinstance(block.measure, partial) and block.measure.func in what


def _version(block: Block) -> str:
    """Return the version of who solves a block: its own, or that of the engine it belongs to."""
    if block.facts.get("entrant") is True:
        said = (block.settings.get("version"), "entered", block.facts["door"])
        return ", ".join(str(word) for word in said if word)
    package = _PACKAGES.get(registry.find(block.solver).engine, "")
    return str(block.settings.get("version") or (registry.version(package) if package else ""))


def _aligned(rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """Yield rows as lines whose columns line up."""
    rows = list(rows)
    widths = [max(map(len, column)) for column in zip_longest(*rows, fillvalue="")]
    for row in rows:
        padded = (f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True) if width)
        yield "  " + "  ".join(padded).rstrip()


def _in_short(what: str, names: Iterable[str]) -> Iterator[str]:
    """Yield how many names there are, and the first of them or of their families."""
    names = list(names)
    families = list(dict.fromkeys(name.partition("/")[0] for name in names))
    for few in range(_FEW, 0, -1):
        more = f" and {len(families) - few} more" if len(families) > few else ""
        text = f"  {counted(len(names), what)}: {'; '.join(families[:few])}{more}"
        lines = textwrap.wrap(text, width(), subsequent_indent="    ")
        if len(lines) <= _LINES:
            break
    yield from lines
