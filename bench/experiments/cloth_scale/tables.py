"""What a step costs as cloths grow to a million particles."""

from collections.abc import Sequence

from ...harness import metrics
from ...harness.record import Record
from ...harness.results import settings
from ...peers import registry
from ...tables.columns import folded, least, number, setting, text
from ...tables.layout import Layout
from ...tables.table import Column, Summary, listing, words

OURS = registry.SUPERNODAL.name
PEERS = {library.name: library.label for library in registry.FACTORS}


def _iterations_columns(records: Sequence[Record]) -> tuple[Column, ...]:
    count = settings(records, "iterations")
    return (
        setting("particles", "particles"),
        *folded(
            [
                _over_particles("nonzeros of L for each", "entries"),
                Column("solve", "ns/nonzero", read=lambda r: _ratio(r, "solve", "entries")),
            ]
        ),
        _over_particles("solve", "solve", "ns/particle"),
        _over_particles("local step", "local", "ns/particle"),
        Column(
            "iteration",
            "ns/particle",
            read=lambda r: metrics.ratio(_iteration(r), r.settings["particles"]),
        ),
        Column(f"{count} iterations", "solves", read=lambda r: _ratio(r, "step", "solve")),
        Column(
            "iteration",
            "plain reads",
            read=lambda r: metrics.ratio(_iteration(r), _median(r, "limit")),
        ),
        number("residual then", "residual"),
    )


def _over_particles(title: str, name: str, unit: str = "") -> Column:
    return Column(
        title, unit, read=lambda r: metrics.ratio(_median(r, name), r.settings["particles"])
    )


def _library(record: Record) -> str:
    by = PEERS.get(record.solver, record.solver)
    return f"{by}: {record.notes['missing']}" if "missing" in record.notes else by


def _memory(record: Record) -> float | None:
    return float(record.arrays["memory"]) if record.arrays else None


def _iteration(record: Record) -> float:
    return _median(record, "step") / float(record.settings["iterations"])


def _iterations_summary(records: Sequence[Record]) -> Summary:
    last = max(records, key=lambda record: record.settings["particles"])
    particles, count = words(last.settings["particles"]), words(last.settings["iterations"])
    return Summary(
        f"With {particles} particles {count} iterations take {words(_median(last, 'step'))} s, as "
        f"long as {words(_ratio(last, 'step', 'solve'))} solves, and leave a residual of "
        f"{words(float(last.arrays['residual']))}."
    )


def _factors_summary(records: Sequence[Record]) -> Summary:
    pairs: dict[int, dict[str, Record]] = {}
    for record in (r for r in records if r.arrays):
        pairs.setdefault(record.settings["particles"], {})[record.solver] = record
    points = (
        f"{words(particles)} particles: factor {_multiple(pair, 'factor')}, solve "
        f"{_multiple(pair, 'solve')}, memory {_multiple(pair, 'memory')}"
        for particles, pair in pairs.items()
        if PEERS.keys() <= pair.keys()
    )
    return listing("Ours as a multiple of CHOLMOD’s:", points)


def _multiple(pair: dict[str, Record], name: str) -> str:
    ours, theirs = (_median(pair[solver], name) for solver in PEERS)
    return words(metrics.ratio(ours, theirs))


def _ratio(record: Record, name: str, other: str) -> float:
    return metrics.ratio(_median(record, name), _median(record, other))


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


iterations = Layout(
    "What does an iteration cost as the cloth grows?",
    "cloth_scale",
    "Local/global iterations as the cloth grows",
    columns=_iterations_columns,
    subjects=lambda results: [r for r in results.all("cloth_scale") if r.solver == OURS],
    shows="A solve has three right-hand sides. A plain read is a loop over as many bytes as an "
    "iteration has to read: the factor twice, the springs, the particles. It is a yardstick and no "
    "lower bound. As a factor outgrows a cache, its nonzeros cost more.",
    measured=_measured,
    summary=_iterations_summary,
)


factors = Layout(
    "And a factor?",
    "cloth_factors",
    "Factors of M + h² L as the cloth grows",
    subjects=lambda results: results.all("cloth_scale"),
    columns=(
        setting("particles", "particles"),
        text("by", _library),
        *least(
            [
                number("first factor", "factor", "s"),
                number("again, pattern known", "refactor", "s"),
                Column("solve", "ms", read=lambda r: _median(r, "solve") if r.arrays else None),
                Column("most memory", "GiB", read=_memory),
            ]
        ),
    ),
    shows="The first factor finds an order of elimination; another step length or stiffness "
    "needs only the second. The memory is that of a whole process, compiler and cloth "
    "included, but for a second factor beside the first.",
    measured=_measured,
    summary=_factors_summary,
)


LAYOUTS = (iterations, factors)
