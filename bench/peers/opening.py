"""Open the user's solvers, once, and note how the solvers describe themselves."""

import importlib.metadata
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from plumbob.text.printable import one_line
from plumbob.verify.connections import LIMITS, open_connection
from plumbob.verify.exchange import NoGreetingError
from plumbob.verify.greeting import Greeting

from ..problems.own import clean
from . import catalogue
from .sources import commit_of, digest_of
from .user_solver import SUITE_TASKS, Spec, UserSolver

GROUP = "plumbob.solvers"


class SolverAddress(NamedTuple):
    """A solver to open: the text of its address, its spec, and the user's name for the solver."""

    text: str
    spec: Spec
    name: str = ""
    version: str = ""


def addresses(words: Sequence[str], program: Sequence[str] = ()) -> list[SolverAddress]:
    """Return the addresses in --with and in a program behind --.

    Args:
        words: each a Python file, module:object, a program's file, or NAME= before any of these.
        program: a command and its arguments.
    """
    solvers = [_address(word) for word in words]
    return [*solvers, SolverAddress(" ".join(program), tuple(program))] if program else solvers


def _address(word: str) -> SolverAddress:
    name, equals, text = word.partition("=")
    if not equals or Path(word).exists():
        name, text = "", word
    if not text:
        raise ValueError(f"with: expected NAME=FILE, got {word!r}")
    place, colon, attribute = text.partition(":")
    is_file = Path(place).exists()
    spec = f"{Path(place).resolve()}{colon}{attribute}" if is_file else text
    return SolverAddress(text, spec, name)


def installed() -> list[SolverAddress]:
    """Return the solvers offered by installed packages as entry points."""
    points = importlib.metadata.entry_points(group=GROUP)
    return [
        SolverAddress(
            f"{point.name} of {point.dist.name}" if point.dist else point.name,
            point.value.replace(" ", "") + ("" if ":" in point.value else ":"),
            version=point.dist.version if point.dist else "",
        )
        for point in sorted(points, key=lambda point: (point.name, point.value))
    ]


def open_solvers(addresses: Sequence[SolverAddress], suites: Sequence[str]) -> list[UserSolver]:
    """Return the solvers, each started once to describe itself.

    Raises:
        ValueError: if a solver cannot be opened, offers no task of the suites, or has the name of
            another.
    """
    solvers = [_open(address) for address in addresses]
    for solver in solvers:
        if not any(map(solver.offers, suites)):
            tasks = [f"{suite} ({', '.join(tasks)})" for suite, tasks in SUITE_TASKS.items()]
            raise ValueError(
                f"with: expected a solver for one of the suites that are run; {solver.address} "
                f"offers {', '.join(solver.tasks)}, and the suites for users' solvers are "
                f"{' and '.join(tasks)}"
            )
    addresses_by_name: dict[str, str] = {}
    for solver in solvers:
        first = addresses_by_name.setdefault(solver.name.casefold(), solver.address)
        if first is not solver.address:
            raise ValueError(
                f"with: expected solvers of different names, got {solver.name!r} twice, {first} "
                f"and {solver.address}; call one otherwise: --with 'another name={solver.address}'"
            )
    return solvers


def open_installed(
    installed: Sequence[SolverAddress], suites: Sequence[str], solvers: Sequence[UserSolver]
) -> Iterator[UserSolver | str]:
    """Yield each installed solver with a task of the suites, or why the solver takes no part."""
    names = {solver.name.casefold() for solver in solvers}
    for address in installed:
        try:
            solver = _open(address)
            if not any(map(solver.offers, suites)):
                continue
            if solver.name.casefold() in names:
                raise ValueError(f"there is a solver called {solver.name!r} already")
            names.add(solver.name.casefold())
            yield solver
        except ValueError as error:
            yield f"{address.text} takes no part: {error}"


def _open(address: SolverAddress) -> UserSolver:
    solver = open_connection(address.spec, LIMITS)
    try:
        greeting = solver.greeting
    except NoGreetingError as error:
        why = one_line(str(error.failure.sentence), 300)
        raise ValueError(
            f"with: expected a solver that says what it is, got {address.text}: {why}"
        ) from None
    finally:
        solver.close()
    return UserSolver(
        _name(address, greeting),
        clean(address.text),
        address.spec,
        clean(greeting.version or address.version),
        commit_of(address.spec),
        digest_of(address.spec),
        greeting.tasks,
        tuple(map(clean, greeting.methods)),
        greeting.step.method,
    )


def _name(address: SolverAddress, greeting: Greeting) -> str:
    """Return a name that no other solver has, with the address appended where needed."""
    own_name, text = greeting.name, clean(address.text)
    if own_name == Greeting(greeting.protocol, ()).name:  # it has none
        word = address.spec if isinstance(address.spec, str) else address.spec[0]
        own_name = Path(word.partition(":")[0]).name
    name = clean(address.name or own_name) or text
    taken_names = set(map(str.casefold, catalogue.names()))
    return f"{name} ({text})" if name.casefold() in taken_names else name
