"""Open the solvers that a user enters, once, and put down what they say of themselves."""

import importlib.metadata
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from plumbob.crosscheck.verify.contestant import NoGreetingError
from plumbob.crosscheck.verify.greeting import Greeting
from plumbob.crosscheck.verify.message import shown
from plumbob.crosscheck.verify.solvers import LIMITS, open_contestant

from ..problems.own import clean
from . import registry
from .entrant import SUITE_TASKS, Entrant, Spec
from .sources import commit_of, digest_of

GROUP = "plumbob.solvers"


class SolverAddress(NamedTuple):
    """A solver as it is asked for: its address, what opens it, and how the user calls it."""

    door: str
    spec: Spec
    called: str = ""
    version: str = ""


def named(words: Sequence[str], program: Sequence[str] = ()) -> list[SolverAddress]:
    """Return what --with and a program behind -- mean.

    Args:
        words: each a Python file, module:object, a program's file, or NAME= before one of these.
        program: a command and its arguments.
    """
    entries = [_entry(word) for word in words]
    return [*entries, SolverAddress(" ".join(program), tuple(program))] if program else entries


def _entry(word: str) -> SolverAddress:
    called, equals, door = word.partition("=")
    if not equals or Path(word).exists():
        called, door = "", word
    if not door:
        raise ValueError(f"with: expected NAME=FILE, got {word!r}")
    place, colon, attribute = door.partition(":")
    is_file = Path(place).exists()
    return SolverAddress(
        door, f"{Path(place).resolve()}{colon}{attribute}" if is_file else door, called
    )


def installed() -> list[SolverAddress]:
    """Return the solvers that installed packages offer as entry points."""
    points = importlib.metadata.entry_points(group=GROUP)
    return [
        SolverAddress(
            f"{point.name} of {point.dist.name}" if point.dist else point.name,
            point.value.replace(" ", "") + ("" if ":" in point.value else ":"),
            version=point.dist.version if point.dist else "",
        )
        for point in sorted(points, key=lambda point: (point.name, point.value))
    ]


def opened(entries: Sequence[SolverAddress], suites: Sequence[str]) -> list[Entrant]:
    """Return the solvers, each started once to say what it is.

    Raises:
        ValueError: if one cannot be opened, offers nothing that the suites ask for, or has the name
            of another.
    """
    entrants = [_opened(entry) for entry in entries]
    doors: dict[str, str] = {}
    for entrant in entrants:
        if not any(map(entrant.offers, suites)):
            asked = [f"{suite} ({', '.join(tasks)})" for suite, tasks in SUITE_TASKS.items()]
            raise ValueError(
                f"with: expected a solver for one of the suites that are run; {entrant.door} "
                f"offers {', '.join(entrant.tasks)}, and suites that ask entrants are "
                f"{' and '.join(asked)}"
            )
    for entrant in entrants:
        before = doors.setdefault(entrant.name.casefold(), entrant.door)
        if before is not entrant.door:
            raise ValueError(
                f"with: expected solvers of different names, got {entrant.name!r} twice, {before} "
                f"and {entrant.door}; call one otherwise: --with 'another name={entrant.door}'"
            )
    return entrants


def opened_where_possible(
    entries: Sequence[SolverAddress], suites: Sequence[str], before: Sequence[Entrant]
) -> Iterator[Entrant | str]:
    """Yield each installed solver, or a sentence on why it takes no part.

    One that offers nothing to the suites is passed over.
    """
    names = {entrant.name.casefold() for entrant in before}
    for entry in entries:
        try:
            entrant = _opened(entry)
            if not any(map(entrant.offers, suites)):
                continue
            if entrant.name.casefold() in names:
                raise ValueError(f"there is a solver called {entrant.name!r} already")
            names.add(entrant.name.casefold())
            yield entrant
        except ValueError as error:
            yield f"{entry.door} takes no part: {error}"


def _opened(entry: SolverAddress) -> Entrant:
    contestant = open_contestant(entry.spec, LIMITS)
    try:
        greeting = contestant.greeting
    except NoGreetingError as error:
        why = shown(str(error.failure.sentence), 300)
        raise ValueError(
            f"with: expected a solver that says what it is, got {entry.door}: {why}"
        ) from None
    finally:
        contestant.close()
    return Entrant(
        _name(entry, greeting),
        clean(entry.door),
        entry.spec,
        clean(greeting.version or entry.version),
        commit_of(entry.spec),
        digest_of(entry.spec),
        greeting.tasks,
        tuple(map(clean, greeting.methods)),
        greeting.step.method,
    )


def _name(entry: SolverAddress, greeting: Greeting) -> str:
    """Return a name that is no solver's of ours or of a peer: the address is put behind it."""
    said = greeting.name
    if said == Greeting(greeting.protocol, ()).name:  # it says none
        words = entry.spec if isinstance(entry.spec, tuple) else (entry.spec,)
        said = Path(words[0].partition(":")[0]).name
    name = clean(entry.called or said) or clean(entry.door)
    taken = {taken.casefold() for taken in registry.names()}
    return f"{name} ({clean(entry.door)})" if name.casefold() in taken else name
