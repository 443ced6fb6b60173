"""Which solvers, problems and robots a command line means, by names that may be parts of names."""

import difflib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

from plumbob.bench.experiments import SCALES, blocks
from plumbob.bench.experiments.published import TOOLBOX, TRAC_IK
from plumbob.bench.experiments.robots import REACHABLE, UNREACHABLE
from plumbob.bench.harness.block import Block, Choice, Scale
from plumbob.bench.peers import registry
from plumbob.bench.peers.entrant import Entrant
from plumbob.bench.problems.own import OwnProblem
from plumbob.reference.arguments import name_list

# The tasks whose problems are robots.
OF_ROBOTS = (REACHABLE, UNREACHABLE, TRAC_IK, TOOLBOX)
# Names that a message lists.
_LISTED = 12


class Wanted(NamedTuple):
    """What a command line asks for.

    Attributes:
        solvers, problems, robots: by name; all if none.
        targets: random targets a problem, if not those of the scale.
    """

    solvers: Sequence[str] = ()
    problems: Sequence[str] = ()
    robots: Sequence[str] = ()
    targets: int | None = None


def scale_of(
    name: str, targets: int | None, entrants: Sequence[Entrant], problems: Sequence[OwnProblem]
) -> Scale:
    """Return a scale with the user's solvers, problems and number of targets.

    Raises:
        ValueError: if the number is none.
    """
    if targets is not None and targets < 1:
        raise ValueError(f"targets: expected 1 or more, got {targets}")
    scale = replace(SCALES[name], entrants=tuple(entrants), problems=tuple(problems))
    return replace(scale, targets=targets or scale.targets)


def choose(suites: Sequence[str], name: str, scale: Scale, wanted: Wanted) -> Choice:
    """Return what is to be measured.

    Raises:
        ValueError: if a name means nothing; the message offers the nearest.
    """
    if not any((wanted.solvers, wanted.problems, wanted.robots)):
        return Choice(name, scale, is_partial=wanted.targets is not None)
    every = [block for suite in suites for block in blocks(suite, scale)]
    solvers = _meant("solver", wanted.solvers, every, _solver_names)
    problems = _meant("problem", wanted.problems, every, _problem_names)
    problems += _meant("robot", wanted.robots, every, _robot_names)
    choice = Choice(name, scale, tuple(solvers), tuple(problems), is_partial=True)
    if not any(map(choice.takes, every)):
        asked = " and ".join(filter(None, map(name_list, (wanted.problems, wanted.robots))))
        raise ValueError(
            f"solver: expected one that is asked {asked or 'something'} in {', '.join(suites)}, "
            f"got {name_list(wanted.solvers)}; `plumbob bench {suites[0]} --list` lists all"
        )
    return choice


# Each returns the name in records, and the names that stand for it on the command line.
def _solver_names(block: Block) -> tuple[str, list[str]]:
    """Return a solver's names: in records, in tables, and without what distinguishes its rows."""
    solver = block.solver
    return solver, [solver, registry.find(solver).label, solver.partition(", ")[0]]


def _problem_names(block: Block) -> tuple[str, list[str]]:
    """Return a problem's name, its title, and the family before the stroke."""
    problem, title = block.problem, str(block.facts.get("title", block.problem))
    parts = problem.split("/")
    return problem, [problem, title, *("/".join(parts[:i]) for i in range(1, len(parts)))]


def _robot_names(block: Block) -> tuple[str, list[str]]:
    robot = block.problem.rpartition("/")[2]
    is_robot = block.facts.get("task") in OF_ROBOTS and robot != "all"
    return block.problem, [robot] if is_robot else []


def _meant(
    kind: str, words: Sequence[str], every: Iterable[Block],
    read: Callable[[Block], tuple[str, list[str]]],
) -> list[str]:  # fmt: skip
    """Return the names in records, one or several each, that words stand for."""
    names: dict[str, list[str]] = {}
    for recorded, called in map(read, every):
        for name in called:
            names.setdefault(name, []).append(recorded)
    simple = {name.casefold(): name for name in reversed(names)}
    meant: list[str] = []
    for word in words:
        name = word if word in names else simple.get(word.casefold(), "")
        if not name:
            raise ValueError(f"unknown {kind} {word!r}: {_hint(word, simple)}")
        meant += names[name]
    return list(dict.fromkeys(meant))


def _hint(word: str, simple: dict[str, str]) -> str:
    near = difflib.get_close_matches(word.casefold(), simple, n=1, cutoff=0.5)
    if near:
        return f"did you mean {simple[near[0]]!r}?"
    listed = sorted(set(simple.values()))
    more = f" and {len(listed) - _LISTED} more; see --list" if len(listed) > _LISTED else ""
    return f"expected one of {name_list(listed[:_LISTED])}{more}" if listed else "there is none"
