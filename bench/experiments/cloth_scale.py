"""Cloths from a thousand particles to a million: factors, solves, iterations, memory.

Each cloth is measured in its own process, because only a process knows its peak memory.
"""

import resource
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from plumbob.reference import ImplicitEuler, MassSpring, State, scenes
from plumbob.reference.arguments import FloatArray
from plumbob.reference.backend.compiled import Kernel
from plumbob.reference.implicit_euler.factor_cache import clear as clear_factor_cache
from plumbob.reference.implicit_euler.factor_cache import prefactored
from plumbob.reference.implicit_euler.objective import global_matrix

from ..clock import compute_time_of
from ..measure import metrics
from ..measure.block import Block, Measured, Scale
from ..measure.isolation import in_a_fresh_process
from ..measure.progress import announce
from ..measure.record import Record
from ..measure.values import Fact, Floats1, Values
from ..peers import catalogue

# A frame [s], a stiff cloth [N/m], and the iterations of Liu et al. 2013.
H, STIFFNESS, ITERATIONS = 1 / 60, 1e4, 10
# Particles along a side, and the shortest benchmark time [s] at which the cloth is measured.
SIZES = {32: 0.0, 100: 0.0, 316: 1.0, 1000: 1.0}
# SuperLU takes 19 s for 100,000 particles, and its time grows faster than their number.
MAX_SIZE_SCIPY = 316
SUPERNODAL = catalogue.SUPERNODAL.name
# Rounds, each of which times all parts once: so many particles in total, within limits.
ROUNDS_PARTICLES, ROUNDS = 1_000_000, (3, 15)
# The plain read goes over this much memory again and again: more than most caches hold [bytes].
STRETCH = 2**28
# Time limit of a part [s], for example the factor of a million particles, with compilation.
PATIENCE = 1800.0


class FactorCosts(Values, frozen=True, kw_only=True):
    """A cloth factored by a library: times [s], (round,), and memory [bytes].

    None where only our factors are measured.
    """

    particles: Fact[int]
    iterations: Fact[int]
    before: int  # the memory before the cloth
    assembly: float | None = None
    factor: float
    refactor: float | None = None  # the time of a second factor of the same pattern
    solve: Floats1  # of three right-hand sides
    local: Floats1 | None = None
    step: Floats1 | None = None
    limit: Floats1 | None = None  # plain reads of as many bytes as an iteration reads
    entries: int | None = None  # nonzeros of the factor
    matrix_entries: int | None = None
    memory: int  # the peak of the process
    residual: float | None = None  # after all iterations of a step
    history: Floats1 | None = None  # the residual at the start and after each iteration


KINDS = {"": FactorCosts}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every size by our own factorisation, and all but the largest by SciPy's."""
    for size, seconds in SIZES.items():
        settings: dict[str, Any] = {"particles": size * size, "h": H, "stiffness": STIFFNESS}
        settings["iterations"] = ITERATIONS
        libraries = catalogue.FACTORS if size <= MAX_SIZE_SCIPY else (catalogue.SUPERNODAL,)
        for library in libraries if scale.seconds >= seconds else ():
            measure_it = partial(in_its_own_process, size, library.name)
            yield Block("cloth_scale", f"cloth/{size}x{size}", library.name, measure_it, settings)


def in_its_own_process(size: int, library: str) -> Measured:
    """Measure a cloth in a fresh process."""
    return in_a_fresh_process(PATIENCE, compiled_and_measured, size, library)


def compiled_and_measured(size: int, library: str) -> dict[str, Any]:
    """Compile everything on a small cloth, then measure."""
    measure(min(SIZES), library)
    clear_factor_cache()
    return measure(size, library)


def billowing_cloth(size: int) -> tuple[MassSpring, State]:
    """Return the lab's cloth, a hundred times as stiff, with two rising waves across."""
    system, flat = scenes.lab_cloth(size=size, stiffness=STIFFNESS)
    x = flat.positions.copy()
    wave = np.sin(np.pi * x[:, 0]) * np.cos(np.pi * x[:, 2])
    x[:, 1] += 0.1 * wave
    v = np.zeros_like(x)
    v[:, 1] = wave
    return system, State(x, v)


def measure(size: int, library: str) -> dict[str, Any]:
    """Return the times [s] and the memory [bytes] of a cloth."""
    before = memory()

    def say(part: str) -> None:
        announce(f"cloth/{size}x{size}, {library}: {part}")

    say("cloth")
    system, state = billowing_cloth(size)
    rounds = int(np.clip(ROUNDS_PARTICLES // size**2, *ROUNDS))
    if library == SUPERNODAL:
        return {"before": before, **steps(system, state, rounds, say)}
    matrix = global_matrix(system, H)
    say("factor")
    factor, seconds = compute_time_of(lambda: superlu(matrix))
    sides = np.array(state.positions)
    times = in_turn({"solve": lambda: factor.solve(sides)}, rounds, say)
    return {"factor": seconds, **times, "memory": memory(), "before": before}


def superlu(matrix: Any) -> Any:
    """Return the factor of a symmetric positive definite matrix by SciPy's SuperLU."""
    return scipy.sparse.linalg.splu(
        matrix,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )


def steps(
    system: MassSpring, state: State, rounds: int, say: Callable[[str], None]
) -> dict[str, Any]:
    """Return the times of iterations and of their parts, and the final residual."""
    say("matrix")
    matrix, assembly = compute_time_of(lambda: global_matrix(system, H))
    say("factor")
    factor, seconds = compute_time_of(lambda: prefactored(matrix))
    integrator = ImplicitEuler(
        system, h=H, solver="local_global", tolerance=0.0, max_iterations=ITERATIONS
    )
    objective = integrator.objective(state)
    gradient = objective.start.gradient
    work = {
        "solve": lambda: factor.solve(gradient),
        "local": lambda: objective.evaluate(objective.y),
        "step": lambda: integrator.step(state),
        "limit": reading(2 * 8 * factor.entries + local_bytes(system)),
    }
    times = in_turn(work, rounds, say)
    say("second factor")
    peak, result = memory(), integrator.step(state)
    double = global_matrix(system, 2 * H)
    _, refactor = compute_time_of(lambda: factor.refactorize(double))
    sizes = {"entries": factor.entries, "matrix_entries": matrix.nnz, "memory": peak}
    errors = {"residual": result.residual, "history": result.history.tolist()}
    factors = {"assembly": assembly, "factor": seconds, "refactor": refactor}
    return {**factors, **times, **sizes, **errors}


def in_turn(
    work: dict[str, Callable[[], Any]], rounds: int, say: Callable[[str], None]
) -> dict[str, list[float]]:
    """Return the time of each part in each round; the first, uncounted round warms up."""
    times: dict[str, list[float]] = {name: [] for name in work}
    for i in range(rounds + 1):
        say(f"round {i} of {rounds}")
        for name, call in work.items():
            times[name].append(compute_time_of(call)[1])
    return {name: seconds[1:] for name, seconds in times.items()}


def local_bytes(system: MassSpring) -> int:
    """Return the bytes read by a local step: the springs, and six numbers per particle."""
    arrays = system.arrays
    springs = (arrays.springs, arrays.rest_lengths, arrays.stiffnesses, arrays.tension_only)
    return sum(array.nbytes for array in springs) + 6 * 3 * 8 * system.particle_count


def reading(size: int) -> Callable[[], float]:
    """Return a call that reads so many bytes, as fast as memory or the caches allow."""
    numbers = np.ones(min(size // 2, STRETCH) // 8)
    passes, remainder = divmod(size // 8, len(numbers))
    return lambda: sum(_total(numbers) for _ in range(passes)) + _total(numbers[:remainder])


def total(numbers: FloatArray) -> float:
    """Return the sum, in the fastest order."""
    result = 0.0
    for i in range(len(numbers)):
        result += numbers[i]
    return result


_total = Kernel(total, relaxed=True)


def memory() -> int:
    """Return the peak memory of this process [bytes].

    On Linux `ru_maxrss` includes the memory of the parent at the start of the process.
    """
    status = Path("/proc/self/status")
    if status.exists():
        return 1024 * int(status.read_text().split("VmHWM:")[1].split()[0])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


# What is shown.

from ..tables.captions import Captions
from ..tables.columns import text
from ..tables.table import NO_SUMMARY, Column, Summary, words

LABELS = {library.name: library.label for library in catalogue.FACTORS}


def _median(record: Record, quantity: str) -> float | None:
    """Return the median of a quantity, None if not measured."""
    if quantity == "iteration":
        step = _median(record, "step")
        return step and step / record.values.iterations
    numbers = getattr(record.values, quantity)
    return None if numbers is None else metrics.spread(numbers).median


def _of(quantity: str, divisor: str = "") -> Callable[[Record], float | None]:
    """Return a reader of a median, or of a ratio of two medians."""

    def read(record: Record) -> float | None:
        median = _median(record, quantity)
        other = _median(record, divisor) if divisor else 1.0
        return None if median is None or other is None else metrics.ratio(median, other)

    return read


_per_solve = _of("step", "solve")

COLUMNS = (
    Column("particles", read=lambda record: record.values.particles),
    text("library", lambda record: LABELS.get(record.solver, record.solver)),
    Column("first factor", "s", best="least", read=_of("factor")),
    Column("second factor", "s", best="least", read=_of("refactor")),
    Column("solve", "ms", best="least", read=_of("solve")),
    Column("peak memory", "GiB", best="least", read=_of("memory")),
    Column("iteration per particle", "ns", read=_of("iteration", "particles")),
    Column("iteration relative to a plain read", read=_of("iteration", "limit")),
    Column("final residual", read=_of("residual")),
    Column("all iterations relative to a solve", folded=True, read=_per_solve),
    Column("local step per particle", "ns", folded=True, read=_of("local", "particles")),
    Column("solve per particle", "ns", folded=True, read=_of("solve", "particles")),
    Column("solve per nonzero", "ns", folded=True, read=_of("solve", "entries")),
    Column("nonzeros of L per particle", folded=True, read=_of("entries", "particles")),
)


def _summary(records: Sequence[Record]) -> Summary:
    stepped = [record for record in records if record.values.step is not None]
    if not stepped:
        return NO_SUMMARY
    largest = max(stepped, key=lambda record: int(record.values.particles))
    return Summary(
        f"With {words(largest.values.particles)} particles {words(largest.values.iterations)} "
        f"iterations take {words(_median(largest, 'step'))} s, as long as "
        f"{words(_per_solve(largest))} solves; the residual after them is "
        f"{words(largest.values.residual)}."
    )


scale = Captions(__file__).layout(
    "cloth_scale", lambda results: results.all("cloth_scale"), _summary, columns=COLUMNS
)

LAYOUTS = (scale,)
