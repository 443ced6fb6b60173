"""Select solvers, problems and robots by the user's names, which may be abbreviated."""

import difflib
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

from plumbob.bench.experiments import SCALES, blocks
from plumbob.bench.experiments.published import TOOLBOX, TRAC_IK
from plumbob.bench.measure.block import Block, Choice, Scale
from plumbob.bench.peers import catalogue, opening
from plumbob.bench.peers.user_solver import UserSolver
from plumbob.bench.problems import files
from plumbob.bench.problems.own import OwnProblem
from plumbob.bench.problems.robots import REACHABLE, UNREACHABLE
from plumbob.reference.arguments import name_list
from plumbob.text.printable import visible

# The tasks whose problems are robots.
ROBOT_TASKS = (REACHABLE, UNREACHABLE, TRAC_IK, TOOLBOX)
# The most names in a message.
_MAX_LISTED = 12


class MeasurementRequest(NamedTuple):
    """The options on solvers and problems.

    Attributes:
        user_solvers: solvers of the user, as given to --with.
        program: of the user, behind --.
        solvers, problems, robots: by name; all if empty. Problems may be files.
        targets: random targets a problem, if not as in the scale.
        seed: of random targets, if not as in the scale.
        seeds: that targets of robots are drawn from.
        effector: link of the user's models that reaches the target.
    """

    user_solvers: Sequence[str] = ()
    program: Sequence[str] = ()
    solvers: Sequence[str] = ()
    problems: Sequence[str] = ()
    robots: Sequence[str] = ()
    targets: int | None = None
    seed: int | None = None
    seeds: int = 1
    effector: str | None = None


def choose(suites: Sequence[str], scale: str, request: MeasurementRequest) -> Choice:
    """Return the requested measurements, after opening the user's solvers and problems.

    Raises:
        ValueError: if a solver or problem cannot be opened, or a name is unknown.
    """
    entries = opening.addresses(request.user_solvers, request.program)
    user_solvers = opening.open_solvers(entries, suites)
    installed = opening.open_installed(opening.installed(), suites, user_solvers)
    for solver in installed:
        if isinstance(solver, str):
            print(f"plumbob: {visible(solver)}", file=sys.stderr)
        else:
            user_solvers.append(solver)
    own, names = files.read(request.problems, suites, request.effector)
    size = _scale(scale, request, user_solvers, own)
    if not any((request.solvers, names, request.robots)):
        return Choice(scale, size, is_partial=request.targets is not None)
    every = [block for suite in suites for block in blocks(suite, size)]
    solvers = _recorded("solver", request.solvers, every, _solver_names)
    if solvers:  # the solvers of this command take part beside them
        addresses = {entry.text for entry in entries}
        solvers += [block.solver for block in every if block.facts.get("door") in addresses]
    problems = _recorded("problem", names, every, _problem_names)
    problems += _recorded("robot", request.robots, every, _robot_names)
    # Blocks of absent solvers are of the problem "robots/all".
    problems += [f"{name.partition('/')[0]}/all" for name in problems]
    choice = Choice(scale, size, tuple(solvers), tuple(problems), is_partial=True)
    if not any(map(choice.takes, every)):
        names_text = " and ".join(filter(None, map(name_list, (names, request.robots))))
        raise ValueError(
            f"solver: expected one that is asked {names_text or 'something'} in "
            f"{', '.join(suites)}, got {name_list(request.solvers)}; "
            f"`plumbob bench {suites[0]} --list` lists all"
        )
    return choice


def _scale(
    name: str,
    request: MeasurementRequest,
    user_solvers: list[UserSolver],
    problems: list[OwnProblem],
) -> Scale:
    """Return a scale with the user's solvers, problems, targets and seeds."""
    scale = SCALES[name]
    return replace(
        scale,
        targets=request.targets or scale.targets,
        seed=scale.seed if request.seed is None else request.seed,
        seeds=request.seeds,
        user_solvers=tuple(user_solvers),
        problems=tuple(problems),
    )


def _solver_names(block: Block) -> tuple[str, list[str]]:
    """Return a solver's name in records, and its names: also in tables, and before the comma."""
    solver = block.solver
    return solver, [solver, catalogue.find(solver).label, solver.partition(", ")[0]]


def _problem_names(block: Block) -> tuple[str, list[str]]:
    """Return a problem's name in records, and its names: also its title and families."""
    problem, title = block.problem, str(block.facts.get("title", block.problem))
    parts = problem.split("/")
    return problem, [problem, title, *("/".join(parts[:i]) for i in range(1, len(parts)))]


def _robot_names(block: Block) -> tuple[str, list[str]]:
    """Return a problem's name in records, and the name of its robot if any."""
    robot = block.problem.rpartition("/")[2]
    is_robot = block.facts.get("task") in ROBOT_TASKS and robot != "all"
    return block.problem, [robot] if is_robot else []


def _recorded(
    kind: str,
    words: Sequence[str],
    every: Iterable[Block],
    read: Callable[[Block], tuple[str, list[str]]],
) -> list[str]:
    """Return the names in records of a user's words, one or several each."""
    recorded: dict[str, list[str]] = {}
    for name, aliases in map(read, every):
        for alias in aliases:
            recorded.setdefault(alias, []).append(name)
    folded = {alias.casefold(): alias for alias in reversed(recorded)}
    names: list[str] = []
    for word in words:
        alias = word if word in recorded else folded.get(word.casefold(), "")
        if not alias:
            raise ValueError(f"unknown {kind} {word!r}: {_hint(word, folded)}")
        names += recorded[alias]
    return list(dict.fromkeys(names))


def _hint(word: str, folded: dict[str, str]) -> str:
    near = difflib.get_close_matches(word.casefold(), folded, n=1, cutoff=0.5)
    if near:
        return f"did you mean {folded[near[0]]!r}?"
    names = sorted(set(folded.values()))
    more = f" and {len(names) - _MAX_LISTED} more; see --list" if len(names) > _MAX_LISTED else ""
    return f"expected one of {name_list(names[:_MAX_LISTED])}{more}" if names else "there is none"
