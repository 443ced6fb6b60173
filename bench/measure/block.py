"""A block: a problem for a solver, and the choice of blocks of a run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from ..peers.user_solver import UserSolver

if TYPE_CHECKING:
    from ..problems.own import OwnProblem


# The seed of random targets, unless the user sets another.
SEED = 1986
# The result of a block: numbers and words by name, of the type that the experiment declares.
Measured = Mapping[str, Any]


class Group(NamedTuple):
    """Blocks to measure together, with times taken in turns."""

    name: str  # equal for all blocks of the group, which follow each other
    measure: Callable[[Sequence[Any]], Sequence[Measured]]  # the results of jobs
    job: Any  # what this block asks for

    def measure_alone(self) -> Measured:
        """Return the result of this block by itself."""
        return self.measure([self.job])[0]


@dataclass(frozen=True)
class Scale:
    """How much is measured."""

    targets: int  # random targets a problem
    seconds: float  # of a benchmark
    seed: int = SEED  # of random targets
    seeds: int = 1  # that reachable targets of robots are drawn from, this one and the following
    user_solvers: tuple[UserSolver, ...] = ()  # the user's solvers, beside the registered ones
    problems: "tuple[OwnProblem, ...]" = ()  # the user's problems, likewise


SCALES = {"quick": Scale(targets=200, seconds=0.2), "full": Scale(targets=2000, seconds=2.0)}


@dataclass(frozen=True)
class Block:
    """A problem for a solver with the settings that change the answer, and how to measure.

    Only a call of `measure` makes the numbers.
    """

    suite: str  # the family of problems
    problem: str  # the name of the problem; with suite, solver and settings it is the block's key
    solver: str  # the name of the solver
    measure: Callable[[], Measured]  # measures it
    # numbers, words and truth values that change the answer
    settings: Mapping[str, Any] = field(default_factory=dict)
    size: float = 0  # how much is measured, where that varies: targets, or seconds of a benchmark
    # the names as values: numbers, words, truth values and lists of words. "title" is the problem
    # as written; "task" is the kind of its numbers, see `measure.values`.
    facts: Mapping[str, Any] = field(default_factory=dict)
    times: bool = True  # whether times are among the numbers, or end the work: see `Experiment`
    # of its solver, beside the conditions of every record
    conditions: Mapping[str, Any] = field(default_factory=dict)
    budget: float = 0.0  # the time that bounds the work [s]; 0 if none does
    group: Group | None = None  # the blocks that it is best measured with

    def of(self, solver: UserSolver | None) -> "Block":
        """Return the block of a user's solver, with its version, facts and conditions."""
        if solver is None:
            return self
        settings = {**self.settings, "version": solver.version}
        facts = {**self.facts, "entrant": True, "door": solver.address, "digest": solver.digest}
        conditions = {"solver_commit": solver.commit}
        return replace(self, settings=settings, facts=facts, conditions=conditions)

    def on(self, problem: "OwnProblem") -> "Block":
        """Return the block of a user's problem, measured again when the problem changes."""
        return replace(self, facts={**self.facts, "problem_digest": problem.digest})


@dataclass(frozen=True)
class Choice:
    """The blocks of a run: all blocks, or the user's selection."""

    name: str  # of the scale, "quick" or "full"
    scale: Scale  # how much is measured, and the user's solvers and problems
    solvers: tuple[str, ...] = ()  # only these, by the names in records; all if none
    problems: tuple[str, ...] = ()  # only these
    is_partial: bool = False  # whether it leaves out something that the scale has

    def takes(self, block: Block) -> bool:
        """Return whether a block is selected."""
        is_solver_selected = not self.solvers or block.solver in self.solvers
        return is_solver_selected and (not self.problems or block.problem in self.problems)
