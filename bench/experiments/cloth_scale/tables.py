"""What a step costs as cloths grow to a million particles."""

from collections.abc import Sequence

from ...harness import metrics
from ...harness.record import Record
from ...peers import registry
from ...presentation.results import Results, settings
from ...presentation.tables import Cell, Column, Summary, Table, words

OURS = registry.SUPERNODAL.name
PEERS = {library.name: library.label for library in registry.FACTORS}
GIB = 2.0**30


def iterations(results: Results) -> Table:
    """Return the time of solves and iterations for each particle and nonzero."""
    records = [r for r in results.all("cloth_scale") if r.solver == OURS]
    count = settings(records, "iterations")
    return Table(
        "cloth_scale",
        "Local/global iterations as the cloth grows",
        (
            Column("particles"),
            Column("nonzeros of L for each"),
            Column("solve", "ns/nonzero"),
            Column("solve", "ns/particle"),
            Column("local step", "ns/particle"),
            Column("iteration", "ns/particle"),
            Column(f"{count} iterations", "solves"),
            Column(f"{count} iterations", "limits"),
            Column("residual then"),
        ),
        tuple(_iterations_row(record) for record in records),
        shows="A solve has three right-hand sides. The limit is the time of reading as many bytes "
        "as an iteration has to: the factor twice, the springs, the particles, in memory as near "
        "as theirs. As a factor outgrows a cache, its nonzeros cost more.",
        measured=_measured(records),
        summary=_iterations_summary(records),
    )


def factors(results: Results) -> Table:
    """Return the time and the memory of factors, ours and CHOLMOD's."""
    records = results.all("cloth_scale")
    return Table(
        "cloth_factors",
        "Factors of M + h² L as the cloth grows",
        (
            Column("particles"),
            Column("by", words=True),
            Column("first factor", "s"),
            Column("again, pattern known", "s"),
            Column("solve", "ms"),
            Column("most memory", "GiB"),
        ),
        tuple(_factor_row(record) for record in records),
        shows="The first factor finds an order of elimination; another step length or stiffness "
        "needs only the second. The memory is that of a whole process, compiler and cloth "
        "included, but for a second factor beside the first.",
        measured=_measured(records),
        summary=_factors_summary(records),
    )


def _iterations_row(record: Record) -> tuple[Cell, ...]:
    particles, entries = record.settings["particles"], int(record.arrays["entries"])
    solve, local, step = (_median(record, name) for name in ("solve", "local", "step"))
    each = step / record.settings["iterations"]
    return (
        particles,
        metrics.ratio(entries, particles),
        metrics.nanoseconds(metrics.ratio(solve, entries)),
        *(metrics.nanoseconds(metrics.ratio(t, particles)) for t in (solve, local, each)),
        metrics.ratio(step, solve),
        metrics.ratio(each, _median(record, "limit")),
        float(record.arrays["residual"]),
    )


def _factor_row(record: Record) -> tuple[Cell, ...]:
    particles, by = record.settings["particles"], PEERS.get(record.solver, record.solver)
    if "missing" in record.notes:
        return (particles, f"{by}: {record.notes['missing']}", None, None, None, None)
    again = record.arrays.get("refactor")
    return (
        particles,
        by,
        float(record.arrays["factor"]),
        None if again is None else float(again),
        metrics.milliseconds(_median(record, "solve")),
        metrics.ratio(float(record.arrays["memory"]), GIB),
    )


def _iterations_summary(records: Sequence[Record]) -> Summary:
    if not records:
        return Summary()
    last = max(records, key=lambda record: record.settings["particles"])
    particles, count = words(last.settings["particles"]), words(last.settings["iterations"])
    step, solve = _median(last, "step"), _median(last, "solve")
    return Summary(
        f"With {particles} particles {count} iterations take {words(step)} s, as long as "
        f"{words(metrics.ratio(step, solve))} solves, and leave a residual of "
        f"{words(float(last.arrays['residual']))}."
    )


def _factors_summary(records: Sequence[Record]) -> Summary:
    pairs: dict[int, dict[str, Record]] = {}
    for record in (r for r in records if r.arrays):
        pairs.setdefault(record.settings["particles"], {})[record.solver] = record
    points = tuple(
        f"{words(particles)} particles: factor {_times(pair, 'factor')}, solve "
        f"{_times(pair, 'solve')}, memory {_times(pair, 'memory')}"
        for particles, pair in pairs.items()
        if PEERS.keys() <= pair.keys()
    )
    return Summary("Ours as a multiple of CHOLMOD’s:" if points else "", points)


def _times(pair: dict[str, Record], name: str) -> str:
    ours, theirs = (_median(pair[solver], name) for solver in PEERS)
    return words(metrics.ratio(ours, theirs))


def _median(record: Record, name: str) -> float:
    return metrics.timing(record.arrays[name]).median


def _measured(records: Sequence[Record]) -> str:
    stiffness, h = settings(records, "stiffness"), settings(records, "h")
    return (
        f"The lab’s cloth, with more particles, a stiffness of {stiffness or '–'} N/m and two "
        f"waves that rise; steps of {h or '–'} s. Each cloth in a process of its own, on one core "
        "but for the springs of the largest, which are summed on all; times are medians of rounds "
        "in which everything is timed once."
    )
