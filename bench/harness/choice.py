"""Which of a suite's blocks a run asks for: all of them, or those that the user chose."""

from dataclasses import dataclass

from .block import Block, Scale


@dataclass(frozen=True)
class Choice:
    """What is to be measured.

    Attributes:
        name: of the scale, "quick" or "full".
        scale: how much is measured, and whose solvers and problems take part.
        solvers: only these, by the names in records; all if none.
        problems: only these.
        is_partial: whether it leaves out something that the scale has.
    """

    name: str
    scale: Scale
    solvers: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    is_partial: bool = False

    def takes(self, block: Block) -> bool:
        """Return whether a block is asked for."""
        by = not self.solvers or block.solver in self.solvers
        return by and (not self.problems or block.problem in self.problems)
