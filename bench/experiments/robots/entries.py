"""What the report shows of robots and the character."""

from ...presentation.entry import Entry
from . import figures, tables


def _entries(kind: str) -> tuple[Entry, ...]:
    """Return the entries that exist for either kind of solver."""
    made = tables.TABLES[kind]
    budgets, profiles = figures.budgets(kind), figures.profiles(kind)
    return (
        Entry(f"With {kind}: how many targets are solved, how soon?", made.success),
        Entry(f"With {kind}: which targets are hard?", made.strata),
        Entry(f"With {kind}: what happens out of reach?", made.unreachable),
        Entry(f"With {kind}: who is ahead at an equal budget?", made.budgets, (budgets,)),
        Entry(f"With {kind}: who is the fastest, how often?", made.profiles, (profiles,)),
    )


ENTRIES = (
    Entry("Who takes part?", tables.who),
    Entry("On which robots?", tables.models),
    *(entry for kind in tables.KINDS for entry in _entries(kind)),
)
