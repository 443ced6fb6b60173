"""Open the user's solvers, once, and note how the solvers describe themselves."""

import importlib.metadata
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from plumbob.text.printable import one_line
from plumbob.verify.contestant import NoGreetingError
from plumbob.verify.door import LIMITS, open_contestant
from plumbob.verify.greeting import Greeting

from ..problems.own import clean
from . import catalogue
from .sources import commit_of, digest_of
from .user_solver import SUITE_TASKS, Entrant, Spec

GROUP = "plumbob.solvers"


class SolverAddress(NamedTuple):
    """A solver to open: its address, its spec, and the user's name for the solver."""

    door: str
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
    name, equals, door = word.partition("=")
    if not equals or Path(word).exists():
        name, door = "", word
    if not door:
        raise ValueError(f"with: expected NAME=FILE, got {word!r}")
    place, colon, attribute = door.partition(":")
    is_file = Path(place).exists()
    spec = f"{Path(place).resolve()}{colon}{attribute}" if is_file else door
    return SolverAddress(door, spec, name)


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


def opened(addresses: Sequence[SolverAddress], suites: Sequence[str]) -> list[Entrant]:
    """Return the solvers, each started once to describe itself.

    Raises:
        ValueError: if a solver cannot be opened, offers no task of the suites, or has the name of
            another.
    """
    entrants = [_opened(address) for address in addresses]
    for entrant in entrants:
        if not any(map(entrant.offers, suites)):
            tasks = [f"{suite} ({', '.join(tasks)})" for suite, tasks in SUITE_TASKS.items()]
            raise ValueError(
                f"with: expected a solver for one of the suites that are run; {entrant.door} "
                f"offers {', '.join(entrant.tasks)}, and suites that ask entrants are "
                f"{' and '.join(tasks)}"
            )
    doors: dict[str, str] = {}
    for entrant in entrants:
        first = doors.setdefault(entrant.name.casefold(), entrant.door)
        if first is not entrant.door:
            raise ValueError(
                f"with: expected solvers of different names, got {entrant.name!r} twice, {first} "
                f"and {entrant.door}; call one otherwise: --with 'another name={entrant.door}'"
            )
    return entrants


def opened_where_possible(
    installed: Sequence[SolverAddress], suites: Sequence[str], entrants: Sequence[Entrant]
) -> Iterator[Entrant | str]:
    """Yield each installed solver with a task of the suites, or why the solver takes no part."""
    names = {entrant.name.casefold() for entrant in entrants}
    for address in installed:
        try:
            entrant = _opened(address)
            if not any(map(entrant.offers, suites)):
                continue
            if entrant.name.casefold() in names:
                raise ValueError(f"there is a solver called {entrant.name!r} already")
            names.add(entrant.name.casefold())
            yield entrant
        except ValueError as error:
            yield f"{address.door} takes no part: {error}"


def _opened(address: SolverAddress) -> Entrant:
    contestant = open_contestant(address.spec, LIMITS)
    try:
        greeting = contestant.greeting
    except NoGreetingError as error:
        why = one_line(str(error.failure.sentence), 300)
        raise ValueError(
            f"with: expected a solver that says what it is, got {address.door}: {why}"
        ) from None
    finally:
        contestant.close()
    return Entrant(
        _name(address, greeting),
        clean(address.door),
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
    own_name, door = greeting.name, clean(address.door)
    if own_name == Greeting(greeting.protocol, ()).name:  # it has none
        word = address.spec if isinstance(address.spec, str) else address.spec[0]
        own_name = Path(word.partition(":")[0]).name
    name = clean(address.name or own_name) or door
    taken_names = set(map(str.casefold, catalogue.names()))
    return f"{name} ({door})" if name.casefold() in taken_names else name
