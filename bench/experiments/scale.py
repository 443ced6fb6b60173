"""Growing cloths and chains: time, memory, their exponents, and the limits of the machine.

Each cloth and each chain is measured in its own process, on one thread: memory that others have
freed would not count.
"""

import math
import resource
import secrets
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache, partial
from itertools import product
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import numpy as np
import scipy

from plumbob import reference
from plumbob.reference import ImplicitEuler, MassSpring, State, scenes
from plumbob.reference.arguments import FloatArray
from plumbob.reference.backend.compiled import Kernel
from plumbob.reference.implicit_euler.certificate import MANY_PARTICLES
from plumbob.reference.implicit_euler.objective import global_matrix
from plumbob.reference.sparse import CholeskyFactor
from plumbob.reference.sparse import factor as sparse_factor

from ..clock import compute_time_of, processor_timer, time_limit
from ..measure import metrics
from ..measure.block import Block, Measured, Scale
from ..measure.isolation import in_a_fresh_process
from ..measure.progress import announce
from ..measure.record import Record
from ..measure.values import Fact, Floats1, Values
from ..peers import catalogue
from ..problems.chains import unit
from .timing import shape

# A frame [s], and explicit steps of a frame: half as long as the longest stable one.
H, STEPS = 1 / 60, 10
# The iterations of Liu et al. 2013; the tolerance is that of `ImplicitEuler` by default.
STOPS: dict[str, dict[str, Any]] = {
    "local_global": {"tolerance": 0.0, "max_iterations": 10},
    "newton_cg": {"tolerance": 1e-10},
}
EXPLICIT, SUPERNODAL, SCIPY = "symplectic Euler", *(s.name for s in catalogue.FACTORS)
# Stiffness of all cloths [N/m], and others of the largest cloth.
STIFFNESS, EXTREMES = 1e4, (1e3, 1e5)
# Particles along a side, and the shortest benchmark time [s] at which the cloth is measured.
SIZES = {10: 0.0, 32: 0.0, 100: 0.0, 316: 1.0, 1000: 1.0}
# SuperLU takes 19 s for 100,000 particles, and its time grows faster than their number.
MAX_SIZE_SCIPY = 316
# Balls of a chain with a reach of 1 m; targets at a distance [m], reached from the straight pose.
JOINTS, TARGETS, DISTANCE = (10, 30, 100, 300, 1000), 5, 0.6
LIMITS: dict[str, Any] = {"tolerance": 1e-6, "max_iterations": 2000}
KINEMATICS = "forward kinematics"
IK = ("ccd", "fabrik", "levenberg_marquardt", "damped_least_squares", "jacobian_transpose")
CLOTH_METHODS = (EXPLICIT, *STOPS, SUPERNODAL, SCIPY)
# Flops of a spring's pull on both ends, of an entry of L in a solve with L and L' for three
# coordinates, and of a joint's global rotation (28) and position (33).
SPRING_FLOPS, ENTRY_FLOPS, JOINT_FLOPS = 21, 12, 61
# Least and most rounds, each of which times all parts once.
ROUNDS = (3, 9)
# Rows of the matrices of a dense product. Bytes of a plain read: at most more than caches hold, at
# least enough to take longer than the call.
ROWS, LONGEST_READ, SHORTEST_READ = 1000, 2**28, 2**20
# Time limit of a part [s], for example the factor of a million particles, with compilation.
PATIENCE = 1800.0


class Cost(Values, frozen=True, kw_only=True):
    """Cost of a step, a factor or a solve: times [s], (round,), memory [bytes], and the limits.

    None stands for what the work does not have.
    """

    size: Fact[int]  # particles or joints
    stiffness: Fact[float | None] = None  # [N/m]
    seconds: Floats1
    memory: float  # the peak of the process
    growth: float  # of the process by the work
    reading: float  # time of a plain read of as many bytes as must be read
    computing: float  # time of as many flops in a dense product
    iterations: float | None = None  # mean of all targets
    residual: float | None = None
    solved: float | None = None  # share of the targets
    proof: float | None = None  # time of the certificate of a step, its memory and numbers
    proof_memory: float | None = None
    distance: float | None = None
    curvature: float | None = None


KINDS = {"cloth": Cost, "chain": Cost}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every size by every method, stiffnesses of the largest cloth, and the chains."""
    seconds, sizes = scale.seconds, [n for n in SIZES if scale.seconds >= SIZES[n]]
    cloths = [
        *product(sizes, CLOTH_METHODS, [STIFFNESS]),
        *product(sizes[-1:], ["newton_cg"], EXTREMES),
    ]
    for size, solver, k in cloths:
        stop = {"steps": STEPS} if solver == EXPLICIT else STOPS.get(solver, {})
        settings = {"size": size * size, "stiffness": k, "h": H, **stop}
        case = PATIENCE, compiled_and_measured, size, solver, k, seconds
        if solver != SCIPY or size <= MAX_SIZE_SCIPY:
            measure: Callable[[], Measured] = partial(in_a_fresh_process, *case)
            yield Block("scale", f"cloth/{size}x{size}", solver, measure, settings, size=seconds,
                        facts={"task": "cloth"})  # fmt: skip
    run = secrets.token_hex(8)
    for joints, solver in product(JOINTS, (*IK, KINEMATICS)):
        measure, settings = partial(_chain, run, joints, seconds, solver), {"size": joints} | LIMITS
        yield Block("scale", f"chain/{joints}", solver, measure, settings, size=seconds,
                    facts={"task": "chain"})  # fmt: skip


def _chain(run: str, joints: int, seconds: float, solver: str) -> Measured:
    return _chains(run, joints, seconds)[solver]


@lru_cache(maxsize=1)  # the blocks of a length follow one another
def _chains(run: str, joints: int, seconds: float) -> Mapping[str, Measured]:
    """Return the costs of a chain by method; each run, by its digits, measures again."""
    return in_a_fresh_process(PATIENCE, measure_chains, joints, seconds)


def compiled_and_measured(size: int, solver: str, stiffness: float, seconds: float) -> Measured:
    """Compile everything on a small cloth, then measure."""
    with reference.set_num_threads(1):
        measure_cloth(min(SIZES), solver, stiffness, 0.0)
        return measure_cloth(size, solver, stiffness, seconds)


def measure_chains(joints: int, seconds: float) -> dict[str, dict[str, Any]]:
    """Return the costs of a chain by method."""
    with reference.set_num_threads(1):
        return {solver: measure_chain(joints, solver, seconds) for solver in (*IK, KINEMATICS)}


def billowing_cloth(size: int, stiffness: float = STIFFNESS) -> tuple[MassSpring, State]:
    """Return the lab's cloth, of another stiffness, with two rising waves across."""
    system, flat = scenes.lab_cloth(size=size, stiffness=stiffness)
    x = flat.positions.copy()
    wave = np.sin(np.pi * x[:, 0]) * np.cos(np.pi * x[:, 2])
    x[:, 1] += 0.1 * wave
    v = np.zeros_like(x)
    v[:, 1] = wave
    return system, State(x, v)


class WorkOfCall(NamedTuple):
    """A call to be timed, its first result, the peak of memory, and the least that it must do."""

    call: Callable[[], Any]
    result: Any
    memory: int  # [bytes]
    flops: float
    bytes_read: float = 0.0
    passes: int = 1  # over the same bytes


def frame(solver: str, system: MassSpring, state: State) -> WorkOfCall:
    """Return the work of a frame: passes over the springs, and solves if any."""
    solves: list[FloatArray] = []
    kernel = sparse_factor._solve

    def counting_solve(*arguments: Any) -> None:
        solves.append(arguments[4])  # the values of L
        kernel(*arguments)

    call: Callable[[], Any]
    call = partial(reference.symplectic_euler, system, state, H / STEPS, steps=STEPS)
    if solver != EXPLICIT:
        call = partial(ImplicitEuler(system, h=H, solver=solver, **STOPS[solver]).step, state)
    with mock.patch.object(sparse_factor, "_solve", counting_solve):
        result = call()
    passes = len(solves) or STEPS
    flops = ENTRY_FLOPS * sum(map(len, solves)) + SPRING_FLOPS * passes * len(system.springs)
    bytes_read = 2 * sum(L.nbytes for L in solves) + passes * spring_bytes(system)
    return WorkOfCall(call, result, memory(), flops, bytes_read, passes)


def spring_bytes(system: MassSpring) -> int:
    """Return the bytes of a pass: the springs, and six numbers per particle."""
    arrays = system.arrays
    springs = (arrays.springs, arrays.rest_lengths, arrays.stiffnesses, arrays.tension_only)
    return sum(array.nbytes for array in springs) + 6 * 8 * system.particle_count


def factorisation(library: str, system: MassSpring, state: State) -> WorkOfCall:
    """Return the work of a factor of M + h² L, ordered anew; the flops are those of our order."""
    matrix = global_matrix(system, H)
    symmetric = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    by_scipy = partial(scipy.sparse.linalg.splu, matrix, "MMD_AT_PLUS_A", **symmetric)
    call = by_scipy if library == SCIPY else partial(CholeskyFactor, matrix)
    result, peak = call(), memory()
    return WorkOfCall(call, result, peak, factor_flops(CholeskyFactor(matrix)))


def factor_flops(factor: CholeskyFactor) -> float:
    """Return the sum of the squared lengths of the columns of L."""
    columns, starts, _, _ = factor.pattern.blocks
    widths = np.diff(columns)
    ends = np.repeat(columns[1:] + np.diff(starts), widths)
    return float(np.sum((ends - np.arange(len(ends))).astype(float) ** 2))


def measure_cloth(size: int, solver: str, stiffness: float, seconds: float) -> dict[str, Any]:
    """Return the costs of a cloth, with the certificate of a step that is to converge."""
    name = f"cloth/{size}x{size}, {solver}"
    announce(f"{name}: cloth")
    before = memory(anew=True)
    system, state = billowing_cloth(size, stiffness)
    work = (frame if solver in (EXPLICIT, *STOPS) else factorisation)(solver, system, state)
    costs: dict[str, Any] = {"memory": work.memory, "growth": work.memory - before}
    if solver in STOPS:
        costs |= {"residual": work.result.residual, "iterations": work.result.iterations}
    if solver == "newton_cg":
        announce(f"{name}: proof")
        certify = partial(ImplicitEuler(system, h=H, solver=solver).certify, state, work.result)
        certificate, costs["proof"] = compute_time_of(certify)
        costs |= {"distance": certificate.distance, "curvature": certificate.curvature}
        why = "" if certificate.covered else certificate.coverage.sentence
        costs |= {"proof_memory": memory(), "remark": why}
    return costs | times_beside_limits(work, seconds, name)


def measure_chain(joints: int, solver: str, seconds: float) -> dict[str, Any]:
    """Return the costs of a target of a chain, or of its forward kinematics."""
    skeleton, straight = scenes.ball_chain(links=joints, link_length=1.0 / joints)
    targets = DISTANCE * unit(np.random.default_rng(joints).standard_normal((TARGETS, 3)))

    def solves() -> list[Any]:
        if solver == KINEMATICS:
            return [reference.forward_kinematics(skeleton, straight) for _ in targets]
        starts = [(skeleton, straight, target, solver) for target in targets]
        return [reference.solve_ik(*start, **LIMITS) for start in starts]

    solves()  # may compile
    before, solutions, peak = memory(anew=True), solves(), memory()
    costs: dict[str, Any] = {"memory": peak, "growth": peak - before, "iterations": 1.0}
    if solver != KINEMATICS:
        costs["iterations"] = float(np.mean([s.iterations for s in solutions]))
        costs["solved"] = float(np.mean([s.residual <= LIMITS["tolerance"] for s in solutions]))
    flops = costs["iterations"] * TARGETS * joints * JOINT_FLOPS
    work = WorkOfCall(solves, solutions, peak, flops)
    times = times_beside_limits(work, seconds, f"chain/{joints}, {solver}")
    return costs | {name: np.divide(time, TARGETS).tolist() for name, time in times.items()}


def times_beside_limits(work: WorkOfCall, seconds: float, name: str) -> dict[str, Any]:
    """Return the times of work in rounds [s], and of as many bytes and flops as it must do."""
    read = max(8, min(LONGEST_READ, int(work.bytes_read / work.passes)))
    numbers, repeats, dense = np.ones(read // 8), -(-SHORTEST_READ // read), np.ones((ROWS, ROWS))
    timers = {
        "seconds": processor_timer(work.call),
        "computing": processor_timer(lambda: dense @ dense),
        "reading": processor_timer(partial(_total, numbers, repeats)),
    }
    loops = {part: shape(timer, seconds)[0] for part, timer in timers.items()}
    times: dict[str, list[float]] = {part: [] for part in timers}
    limit = time_limit(seconds)
    for i in range(ROUNDS[1]):
        announce(f"{name}: round {i + 1}")
        for part, timer in timers.items():
            times[part].append(timer.timeit(loops[part]) / loops[part])
        if i + 1 >= ROUNDS[0] and limit():
            break
    reading, computing = (float(np.median(times[part])) for part in ("reading", "computing"))
    return {
        "seconds": times["seconds"],
        "reading": reading * work.bytes_read / (repeats * numbers.nbytes),
        "computing": computing * work.flops / (2.0 * ROWS**3),
    }


def total(numbers: FloatArray, passes: int) -> float:
    """Return the sum of all passes, in the fastest order."""
    result = 0.0
    for _ in range(passes):
        for i in range(len(numbers)):
            result += numbers[i]
    return result


_total = Kernel(total, relaxed=True)


def memory(anew: bool = False) -> int:
    """Return the peak memory of this process [bytes]; anew, the peak begins again on Linux.

    On Linux `ru_maxrss` includes the memory of the parent at the start of the process.
    """
    status, peaks = Path("/proc/self/status"), Path("/proc/self/clear_refs")
    if anew and peaks.exists():
        peaks.write_text("5")
    if status.exists():
        return 1024 * int(status.read_text().split("VmHWM:")[1].split()[0])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


# What is shown.

from ..figures.chart import Panel, Series, declared_chart, series
from ..figures.sketch import Sketch
from ..tables.captions import Captions
from ..tables.columns import text, words_in
from ..tables.results import Results, grouped, label, listed, solvers
from ..tables.table import Column, Summary, words

CAPTIONS = Captions(
    __file__, targets=words(TARGETS), distance=words(DISTANCE), spring=words(SPRING_FLOPS),
    entry=words(ENTRY_FLOPS), joint=words(JOINT_FLOPS), many=words(MANY_PARTICLES),
    newton=words(STOPS["newton_cg"]["tolerance"]),
)  # fmt: skip
TITLES = {
    EXPLICIT: f"symplectic Euler, {STEPS} steps",
    "local_global": f"local/global, {STOPS['local_global']['max_iterations']} iterations",
    SUPERNODAL: "factor of M + h² L",
    SCIPY: "factor by SciPy's SuperLU",
}
LIMIT = catalogue.MACHINE.name
# Less growth than this [bytes] may be memory that was freed before and is used again.
NOTICED = 2**20


class Row(NamedTuple):
    """A cost beside that of the next smaller size by the same method; times in seconds."""

    record: Record
    smaller: "Row | None"
    title: str  # the method
    size: int  # particles or joints
    time: float  # the median
    limit: float
    above: float  # the time relative to the limit
    iteration: float  # time of an iteration
    growth: float | None  # memory for the work [bytes], None if too little is noticed

    def exponent(self, name: str) -> float | None:
        """Return the power of the size with which a number grows, None if not known twice."""
        if self.smaller is None or self.smaller.size == self.size:
            return None
        numbers = [getattr(row, name) for row in (self, self.smaller)]
        if None in numbers or min(numbers) <= 0.0:
            return None
        return math.log(numbers[0] / numbers[1]) / math.log(self.size / self.smaller.size)


def row_of(record: Record, smaller: Row | None = None) -> Row:
    """Return the row of a record."""
    values, title = record.values, TITLES.get(record.solver, label(record.solver))
    time = metrics.spread(values.seconds).median
    growth = values.growth if values.growth >= NOTICED else None
    limit, iteration = max(values.reading, values.computing), time / (values.iterations or 1.0)
    above = metrics.ratio(time, limit)
    return Row(record, smaller, title, values.size, time, limit, above, iteration, growth)


def rows(kind: str, results: Results) -> list[Row]:
    """Return the rows of cloths of the common stiffness or of chains, by method and size."""
    records = sorted(results.all("scale", task=kind), key=lambda record: record.values.size)
    members: list[Row] = []
    for solver in solvers(records):
        smaller = None
        for record in records:
            if record.solver == solver and record.values.stiffness in (None, STIFFNESS):
                smaller = row_of(record, smaller)
                members.append(smaller)
    return members


def proofs(results: Results) -> list[Row]:
    """Return the certified steps, by size and stiffness."""
    cloths = results.all("scale", task="cloth")
    certified = [record for record in cloths if record.values.distance is not None]
    certified.sort(key=lambda record: (record.values.size, record.values.stiffness))
    return list(map(row_of, certified))


def _times(unit: str, noun: str) -> tuple[Column, ...]:
    """Return the columns of method, size, time, exponent and limit."""
    return (
        text("method", attrgetter("title")),
        Column(noun, read=attrgetter("size")),
        Column("time", unit, read=attrgetter("time")),
        Column("exponent of time", read=lambda row: row.exponent("time")),
        Column("limit", unit, read=attrgetter("limit")),
        Column("relative to the limit", read=attrgetter("above")),
    )


def _measured(title: str, name: str, unit: str = "", folded: bool = False) -> Column:
    return Column(title, unit, read=attrgetter(f"record.values.{name}"), folded=folded)


def _binding(row: Row) -> str:
    return "memory" if row.record.values.reading == row.limit else "flops"


CLOTH_COLUMNS = (
    *_times("ms", "particles"),
    text("limited by", _binding),
    _measured("peak memory", "memory", "GiB"),
    Column("memory per particle", "bytes", read=lambda row: row.growth and row.growth / row.size),
    Column("exponent of memory", read=lambda row: row.exponent("growth")),
    _measured("residual", "residual", folded=True),
)
CHAIN_COLUMNS = (
    *_times("µs", "joints"),
    _measured("iterations", "iterations"),
    _measured("solved", "solved", "%"),
    Column("iteration per joint", "ns", read=lambda row: row.iteration / row.size),
    Column("exponent of an iteration", read=lambda row: row.exponent("iteration")),
    _measured("peak memory", "memory", "GiB", folded=True),
)
PROOF_COLUMNS = (
    Column("particles", read=attrgetter("size")),
    _measured("stiffness", "stiffness", "N/m"),
    Column("iterations", read=lambda row: int(row.record.values.iterations)),
    _measured("residual", "residual"),
    _measured("proven distance", "distance", "m"),
    _measured("least curvature", "curvature", "kg"),
    Column("step", "s", read=attrgetter("time")),
    _measured("proof", "proof", "s"),
    _measured("peak memory", "proof_memory", "GiB"),
    text("remark", attrgetter("record.values.remark")),
)


def _summary(unit: str, noun: str, rows: Sequence[Row]) -> Summary:
    largest = max(row.size for row in rows)
    times = [
        f"{row.title} {words_in(row.time, unit)} ({words(row.above)} times the limit)"
        for row in rows
        if row.size == largest
    ]
    return Summary(f"With {words(largest)} {noun}: {listed(times)}.")


def _proof_summary(rows: Sequence[Row]) -> Summary:
    largest = [row.record.values for row in rows if row.size == rows[-1].size]
    return Summary(
        f"With {words(rows[-1].size)} particles at {listed([words(v.stiffness) for v in largest])}"
        f" N/m a minimiser is proven within {words(max(v.distance for v in largest))} m."
    )


def _curve(name: str, rows: Sequence[Row], read: Callable[[Row], Any]) -> Series:
    return series(name, [row.size for row in rows], [read(row) or np.nan for row in rows])


def _chart(name: str, panels: Sequence[Panel], results: Results) -> Sketch | None:
    return declared_chart(CAPTIONS.figure(name), panels, results.user_solvers)


def _by_method(kind: str, results: Results) -> dict[str, list[Row]]:
    return grouped(rows(kind, results), lambda row: row.record.solver)


def cloth_chart(results: Results) -> Sketch | None:
    """Show the time of each method beside its limit, and the factor by both libraries."""
    methods, panels = _by_method("cloth", results), []
    scipys = [_curve(SCIPY, methods.pop(SCIPY, []), attrgetter("time"))]
    for solver, rows in methods.items():
        curves = [_curve(catalogue.PLUMBOB, rows, attrgetter("time"))]
        curves += [_curve(LIMIT, rows, attrgetter("limit")), *scipys * (solver == SUPERNODAL)]
        panels.append(Panel(rows[0].title, tuple(curves)))
    return _chart("scale_cloth", panels, results)


def memory_chart(results: Results) -> Sketch | None:
    """Show the peak memory of each method."""
    methods, memory = _by_method("cloth", results).values(), attrgetter("record.values.memory")
    curves = tuple(_curve(rows[0].title, rows, memory) for rows in methods)
    return _chart("scale_memory", [Panel("", curves)], results)


def chain_chart(results: Results) -> Sketch | None:
    """Show the times of a solve and of an iteration, beside the limit of an iteration."""
    methods = _by_method("chain", results)
    yardsticks = [methods.pop(KINEMATICS)] if KINEMATICS in methods else []
    limits = [_curve(LIMIT, rows, attrgetter("limit")) for rows in yardsticks]
    solves, iterations = (
        tuple(_curve(name, rows, attrgetter(time)) for name, rows in methods.items())
        for time in ("time", "iteration")
    )
    panels = Panel("A solve", solves), Panel("An iteration", (*iterations, *limits))
    return _chart("scale_chain", panels, results)


cloth, chain, proof = LAYOUTS = (
    CAPTIONS.layout(
        "scale_cloth", partial(rows, "cloth"), partial(_summary, "s", "particles"),
        columns=CLOTH_COLUMNS, figures=(cloth_chart, memory_chart),
    ),
    CAPTIONS.layout(
        "scale_chain", partial(rows, "chain"), partial(_summary, "ms", "joints"),
        columns=CHAIN_COLUMNS, figures=(chain_chart,),
    ),
    CAPTIONS.layout("scale_proof", proofs, _proof_summary, columns=PROOF_COLUMNS),
)  # fmt: skip
