"""A block: one problem for one solver, measured in one go."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from ..peers.entrant import Entrant

if TYPE_CHECKING:
    from ..problems.own import OwnProblem


class Measured(NamedTuple):
    """What a block found.

    Attributes:
        values: numbers, of the type that the experiment declares; None where there are none.
        notes: sentences that belong to them, by name.
        facts: what tables select and sort by, beside the facts of the block; see `Block`.
    """

    values: Any  # `Values` of the type that the experiment declares, or None
    notes: Mapping[str, str] = {}
    facts: Mapping[str, Any] = {}

    @property
    def arrays(self) -> Mapping[str, Any]:
        """The values by the names they have on record."""
        from .values import stored  # the command line lists blocks without NumPy

        return {} if self.values is None else stored(self.values)


@dataclass(frozen=True)
class Scale:
    """How much is measured.

    Attributes:
        targets: random targets a problem.
        seconds: of a benchmark.
        entrants: solvers of the user's, beside those that the bench knows.
        problems: problems of the user's, likewise.
    """

    targets: int
    seconds: float
    entrants: tuple[Entrant, ...] = ()
    problems: "tuple[OwnProblem, ...]" = ()

    def is_as_short_as(self, name: str) -> bool:
        """Return whether benchmarks are as short as at a scale that has a name."""
        return self.seconds == SCALES[name].seconds


SCALES = {"quick": Scale(targets=200, seconds=0.2), "full": Scale(targets=2000, seconds=2.0)}


@dataclass(frozen=True)
class Block:
    """One problem for one solver with the settings that change the answer, and how to measure it.

    The numbers are made only when `measure` is called.

    Attributes:
        suite: which family of problems.
        problem: the name of the problem; with suite, solver and settings it is the block's key.
        solver: what solves it.
        measure: measures it.
        settings: numbers, words and truth values that change the answer.
        size: how much is measured, where that varies: targets, or seconds of a benchmark.
        facts: what the names say, as values: numbers, words, truth values and lists of words.
            "title" is how the problem is written, "task" which of the suite's kinds it is.
        times: whether times are among the numbers, or end the work: see `Experiment`.
        conditions: what its solver is measured under, beside what every record has.
        budget: the time that bounds the work [s]; 0 if none does.
    """

    suite: str
    problem: str
    solver: str
    measure: Callable[[], Measured]
    settings: Mapping[str, Any] = field(default_factory=dict)
    size: float = 0
    facts: Mapping[str, Any] = field(default_factory=dict)
    times: bool = True
    conditions: Mapping[str, Any] = field(default_factory=dict)
    budget: float = 0.0

    def of(self, entrant: Entrant | None) -> "Block":
        """Return a block that says whose it is; what opens a user's solver changes no answer."""
        if entrant is None:
            return self
        return replace(
            self,
            settings={**self.settings, "version": entrant.version},
            facts={**self.facts, **entrant.facts},
            conditions=entrant.conditions,
        )

    def on(self, problem: "OwnProblem") -> "Block":
        """Return a block that is measured again once a user's problem is another."""
        return replace(self, facts={**self.facts, "problem_digest": problem.digest})
