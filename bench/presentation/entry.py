"""What an experiment offers to the report: questions, each with a table and figures."""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from .results import Results
from .tables import Table

if TYPE_CHECKING:
    from .figures import Drawing

Figure = Callable[[Results], "Drawing | None"]


class Entry(NamedTuple):
    """A question, the table that answers it, and the figures that stand beside it."""

    question: str
    table: Callable[[Results], Table]
    figures: tuple[Figure, ...] = ()
