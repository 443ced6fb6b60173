"""Which solvers, problems and robots a command line means, by names that may be parts of names."""

import difflib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

from plumbob.reference.arguments import name_list

from ..experiments import SCALES, blocks
from ..experiments.published import TOOLBOX, TRAC_IK
from ..experiments.robots import REACHABLE, UNREACHABLE
from ..harness.block import Block, Scale
from ..harness.choice import Choice
from ..peers import registry
from .entrant import Entrant
from .problems import OwnProblem

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
    known = SCALES[name]
    if targets is not None and targets < 1:
        raise ValueError(f"targets: expected 1 or more, got {targets}")
    return replace(
        known,
        targets=targets or known.targets,
        entrants=tuple(entrants),
        problems=tuple(problems),
    )


def choose(suites: Sequence[str], name: str, scale: Scale, wanted: Wanted) -> Choice:
    """Return what is to be measured.

    Raises:
        ValueError: if a name means nothing; the message offers the nearest.
    """
    if not any((wanted.solvers, wanted.problems, wanted.robots)):
        return Choice(name, scale, is_partial=wanted.targets is not None)
    there = [block for suite in suites for block in blocks(suite, scale)]
    solvers = _meant("solver", wanted.solvers, _names_of(there, _solver_names))
    problems = _meant("problem", wanted.problems, _names_of(there, _problem_names))
    problems += _meant("robot", wanted.robots, _names_of(there, _robot_names))
    choice = Choice(name, scale, tuple(solvers), tuple(problems), is_partial=True)
    if not any(map(choice.takes, there)):
        asked = " and ".join(filter(None, map(name_list, (wanted.problems, wanted.robots))))
        raise ValueError(
            f"solver: expected one that is asked {asked or 'something'} in {', '.join(suites)}, "
            f"got {name_list(wanted.solvers)}; `plumbob bench {suites[0]} --list` lists all"
        )
    return choice


# The name in records that a name on the command line stands for, one or several.
_Names = dict[str, list[str]]


def _names_of(there: Iterable[Block], read: Callable[[Block], tuple[str, list[str]]]) -> _Names:
    names: _Names = {}
    for block in there:
        recorded, called = read(block)
        for name in called:
            names.setdefault(name, []).append(recorded)
    return {name: list(dict.fromkeys(of)) for name, of in names.items()}


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
    problem = block.problem
    robot = problem.rpartition("/")[2]
    return problem, [robot] if block.facts.get("task") in OF_ROBOTS and robot != "all" else []


def _meant(kind: str, wanted: Sequence[str], names: _Names) -> list[str]:
    simple = {name.casefold(): name for name in reversed(names)}
    found: list[str] = []
    for word in wanted:
        name = word if word in names else simple.get(word.casefold())
        if name is None:
            raise ValueError(f"unknown {kind} {word!r}: {_hint(word, simple)}")
        found += names[name]
    return list(dict.fromkeys(found))


def _hint(word: str, simple: dict[str, str]) -> str:
    near = difflib.get_close_matches(word.casefold(), simple, n=1, cutoff=0.5)
    if near:
        return f"did you mean {simple[near[0]]!r}?"
    listed = sorted(set(simple.values()))
    more = f" and {len(listed) - _LISTED} more; see --list" if len(listed) > _LISTED else ""
    return f"expected one of {name_list(listed[:_LISTED])}{more}" if listed else "there is none"
